"""``fubini cells``: draw the Fubini cells of the planar faces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fubini.cli.common import FaceList, check_outputs

if TYPE_CHECKING:
    from fubini.model import Face


@click.command()
@click.argument("source", metavar="IN", type=click.Path())
@click.option("-o", "--output", metavar="FILE", required=True, type=click.Path(), help="Picture (.png, .svg, .pdf).")
@click.option("--direction", type=click.Choice(["x", "y", "auto"]), default="auto", show_default=True,
              help="x: limits are functions of x (I1); y: of y (I2); auto: fewer and rounder cells.")  # fmt: skip
@click.option("--at-vertices", is_flag=True, help="Slice at every vertex, not only where it must be.")
@click.option("--faces", type=FaceList(), metavar="I,J", help="Only these faces: indices such as 0,3,5-9.")
@click.option("--select", metavar="NAME", help="Only the faces of this name.")
def cells(
    source: str,
    output: str,
    direction: str,
    at_vertices: bool,
    faces: tuple[int, ...] | None,
    select: str | None,
) -> None:
    """Draw the cells and slices of the planar faces of IN, each in its own plane."""
    if faces is not None and select is not None:
        raise click.UsageError("--faces and --select exclude each other")
    from fubini.report.canvas import check_picture_path, require_matplotlib

    check_picture_path(output)
    require_matplotlib()
    check_outputs(source, [output])

    import fubini
    from fubini.pipeline.selection import select_faces
    from fubini.report import plot_cells

    model = select_faces(fubini.load(source), faces, select)
    groups = [fubini.decompose(face.region, direction, at_vertices) for face in model.faces]
    regions = [face.region for face in model.faces]
    titles = [_title(face) for face in model.faces] if len(model.faces) > 1 else None
    plot_cells(regions, groups, output, titles=titles)
    for face, group in zip(model.faces, groups):
        area = sum(cell.area() for cell in group)
        error = abs(area - face.region.area) / face.region.area
        click.echo(f"{_title(face)}: {len(group)} cells of kind {group[0].kind}, area {area:.12g} (error {error:.1e})")


def _title(face: Face) -> str:
    return f"face {face.index}" + (f" ({face.name})" if face.name else "")
