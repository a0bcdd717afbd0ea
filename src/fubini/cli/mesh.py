"""``fubini mesh``: from a CAD file to certified meshes, a report and a picture."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from fubini.cli.common import FaceList, PartValue, Progress, json_option, stdout_to_stderr
from fubini.cli.outputs import check_paths, tell, write_all


@click.command()
@click.argument("source", metavar="IN", type=click.Path())
@click.option("-o", "--output", "outputs", metavar="OUT", multiple=True, required=True, type=click.Path(),
              help="Mesh file; may be repeated: .stl .obj .ply .glb .3mf .vtu .vtk .inp .msh .unv .mesh "
                   ".su2 .npz.")  # fmt: skip
@click.option("--size", type=float, metavar="H", help="Wanted edge length in model units; by default from the model.")
@click.option("--faces", type=FaceList(), metavar="I,J", help="Only these faces: indices such as 0,3,5-9.")
@click.option("--select", metavar="NAME", help="Only the faces of this name.")
@click.option("--imprint", is_flag=True, help="Cut parts where they touch or overlap, so that the mesh conforms.")
@click.option("--sew", type=float, metavar="T", help="Join edges of different faces within this distance.")
@click.option("--crack", "cracks", metavar="WHAT", multiple=True,
              help='Part the mesh along these edges (a name, or as "edges 3,5-7"); may be repeated.')  # fmt: skip
@click.option("--point", "points", metavar="NAME=X,Y,Z", multiple=True,
              help="A place inside a face that becomes a node of this name; may be repeated.")  # fmt: skip
@click.option("--pattern", type=click.Choice(["auto", "SP13", "SP41", "ASP20", "ASP48"]),
              default="auto", show_default=True, help="Reference points laid into the cells.")  # fmt: skip
@click.option("--pattern-direction", type=click.Choice(["auto", "x", "y"]), default="auto", show_default=True,
              help="Cells between limits that are functions of x, or of y.")  # fmt: skip
@click.option("--pattern-turn", type=click.Choice(["0", "90", "180", "270"]), default="0", show_default=True,
              help="Degrees by which the points are turned: dense sides up, left, down, right.")  # fmt: skip
@click.option("--min-skew", type=float, default=45.0, show_default=True, metavar="D",
              help="Triangles at or below this skewness (degrees) are flawed.")  # fmt: skip
@click.option("--max-aspect-ratio", type=float, default=2.0, show_default=True, metavar="A",
              help="Triangles at or above this aspect ratio are flawed.")  # fmt: skip
@click.option("--growth", type=float, default=1.5, show_default=True, metavar="G",
              help="Largest ratio of the sizes of neighbouring triangles.")  # fmt: skip
@click.option("--turn", type=float, default=43.0, show_default=True, metavar="D",
              help="Largest turning (degrees) of a curve along one segment.")  # fmt: skip
@click.option("--segments-per-turn", type=int, metavar="N", help="Least number of segments on a full circle.")
@click.option("--chord-tolerance", type=float, metavar="D", help="Largest distance of the mesh from a curved edge.")
@click.option("--edge-size", type=PartValue(), multiple=True, metavar="WHAT=H",
              help='Smaller size on edges: a name, or indices as "3,5-7=0.2"; may be repeated.')  # fmt: skip
@click.option("--face-size", type=PartValue(), multiple=True, metavar="WHAT=H", help="Smaller size on faces.")
@click.option("--vertex-size", type=PartValue(), multiple=True, metavar="WHAT=H", help="Smaller size at vertices.")
@click.option("--edge-segments", type=PartValue(), multiple=True, metavar="WHAT=N",
              help="Least number of segments on edges.")  # fmt: skip
@click.option("--order", type=click.IntRange(1, 2), default=1, show_default=True,
              help="Nodes on the corners only, or on the sides too (true to the curves).")  # fmt: skip
@click.option("--name", "named", metavar="NAME=WHAT", multiple=True,
              help='Name faces, edges or vertices, as --name "bore=edges 3,5-7"; may be repeated.')  # fmt: skip
@json_option
@click.option("--plot", "picture", metavar="FILE", type=click.Path(), help="Draw the mesh (.png, .svg, .pdf).")
@click.option("-q", "--quiet", is_flag=True, help="No table.")
@click.pass_context
def mesh(
    ctx: click.Context,
    source: str,
    outputs: tuple[str, ...],
    faces: tuple[int, ...] | None,
    select: str | None,
    named: tuple[str, ...],
    json_path: str | None,
    picture: str | None,
    quiet: bool,
    cracks: tuple[str, ...],
    points: tuple[str, ...],
    **options: Any,
) -> None:
    """Mesh the planar faces of the CAD file IN.

    IN is a .step, .stp, .brep, .iges, .dxf, .svg or .FCStd file. All outputs are written at the end, or
    none of them.
    """
    if faces is not None and select is not None:
        raise click.UsageError("--faces and --select exclude each other")
    check_paths(source, outputs, json_path, picture)
    names = _names(named)
    options["pattern_turn"] = int(options["pattern_turn"])
    for option in ("edge_size", "face_size", "vertex_size", "edge_segments"):
        options[option] = _by_part(options[option], max if option == "edge_segments" else min)
    with stdout_to_stderr(json_path == "-"):
        import fubini

        with Progress() as progress:
            result = fubini.mesh(
                source,
                faces=faces,
                select=select,
                names=names,
                cracks=cracks or None,
                points=_points(points),
                progress=progress,
                **options,
            )
        data = write_all(result, outputs, json_path, picture)
    tell(result, data, outputs, json_path, quiet)
    ctx.exit(0 if result.certificate.certified else 1)


def _names(named: tuple[str, ...]) -> dict[str, str]:
    """Names and selections from ``NAME=WHAT``."""
    found: dict[str, str] = {}
    for text in named:
        name, equals, what = text.partition("=")
        if not equals or not name.strip():
            raise click.UsageError(f'--name takes NAME=WHAT, such as "bore=edges 3,5-7", not {text!r}')
        if name.strip() in found:
            raise click.UsageError(f"--name {name.strip()!r} is given twice")
        found[name.strip()] = what
    return found


def _by_part(given: tuple[tuple[str, float], ...], finer: Callable[..., float]) -> dict[str, float]:
    """Values by part; of two for the same part the one that asks for finer elements."""
    found: dict[str, float] = {}
    for what, value in given:
        found[what] = finer(value, found.get(what, value))
    return found


def _points(placed: tuple[str, ...]) -> dict[str, list[float]]:
    """Names and places from ``NAME=X,Y,Z``."""
    found: dict[str, list[float]] = {}
    for text in placed:
        name, _, numbers = text.partition("=")
        try:
            place = [float(x) for x in numbers.split(",")]
        except ValueError:
            place = []
        if not name.strip() or len(place) not in (2, 3):
            raise click.UsageError(f"--point takes NAME=X,Y,Z, not {text!r}")
        found[name.strip()] = place
    return found
