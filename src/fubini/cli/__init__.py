"""The command line: ``fubini mesh``, ``remesh``, ``check``, ``cells`` and ``info``.

Exit status: 0 certified (valid); 1 written, but not certified (not valid); 2 bad usage or input, nothing
written; 3 an error that nobody foresaw; 130 interrupted.
"""

from __future__ import annotations

import click

from fubini.cli.cells import cells
from fubini.cli.check import check
from fubini.cli.group import FubiniGroup
from fubini.cli.info import info
from fubini.cli.mesh import mesh
from fubini.cli.remesh import remesh


@click.group(cls=FubiniGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="fubini", prog_name="fubini")
def main() -> None:
    """Triangle meshes of the planar faces of CAD models, with a certificate of quality.

    Exit status: 0 certified, 1 written but not certified, 2 bad usage or input (nothing is written).
    """


for command in (mesh, remesh, check, cells, info):
    main.add_command(command)
