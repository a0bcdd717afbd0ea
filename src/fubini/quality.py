"""Quality of triangles: aspect ratio, skewness, angles (Perumal 2019, Eq. 2 and 3).

Triangles are given as corner coordinates ``p`` of shape (m, 3, d), d = 2 or 3.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from fubini.tolerance import MAX_ASPECT_RATIO, MIN_SKEW

Array = NDArray[np.float64]


def edge_vectors(p: Array) -> Array:
    """Vectors (m, 3, d) of the edges opposite to each corner."""
    return p[:, [2, 0, 1]] - p[:, [1, 2, 0]]


def areas(p: Array) -> Array:
    """Areas (m,) of triangles p (m, 3, d): signed in the plane (d = 2), positive in space."""
    u, v = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    if p.shape[2] == 2:
        return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    normal = np.cross(u, v)
    return 0.5 * np.sqrt((normal * normal).sum(1))


def squared_lengths(p: Array) -> Array:
    """Squared lengths (m, 3) of the edges opposite to each corner."""
    e = edge_vectors(p)
    return (e * e).sum(2)


def aspect_ratios(p: Array) -> Array:
    """Aspect ratios (m,): ``abc / (8 (s-a)(s-b)(s-c)) = R / 2r``; 1 for the equilateral triangle.

    Eq. 2 of the paper with ``(s-a)(s-b)(s-c) = A^2 / s``. Infinite for triangles of no area.
    """
    length = np.sqrt(squared_lengths(p))
    a = np.abs(areas(p))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = length.prod(1) * length.sum(1) / (16.0 * a * a)
    ratio[~np.isfinite(ratio)] = np.inf
    return ratio


def skewness(p: Array) -> Array:
    """Skewness (m,) in degrees: ``atan(4 A / (Lmax^2 - Lmin^2))``; 90 for the equilateral triangle.

    The paper's skewness is the smallest angle between a median and the mid-line of the other two
    sides; this closed form equals it (see docs, theory of quality). Negative where the corners run
    clockwise in the plane.
    """
    square = squared_lengths(p)
    a = areas(p)
    skew = np.degrees(np.arctan2(4.0 * a, square.max(1) - square.min(1)))
    skew[a == 0.0] = 0.0
    return np.where(a < 0.0, -np.abs(skew), skew)


def angles(p: Array) -> Array:
    """Interior angles (m, 3) in degrees at the corners."""
    e = edge_vectors(p)
    out = np.empty(p.shape[:2])
    for i in range(3):
        u, v = -e[:, (i + 1) % 3], e[:, (i + 2) % 3]
        dot = (u * v).sum(1)
        cross = np.sqrt(np.maximum((u * u).sum(1) * (v * v).sum(1) - dot * dot, 0.0))
        if p.shape[2] == 2:
            cross = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
        out[:, i] = np.degrees(np.arctan2(cross, dot))
    return out


def flawed(p: Array, min_skew: float = MIN_SKEW, max_aspect_ratio: float = MAX_ASPECT_RATIO) -> NDArray[np.bool_]:
    """Which triangles (m,) are not valid: aspect ratio at or above, or skewness at or below, its bound."""
    return (skewness(p) <= min_skew) | (aspect_ratios(p) >= max_aspect_ratio)


@functools.lru_cache(maxsize=64)
def corner_limit(min_skew: float = MIN_SKEW, max_aspect_ratio: float = MAX_ASPECT_RATIO) -> float:
    """Smallest corner angle in degrees that one triangle within both bounds can fill.

    The best triangle for a sharp corner is isosceles with apex ``a``; with ``c = cot(a/2)`` its
    angles give ``cot a - cot(90 - a/2) = (c - 3/c) / 2``, so the bound ``2 / (...) = tan(min_skew)``
    is a quadratic in ``c``; so is ``1 / (4 s (1 - s)) = max_aspect_ratio`` in ``s = sin(a/2)``, which
    decides only below 1.505 when ``min_skew`` is 45. 24.295 degrees by default (docs, theory of quality).
    """
    k = 2.0 / math.tan(math.radians(min_skew))
    c = k + math.sqrt(k * k + 3.0)
    s = 0.5 * (1.0 - math.sqrt(max(0.0, 1.0 - 1.0 / max_aspect_ratio)))
    return 2.0 * math.degrees(max(math.atan(1.0 / c), math.asin(s)))


def growth_rates(points: Array, triangles: NDArray[np.signedinteger]) -> Array:
    """Growth (k,) of the element size across every edge with a triangle on both sides; at least 1.

    The size of a triangle is the mean length of its three edges; the growth is the larger of the two sizes over the
    smaller one. ``points`` (n, d), ``triangles`` (m, 3). See ``edge_ratios`` for lengths at a node.
    """
    size = np.sqrt(squared_lengths(points[triangles])).mean(axis=1)
    a, b = triangles.astype(np.int64), np.roll(triangles, -1, axis=1).astype(np.int64)
    side = (np.minimum(a, b) * len(points) + np.maximum(a, b)).ravel()
    order = np.argsort(side, kind="stable")
    both = side[order[1:]] == side[order[:-1]]
    first, second = size[order[:-1][both] // 3], size[order[1:][both] // 3]
    rates: Array = np.maximum(first, second) / np.minimum(first, second)
    return rates


def edge_ratios(points: Array, triangles: NDArray[np.signedinteger]) -> Array:
    """Longest edge over shortest edge at every node (n,); 1 at nodes without a triangle.

    ``points`` (n, d), ``triangles`` (m, 3). A good triangle alone may have edges in the ratio 2.
    """
    length = np.sqrt(squared_lengths(points[triangles]))
    ends = triangles[:, [[1, 2], [2, 0], [0, 1]]]
    longest, shortest = np.zeros(len(points)), np.full(len(points), np.inf)
    for k in range(2):
        np.maximum.at(longest, ends[:, :, k], length)
        np.minimum.at(shortest, ends[:, :, k], length)
    ratios: Array = np.where(longest > 0.0, longest / shortest, 1.0)
    return ratios
