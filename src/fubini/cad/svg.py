"""SVG drawings: filled shapes to planar faces (svgelements parses the file).

svgelements is used rather than build123d's ``import_svg`` because it alone is needed: it parses lines, arcs,
Bezier curves, transforms and styles without rounding, under any generation of the CAD kernel, and hands them
over untransformed, so that an arc under a skewed transform becomes an exact ellipse here.

The y axis points up and the page starts at the origin, as build123d places it. Every filled shape gives its
own faces by its fill rule, named by its id, else by the id of the nearest group. Strokes are not areas.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fubini.cad.drawing import Affine, Curve, Line, bezier, ellipse, length_scale, matching
from fubini.cad.loops import Outline, Use, outline_of
from fubini.cad.nesting import faces_by_winding
from fubini.cad.source import ReadOptions, Source
from fubini.errors import DependencyError, FubiniError, GeometryError, InputError

DEFAULTS = ReadOptions()

#: Pieces shorter than this (times the diagonal of the drawing) are rounding of the file, not edges.
SPECK = 1e-7

#: Lengths with units come out in millimetres, as in build123d. svgelements takes a millimetre for 0.0393701 inches:
#: this makes millimetres and centimetres exact, and inches and points too short by 5e-7.
PIXELS_PER_INCH = 1 / 0.0393701


@dataclass(frozen=True)
class FilledShape:
    """A filled element: its closed subpaths as chains of curves, its fill rule and its name."""

    subpaths: tuple[tuple[Curve, ...], ...]
    rule: str
    name: str | None


def read_svg(path: Path, options: ReadOptions = DEFAULTS) -> Source:
    """Planar faces of the filled shapes of an SVG drawing, in the XY plane.

    ``options.gap``: pieces shorter than this are left out (model units; default ``SPECK`` diagonals).

    Raises
    ------
    DependencyError : svgelements is not installed.
    InputError : not an SVG file, or nothing in it is filled.
    GeometryError : subpaths of one shape cross, or a shape has no area at all.
    """
    notes = Counter[str]()
    document = _parse(path)
    shapes = [s for s in _filled_shapes(document, notes) if s.subpaths]
    if not shapes:
        raise InputError(
            "the drawing holds no filled shape",
            file=str(path),
            fix="strokes bound no area: convert them to paths, or give the shapes a fill",
        )
    everything = [c for s in shapes for sub in s.subpaths for c in sub]
    speck = SPECK * length_scale(everything) if options.gap is None else options.gap
    try:
        return _source(path, shapes, speck, notes)
    except FubiniError as error:
        error.file = str(path)
        raise


def _parse(path: Path) -> Any:
    try:
        import svgelements
    except ImportError as error:
        raise DependencyError("reading SVG needs svgelements", fix='pip install "fubini[svg]"') from error
    try:
        with path.open("rb") as stream:
            document = svgelements.SVG.parse(stream, reify=False, ppi=PIXELS_PER_INCH)
    except OSError as error:
        raise InputError(f"cannot be read: {error}", file=str(path)) from error
    except Exception as error:  # a damaged file may raise anything inside the parser
        raise InputError(f"not an SVG drawing: {error}", file=str(path)) from error
    if not isinstance(document, svgelements.SVG):
        raise InputError("not an SVG drawing: it does not begin with an svg element of its namespace", file=str(path))
    return document


def _source(path: Path, shapes: list[FilledShape], speck: float, notes: Counter[str]) -> Source:
    """Faces and names of the shapes."""
    from fubini.cad.faces import FaceBuilder

    curves: list[Curve] = []
    ends: dict[int, tuple[int, int]] = {}
    owner: list[str | None] = []
    by_shape = []
    for shape in shapes:
        outlines = [o for sub in shape.subpaths if (o := _outline(sub, speck, curves, ends, notes)) is not None]
        owner += [shape.name] * (len(curves) - len(owner))
        by_shape.append((shape, outlines))
    builder = FaceBuilder(curves, ends)
    names = []
    for shape, outlines in by_shape:
        made = [builder.add(f) for f in faces_by_winding(outlines, shape.rule)]
        names += [(face, shape.name) for face in made if shape.name]
    if not builder.edges:
        raise GeometryError("no filled shape of the drawing encloses an area", file=str(path))
    edges = tuple((edge, name) for k, edge in builder.edges.items() if (name := owner[k]))
    remarks = [what if n == 1 else f"{what} ({n} times)" for what, n in notes.items()]
    return Source(builder.compound, str(path), tuple(names), edges, tuple(remarks))


def _outline(
    chain: tuple[Curve, ...],
    speck: float,
    curves: list[Curve],
    ends: dict[int, tuple[int, int]],
    notes: Counter[str],
) -> Outline | None:
    """Append the curves of a subpath, closed and joined, and give its outline; None when it has no area."""
    kept = [c for c in chain if abs(c.points() - c.start).max() > speck]
    if len(kept) < len(chain):
        notes["a piece shorter than the tolerance left out"] += len(chain) - len(kept)
    if not kept:
        return None
    if abs(kept[-1].end - kept[0].start) > speck:
        kept.append(Line(kept[-1].end, kept[0].start))
    first = len(curves)
    numbers = range(first, first + len(kept))
    starts = [c.start for c in kept]
    for k, curve, end in zip(numbers, kept, starts[1:] + starts[:1], strict=True):
        curves.append(matching(curve, curve.start, end))
        ends[k] = (k, k + 1 if k + 1 < first + len(kept) else first)
    outline = outline_of(curves, [Use(k, True) for k in numbers])
    extent = float(abs(outline.polygon - outline.polygon[0]).max())
    if abs(outline.area) <= speck * extent:
        notes["a subpath that encloses no area left out"] += 1
        return None
    return outline


def _filled_shapes(document: Any, notes: Counter[str]) -> Iterator[FilledShape]:
    """Every visible filled shape in document order, in the coordinates of the faces."""
    import svgelements

    place = _placement(document)
    for element, names in _walk(document, ()):
        kind = type(element).__name__.lower()
        if not isinstance(element, svgelements.Shape):
            if isinstance(element, (svgelements.Text, svgelements.Image)):
                notes[f"{kind} left out: convert it to paths"] += 1
            continue
        values = element.values or {}
        if values.get("visibility") in ("hidden", "collapse"):
            notes[f"hidden {kind} left out"] += 1
        elif element.fill is None or element.fill.value is None:
            notes[f"{kind} without fill left out: a stroke bounds no area"] += 1
        else:
            rule = str(values.get("fill-rule", "nonzero")).strip().lower()
            yield FilledShape(tuple(_subpaths(element, place)), rule, next(iter(names), None))


def _walk(element: Any, names: tuple[str, ...]) -> Iterator[tuple[Any, tuple[str, ...]]]:
    """Leaves of the document with their ids, the own one first, then those of the groups outwards."""
    import svgelements

    own = getattr(element, "values", None) or {}
    label = own.get("attributes", {}).get("id") if isinstance(own.get("attributes"), dict) else element.id
    if label and not isinstance(element, svgelements.SVG):
        names = (str(label), *(n for n in names if n != label))
    if isinstance(element, (svgelements.Group, svgelements.Use)):
        for child in element:
            yield from _walk(child, names)
    else:
        yield element, names


def _placement(document: Any) -> Affine:
    """From the page (y down) to the plane of the faces (y up, lower left corner at the origin)."""
    height = float(document.height or 0.0)
    return Affine(0, 1, 1j * height)


def _subpaths(element: Any, place: Affine) -> Iterator[tuple[Curve, ...]]:
    """Chains of curves of one shape, transformed and placed."""
    import svgelements

    m = element.transform
    p, q = complex(m.a, m.b), complex(m.c, m.d)
    own = Affine((p - 1j * q) / 2, (p + 1j * q) / 2, complex(m.e, m.f))
    bare = svgelements.Path(element)
    bare.transform = svgelements.Matrix()
    for subpath in bare.as_subpaths():
        chain = [c for segment in subpath for c in _curves(segment)]
        if chain:
            yield tuple(c.affine(own).affine(place) for c in chain)


def _curves(segment: Any) -> list[Curve]:
    """The curve of one path segment, in the element's own coordinates."""
    import svgelements

    if isinstance(segment, svgelements.Move) or segment.start is None or segment.end is None:
        return []
    start, end = _complex(segment.start), _complex(segment.end)
    if isinstance(segment, svgelements.QuadraticBezier):
        return [bezier(start, _complex(segment.control), end)]
    if isinstance(segment, svgelements.CubicBezier):
        return [bezier(start, _complex(segment.control1), _complex(segment.control2), end)]
    if isinstance(segment, svgelements.Arc):
        return [_arc(segment, start, end)]
    return [Line(start, end)] if start != end else []


def _arc(segment: Any, start: complex, end: complex) -> Curve:
    centre = _complex(segment.center)
    p, q = _complex(segment.prx) - centre, _complex(segment.pry) - centre
    area = (p.conjugate() * q).imag
    if area == 0:
        return Line(start, end)
    d = start - centre
    first = math.atan2((p.conjugate() * d).imag / area, (d.conjugate() * q).imag / area)
    direction = math.copysign(1.0, area)
    return ellipse(centre, p, q, first, float(segment.sweep) * direction)


def _complex(point: Any) -> complex:
    z = complex(float(point.x), float(point.y))
    if not np.isfinite(z):
        raise InputError("a coordinate is no finite number")
    return z
