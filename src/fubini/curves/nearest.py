"""Nearest points on a curve: a table of samples to start from, then safeguarded Newton."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves.base import Curve

Float = NDArray[np.float64]

_STEPS = 60
_CHUNK = 2048


def nearest(curve: Curve, table: Float, points: ArrayLike) -> tuple[Float, Float]:
    """Parameters (n,) and distances (n,) of the nearest points to ``points`` (n, 2).

    ``table`` (m,) are sorted parameters from 0 to 1, among them all where the derivative may jump, dense
    enough that between neighbours the distance to any point has at most one interior minimum. Every local
    minimum of the sampled distances that could hold the nearest point is refined.
    """
    q = np.asarray(points, np.float64).reshape(-1, 2)
    samples = curve.point(table)
    chord = np.hypot(*np.diff(samples, axis=0).T)
    reach = np.maximum(np.concatenate([[0.0], chord]), np.concatenate([chord, [0.0]]))
    t, distance = np.empty(len(q)), np.empty(len(q))
    for i in range(0, len(q), _CHUNK):
        part = slice(i, i + _CHUNK)
        t[part], distance[part] = _nearest_chunk(curve, table, samples, reach, q[part])
    return t, distance


def _nearest_chunk(curve: Curve, table: Float, samples: Float, reach: Float, q: Float) -> tuple[Float, Float]:
    d = np.hypot(q[:, :1] - samples[:, 0], q[:, 1:] - samples[:, 1])
    best = d.argmin(axis=1)
    rows = np.arange(len(q))
    low = d[rows, best]
    minimum = np.ones(d.shape, bool)
    minimum[:, 1:] &= d[:, 1:] <= d[:, :-1]
    minimum[:, :-1] &= d[:, :-1] <= d[:, 1:]
    row, column = np.nonzero(minimum & (d - reach <= low[:, None]))
    t, distance = table[best], low
    for side in (-1, 1):  # each neighbouring interval by itself: the derivative may jump between them
        inside = (column + side >= 0) & (column + side < len(table))
        r, c = row[inside], column[inside]
        s = _refine(curve, q[r], table[np.minimum(c, c + side)], table[np.maximum(c, c + side)])
        gap = np.hypot(*(q[r] - curve.point(s)).T)
        order = np.lexsort((s, gap, r))
        r, s, gap = r[order], s[order], gap[order]
        first = np.concatenate([[True], r[1:] != r[:-1]]) if len(r) else np.zeros(0, bool)
        r, s, gap = r[first], s[first], gap[first]
        closer = gap < distance[r]
        t[r[closer]], distance[r[closer]] = s[closer], gap[closer]
    return t, distance


def _refine(curve: Curve, q: Float, low: Float, high: Float) -> Float:
    """Where (c(t) - q) . c'(t) changes sign between low and high: Newton, bisection where it strays."""
    low, high = low.copy(), high.copy()
    t = (low + high) / 2.0
    for _ in range(_STEPS):
        gap, d, dd = curve._point(t) - q, curve._derivative(t), curve._second_derivative(t)
        f = (gap * d).sum(axis=1)
        slope = (d * d).sum(axis=1) + (gap * dd).sum(axis=1)
        low, high = np.where(f < 0.0, t, low), np.where(f > 0.0, t, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = t - f / slope
        stray = ~((newton > low) & (newton < high) & (slope > 0.0))
        new = np.where(f == 0.0, t, np.where(stray, (low + high) / 2.0, newton))
        if (np.abs(new - t) <= 1e-16).all():
            break
        t = new
    return t
