"""``fubini check``: judge any triangle mesh."""

from __future__ import annotations

import click

from fubini.cli.common import check_outputs, dump_json, json_files, json_option, stdout_to_stderr, write_json


@click.command()
@click.argument("mesh_file", metavar="MESH", type=click.Path())
@click.option("--min-skew", type=float, default=45.0, show_default=True, metavar="D",
              help="Triangles at or below this skewness (degrees) are flawed.")  # fmt: skip
@click.option("--max-aspect-ratio", type=float, default=2.0, show_default=True, metavar="A",
              help="Triangles at or above this aspect ratio are flawed.")  # fmt: skip
@json_option
@click.pass_context
def check(ctx: click.Context, mesh_file: str, min_skew: float, max_aspect_ratio: float, json_path: str | None) -> None:
    """Judge the triangles of MESH, any file that trimesh or meshio reads.

    Exit status: 0 when no triangle is flawed but the unavoidable ones (in corners of the mesh's own outline
    that no valid triangle fits into), 1 when some are, 2 when MESH cannot be read.
    """
    files = json_files(json_path)
    check_outputs(mesh_file, files)
    with stdout_to_stderr(json_path == "-"):
        from fubini.export import Transaction
        from fubini.report import check as judge
        from fubini.report import check_table

        found = judge(mesh_file, min_skew=min_skew, max_aspect_ratio=max_aspect_ratio)
        with Transaction() as transaction:
            write_json(found.to_json(), json_path, transaction)
    click.echo(dump_json(found.to_json()) if json_path == "-" else check_table(found) + "\n", nl=False)
    ctx.exit(0 if found.valid else 1)
