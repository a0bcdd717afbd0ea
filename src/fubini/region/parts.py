"""The boundary cut into parts that are monotone in x and in y, and pairs of parts that come close."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.curves import Curve, Line
from fubini.region.loop import Loop

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

#: Pairs looked at in one go.
_CHUNK = 2_000_000


@dataclass(frozen=True)
class Parts:
    """Monotone parts of all curves of some loops, in order; every field has one row a part.

    ``curve`` numbers the curves through all loops; ``index`` is its number within loop ``loop``.
    The part runs from parameter ``t0`` to ``t1`` and from point ``p0`` to ``p1``. ``following`` is
    the part that begins where this one ends. ``start`` is the distance along the loop at which the
    part begins (lengths of fine polygons), ``total`` the length of the loop.
    """

    curves: tuple[Curve, ...]
    loop: Int
    curve: Int
    index: Int
    t0: Float
    t1: Float
    p0: Float
    p1: Float
    straight: Bool
    following: Int
    start: Float
    total: Float

    @property
    def low(self) -> Float:
        """Lowest corners (k, 2) of the boxes."""
        return np.minimum(self.p0, self.p1)

    @property
    def high(self) -> Float:
        """Highest corners (k, 2) of the boxes."""
        return np.maximum(self.p0, self.p1)

    def __len__(self) -> int:
        return len(self.curve)


def monotone_parameters(curve: Curve) -> Float:
    """Parameters from 0 to 1 between which the curve turns back neither in x nor in y."""
    if isinstance(curve, Line):
        return np.array([0.0, 1.0])
    turns = [np.asarray(curve.turning_points(axis), float).ravel() for axis in (0, 1)]
    return np.unique(np.concatenate([[0.0, 1.0], *turns]))


def cut(loops: Sequence[Loop]) -> Parts:
    """Monotone parts of all loops."""
    rows: list[tuple[int, int, int, float, float, Float, Float, bool, float]] = []
    following: list[int] = []
    curves: list[Curve] = []
    for k, loop in enumerate(loops):
        first = len(rows)
        for i, curve in enumerate(loop.curves):
            t = monotone_parameters(curve)
            p = np.asarray(curve.point(t), float)
            for j in range(len(t) - 1):
                length = _length(curve, t[j], t[j + 1], p[j], p[j + 1])
                straight = isinstance(curve, Line)
                rows.append((k, len(curves), i, t[j], t[j + 1], p[j], p[j + 1], straight, length))
            curves.append(curve)
        following += [*range(first + 1, len(rows)), first]
    owner, number, index, t0, t1, p0, p1, flat, lengths = (np.array(c) for c in zip(*rows, strict=True))
    begin, total = np.empty(len(rows)), np.empty(len(rows))
    for k in range(len(loops)):
        mine = owner == k
        begin[mine] = np.cumsum(lengths[mine]) - lengths[mine]
        total[mine] = lengths[mine].sum()
    return Parts(tuple(curves), owner, number, index, t0, t1, p0, p1, flat, np.array(following), begin, total)


def close_pairs(parts: Parts, tolerance: float) -> Iterator[tuple[Int, Int]]:
    """Blocks of pairs (a, b), a < b, of parts whose boxes come within ``tolerance``; by sorted sweep."""
    low, high = parts.low - tolerance, parts.high
    order = np.argsort(low[:, 0], kind="stable")
    low, high = low[order], high[order]
    stop = np.searchsorted(low[:, 0], high[:, 0], side="right")
    for i, j in ranges(np.arange(1, len(order) + 1), stop):
        keep = (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
        a, b = order[i[keep]], order[j[keep]]
        yield np.minimum(a, b), np.maximum(a, b)


def ranges(first: Int, stop: Int) -> Iterator[tuple[Int, Int]]:
    """All (i, k) with first[i] <= k < stop[i], in blocks: arrays i and k of equal length."""
    count = np.maximum(stop - first, 0)
    total = np.cumsum(count)
    start = 0
    while start < len(count):
        done = total[start - 1] if start else 0
        end = max(int(np.searchsorted(total, done + _CHUNK, side="right")), start + 1)
        n = count[start:end]
        i = np.repeat(np.arange(start, end), n)
        offset = np.arange(len(i)) - np.repeat(np.cumsum(n) - n, n)
        yield i, first[i] + offset
        start = end


def _length(curve: Curve, t0: float, t1: float, p0: Float, p1: Float) -> float:
    if isinstance(curve, Line):
        return float(np.hypot(*(p1 - p0)))
    p = np.asarray(curve.point(np.linspace(t0, t1, 17)), float)
    return float(np.hypot(*np.diff(p, axis=0).T).sum())
