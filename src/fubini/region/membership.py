"""Point membership by winding number about exact curves, for many points at once.

A ray runs from every point in the direction of +x. Boundary pieces that rise or fall through its
ordinate on the right of the point are counted with their sign, each piece holding its lower but
not its upper end, so that a ray through a vertex counts it once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fubini.curves import Curve, Line
from fubini.region.loop import Loop
from fubini.region.parts import monotone_parameters, ranges

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]
Int = NDArray[np.int64]

#: A curve is covered by this many boxes per monotone piece in the search for points near it.
_BOXES = 16


class Membership:
    """Prepared loops: answers ``contains`` for any number of points."""

    def __init__(self, loops: Sequence[Loop]) -> None:
        curves = [c for loop in loops for c in loop.curves]
        lines = [c for c in curves if isinstance(c, Line)]
        self._curved = [c for c in curves if not isinstance(c, Line)]
        ends = np.array([[c.start, c.end] for c in lines], dtype=float).reshape(-1, 2, 2)
        self._p, self._q = ends[:, 0], ends[:, 1]

    def contains(self, points: Float, slack: float) -> Bool:
        """Which points (n, 2) are inside or within ``slack`` of the boundary."""
        order = np.argsort(points[:, 1], kind="stable")
        p = points[order]
        inside = (self._winding_of_lines(p) + self._winding_of_curves(p)) > 0
        if slack > 0.0:
            outside = np.flatnonzero(~inside)
            inside[outside] = self._near_lines(p[outside], slack) | self._near_curves(p[outside], slack)
        result = np.empty(len(points), dtype=bool)
        result[order] = inside
        return result

    @cached_property
    def _pieces(self) -> list[_Piece]:
        return [_Piece(piece) for c in self._curved for piece in c.graph_pieces(1) if not _is_level(piece)]

    @cached_property
    def _boxes(self) -> tuple[Float, Float, Int]:
        """Boxes that cover the curved pieces: low (k, 2), high (k, 2), number of the curve (k,)."""
        low, high, owner = [np.empty((0, 2))], [np.empty((0, 2))], [np.empty(0, dtype=np.int64)]
        for i, curve in enumerate(self._curved):
            ends = _monotone_points(curve)
            low.append(np.minimum(ends[:-1], ends[1:]))
            high.append(np.maximum(ends[:-1], ends[1:]))
            owner.append(np.full(len(ends) - 1, i))
        return np.concatenate(low), np.concatenate(high), np.concatenate(owner)

    def _winding_of_lines(self, p: Float) -> Int:
        """Signed crossings (n,) of the rays of points (n, 2), sorted by y, with the straight edges."""
        low = np.minimum(self._p[:, 1], self._q[:, 1])
        high = np.maximum(self._p[:, 1], self._q[:, 1])
        first = np.searchsorted(p[:, 1], low, side="left")
        stop = np.searchsorted(p[:, 1], high, side="left")
        winding = np.zeros(len(p), dtype=np.int64)
        for i, k in ranges(first, stop):
            a, d = self._p[i], self._q[i] - self._p[i]
            side = d[:, 0] * (p[k, 1] - a[:, 1]) - d[:, 1] * (p[k, 0] - a[:, 0])
            up = d[:, 1] > 0.0
            hit = np.where(up, side > 0.0, side < 0.0)
            winding += np.bincount(k[hit & up], minlength=len(p))
            winding -= np.bincount(k[hit & ~up], minlength=len(p))
        return winding

    def _winding_of_curves(self, p: Float) -> Int:
        winding = np.zeros(len(p), dtype=np.int64)
        for piece in self._pieces:
            first, stop = np.searchsorted(p[:, 1], [piece.low[1], piece.high[1]], side="left")
            x, y = p[first:stop, 0], p[first:stop, 1]
            hit = x < piece.low[0]
            near = np.flatnonzero(~hit & (x <= piece.high[0]))
            if len(near):
                hit[near] = x[near] < piece.limit(y[near])
            winding[first:stop] += piece.sign * hit
        return winding

    def _near_lines(self, p: Float, slack: float) -> Bool:
        """Which points (n, 2), sorted by y, lie within ``slack`` of a straight edge."""
        low = np.minimum(self._p, self._q) - slack
        high = np.maximum(self._p, self._q) + slack
        near = np.zeros(len(p), dtype=bool)
        for i, k in _pairs_in_boxes(p, low, high):
            a, d = self._p[i], self._q[i] - self._p[i]
            length2 = np.maximum((d * d).sum(axis=1), np.finfo(float).tiny)
            t = np.clip(((p[k] - a) * d).sum(axis=1) / length2, 0.0, 1.0)
            off = p[k] - (a + t[:, None] * d)
            near[k[np.hypot(off[:, 0], off[:, 1]) <= slack]] = True
        return near

    def _near_curves(self, p: Float, slack: float) -> Bool:
        low, high, owner = self._boxes
        near = np.zeros(len(p), dtype=bool)
        for i, k in _pairs_in_boxes(p, low - slack, high + slack):
            for c in np.unique(owner[i]):
                candidates = np.unique(k[owner[i] == c])
                _, distance = self._curved[c].closest(p[candidates])
                near[candidates[distance <= slack]] = True
        return near


class _Piece:
    """A curved boundary piece as a function x(y), with its box and the sign of its crossing."""

    def __init__(self, curve: Curve) -> None:
        box = np.asarray(curve.bounding_box(), float)
        self.low, self.high = box[0].copy(), box[1].copy()
        # The ends decide the range: bit for bit those of the neighbouring pieces.
        self.low[1] = min(curve.start[1], curve.end[1])
        self.high[1] = max(curve.start[1], curve.end[1])
        self.sign = 1 if curve.end[1] > curve.start[1] else -1
        self.limit = curve.limit(1)


def _is_level(curve: Curve) -> bool:
    return bool(curve.start[1] == curve.end[1])


def _monotone_points(curve: Curve) -> Float:
    """Points (k, 2) along a curve such that it is monotone in x and y between consecutive ones."""
    t = np.unique(np.concatenate([monotone_parameters(curve), np.linspace(0.0, 1.0, _BOXES + 1)]))
    return np.asarray(curve.point(t), float)


def _pairs_in_boxes(p: Float, low: Float, high: Float) -> Iterator[tuple[Int, Int]]:
    """Blocks of (box i, point k) for points (n, 2), sorted by y, that lie in the closed box."""
    first = np.searchsorted(p[:, 1], low[:, 1], side="left")
    stop = np.searchsorted(p[:, 1], high[:, 1], side="right")
    for i, k in ranges(first, stop):
        keep = (p[k, 0] >= low[i, 0]) & (p[k, 0] <= high[i, 0])
        yield i[keep], k[keep]
