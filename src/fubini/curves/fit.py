"""Chains of cubic Bezier curves through measured or sampled points."""

from __future__ import annotations

import bisect
import heapq
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves import bernstein
from fubini.curves.base import Float, frozen
from fubini.curves.spline import Bezier
from fubini.errors import GeometryError, OptionError

#: Rounds for one cubic: the first fit points, the others mind the distance across the curve.
_ROUNDS, _FIRST_ROUNDS = 16, 3
#: How much a distance along the curve counts in those, where the parameter will follow anyway.
_ALONG = 1e-3
#: A tangent is taken from a polynomial through at least so many neighbours on each side, of this degree.
_NEIGHBOURS, _TANGENT_DEGREE = 3, 5


@dataclass(frozen=True, eq=False)
class BezierFit:
    """Outcome of ``fit_bezier``.

    Attributes
    ----------
    curves : cubics that meet bit for bit in data points, smooth (G1) but at corners.
    error : largest distance of a data point to the curves; above the tolerance only when the pieces ran out.
    corners : indices of the data points kept as corners, the ends of an open chain included.
    """

    curves: tuple[Bezier, ...]
    error: float
    corners: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class _Piece:
    """A cubic fitted to the data points first..last, its largest error and where that is."""

    first: int
    last: int
    poles: Float
    error: float
    worst: int


def fit_bezier(
    points: ArrayLike,
    tolerance: float,
    corners: Sequence[int] | None = None,
    corner_angle: float = 30.0,
    max_pieces: int = 10_000,
) -> BezierFit:
    """Cubic Bezier curves within ``tolerance`` (model units) of ``points`` (n, 2), in order.

    Each stretch between corners is fitted by least squares over chord-length parameters improved by
    Gauss-Newton; the piece with the largest error is split at its worst point, where both parts share
    the tangent of the data, until all are good or there are ``max_pieces``. Points that repeat the first
    at the end make a closed chain, smooth at the joint unless that is a corner.

    Parameters
    ----------
    corners : indices of corner points; None finds those where the polyline turns by more than
        ``corner_angle`` degrees.

    Raises
    ------
    GeometryError : fewer than two different points, or a coordinate that is not finite.
    OptionError : a tolerance or angle that is not positive, a corner that is no index.
    """
    data = frozen(points, (None, 2), "points")
    _check(tolerance, corner_angle, max_pieces, corners, len(data))
    kept = np.concatenate([[True], (data[1:] != data[:-1]).any(axis=1)]) if len(data) else np.zeros(0, bool)
    index = np.nonzero(kept)[0]
    q = data[index]
    if len(q) < 2:
        raise GeometryError("a fit needs two different points")
    closed = len(q) > 3 and bool((q[0] == q[-1]).all())
    if corners is None:
        corner = _find_corners(q, closed, math.radians(corner_angle))
    else:
        corner = np.isin(np.cumsum(kept) - 1, np.cumsum(kept)[list(corners)] - 1)[index]
    if closed:
        corner[0] = corner[-1] = corner[0] or corner[-1]
    pieces = _Fitting(q, corner, closed).run(tolerance, max_pieces)
    curves = tuple(Bezier(p.poles, start=q[p.first], end=q[p.last]) for p in pieces)
    parts = [c.closest(q[p.first : p.last + 1])[1].max() for c, p in zip(curves, pieces)]
    ends = set() if closed else {0, len(q) - 1}
    named = sorted(ends | set(np.nonzero(corner)[0].tolist()))
    return BezierFit(curves, float(max(parts)), tuple(int(index[i]) for i in named))


def _check(tolerance: float, angle: float, pieces: int, corners: Sequence[int] | None, n: int) -> None:
    if not (tolerance > 0.0 and math.isfinite(tolerance)):
        raise OptionError(f"tolerance {tolerance!r} of a fit is not a positive number")
    if not 0.0 < angle <= 180.0:
        raise OptionError(f"corner_angle {angle!r} does not lie between 0 and 180 degrees")
    if pieces < 1:
        raise OptionError(f"max_pieces {pieces!r} is below 1")
    for i in corners or ():
        if not 0 <= i < n:
            raise OptionError(f"corner {i!r} is no index into {n} points")


