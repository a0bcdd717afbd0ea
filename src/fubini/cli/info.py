"""``fubini info``: what a CAD file holds."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import click

from fubini.cli.common import check_outputs, dump_json, json_files, json_option, stdout_to_stderr, write_json

#: Joints within this many degrees of straight are no corners.
SMOOTH = 0.1

if TYPE_CHECKING:
    from fubini.model import Face, Model


@click.command()
@click.argument("source", metavar="IN", type=click.Path())
@click.option("--imprint", is_flag=True, help="As the parts are once cut at each other; see mesh.")
@click.option("--sew", type=float, metavar="T", help="As the faces are once sewn within this distance; see mesh.")
@json_option
def info(source: str, json_path: str | None, **reading: Any) -> None:
    """List the faces of the CAD file IN with their edges, curve types, corners and names."""
    check_outputs(source, json_files(json_path))
    with stdout_to_stderr(json_path == "-"):
        import fubini
        from fubini.export import Transaction
        from fubini.report.figures import strict

        data = strict(describe(fubini.load(source, **reading)))
        with Transaction() as files:
            write_json(data, json_path, files)
    click.echo(dump_json(data) if json_path == "-" else as_text(data) + "\n", nl=False)


def describe(model: Model) -> dict[str, Any]:
    """The model as plain values: ``faces``, ``edges``, ``skipped``, ``notes``; corner angles in degrees."""
    lengths = {
        edge: curve.length() for face in model.faces for edge, curve in zip(face.region.edges, face.region.curves)
    }
    edges = [
        {
            "edge": e.index,
            "kind": e.kind,
            "name": e.name,
            "length": lengths.get(e.index),
            "vertices": [e.start, e.end],
            "tolerance": e.tolerance,
            "conversion": e.conversion,
        }
        for e in sorted(model.edges.values(), key=lambda e: e.index)
    ]
    return {
        "source": model.source,
        "diagonal": model.diagonal,
        "faces": [_face(model, *both) for both in zip(model.faces, model.faces_cut, strict=True)],
        "edges": edges,
        "skipped": [{"face": s.index, "name": s.name, "surface": s.surface, "reason": s.reason} for s in model.skipped],
        "notes": list(model.notes),
    }


def _face(model: Model, face: Face, cut: Face) -> dict[str, Any]:
    """One face, whose corners are those of the same face with its edges ``cut`` at kinks."""
    from fubini.quality import corner_limit

    corners = [
        {
            "point": face.frame.to_space([corner.point])[0].tolist(),
            "angle": corner.angle,
            "unavoidable": corner.angle < corner_limit(),
        }
        for corner in cut.region.corners()
        if abs(corner.angle - 180.0) > SMOOTH
    ]
    return {
        "face": face.index,
        "name": face.name,
        "area": face.region.area,
        "perimeter": face.region.perimeter,
        "normal": face.frame.normal.tolist(),
        "loops": [list(loop.edges) for loop in face.region.loops],
        "curves": dict(sorted(Counter(model.edges[e].kind for e in face.region.edges).items())),
        "corners": corners,
    }


def as_text(data: dict[str, Any]) -> str:
    """The description for people."""
    lines = [
        f"{data['source']}: {len(data['faces'])} planar faces, {len(data['edges'])} edges, "
        f"{len(data['skipped'])} faces skipped, diagonal {data['diagonal']:.9g}"
    ]
    for face in data["faces"]:
        sharp = sum(c["unavoidable"] for c in face["corners"])
        least = min((c["angle"] for c in face["corners"]), default=None)
        curves = ", ".join(f"{n} {kind}" for kind, n in face["curves"].items())
        holes = len(face["loops"]) - 1
        lines.append(
            f"face {face['face']}{_name(face)}: area {face['area']:.9g}, {curves}"
            + (f", {holes} hole{'s' if holes > 1 else ''}" if holes else "")
            + (f", {len(face['corners'])} corners from {least:.4g} degrees" if least is not None else ", no corner")
            + (f", {sharp} too sharp for a valid triangle" if sharp else "")
        )
    for edge in data["edges"]:
        length = "" if edge["length"] is None else f", length {edge['length']:.9g}"
        off = f", converted within {edge['conversion']:.1e}" if edge["conversion"] else ""
        start, end = edge["vertices"]
        lines.append(f"edge {edge['edge']}{_name(edge)}: {edge['kind']}{length}, vertices {start} to {end}{off}")
    for face in data["skipped"]:
        lines.append(f"face {face['face']}{_name(face)}: skipped, {face['surface']}: {face['reason']}")
    return "\n".join(lines + [f"note: {note}" for note in data["notes"]])


def _name(part: dict[str, Any]) -> str:
    return f" ({part['name']})" if part["name"] else ""
