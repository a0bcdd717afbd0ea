"""DXF drawings: curves of the model space to planar faces (ezdxf reads the file).

LINE, ARC, CIRCLE, ELLIPSE, SPLINE, LWPOLYLINE, POLYLINE (bulges are arcs) and INSERT (exploded with its
placement) are taken, seen along z, and boundaries of HATCH where there is nothing else; the rest is left out with
a note. Outlines nest even-odd: an outline in a face is a hole, one in a hole is another face.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fubini.cad.drawing import (
    Affine,
    Curve,
    Line,
    bspline,
    bulge_arc,
    ellipse,
    length_scale,
    periodic_bspline,
)
from fubini.cad.loops import Outline, find_outlines
from fubini.cad.nesting import faces_even_odd
from fubini.cad.source import ReadOptions, Source
from fubini.errors import DependencyError, FubiniError, InputError

DEFAULTS = ReadOptions()

#: Ends closer than this (times the diagonal of the drawing) are joined unless an option says otherwise:
#: files with six significant digits need it, and it is far below any real edge.
GAP = 1e-5

#: Entities out of the plane z = constant by more than this (times their size) are not flat.
OUT_OF_PLANE = 1e-7

#: Blocks may hold blocks; deeper than this is a cycle.
MAX_NESTING = 16

#: Line types of lines that guide the eye and bound nothing.
GUIDE_LINES = ("CENTER", "CENTRE", "PHANTOM")

#: Entities that fill an area and repeat its boundary.
FILLINGS = ("HATCH", "MPOLYGON")

UNITS = {1: "inch", 2: "foot", 4: "mm", 5: "cm", 6: "m", 8: "microinch", 9: "mil", 10: "yard", 13: "micron"}


@dataclass(frozen=True)
class Stroke:
    """One curve of the drawing, its layer, and the type of the entity that it comes from."""

    curve: Curve
    layer: str
    entity: str


def read_dxf(path: Path, options: ReadOptions = DEFAULTS) -> Source:
    """Planar faces of a DXF drawing, in the XY plane, named by the layers of their outer outlines.

    ``options.gap``: ends closer than this are joined (model units; default ``GAP`` times the diagonal).

    Raises
    ------
    DependencyError : ezdxf is not installed.
    InputError : not a DXF file, or nothing in it can bound a face.
    GeometryError : an open outline (with the coordinates of both ends), outlines that cross.
    """
    _require_end(path)
    document = _open(path)
    notes = Counter[str]()
    strokes = _without_fillings(list(_strokes(document, notes)), notes)
    if not strokes:
        raise InputError(
            "the drawing holds no curve that could bound a face",
            file=str(path),
            fix="outlines must be in the model space, on layers that are switched on",
        )
    curves = [s.curve for s in strokes]
    gap = GAP * length_scale(curves) if options.gap is None else options.gap
    try:
        return _source(path, document, strokes, gap, notes)
    except FubiniError as error:
        error.file = str(path)
        raise


def _require_end(path: Path) -> None:
    """Raise where a text DXF lacks its end mark: what is left of a cut file may still read, with parts missing."""
    try:
        with open(path, "rb") as file:
            head = file.read(4096)
            file.seek(max(0, path.stat().st_size - 1024))
            tail = file.read()
    except OSError as error:
        raise InputError(f"cannot be read: {error}", file=str(path)) from error
    is_text = b"SECTION" in head and not head.startswith(b"AutoCAD Binary DXF")
    if is_text and tail.split()[-1:] != [b"EOF"]:
        raise InputError(
            "the DXF file is cut short: its end mark EOF is missing",
            file=str(path),
            fix="export or download it again",
        )


def _open(path: Path) -> Any:
    try:
        import ezdxf
        from ezdxf import recover
    except ImportError as error:
        raise DependencyError("reading DXF needs ezdxf", fix='pip install "fubini[dxf]"') from error
    try:
        return ezdxf.readfile(path)
    except OSError as error:
        raise InputError(f"cannot be read: {error}", file=str(path)) from error
    except Exception as first:  # a damaged file may raise anything inside the parser
        try:
            document, audit = recover.readfile(path)
        except Exception as error:
            raise InputError(f"not a DXF drawing: {first}", file=str(path)) from error
        if audit.has_errors and not len(document.modelspace()):
            raise InputError(f"damaged DXF drawing: {audit.errors[0].message}", file=str(path)) from first
        return document


def _source(path: Path, document: Any, strokes: list[Stroke], gap: float, notes: Counter[str]) -> Source:
    """Outlines, faces and names of the strokes."""
    from fubini.cad.faces import FaceBuilder

    drawing = find_outlines([s.curve for s in strokes], gap)
    builder = FaceBuilder(drawing.curves, drawing.ends)

    def layer_of(outline: Outline) -> str:
        return Counter(strokes[u.curve].layer for u in outline.uses).most_common(1)[0][0]

    face_names = tuple((builder.add(f), layer_of(f.outer)) for f in faces_even_odd(drawing.groups))
    if not face_names:
        raise InputError("the drawing holds no closed outline", file=str(path))
    edge_names = tuple((edge, strokes[k].layer) for k, edge in builder.edges.items())
    unit = UNITS.get(int(document.header.get("$INSUNITS", 0)))
    remarks = [f"drawing unit: {unit}" if unit else "drawing unit: not stated"]
    remarks += [what if n == 1 else f"{what} ({n} times)" for what, n in notes.items()]
    return Source(builder.compound, str(path), face_names, edge_names, (*remarks, *drawing.notes))


def _strokes(document: Any, notes: Counter[str]) -> Iterator[Stroke]:
    """All curves of the model space on layers that are shown."""
    for entity, layer in _entities(document.modelspace(), notes, "0", 0):
        if _hidden(document, entity, layer):
            notes[f"{entity.dxftype()} on layer {layer} left out: hidden, or a guide line"] += 1
            continue
        curves = _curves(entity)
        if curves is None:
            notes[f"{entity.dxftype()} left out: bounds no area"] += 1
            continue
        for curve in curves:
            yield Stroke(curve, layer, entity.dxftype())


def _without_fillings(strokes: list[Stroke], notes: Counter[str]) -> list[Stroke]:
    """Strokes without those of hatches, which repeat outlines of the drawing, when it has any others."""
    outlines = [s for s in strokes if s.entity not in FILLINGS]
    if outlines and len(outlines) < len(strokes):
        notes["curves of a HATCH left out: the drawing has outlines of its own"] += len(strokes) - len(outlines)
    return outlines or strokes


def _entities(layout: Iterable[Any], notes: Counter[str], parent_layer: str, depth: int) -> Iterator[tuple[Any, str]]:
    """Entities with their layers; inserted blocks are exploded, and their layer "0" is that of the insert."""
    for entity in layout:
        own = str(entity.dxf.get("layer", "0"))
        layer = parent_layer if own == "0" and depth else own
        if entity.dxftype() != "INSERT":
            yield entity, layer
        elif depth >= MAX_NESTING:
            raise InputError(
                f"block {entity.dxf.name!r} is inserted more than {MAX_NESTING} deep",
                fix="does it contain itself?",
            )
        else:
            copies = entity.multi_insert() if entity.mcount > 1 else (entity,)
            for copy in copies:
                yield from _entities(copy.virtual_entities(), notes, layer, depth + 1)


def _hidden(document: Any, entity: Any, layer: str) -> bool:
    if entity.dxf.get("invisible", 0):
        return True
    record = document.layers.get(layer) if layer in document.layers else None
    if record is not None and (record.is_off() or record.is_frozen()):
        return True
    style = str(entity.dxf.get("linetype", "BYLAYER")).upper()
    if style == "BYLAYER" and record is not None:
        style = str(record.dxf.get("linetype", "CONTINUOUS")).upper()
    return style.startswith(GUIDE_LINES)


def _curves(entity: Any) -> list[Curve] | None:
    """Curves of one entity; None when it is of a kind that bounds nothing."""
    convert = _CONVERT.get(entity.dxftype())
    if convert is None:
        return None
    try:
        return convert(entity)
    except (ValueError, TypeError, ZeroDivisionError) as error:
        raise InputError(f"{entity.dxftype()} (handle {entity.dxf.handle}) makes no curve: {error}") from error


def _flat(points: Iterable[Any], what: str) -> np.ndarray:
    """Points (n,) in the plane; those that do not share one height are refused."""
    p = np.array([tuple(q) if len(q) == 3 else (*q, 0.0) for q in points], float).reshape(-1, 3)
    if not np.all(np.isfinite(p)):
        raise InputError(f"{what} has a coordinate that is no finite number")
    height = float(np.ptp(p[:, 2]))
    if height > OUT_OF_PLANE * max(1e-300, float(np.ptp(p[:, :2], axis=0).max())):
        raise InputError(
            f"{what} is not flat: it spans {height:.3g} along z",
            at=p[0].tolist(),
            fix="draw in a plane parallel to XY",
        )
    return np.asarray(p[:, 0] + 1j * p[:, 1])


def _plane_map(ocs: Any, elevation: float) -> Affine:
    """The map from an entity's own coordinates (OCS) to the XY plane; the extrusion must be along z."""
    o, x, y = (ocs.to_wcs(p) for p in ((0, 0, elevation), (1, 0, elevation), (0, 1, elevation)))
    z = _flat([o, x, y], "an entity with a tilted extrusion")
    p, q = z[1] - z[0], z[2] - z[0]
    return Affine(complex(p - 1j * q) / 2, complex(p + 1j * q) / 2, complex(z[0]))