def _find_corners(q: Float, closed: bool, angle: float) -> NDArray[np.bool_]:
    d = np.diff(q, axis=0)
    if closed:
        d = np.concatenate([d[-1:], d, d[:1]])
    turn = np.abs(np.arctan2(d[:-1, 0] * d[1:, 1] - d[:-1, 1] * d[1:, 0], (d[:-1] * d[1:]).sum(axis=1)))
    return turn > angle if closed else np.concatenate([[False], turn > angle, [False]])


class _Fitting:
    """Worst-first splitting: the pieces so far, and one tangent for each smooth joint."""

    def __init__(self, q: Float, corner: NDArray[np.bool_], closed: bool) -> None:
        self.q, self.closed = q, closed
        self.last = len(q) - 1
        self.smooth = ~corner
        if not closed:
            self.smooth[[0, -1]] = False
        self.joints = sorted({0, self.last, *np.nonzero(corner)[0].tolist()})
        self.tangents: dict[int, Float] = {}
        self.pieces: dict[int, _Piece] = {}  # by their first point
        self.heap: list[tuple[float, int, int]] = []  # -error, first, last; outdated entries are passed over
        self._refit(range(len(self.joints)))

    def run(self, tolerance: float, budget: int) -> list[_Piece]:
        """Split until every error is within the tolerance or the budget of pieces is spent."""
        while len(self.pieces) < budget:
            piece = self._worst()
            if piece.error <= tolerance or piece.last - piece.first < 2:
                break
            k = bisect.bisect(self.joints, piece.worst)
            self.joints.insert(k, piece.worst)
            self._refit(range(k - 1, k + 2))
        return [self.pieces[j] for j in self.joints[:-1]]

    def _worst(self) -> _Piece:
        while True:  # every piece has its entry
            error, first, last = self.heap[0]
            piece = self.pieces.get(first)
            if piece is not None and piece.last == last and piece.error == -error:
                return piece
            heapq.heappop(self.heap)

    def _refit(self, numbers: Iterable[int]) -> None:
        """New tangents at these joints, new pieces on both sides of each."""
        changed = set(numbers)
        if self.closed and changed & {0, len(self.joints) - 1}:
            changed |= {0, len(self.joints) - 1}
        for k in sorted(changed):
            if self.smooth[self.joints[k]]:
                self.tangents[self.joints[k]] = self._tangent_at(k)
        touched = {i for k in changed for i in (k - 1, k) if 0 <= i < len(self.joints) - 1}
        for k in sorted(touched):
            a, b = self.joints[k], self.joints[k + 1]
            piece = _fit_one(self.q, a, b, self.tangents.get(a), self.tangents.get(b))
            self.pieces[a] = piece
            heapq.heappush(self.heap, (-piece.error, a, b))

    def _tangent_at(self, k: int) -> Float:
        """Tangent of the data about a joint, from half of either neighbour but not across a corner."""
        j, joints = self.joints[k], self.joints
        if j in (0, self.last):  # the smooth joint of a closed chain
            reach = max(_NEIGHBOURS, min(joints[1], self.last - joints[-2]) // 2)
            before = self.q[max(self.last - reach, 0) : -1]
            return _tangent(np.concatenate([before, self.q[: reach + 1]]), len(before))
        reach = max(_NEIGHBOURS, min(joints[k + 1] - j, j - joints[k - 1]) // 2)
        low = max((i for i in joints[:k] if not self.smooth[i]), default=0)
        high = min((i for i in joints[k + 1 :] if not self.smooth[i]), default=self.last)
        a, b = max(low, j - reach), min(high, j + reach)
        return _tangent(self.q[a : b + 1], j - a)


def _chords(q: Float) -> Float:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(q, axis=0).T))])


