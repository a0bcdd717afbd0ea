"""What the commands share: parameters, progress, standard output kept clean, outputs checked early."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from typing import Any, Self

import click

#: Seconds of work before progress is shown, and between two updates.
PATIENCE, INTERVAL = 0.5, 0.1

json_option = click.option(
    "--json", "json_path", metavar="FILE|-", help="Write the figures as one JSON object ('-': standard output)."
)


class FaceList(click.ParamType):
    """Face indices as ``0,3,5-9``."""

    name = "faces"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...]:
        """The indices, sorted, each once."""
        if isinstance(value, tuple):
            return value
        found: set[int] = set()
        try:
            for part in str(value).split(","):
                low, dash, high = part.strip().partition("-")
                first, last = int(low), int(high) if dash else int(low)
                if not 0 <= first <= last < 10_000_000:
                    raise ValueError
                found.update(range(first, last + 1))
        except ValueError:
            self.fail(f"{value!r} is no list of face indices such as 0,3,5-9", param, ctx)
        return tuple(sorted(found))


class PartValue(click.ParamType):
    """A value for parts of the model, as ``bore=0.2`` or ``3,5-7=0.2``."""

    name = "value"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, float]:
        """What stands before the last equals sign, and the number after it."""
        if isinstance(value, tuple):
            return value
        what, _, number = str(value).rpartition("=")
        try:
            if not what.strip():
                raise ValueError
            return what.strip(), float(number)
        except ValueError:
            self.fail(f'{value!r} is not WHAT=NUMBER, such as "bore=0.2" or "3,5-7=0.2"', param, ctx)


def check_outputs(source: str, paths: Sequence[str]) -> None:
    """Raise where an output cannot be written, is named twice, or is the input itself."""
    from fubini.errors import ExportError
    from fubini.export import check_target

    taken = {os.path.realpath(source): "the input"}
    for path in paths:
        target = check_target(path)
        if str(target) in taken:
            raise ExportError(f"would overwrite {taken[str(target)]}", file=path, fix="give another path")
        taken[str(target)] = "another output"


def dump_json(data: Any) -> str:
    """Strict JSON, one object, keys in their order."""
    return json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


@contextlib.contextmanager
def stdout_to_stderr(active: bool) -> Iterator[None]:
    """Send what libraries print to standard output to standard error instead, C++ libraries included.

    CAD kernels print from compiled code; a JSON object on standard output must stand alone.
    """
    try:
        descriptor = sys.stdout.fileno() if active else -1
    except (OSError, ValueError, AttributeError):  # captured in memory
        descriptor = -1
    if descriptor < 0:
        with contextlib.redirect_stdout(sys.stderr) if active else contextlib.nullcontext():
            yield
        return
    sys.stdout.flush()
    kept = os.dup(descriptor)
    os.dup2(2, descriptor)
    try:
        yield
    finally:
        sys.stdout.flush()
        _flush_compiled()
        os.dup2(kept, descriptor)
        os.close(kept)


def _flush_compiled() -> None:
    """Flush the buffers of the C library, which hold what compiled code has printed."""
    import ctypes

    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).fflush(None)


class Progress:
    """One line on stderr that rewrites itself, only on a terminal and only when work takes long."""

    def __init__(self) -> None:
        self._on = sys.stderr.isatty()
        self._next = time.monotonic() + PATIENCE
        self._width = 0

    def __call__(self, stage: str, done: int, total: int) -> None:
        now = time.monotonic()
        if not self._on or now < self._next:
            return
        self._next = now + INTERVAL
        text = f"{stage} {done}/{total}" if total else stage
        click.echo("\r" + text.ljust(self._width), nl=False, err=True)
        self._width = max(self._width, len(text))

    def clear(self) -> None:
        """Wipe the line."""
        if self._width:
            click.echo("\r" + " " * self._width + "\r", nl=False, err=True)
            self._width = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.clear()


def write_json(data: Any, path: str | None, transaction: Any) -> None:
    """Stage the JSON file, unless it goes to standard output or nowhere."""
    if path is not None and path != "-":
        transaction.stage(path).write_text(dump_json(data), encoding="utf-8")


def json_files(path: str | None) -> list[str]:
    """The JSON output as a list of files: none or one."""
    return [path] if path is not None and path != "-" else []