def _line(entity: Any) -> list[Curve]:
    start, end = _flat([entity.dxf.start, entity.dxf.end], "LINE")
    return [Line(complex(start), complex(end))]


def _arc(entity: Any) -> list[Curve]:
    """ARC and CIRCLE: angles in degrees, counter-clockwise about the extrusion."""
    centre = entity.dxf.center
    first, sweep = 0.0, 360.0
    if entity.dxftype() == "ARC":
        first = entity.dxf.start_angle
        sweep = (entity.dxf.end_angle - first) % 360.0 or 360.0
    radius = float(entity.dxf.radius)
    if radius <= 0:
        raise ValueError(f"radius {radius:g}")
    arc = ellipse(complex(centre.x, centre.y), radius, 1j * radius, math.radians(first), math.radians(sweep))
    return [arc.affine(_plane_map(entity.ocs(), centre.z))]


def _ellipse(entity: Any) -> list[Curve]:
    """ELLIPSE: in world coordinates, angles from the major axis about the extrusion."""
    centre, major, minor = entity.dxf.center, entity.dxf.major_axis, entity.minor_axis
    o, p, q = _flat([centre, centre + major, centre + minor], "ELLIPSE")
    first, last = float(entity.dxf.start_param), float(entity.dxf.end_param)
    sweep = (last - first) % (2 * math.pi) or 2 * math.pi
    return [ellipse(complex(o), complex(p - o), complex(q - o), first, sweep)]