def _tangent(q: Float, at: int) -> Float:
    """Unit tangent at q[at] of the polynomial fitted to q over its chord lengths."""
    s = _chords(q)
    powers = ((s - s[at]) / s[-1])[:, None] ** np.arange(1, min(_TANGENT_DEGREE, len(q) - 1) + 1)
    d = np.linalg.lstsq(powers, q - q[at], rcond=None)[0][0]
    if math.hypot(*d) <= 1e-6 * s[-1]:  # the data turn back on themselves: any direction of theirs will do
        d = q[min(at + 1, len(q) - 1)] - q[at] if at + 1 < len(q) else q[at] - q[at - 1]
    return d / math.hypot(*d)


def _fit_one(q: Float, first: int, last: int, start: Float | None, end: Float | None) -> _Piece:
    """Least-squares cubic over q[first..last]; tangent directions fixed where given."""
    p = q[first : last + 1]
    t = _chords(p)
    t /= t[-1]
    best = (math.inf, np.empty((0, 2)), 0)
    across = None
    for k in range(_ROUNDS):
        poles = _solve(p, t, start, end, across)
        value, d, dd = bernstein.jet(np.broadcast_to(poles, (len(t), 4, 2)), t, 2)
        gap = value - p
        distance = np.hypot(gap[:, 0], gap[:, 1])
        worst = int(distance.argmax())
        if distance[worst] < best[0]:
            best = (float(distance[worst]), poles, worst)
        elif k > _FIRST_ROUNDS + 2 and distance[worst] > 0.9 * best[0]:
            break
        slope = (d * d).sum(axis=1) + np.maximum((gap * dd).sum(axis=1), 0.0)
        step = (gap * d).sum(axis=1) / np.where(slope > 0.0, slope, 1.0)
        t = np.maximum.accumulate(np.clip(t - step, 0.0, 1.0))
        t[0], t[-1] = 0.0, 1.0
        if k >= _FIRST_ROUNDS:
            size = np.hypot(d[:, 0], d[:, 1])[:, None]
            across = np.stack([-d[:, 1], d[:, 0]], axis=1) / np.where(size > 0.0, size, 1.0)
    error, poles, worst = best
    return _Piece(first, last, poles, error, first + min(max(worst, 1), len(p) - 2))


def _solve(p: Float, t: Float, start: Float | None, end: Float | None, across: Float | None) -> Float:
    """Poles (4, 2) of the cubic from p[0] to p[-1] nearest to p (n, 2) at t (n,).

    With unit normals ``across`` (n, 2), distances along the curve count ``_ALONG`` times: a Gauss-Newton step
    for poles and parameters together.
    """
    b = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3], axis=1)
    reach = np.hypot(*(p[-1] - p[0])) or _chords(p)[-1]
    # unknowns: the length along a fixed tangent, else how far the inner pole lies from its third of the chord
    poles = np.array([p[0], p[0], p[-1], p[-1]])
    inner: list[tuple[int, Float]] = []
    for column, tangent in ((1, start), (2, None if end is None else -end)):
        if tangent is None:
            poles[column] = p[0] + column * (p[-1] - p[0]) / 3.0
            inner += [(column, np.array([1.0, 0.0])), (column, np.array([0.0, 1.0]))]
        else:
            inner.append((column, tangent))
    columns = [b[:, c : c + 1] * d for c, d in inner] + [p - b @ poles]
    if across is not None:
        normal = [(v * across).sum(axis=1)[:, None] * across for v in columns]
        columns = [n + _ALONG * (v - n) for n, v in zip(normal, columns)]
    matrix = np.stack([v.ravel() for v in columns], axis=1)
    x = np.linalg.lstsq(matrix[:, :-1], matrix[:, -1], rcond=1e-12)[0]
    if start is not None:
        x[0] = x[0] if x[0] > 1e-3 * reach else reach / 3.0
    if end is not None:
        x[-1] = x[-1] if x[-1] > 1e-3 * reach else reach / 3.0
    for (column, direction), length in zip(inner, x):
        poles[column] += length * direction
    return poles
