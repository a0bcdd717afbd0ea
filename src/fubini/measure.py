"""Figures of triangles, and whether they fit together: everything from the arrays of points and triangles alone.

``measure`` goes through a mesh once and keeps sums and worst cases; ``triangle_figures`` keeps the figures of every
triangle. ``closes_up`` knows nothing of how the triangles were made.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini import _kernels_shipped as kernels
from fubini._jit import readonly
from fubini.errors import OptionError

Float = NDArray[np.float64]
Int = NDArray[np.signedinteger]
Unsigned = NDArray[np.uint32]

#: Triangles measured at a time.
BLOCK = 8192
#: Flawed triangles that there is room for at first.
ROOM = 64
#: Most nodes of one face: an edge is one uint32 beside its lower node.
MOST_NODES = 2**30


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


@dataclass(frozen=True)
class Measures:
    """Sums and worst cases of the triangles of one face.

    Attributes
    ----------
    area : by the outward normal, negative where triangles lie upside down.
    mean_skew, worst_skew, worst_aspect, least, greatest : over all triangles; angles in degrees.
    flawed, flaws : (f,) triangles at or beyond a bound, and (f, 2) their skewness and aspect ratio.
    worst_sound : the triangle of least skewness among the others and that skewness; -1 and infinity for none.
    inverted : number of triangles of no area or upside down, and the first of them.
    height : largest distance of a node from the plane, and the node.
    longest : length of the longest edge.
    closed : whether the triangles fit together (see ``closes_up``).
    """

    area: float
    mean_skew: float
    worst_skew: float
    worst_aspect: float
    least: float
    greatest: float
    flawed: Int
    flaws: Float
    worst_sound: tuple[int, float]
    inverted: tuple[int, int]
    height: tuple[float, int]
    longest: float
    closed: bool


def numbering(points: int) -> Unsigned:
    """Scratch space (n,) for the faces of a mesh with n points, measured one after the other."""
    return np.full(points, kernels.FREE, np.uint32)


def measure(
    points: Float,
    triangles: Int,
    segments: Int,
    plane: tuple[Float, Float],
    limits: tuple[float, float],
    number: Unsigned | None = None,
) -> Measures:
    """Measure the triangles (m, 3), m > 0, of one face.

    Parameters
    ----------
    points : (n, 3), may hold more than the face uses.
    segments : (k, 2), its boundary, the face on the left of each.
    plane : a point on the plane of the face, and its outward unit normal.
    limits : skewness at or below which a triangle is flawed, and aspect ratio at or above which it is.
    number : ``numbering(n)``, left as it was; made anew where it is not given, for all n points.

    Raises OptionError where a triangle or segment names a point that does not exist.
    """
    points, corners, ends = readonly(points, np.float64), _indices(triangles, 3), _indices(segments, 2)
    number = numbering(len(points)) if number is None else number
    figures, counts = np.empty(kernels.FIGURES), np.empty(kernels.COUNTS, np.int64)
    found, room = ROOM, 0
    while found > room:
        flawed, flaws, room = np.empty(found, np.int32), np.empty((found, 2)), found
        found = kernels.measure(
            points, corners, np.array(plane), np.array(limits), number, flawed, flaws, figures, counts
        )
        if found > room:
            kernels.forget(corners, number)
    if found < 0:
        raise OptionError("a triangle names a point that does not exist")
    closed = _fits(corners, ends, number, int(counts[kernels.NODES]))
    if 3 * len(triangles) > len(points):
        number.fill(kernels.FREE)
    else:
        kernels.forget(corners, number)
        kernels.forget(ends, number)
    return Measures(
        area=float(figures[kernels.AREA]),
        mean_skew=float(figures[kernels.SKEW_SUM]) / len(triangles),
        worst_skew=float(figures[kernels.WORST_SKEW]),
        worst_aspect=float(figures[kernels.WORST_ASPECT]),
        least=float(figures[kernels.LEAST]),
        greatest=float(figures[kernels.GREATEST]),
        flawed=flawed[:found],
        flaws=flaws[:found],
        worst_sound=(int(counts[kernels.WORST_SOUND]), float(figures[kernels.SOUND_SKEW])),
        inverted=(int(counts[kernels.INVERTED]), int(counts[kernels.FIRST_INVERTED])),
        height=(float(figures[kernels.HEIGHT]), int(counts[kernels.FARTHEST])),
        longest=float(figures[kernels.LONGEST]),
        closed=closed,
    )


@dataclass(frozen=True)
class BoundaryFigures:
    """Distance of the two ends of segments from the curve (k, 2), of the curve from the chord (k,), lengths (k,)."""

    node: Float
    chord: Float
    length: Float


def compare_with_curves(points: Float, segments: Int, on_curve: Float) -> BoundaryFigures:
    """Compare segments (k, 2) with the curves that they stand for.

    on_curve : (k, 2 + s, 3) points of the curve at the ends of each segment, then between them.
    """
    ends, k = _indices(segments, 2), len(segments)
    if k and int(ends.max()) >= len(points):
        raise OptionError("a segment names a point that does not exist")
    found = BoundaryFigures(np.empty((k, 2)), np.empty(k), np.empty(k))
    kernels.compare_with_curves(
        readonly(points, np.float64), ends, readonly(on_curve, np.float64), found.node, found.chord, found.length
    )
    return found


def closes_up(triangles: Int, segments: Int, points: int) -> bool:
    """Whether every directed edge of the triangles occurs once, and its reverse too but on the given segments.

    triangles (m, 3), segments (k, 2) : indices below ``points``. Segments there and back cancel out. Linear time.

    Raises OptionError where a triangle or segment names a point that does not exist.
    """
    number = numbering(points)
    corners = _indices(triangles, 3)
    nodes = kernels.number_more(0, corners, number)
    if nodes < 0:
        raise OptionError("a triangle names a point that does not exist")
    return _fits(corners, _indices(segments, 2), number, nodes)


def _fits(triangles: Unsigned, segments: Unsigned, number: Unsigned, nodes: int) -> bool:
    """``closes_up`` for triangles whose nodes have numbers."""
    nodes = kernels.number_more(nodes, segments, number)
    if nodes < 0:
        raise OptionError("a segment names a point that does not exist")
    if nodes >= MOST_NODES:
        raise OptionError(f"{nodes} nodes on one face", fix=f"stay below {MOST_NODES}")
    entries = np.empty(triangles.size + len(segments), np.uint32)
    first, state = np.zeros(nodes, np.uint32), np.zeros(nodes, np.int32)
    return bool(kernels.fit_together(triangles, segments, number, nodes, first, entries, state))


def _indices(rows: Any, width: int) -> Unsigned:
    """Rows of node numbers (k, width) as kernels read them; negative ones become larger than any."""
    return readonly(np.asarray(rows).reshape(-1, width), np.int32).view(np.uint32)
