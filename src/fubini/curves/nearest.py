"""Nearest points on a curve: a table of samples to start from, then safeguarded Newton."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves.base import Curve

Float = NDArray[np.float64]

#: Newton and bisection steps, and the change of a parameter that ends them.
_STEPS, _CLOSE = 60, 2e-16
_CHUNK = 2048


def nearest(curve: Curve, table: Float, samples: Float, points: ArrayLike) -> tuple[Float, Float]:
    """Parameters (n,) and distances (n,) of the nearest points to ``points`` (n, 2).

    ``table`` (m,) are sorted parameters from 0 to 1 and ``samples`` (m, 2) their points, among them all where
    the derivative may jump, dense
    enough that between neighbours the distance to any point has at most one interior minimum. Every local
    minimum of the sampled distances that could hold the nearest point is refined.
    """
    q = np.asarray(points, np.float64).reshape(-1, 2)
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
    low, high, t = low.copy(), high.copy(), (low + high) / 2.0
    before = high - low
    left = np.arange(len(t))
    for _ in range(_STEPS):
        now = t[left]
        gap, d, dd = curve._point(now) - q[left], curve._derivative(now), curve._second_derivative(now)
        f = (gap * d).sum(axis=1)
        slope = (d * d).sum(axis=1) + (gap * dd).sum(axis=1)
        low[left] = np.where(f < 0.0, now, low[left])
        high[left] = np.where(f > 0.0, now, high[left])
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(slope > 0.0, -f / slope, np.inf)
        new = now + step
        stray = ~((new > low[left]) & (new < high[left]) & (np.abs(step) <= before[left] / 2.0))
        near = (f == 0.0) | (np.abs(step) <= _CLOSE)
        t[left] = np.where(near, now, np.where(stray, (low[left] + high[left]) / 2.0, new))
        before[left] = np.abs(t[left] - now)
        left = left[~near & (high[left] - low[left] > _CLOSE)]
        if len(left) == 0:
            break
    return t
