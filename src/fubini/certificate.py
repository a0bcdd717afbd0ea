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

from fubini.measure import BLOCK, BoundaryFigures, Measures, compare_with_curves, measure, triangle_figures
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
    number: NDArray[np.uint32] | None = None,
) -> FaceCertificate:
    """Figures and verdict of one face.

    Parameters
    ----------
    face : index, name, frame and area are read (``face.area``, else ``face.region.area``).
    points, triangles : (n, 3), may hold more than the face uses; (m, 3), outward normals.
    evaluate : curve numbers (k,) and parameters (k,) to plane coordinates (k, 2), as
        ``functools.partial(fubini.tracks.evaluate, tracks)`` gives.
    diagonal : of the whole model; tolerances are relative to it.
    number : ``fubini.measure.numbering(n)``, shared by the faces of one mesh.
    """
    if not len(triangles):
        return _nothing(face)
    limits = min_skew, max_aspect_ratio
    shape = measure(points, triangles, outline.segments, (face.frame.origin, face.frame.normal), limits, number)
    flaws = _find_flaws(face, points, triangles, shape, outline, limits)
    boundary = _boundary_figures(face, points, outline, evaluate)
    area = float(face.area if face.area is not None else face.region.area)
    reasons = (
        *_flaw_reasons(flaws, points, triangles, limits, budget_exhausted),
        *_boundary_reasons(boundary, points, outline, diagonal),
        *_cover_reasons(outline),
        *_area_reasons(area, shape.area, boundary, outline),
        *_shape_reasons(face, points, triangles, shape, outline, diagonal),
    )
    return FaceCertificate(
        face=face.index,
        name=face.name,
        triangles=len(triangles),
        flawed=len(shape.flawed),
        unavoidable=len(flaws.corners),
        corners=flaws.corners,
        excess=flaws.excess,
        worst_skew=shape.worst_skew,
        mean_skew=shape.mean_skew,
        avoidable_skew=flaws.avoidable_skew,
        worst_aspect_ratio=shape.worst_aspect,
        worst_at=flaws.worst_at,
        min_angle=shape.least,
        max_angle=shape.greatest,
        longest_edge=shape.longest,
        area_error=abs(shape.area - area) / (area if area > 0.0 else max(shape.area, 1e-300)),
        boundary_distance=float(boundary.node.max(initial=0.0)),
        chord_error=float(boundary.chord.max(initial=0.0)),
        reasons=reasons,
        moves=dict(moves or {}),
        budget_exhausted=budget_exhausted,
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
    """Number of flawed triangles that no corner excuses, the one furthest beyond its bound, and the sharp corners.

    ``worst_at`` is the centroid of the triangle of least skewness among those not excused, ``avoidable_skew`` its
    skewness. Where all triangles are excused the worst of all counts, and ``avoidable_skew`` is 90.
    """

    excess: int
    worst: int
    corners: tuple[Corner, ...]
    worst_at: tuple[float, float, float]
    avoidable_skew: float


def _find_flaws(
    face: Face,
    points: Float,
    triangles: Int,
    shape: Measures,
    outline: Outline,
    limits: tuple[float, float],
) -> _Flaws:
    sharp = np.flatnonzero(outline.angles < corner_limit(*limits))
    nodes = outline.corners[sharp]
    free = np.ones(len(shape.flawed), bool)
    if len(free) and len(nodes):
        free[excuse(triangles[shape.flawed], nodes)] = False
    worst, skew = shape.worst_sound
    all_excused = worst < 0 and not free.any()
    among = np.flatnonzero(free | all_excused)
    if len(among):
        k = among[shape.flaws[among, 0].argmin()]
        if worst < 0 or (shape.flaws[k, 0], shape.flawed[k]) < (skew, worst):
            worst, skew = int(shape.flawed[k]), float(shape.flaws[k, 0])
    corners = tuple(
        Corner(face.index, _place(points[i]), float(angle))
        for i, angle in zip(nodes, outline.angles[sharp], strict=True)
    )
    at = _place(points[triangles[worst]].mean(0))
    beyond = np.minimum(shape.flaws[free, 0] / limits[0], limits[1] / shape.flaws[free, 1])
    furthest = int(shape.flawed[free][beyond.argmin()]) if len(beyond) else -1
    return _Flaws(int(free.sum()), furthest, corners, at, 90.0 if all_excused else skew)


def _boundary_figures(face: Face, points: Float, outline: Outline, evaluate: Evaluate) -> BoundaryFigures:
    """Compare the nodes with the curve at their own parameters, and chords with the curve between."""
    k = len(outline.segments)
    blocks = [slice(i, i + BLOCK) for i in range(0, max(k, 1), BLOCK)]  # small enough to stay in the cache
    found = [_block_figures(face, points, outline, evaluate, block) for block in blocks]
    if len(found) == 1:
        return found[0]
    return BoundaryFigures(*(np.concatenate([getattr(f, x) for f in found]) for x in ("node", "chord", "length")))


def _block_figures(face: Face, points: Float, outline: Outline, evaluate: Evaluate, block: slice) -> BoundaryFigures:
    """The same for a block of the segments."""
    t, curve = outline.t[block], outline.curve[block]
    k, inner = len(t), len(CHORD_SAMPLES)
    t0, t1 = t[:, :1], t[:, 1:]
    params = np.hstack([t, t0 + (t1 - t0) * CHORD_SAMPLES])
    curves = np.repeat(np.maximum(curve, 0), inner + 2).astype(np.int32)
    on_curve = face.frame.to_space(evaluate(curves, params.ravel())).reshape(k, inner + 2, 3)
    found = compare_with_curves(points, outline.segments[block], on_curve)
    found.node[curve < 0], found.chord[curve < 0] = 0.0, 0.0
    return found


def _flaw_reasons(flaws: _Flaws, points: Float, triangles: Int, limits: tuple[float, float], spent: bool) -> list[str]:
    """How many triangles miss the bounds, and the figures of one of them beside the bound that it misses."""
    if not flaws.excess:
        return []
    beyond = f" beyond the {len(flaws.corners)} unavoidable" if flaws.corners else ""
    what = "triangle" if flaws.excess == 1 else "triangles"
    row = triangles[flaws.worst : flaws.worst + 1]
    found = triangle_figures(points, row)
    skew = f"skewness {found.skew[0]:.4g}" + (f" (not above {limits[0]:g})" if found.skew[0] <= limits[0] else "")
    aspect = f"aspect ratio {found.aspect[0]:.4g}"
    aspect += f" (not below {limits[1]:g})" if found.aspect[0] >= limits[1] else ""
    at = _text(points[row[0]].mean(0))
    end = "; the budget of moves was spent" if spent else ""
    return [f"{flaws.excess} flawed {what}{beyond}, worst at {at}: {skew}, {aspect}{end}"]


def _boundary_reasons(boundary: BoundaryFigures, points: Float, outline: Outline, diagonal: float) -> list[str]:
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


def _area_reasons(area: float, mesh_area: float, boundary: BoundaryFigures, outline: Outline) -> list[str]:
    """The mesh may miss or add what lies between chords and curves, within 1.5 times chord error x length."""
    reach = 1.5 * boundary.chord + 2.0 * boundary.node.max(axis=1, initial=0.0) + outline.slack
    allowed = float((reach * boundary.length).sum()) + 1e3 * AREA * area
    if abs(mesh_area - area) <= allowed:
        return []
    if not area > 0.0:
        return [f"the CAD kernel gives the face an area of {area:.3g}, and the mesh has {mesh_area:.6g}"]
    off = (mesh_area - area) / area
    return [f"area differs by {off:.2g} of the CAD area, more than its curves explain ({allowed / area:.2g})"]


def _shape_reasons(
    face: Face, points: Float, triangles: Int, shape: Measures, outline: Outline, diagonal: float
) -> list[str]:
    """Triangles upside down, nodes off the plane, edges that do not close up."""
    reasons = []
    count, first = shape.inverted
    if count:
        at = _text(points[triangles[first]].mean(0))
        reasons.append(f"{count} triangles have no area or lie upside down, the first at {at}")
    height, node = shape.height
    if not height <= FLAT * diagonal + face.tolerance + outline.slack:
        reasons.append(f"a node lies {height:.2g} off the plane of the face at {_text(points[node])}")
    if not shape.closed:
        reasons.append("the triangles do not fit together, or do not end at the boundary segments")
    return reasons


def _place(point: Float) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in point)
    return x, y, z


def _text(point: Iterable[float]) -> str:
    return "(" + ", ".join(f"{v:.6g}" for v in point) + ")"
