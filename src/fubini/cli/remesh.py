"""``fubini remesh``: an existing triangle mesh, meshed anew patch by planar patch."""

from __future__ import annotations

from typing import Any

import click

from fubini.cli.common import Progress, json_option, stdout_to_stderr
from fubini.cli.outputs import check_paths, tell, write_all


@click.command()
@click.argument("source", metavar="IN", type=click.Path())
@click.option("-o", "--output", "outputs", metavar="OUT", multiple=True, required=True, type=click.Path(),
              help="Mesh file, as for mesh; may be repeated.")  # fmt: skip
@click.option("--size", type=float, metavar="H", help="Wanted edge length in model units; by default from the model.")
@click.option("--tolerance", type=float, metavar="T",
              help="How far corners may lie off their plane; by default 1e-6 times the diagonal.")  # fmt: skip
@click.option("--angle", type=float, default=1.0, show_default=True, metavar="D",
              help="Largest lean (degrees) of a triangle against its planar patch.")  # fmt: skip
@click.option("--min-skew", type=float, default=45.0, show_default=True, metavar="D",
              help="Triangles at or below this skewness (degrees) are flawed.")  # fmt: skip
@click.option("--max-aspect-ratio", type=float, default=2.0, show_default=True, metavar="A",
              help="Triangles at or above this aspect ratio are flawed.")  # fmt: skip
@json_option
@click.option("--plot", "picture", metavar="FILE", type=click.Path(), help="Draw the mesh (.png, .svg, .pdf).")
@click.option("-q", "--quiet", is_flag=True, help="No table.")
@click.pass_context
def remesh(
    ctx: click.Context,
    source: str,
    outputs: tuple[str, ...],
    json_path: str | None,
    picture: str | None,
    quiet: bool,
    **options: Any,
) -> None:
    """Mesh the triangle mesh IN anew: the same surface, conforming, with certified triangles.

    IN is a .stl, .obj, .ply, .off, .glb or .3mf file. Triangles that lie in one plane form a patch; outlines
    of patches are kept. All outputs are written at the end, or none of them.
    """
    check_paths(source, outputs, json_path, picture)
    with stdout_to_stderr(json_path == "-"):
        import fubini

        with Progress() as progress:
            result = fubini.remesh(source, progress=progress, **options)
        data = write_all(result, outputs, json_path, picture)
    tell(result, data, outputs, json_path, quiet)
    ctx.exit(0 if result.certificate.certified else 1)
