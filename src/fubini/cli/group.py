"""How every command ends: expected errors in one line, others with a word of what to do."""

from __future__ import annotations

import errno
import os
import traceback
from typing import Any

import click

from fubini.errors import FubiniError

BAD_INPUT, UNFORESEEN, INTERRUPTED = 2, 3, 130


class FubiniGroup(click.Group):
    """A group whose commands turn exceptions into messages on stderr and exit codes."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; never a traceback unless ``FUBINI_DEBUG`` is set."""
        try:
            return super().invoke(ctx)
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except FubiniError as error:
            _say(str(error))
            ctx.exit(BAD_INPUT)
        except MemoryError:
            _say("out of memory; use a larger size or fewer faces")
            ctx.exit(BAD_INPUT)
        except KeyboardInterrupt:
            _say("interrupted, nothing written")
            ctx.exit(INTERRUPTED)
        except Exception as error:
            if isinstance(error, OSError) and error.errno == errno.EPIPE:
                raise  # the reader of our output has gone; click ends quietly
            _say(f"unforeseen error, nothing written: {type(error).__name__}: {error}")
            if os.environ.get("FUBINI_DEBUG"):
                click.echo(traceback.format_exc(), err=True)
            else:
                _say("please report it with the input file; FUBINI_DEBUG=1 shows where it happened")
            ctx.exit(UNFORESEEN)


def _say(text: str) -> None:
    click.echo(f"fubini: {text}", err=True)
