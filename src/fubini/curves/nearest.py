"""Nearest points on a curve: a table of samples to start from, then safeguarded Newton."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves.base import Curve

Float = NDArray[np.float64]

#: Newton and bisection steps, and the change of a parameter that ends them.
_STEPS, _CLOSE = 60, 1e-15
#: Points treated at once, to bound memory.
_CHUNK = 256
#: Parts into which an interval that may hold the nearest point is cut.
_PARTS = 4
#: Intervals are halved, at most so often, where the curve is this far (times the chord) off its chord.
_SAG, _HALVINGS = 0.1, 8


class Table(NamedTuple):
    """Samples of a curve: sorted parameters (m,) from 0 to 1 and their points (m, 2), dense where it bends.

    ``off`` (m - 1,) is twice the distance of the middle of an interval from the middle of its chord, an
    estimate from above of how far the curve leaves the chord.
    """

    t: Float
    points: Float
    off: Float


def sample(point: Callable[[Float], Float], t: Float) -> Table:
    """A table that starts from parameters ``t``, where all jumps of the derivative must be among them."""
    p = point(t)
    for k in range(_HALVINGS + 1):
        middle = (t[:-1] + t[1:]) / 2.0
        m = point(middle)
        sag = np.hypot(*(m - (p[:-1] + p[1:]) / 2.0).T)
        coarse = np.nonzero(sag > _SAG * np.hypot(*np.diff(p, axis=0).T))[0]
        if len(coarse) == 0 or k == _HALVINGS:
            break
        t = np.insert(t, coarse + 1, middle[coarse])
        p = np.insert(p, coarse + 1, m[coarse], axis=0)
    return Table(t, p, 2.0 * sag)


def nearest(curve: Curve, table: Table, points: ArrayLike) -> tuple[Float, Float]:
    """Parameters (n,) and distances (n,) of the nearest points of a curve to ``points`` (n, 2).

    Every interval of the table that may come closer than the nearest sample is searched for minima.
    """
    q = np.asarray(points, np.float64).reshape(-1, 2)
    t, distance = np.empty(len(q)), np.empty(len(q))
    for i in range(0, len(q), _CHUNK):
        part = slice(i, i + _CHUNK)
        t[part], distance[part] = _nearest_chunk(curve, table, q[part])
    return t, distance


def _nearest_chunk(curve: Curve, table: Table, q: Float) -> tuple[Float, Float]:
    away = np.hypot(q[:, :1] - table.points[:, 0], q[:, 1:] - table.points[:, 1])
    best = away.argmin(axis=1)
    t, distance = table.t[best], away[np.arange(len(q)), best]
    row, k = np.nonzero(_chord_distance(table, q) - table.off <= distance[:, None])
    low, high = table.t[k], table.t[k + 1]
    # cut each interval; a minimum lies where the distance falls at one cut and rises at the next
    cuts = low[:, None] + (high - low)[:, None] * (np.arange(_PARTS + 1) / _PARTS)
    cuts[:, -1] = np.nextafter(high, low)  # the derivative from the left
    flat, many = cuts.ravel(), np.repeat(row, _PARTS + 1)
    rate = ((curve._point(flat) - q[many]) * curve._derivative(flat)).sum(axis=1).reshape(cuts.shape)
    i, j = np.nonzero((rate[:, :-1] < 0.0) & (rate[:, 1:] > 0.0))
    found = _refine(curve, q[row[i]], cuts[i, j], cuts[i, j + 1])
    s, r = np.concatenate([found, flat]), np.concatenate([row[i], many])
    gap = np.hypot(*(q[r] - curve.point(s)).T)
    order = np.lexsort((s, gap, r))
    r, s, gap = r[order], s[order], gap[order]
    first = np.nonzero(np.diff(r, prepend=-1))[0]
    closer = first[gap[first] < distance[r[first]]]
    t[r[closer]], distance[r[closer]] = s[closer], gap[closer]
    return t, distance


def _chord_distance(table: Table, q: Float) -> Float:
    """Distances (n, m - 1) of points q (n, 2) to the chords of a table."""
    p, d = table.points[:-1], np.diff(table.points, axis=0)
    x, y = q[:, :1] - p[:, 0], q[:, 1:] - p[:, 1]
    square = (d * d).sum(axis=1)
    along = (x * d[:, 0] + y * d[:, 1]) / np.where(square > 0.0, square, 1.0)
    along = np.clip(along, 0.0, 1.0)
    return np.hypot(x - along * d[:, 0], y - along * d[:, 1])


def _refine(curve: Curve, q: Float, low: Float, high: Float) -> Float:
    """Where (c(t) - q) . c'(t) changes sign between low and high: Newton, bisection where it strays."""
    low, high, t = low.copy(), high.copy(), (low + high) / 2.0
    before = high - low
    left = np.arange(len(t))
    for _ in range(_STEPS):
        if len(left) == 0:
            break
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
        near = np.abs(step) <= _CLOSE
        t[left] = np.where(stray & ~near, (low[left] + high[left]) / 2.0, new)
        before[left] = np.abs(t[left] - now)
        left = left[~near & (high[left] - low[left] > _CLOSE)]
    return t