def _spline(entity: Any) -> list[Curve]:
    """SPLINE: by control points, else interpolated through its fit points."""
    if entity.closed and len(entity.knots) == len(entity.control_points) + 1:
        poles = _flat(entity.control_points, "SPLINE")
        return [periodic_bspline(entity.dxf.degree, entity.knots, poles, entity.weights)]
    tool = entity.construction_tool()
    poles = _flat(tool.control_points, "SPLINE")
    return [bspline(tool.order - 1, tool.knots(), poles, tool.weights())]


def _lwpolyline(entity: Any) -> list[Curve]:
    points = [(complex(x, y), float(bulge)) for x, y, bulge in entity.get_points("xyb")]
    plane = _plane_map(entity.ocs(), float(entity.dxf.elevation))
    return [c.affine(plane) for c in _bulged(points, bool(entity.closed))]


def _polyline(entity: Any) -> list[Curve]:
    if not (entity.is_2d_polyline or entity.is_3d_polyline):
        raise InputError("POLYLINE is a mesh, not a curve", fix="remove it, or move it to a frozen layer")
    if entity.is_3d_polyline:
        places = _flat([v.dxf.location for v in entity.vertices], "POLYLINE")
        return _bulged([(complex(z), 0.0) for z in places], bool(entity.is_closed))
    corners = [v for v in entity.vertices if not v.dxf.flags & 16]  # 16: control point of a spline frame
    points = [(complex(v.dxf.location.x, v.dxf.location.y), float(v.dxf.get("bulge", 0))) for v in corners]
    plane = _plane_map(entity.ocs(), float(entity.dxf.get("elevation", (0, 0, 0))[2]))
    return [c.affine(plane) for c in _bulged(points, bool(entity.is_closed))]


def _bulged(points: list[tuple[complex, float]], closed: bool) -> list[Curve]:
    """Segments and arcs through the points, the bulge of each standing for the step to the next."""
    following = points[1:] + (points[:1] if closed else [])
    steps = zip(points, following, strict=False)
    return [bulge_arc(a, b, bulge) for (a, bulge), (b, _) in steps if a != b]


def _hatch(entity: Any) -> list[Curve]:
    """Boundary paths of a HATCH."""
    plane = _plane_map(entity.ocs(), float(entity.dxf.elevation[2]))
    curves: list[Curve] = []
    for path in entity.paths:
        if hasattr(path, "vertices"):
            points = [(complex(x, y), float(bulge)) for x, y, bulge in path.vertices]
            curves += _bulged(points, bool(path.is_closed))
        else:
            curves += [_hatch_edge(edge) for edge in path.edges]
    return [c.affine(plane) for c in curves]


def _hatch_edge(edge: Any) -> Curve:
    kind = edge.EDGE_TYPE
    if kind == "LineEdge":
        return Line(complex(edge.start.x, edge.start.y), complex(edge.end.x, edge.end.y))
    if kind == "SplineEdge":
        tool = edge.construction_tool()
        poles = [complex(p.x, p.y) for p in tool.control_points]
        return bspline(tool.order - 1, tool.knots(), poles, tool.weights())
    centre = complex(edge.center.x, edge.center.y)
    if kind == "ArcEdge":
        p, q = complex(edge.radius), 1j * edge.radius
        first, last = math.radians(edge.start_angle), math.radians(edge.end_angle)
    else:
        p = complex(edge.major_axis.x, edge.major_axis.y)
        q = 1j * edge.ratio * p
        first, last = float(edge.start_param), float(edge.end_param)
    # ezdxf stores the angles counter-clockwise whatever the direction of the path
    return ellipse(centre, p, q, first, (last - first) % (2 * math.pi) or 2 * math.pi)


_CONVERT = {
    "LINE": _line,
    "ARC": _arc,
    "CIRCLE": _arc,
    "ELLIPSE": _ellipse,
    "SPLINE": _spline,
    "LWPOLYLINE": _lwpolyline,
    "POLYLINE": _polyline,
    "HATCH": _hatch,
    "MPOLYGON": _hatch,
}
