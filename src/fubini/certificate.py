"""The certificate: every figure is computed from the arrays that are shipped, none is carried over.

Curves enter as one function that evaluates them, so nothing here depends on their kinds. The rule for
flawed triangles (see the docs, theory of quality): a corner of the face below ``corner_limit`` excuses
one flawed triangle that touches it, and nothing else is excused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fubini.quality import corner_limit
from fubini.result import Certificate, Corner, FaceCertificate
from fubini.tolerance import AREA, FLAT, MAX_ASPECT_RATIO, MIN_SKEW, ON_CURVE

if TYPE_CHECKING:
    from fubini.model import Face

Float = NDArray[np.float64]
Int = NDArray[np.signedinteger]
Evaluate = Callable[[Int, Float], Float]

#: Where a curve is compared with its chord, beside its ends (shares of the parameter span).
CHORD_SAMPLES = np.arange(1, 8) / 8.0
#: Triangles measured at a time.
BLOCK = 8192


@dataclass(frozen=True)
class Outline:
    """The boundary of one face's mesh, tied to the curves of its region.

    Attributes
    ----------
    segments : (k, 2) indices of points, the face on the left of each.
    curve : (k,) number of the curve that the segment stands for, as ``evaluate`` counts them; -1 for a
        straight segment that stands for no curve.
    t : (k, 2) parameters of its two ends on the curve.
    corners : (c,) indices of the points at corners of the region.
    angles : (c,) interior angles in degrees between the tangents there.
    edges : CAD edge index by curve number, for messages; the number itself where it is missing.
    slack : distance that nodes may be off the curves beside ``ON_CURVE``: the tolerance the CAD states.
    """

    segments: Int
    curve: Int
    t: Float
    corners: Int
    angles: Float
    edges: Mapping[int, int] = field(default_factory=dict)
    slack: float = 0.0


@dataclass(frozen=True)
class TriangleFigures:
    """Per triangle (m,): twice the area vector (m, 3), skewness, aspect ratio, least and greatest angle."""

    normals: Float
    skew: Float
    aspect: Float
    least: Float
    greatest: Float

    def flawed(self, min_skew: float, max_aspect_ratio: float) -> NDArray[np.bool_]:
        """Which triangles (m,) are at or beyond a bound."""
        return (self.skew <= min_skew) | (self.aspect >= max_aspect_ratio)


def triangle_figures(points: Float, triangles: Int) -> TriangleFigures:
    """All figures of triangles (m, 3) of points (n, 3), block by block: what is in the cache stays there."""
    if len(triangles) <= BLOCK:
        return _figures_of_block(points, triangles)
    m = len(triangles)
    out = TriangleFigures(np.empty((m, 3)), np.empty(m), np.empty(m), np.empty(m), np.empty(m))
    for i in range(0, m, BLOCK):
        part = _figures_of_block(points, triangles[i : i + BLOCK])
        for name in ("normals", "skew", "aspect", "least", "greatest"):
            getattr(out, name)[i : i + BLOCK] = getattr(part, name)
    return out


def _figures_of_block(points: Float, triangles: Int) -> TriangleFigures:
    """Figures from the squared sides and one cross product."""
    a, b, c = (np.ascontiguousarray(points[triangles[:, i]].T) for i in range(3))
    u, v, w = b - a, c - a, c - b
    normals = u[[1, 2, 0]] * v[[2, 0, 1]] - u[[2, 0, 1]] * v[[1, 2, 0]]
    double = np.sqrt((normals * normals).sum(0))
    squares = np.stack([(e * e).sum(0) for e in (u, v, w)])
    total, low, high = squares.sum(0), squares.min(0), squares.max(0)
    middle = total - low - high
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = np.sqrt(squares)
        aspect = sides.prod(0) * sides.sum(0) / (4.0 * double * double)
    aspect[~np.isfinite(aspect)] = np.inf
    skew = np.degrees(np.arctan2(2.0 * double, high - low))
    skew[double == 0.0] = 0.0
    least = np.degrees(np.arctan2(2.0 * double, middle + high - low))
    greatest = np.degrees(np.arctan2(2.0 * double, low + middle - high))
    return TriangleFigures(normals.T, skew, aspect, least, greatest)


def certify_face(
    face: Face,
    points: Float,
    triangles: Int,
    outline: Outline,
    evaluate: Evaluate,
    *,
    diagonal: float,
    min_skew: float = MIN_SKEW,
    max_aspect_ratio: float = MAX_ASPECT_RATIO,
    moves: Mapping[str, int] | None = None,
    budget_exhausted: bool = False,
) -> FaceCertificate:
    """Figures and verdict of one face.

    Parameters
    ----------
    face : index, name, frame and area are read (``face.area``, else ``face.region.area``).
    points, triangles : (n, 3), may hold more than the face uses; (m, 3), outward normals.
    evaluate : curve numbers (k,) and parameters (k,) to plane coordinates (k, 2), as
        ``functools.partial(fubini.tracks.evaluate, tracks)`` gives.
    diagonal : of the whole model; tolerances are relative to it.
    """
    if not len(triangles):
        return _nothing(face)
    shape = triangle_figures(points, triangles)
    flaws = _find_flaws(face, points, triangles, shape, outline, (min_skew, max_aspect_ratio))
    boundary = _boundary_figures(face, points, outline, evaluate)
    area = float(face.area if face.area is not None else face.region.area)
    mesh_area = 0.5 * float((shape.normals @ face.frame.normal).sum())
    reasons = [
        *_flaw_reasons(flaws, shape),
        *_boundary_reasons(boundary, points, outline, diagonal),
        *_cover_reasons(outline),
        *_area_reasons(area, mesh_area, boundary, outline),
        *_shape_reasons(face, points, triangles, shape, outline, diagonal),
    ]
    return FaceCertificate(
        face=face.index,
        name=face.name,
        triangles=len(triangles),
        flawed=flaws.count,
        unavoidable=len(flaws.corners),
        corners=flaws.corners,
        worst_skew=float(shape.skew.min()),
        mean_skew=float(shape.skew.mean()),
        worst_aspect_ratio=float(shape.aspect.max()),
        worst_at=flaws.worst_at,
        min_angle=float(shape.least.min()),
        max_angle=float(shape.greatest.max()),
        area_error=abs(mesh_area - area) / area,
        boundary_distance=float(boundary.node.max(initial=0.0)),
        chord_error=float(boundary.chord.max(initial=0.0)),
        reasons=tuple(reasons),
        moves=dict(moves or {}),
        budget_exhausted=budget_exhausted,
        excess=flaws.excess,
        avoidable_skew=flaws.avoidable_skew,
    )


def _nothing(face: Face) -> FaceCertificate:
    """The certificate of a face that has no triangle."""
    at = _place(face.frame.origin)
    return FaceCertificate(
        face.index, face.name, 0, 0, 0, (), 0.0, 0.0, 1.0, at, 0.0, 0.0, 1.0, 0.0, 0.0, ("the face has no triangle",)
    )


def certify(
    faces: Iterable[FaceCertificate],
    *,
    min_skew: float = MIN_SKEW,
    max_aspect_ratio: float = MAX_ASPECT_RATIO,
    skipped_faces: int = 0,
    notes: Iterable[str] = (),
) -> Certificate:
    """The certificate of the whole mesh, faces in index order."""
    ordered = tuple(sorted(faces, key=lambda f: f.face))
    return Certificate(ordered, min_skew, max_aspect_ratio, skipped_faces, tuple(notes))


def excuse(triangles: Int, corners: Int) -> NDArray[np.intp]:
    """Which of the flawed ``triangles`` (m, 3) the sharp ``corners`` (c,) excuse: row numbers, sorted.

    Each corner excuses at most one triangle that has it as a corner; as many are excused as can be (a
    maximum matching). A point listed twice, where two corners meet in one node, excuses two.
    """
    owner: dict[int, int] = {}  # corner number -> row
    at_node: dict[int, list[int]] = {}
    for number, node in enumerate(corners.tolist()):
        at_node.setdefault(node, []).append(number)
    touched = [[k for node in row for k in at_node.get(node, ())] for row in triangles.tolist()]

    def find(row: int, seen: set[int]) -> bool:
        for corner in touched[row]:
            if corner not in seen:
                seen.add(corner)
                if corner not in owner or find(owner[corner], seen):
                    owner[corner] = row
                    return True
        return False

    for row in range(len(triangles)):
        find(row, set())
    return np.array(sorted(owner.values()), np.intp)


@dataclass(frozen=True)
class _Flaws:
    """Flawed triangles of a face, the corners that excuse some, and the worst triangle of the others."""

    count: int
    excess: int
    corners: tuple[Corner, ...]
    worst: int
    worst_at: tuple[float, float, float]
    avoidable_skew: float


def _find_flaws(
    face: Face,
    points: Float,
    triangles: Int,
    shape: TriangleFigures,
    outline: Outline,
    limits: tuple[float, float],
) -> _Flaws:
    flawed = np.flatnonzero(shape.flawed(*limits))
    sharp = np.flatnonzero(outline.angles < corner_limit(*limits))
    nodes = outline.corners[sharp]
    excused = flawed[excuse(triangles[flawed], nodes)] if len(flawed) and len(nodes) else flawed[:0]
    rest = shape.skew.copy()
    rest[excused] = np.inf
    all_excused = len(excused) == len(rest)
    worst = int(shape.skew.argmin() if all_excused else rest.argmin())
    corners = tuple(
        Corner(face.index, _place(points[i]), float(angle))
        for i, angle in zip(nodes, outline.angles[sharp], strict=True)
    )
    return _Flaws(
        len(flawed),
        len(flawed) - len(excused),
        corners,
        worst,
        _place(points[triangles[worst]].mean(0)),
        90.0 if all_excused else float(shape.skew[worst]),
    )


@dataclass(frozen=True)
class _Boundary:
    """Per segment: distance of its two ends from the curve (k, 2), of the chord (k,), its length (k,)."""

    node: Float
    chord: Float
    length: Float


def _boundary_figures(face: Face, points: Float, outline: Outline, evaluate: Evaluate) -> _Boundary:
    """Compare the nodes with the curve at their own parameters, and chords with the curve between."""
    ends = points[outline.segments]
    k, inner = len(outline.segments), len(CHORD_SAMPLES)
    t0, t1 = outline.t[:, :1], outline.t[:, 1:]
    params = np.hstack([outline.t, t0 + (t1 - t0) * CHORD_SAMPLES])
    curves = np.repeat(np.maximum(outline.curve, 0), inner + 2).astype(np.int32)
    on_curve = face.frame.to_space(evaluate(curves, params.ravel())).reshape(k, inner + 2, 3)
    node = np.linalg.norm(on_curve[:, :2] - ends, axis=2)
    along = ends[:, 1] - ends[:, 0]
    square = np.einsum("ij,ij->i", along, along)
    offset = on_curve[:, 2:] - ends[:, :1]
    share = np.einsum("kij,kj->ki", offset, along) / np.maximum(square, 1e-300)[:, None]
    foot = np.clip(share, 0.0, 1.0)[..., None] * along[:, None]
    chord = np.linalg.norm(offset - foot, axis=2).max(1, initial=0.0)
    node[outline.curve < 0], chord[outline.curve < 0] = 0.0, 0.0
    return _Boundary(node, chord, np.sqrt(square))


def _flaw_reasons(flaws: _Flaws, shape: TriangleFigures) -> list[str]:
    if not flaws.excess:
        return []
    beyond = f" beyond the {len(flaws.corners)} unavoidable" if flaws.corners else ""
    what = "triangle" if flaws.excess == 1 else "triangles"
    skew, aspect = shape.skew[flaws.worst], shape.aspect[flaws.worst]
    figures = f"skewness {skew:.4g}, aspect ratio {aspect:.4g}"
    return [f"{flaws.excess} flawed {what}{beyond}, worst at {_text(flaws.worst_at)}: {figures}"]


def _boundary_reasons(boundary: _Boundary, points: Float, outline: Outline, diagonal: float) -> list[str]:
    if not boundary.node.size or boundary.node.max() <= ON_CURVE * diagonal + outline.slack:
        return []
    segment, end = np.unravel_index(boundary.node.argmax(), boundary.node.shape)
    number = int(outline.curve[segment])
    at = _text(points[outline.segments[segment, end]])
    return [f"boundary node {boundary.node.max():.2g} from edge {outline.edges.get(number, number)} at {at}"]


def _cover_reasons(outline: Outline) -> list[str]:
    """Every curve that occurs must be covered by its segments, once from end to end."""
    tied = outline.curve >= 0
    spans = np.abs(outline.t[tied, 1] - outline.t[tied, 0])
    covered = np.bincount(outline.curve[tied], spans)
    bad = [k for k in np.flatnonzero(np.abs(covered - 1.0) > 1e-9).tolist() if covered[k] > 0.0]
    return [f"edge {outline.edges.get(k, k)} is covered {covered[k]:.6g} times, not once" for k in bad]


def _area_reasons(area: float, mesh_area: float, boundary: _Boundary, outline: Outline) -> list[str]:
    """The mesh may miss or add what lies between chords and curves, within 1.5 times chord error x length."""
    reach = 1.5 * boundary.chord + 2.0 * boundary.node.max(axis=1, initial=0.0) + outline.slack
    allowed = float((reach * boundary.length).sum()) + 1e3 * AREA * area
    if abs(mesh_area - area) <= allowed:
        return []
    off = (mesh_area - area) / area
    return [f"area differs by {off:.2g} of the CAD area, more than its curves explain ({allowed / area:.2g})"]


def _shape_reasons(
    face: Face, points: Float, triangles: Int, shape: TriangleFigures, outline: Outline, diagonal: float
) -> list[str]:
    """Triangles upside down, nodes off the plane, edges that do not close up."""
    normal, reasons = face.frame.normal, []
    inverted = np.flatnonzero(shape.normals @ normal <= 0.0)
    if len(inverted):
        at = _text(points[triangles[inverted[0]]].mean(0))
        reasons.append(f"{len(inverted)} triangles have no area or lie upside down, the first at {at}")
    corner = triangles.ravel()
    if len(points) < corner.size:
        height = np.abs((points - face.frame.origin) @ normal)[corner]
    else:
        height = np.abs((points[corner] - face.frame.origin) @ normal)
    if height.max() > FLAT * diagonal + face.tolerance + outline.slack:
        at = _text(points[corner[height.argmax()]])
        reasons.append(f"a node lies {height.max():.2g} off the plane of the face at {at}")
    if not closes_up(triangles, outline.segments, len(points)):
        reasons.append("the triangles do not fit together, or do not end at the boundary segments")
    return reasons


def closes_up(triangles: Int, segments: Int, points: int) -> bool:
    """Whether every directed edge occurs once, and its reverse too but on the given boundary segments."""
    sides = np.empty(triangles.size, np.int64)
    for i in range(0, len(triangles), BLOCK):
        part = triangles[i : i + BLOCK]
        sides[3 * i : 3 * (i + len(part))] = _directed(part, part[:, [1, 2, 0]], points).ravel()
    sides.sort()
    if (sides[1:] == sides[:-1]).any():
        return False
    lines = sides >> 1
    alone = np.ones(len(lines), bool)
    alone[1:] = lines[1:] != lines[:-1]
    alone[:-1] &= alone[1:]
    ends = _directed(segments[:, 0], segments[:, 1], points)
    line, at = np.unique(ends >> 1, return_inverse=True)
    surplus = np.bincount(at.ravel(), 1.0 - 2.0 * (ends & 1))  # segments there and back cancel out
    once = surplus != 0.0
    rim = 2 * line[once] + (surplus[once] < 0.0)
    return bool((np.abs(surplus) <= 1.0).all()) and np.array_equal(sides[alone], rim)


def _directed(start: Int, end: Int, points: int) -> NDArray[np.int64]:
    """Number of each directed edge; edges there and back differ in the last bit only."""
    a, b = start.astype(np.int64), end.astype(np.int64)
    return 2 * (np.minimum(a, b) * points + np.maximum(a, b)) + (a > b)


def _place(point: Float) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in point)
    return x, y, z


def _text(point: Iterable[float]) -> str:
    return "(" + ", ".join(f"{v:.6g}" for v in point) + ")"
