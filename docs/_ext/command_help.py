"""Directive ``command-help``: the ``--help`` text of a subcommand, as it stands in the program."""

from __future__ import annotations

from click.testing import CliRunner
from docutils import nodes
from docutils.parsers.rst import Directive


class CommandHelp(Directive):
    """``{command-help} mesh`` inserts what ``fubini mesh --help`` prints."""

    optional_arguments = 1

    def run(self):
        from fubini.cli import main

        arguments = [*self.arguments, "--help"]
        result = CliRunner().invoke(main, arguments, prog_name="fubini", terminal_width=84)
        if result.exit_code != 0:
            raise self.error(f"fubini {' '.join(arguments)} failed: {result.output}")
        text = f"$ fubini {' '.join(arguments)}\n{result.output}"
        return [nodes.literal_block(text, text, language="text")]


def setup(app):
    app.add_directive("command-help", CommandHelp)
    return {"parallel_read_safe": True}
