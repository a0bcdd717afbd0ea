"""Bezier and B-spline curves, polynomial or rational."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves import moments
from fubini.curves.base import NOISE, Curve, Float, affine, frozen, other
from fubini.curves.chain import Chain, bezier_pieces, make_chain
from fubini.curves.kinks import Stretch, find_stretches
from fubini.curves.nearest import nearest
from fubini.curves.quadrature import arc_length
from fubini.errors import GeometryError, OptionError
from fubini.quadrature import adaptive, fixed

#: Newton and bisection steps of the limit functions; bisection alone needs 53.
_STEPS = 80

#: Parameters this far (relative) outside the domain of a B-spline are taken to be its end.
_KNOT = 1e-9


class Spline(Curve):
    """What Bezier and B-spline curves share: a chain of rational Bezier pieces."""

    poles: Float
    weights: Float | None

    @property
    def chain(self) -> Chain:
        """The curve as Bezier pieces over [0, 1]."""
        raise NotImplementedError

    def _point(self, t: Float) -> Float:
        return self.chain.evaluate(np.asarray(t), 0)[0]

    def _derivative(self, t: Float) -> Float:
        return self.chain.evaluate(np.asarray(t), 1)[1]

    def _second_derivative(self, t: Float) -> Float:
        return self.chain.evaluate(np.asarray(t), 2)[2]

    def length(self, t0: float = 0.0, t1: float = 1.0) -> float:
        return arc_length(self._derivative, self.chain.breaks, t0, t1)

    def closest(self, points: ArrayLike) -> tuple[Float, Float]:
        return nearest(self, self.chain.table, points)

    @cached_property
    def _turns(self) -> tuple[Float, Float]:
        return _turning_points(self, 0), _turning_points(self, 1)

    def turning_points(self, axis: int) -> Float:
        other(axis)
        return self._turns[axis].copy()

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        return find_stretches(self.chain, np.concatenate(self._turns))

    def _invert(self, axis: int, values: Float, t0: float | Float, t1: float | Float) -> Float:
        low, high = np.broadcast_to(t0, values.shape), np.broadcast_to(t1, values.shape)
        a, b = self._point(low)[:, axis], self._point(high)[:, axis]
        sign = np.where(b >= a, 1.0, -1.0)
        if np.ndim(t0) == 0 and len(values):  # one stretch: the table narrows it
            t, p = self.chain.table.t, self.chain.table.points
            inside = (t > t0) & (t < t1)
            t = np.concatenate([low[:1], t[inside], high[:1]])
            levels = np.concatenate([a[:1], p[inside, axis], b[:1]])
            levels = np.maximum.accumulate(sign[0] * levels)
            i = np.clip(np.searchsorted(levels, sign[0] * values, side="right") - 1, 0, len(t) - 2)
            low, high, a, b = t[i], t[i + 1], sign * levels[i], sign * levels[i + 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.clip((values - a) / (b - a), 0.0, 1.0)
        guess = low + np.where(np.isfinite(part), part, 0.5) * (high - low)
        return self._root(axis, values, sign, low, high, guess)

    def _root(self, axis: int, values: Float, sign: Float, low: Float, high: Float, guess: Float) -> Float:
        """Where the coordinate, rising by ``sign``, takes ``values``: Newton, bisection where it strays.

        A parameter is taken as soon as its coordinate is right to rounding.
        """
        t, before = guess.copy(), high - low
        low, high = low.copy(), high.copy()
        enough = self.chain.noise(axis) / 8.0
        left = np.arange(len(values))
        for _ in range(_STEPS):
            p, d = self.chain.evaluate(t[left], 1)
            gap, slope = sign[left] * (p[:, axis] - values[left]), sign[left] * d[:, axis]
            go = np.abs(gap) > enough
            left, gap, slope = left[go], gap[go], slope[go]
            if len(left) == 0:
                break
            now = t[left]
            low[left] = np.where(gap < 0.0, now, low[left])
            high[left] = np.where(gap > 0.0, now, high[left])
            with np.errstate(divide="ignore", invalid="ignore"):
                new = now - gap / slope
            stray = ~((new > low[left]) & (new < high[left]) & (np.abs(new - now) <= before[left] / 2.0))
            t[left] = np.where(stray, (low[left] + high[left]) / 2.0, new)
            before[left] = np.abs(t[left] - now)
            left = left[(t[left] > low[left]) & (t[left] < high[left])]
        return t

    def area_moments(self, origin: ArrayLike = (0.0, 0.0)) -> moments.Moments:
        o = np.asarray(origin, np.float64)

        def integrand(t: Float) -> Float:
            p, d = self.chain.evaluate(t, 1)
            return moments.integrand(p - o, d)

        if self.chain.rational:
            inner = adaptive(integrand, self.chain.breaks, 1e-14)
        else:  # second moments have degree 4 d - 1
            inner = fixed(integrand, self.chain.breaks, 2 * self.chain.degree).sum(axis=0)
        ends = self._point(np.array([0.0, 1.0])) - o
        return moments.add(
            tuple(inner.tolist()),
            moments.segment_moments(self.start - o, ends[0]),
            moments.segment_moments(ends[1], self.end - o),
        )

    def _ends(self, start: ArrayLike | None, end: ArrayLike | None) -> None:
        """Store the ends; the first and last control points where the curve reaches them."""
        computed = self.chain.evaluate(np.array([0.0, 1.0]), 0)[0]
        for name, given, p, pole in (
            ("start", start, computed[0], self.poles[0]),
            ("end", end, computed[1], self.poles[-1]),
        ):
            if given is None:
                reached = np.abs(p - pole).max() <= NOISE * np.abs(self.poles).max()
                given = pole if reached else p
            self._store(**{name: frozen(given, (2,), name)})


def _turning_points(curve: Spline, axis: int) -> Float:
    chain = curve.chain
    t = chain.extremes(axis)
    x = curve.point(t)[:, axis]
    flat = np.concatenate([[False], chain.flats(axis), [False]])
    # stretches of constant coordinate part the curve; between them, turns whose swing exceeds the noise
    edges = chain.breaks[np.nonzero(flat[1:] != flat[:-1])[0]]
    found = [float(e) for e in edges if 0.0 < e < 1.0]
    cuts = [0.0, *found, 1.0]
    for a, b in itertools.pairwise(cuts):
        inside = np.nonzero((t >= a) & (t <= b))[0]
        found += [float(t[inside[i]]) for i in _swings(x[inside], chain.noise(axis))]
    return np.array(sorted(found), np.float64)


def _swings(x: NDArray[np.float64], noise: float) -> list[int]:
    """Indices of the extremes from which x retreats by more than ``noise`` in both directions."""
    found: list[int] = []
    extreme, direction = 0, 0.0
    for i in range(1, len(x)):
        step = x[i] - x[extreme]
        if direction == 0.0:
            if abs(step) > noise:
                direction, extreme = math.copysign(1.0, step), i
        elif step * direction >= 0.0:
            extreme = i
        elif -step * direction > noise:
            found.append(extreme)
            direction, extreme = -direction, i
    return found


def _weights(weights: ArrayLike | None, n: int) -> Float | None:
    """Checked weights (n,); None when there are none or they are all equal."""
    if weights is None:
        return None
    w = frozen(weights, (n,), "weights")
    if not (w > 0.0).all():
        raise GeometryError("a spline has a weight that is not positive")
    return None if (w == w[0]).all() else w


def _homogeneous(poles: Float, weights: Float | None) -> Float:
    w = np.ones(len(poles)) if weights is None else weights
    return np.concatenate([poles * w[:, None], w[:, None]], axis=1)


def _plain(chain: Chain) -> tuple[Float, Float | None]:
    """Control points and weights of a chain as one B-spline whose inner knots have full multiplicity."""
    h = np.concatenate([chain.poles[:, :-1].reshape(-1, 3), chain.poles[-1, -1:]])
    w = h[:, 2]
    return h[:, :2] / w[:, None] + chain.origin, w if chain.rational else None


@dataclass(frozen=True, init=False, eq=False)
class Bezier(Spline):
    """Bezier curve with control points ``poles`` (n, 2), n >= 2, and positive ``weights`` (n,) or None."""

    poles: Float
    weights: Float | None
    start: Float
    end: Float
    kind = "bezier"

    def __init__(
        self,
        poles: ArrayLike,
        weights: ArrayLike | None = None,
        *,
        start: ArrayLike | None = None,
        end: ArrayLike | None = None,
    ) -> None:
        p = frozen(poles, (None, 2), "poles")
        if len(p) < 2 or (p == p[0]).all():
            raise GeometryError("a Bezier curve needs two different control points")
        self._store(poles=p, weights=_weights(weights, len(p)))
        self._ends(p[0] if start is None else start, p[-1] if end is None else end)

    @cached_property
    def chain(self) -> Chain:
        """The curve as one Bezier piece."""
        return make_chain(np.array([0.0, 1.0]), _homogeneous(self.poles, self.weights)[None])

    @property
    def degree(self) -> int:
        """Degree of the curve."""
        return len(self.poles) - 1

    def trim(self, t0: float, t1: float) -> Bezier:
        self._check_trim(t0, t1)
        poles, w = _plain(self.chain.trim(t0, t1))
        return Bezier(poles, w, start=self.point(t0), end=self.point(t1))

    def reverse(self) -> Bezier:
        w = None if self.weights is None else self.weights[::-1]
        return Bezier(self.poles[::-1], w, start=self.end, end=self.start)

    def transform(self, matrix: ArrayLike, offset: ArrayLike = (0.0, 0.0)) -> Bezier:
        m, o = np.asarray(matrix, np.float64), np.asarray(offset, np.float64)
        ends = {"start": affine(m, o, self.start), "end": affine(m, o, self.end)}
        return Bezier(affine(m, o, self.poles), self.weights, **ends)


@dataclass(frozen=True, init=False, eq=False)
class BSpline(Spline):
    """B-spline with the full knot vector ``knots`` (n + degree + 1,), multiplicities written out.

    ``poles`` (n, 2), positive ``weights`` (n,) or None. The curve runs over the knots' domain
    ``[knots[degree], knots[n]]``; the vector need not be clamped.
    """

    degree: int
    knots: Float
    poles: Float
    weights: Float | None
    start: Float
    end: Float
    kind = "bspline"

    def __init__(
        self,
        degree: int,
        knots: ArrayLike,
        poles: ArrayLike,
        weights: ArrayLike | None = None,
        *,
        start: ArrayLike | None = None,
        end: ArrayLike | None = None,
    ) -> None:
        p, k = frozen(poles, (None, 2), "poles"), frozen(knots, (None,), "knots")
        _check_knots(degree, k, len(p))
        if (p == p[0]).all():
            raise GeometryError("a B-spline needs two different control points")
        self._store(degree=int(degree), knots=k, poles=p, weights=_weights(weights, len(p)))
        self._ends(start, end)

    @classmethod
    def from_domain(
        cls,
        degree: int,
        knots: ArrayLike,
        poles: ArrayLike,
        weights: ArrayLike | None,
        u0: float,
        u1: float,
        *,
        start: ArrayLike | None = None,
        end: ArrayLike | None = None,
    ) -> BSpline:
        """The piece of a B-spline between the knot parameters u0 < u1 of its domain."""
        whole = cls(degree, knots, poles, weights)
        low, high = whole.domain
        slack = _KNOT * max(abs(low), abs(high), high - low)
        if not low - slack <= u0 < u1 <= high + slack:
            raise GeometryError(f"parameters {u0!r} to {u1!r} lie outside the domain {low!r} to {high!r}")
        t0, t1 = (min(max((u - low) / (high - low), 0.0), 1.0) for u in (u0, u1))
        piece = whole if (t0, t1) == (0.0, 1.0) else whole.trim(t0, t1)
        if start is None and end is None:
            return piece
        return cls(piece.degree, piece.knots, piece.poles, piece.weights, start=start, end=end)

    @property
    def domain(self) -> tuple[float, float]:
        """First and last knot parameter of the curve."""
        return float(self.knots[self.degree]), float(self.knots[len(self.poles)])

    @cached_property
    def chain(self) -> Chain:
        """The curve as Bezier pieces between its knots."""
        breaks, poles = bezier_pieces(self.degree, self.knots, _homogeneous(self.poles, self.weights))
        return make_chain(_unit(breaks), poles)

    def trim(self, t0: float, t1: float) -> BSpline:
        self._check_trim(t0, t1)
        low, high = self.domain
        piece = self.chain.trim(t0, t1)
        breaks = low + (t0 + piece.breaks * (t1 - t0)) * (high - low)
        poles, w = _plain(piece)
        times = np.full(len(breaks), self.degree)
        times[[0, -1]] += 1
        result = BSpline.__new__(BSpline)  # sound by construction, and its Bezier pieces are at hand
        result._store(
            degree=self.degree,
            knots=frozen(np.repeat(breaks, times), (None,), "knots"),
            poles=frozen(poles, (None, 2), "poles"),
            weights=None if w is None else frozen(w, (None,), "weights"),
            start=frozen(self.point(t0), (2,), "start"),
            end=frozen(self.point(t1), (2,), "end"),
            chain=piece,
        )
        return result

    def reverse(self) -> BSpline:
        w = None if self.weights is None else self.weights[::-1]
        low, high = self.domain
        knots = (low + high) - self.knots[::-1]
        return BSpline(self.degree, knots, self.poles[::-1], w, start=self.end, end=self.start)

    def transform(self, matrix: ArrayLike, offset: ArrayLike = (0.0, 0.0)) -> BSpline:
        m, o = np.asarray(matrix, np.float64), np.asarray(offset, np.float64)
        ends = {"start": affine(m, o, self.start), "end": affine(m, o, self.end)}
        return BSpline(self.degree, self.knots, affine(m, o, self.poles), self.weights, **ends)


def _unit(breaks: Float) -> Float:
    t = (breaks - breaks[0]) / (breaks[-1] - breaks[0])
    t[-1] = 1.0
    return t


def _check_knots(degree: int, knots: Float, n: int) -> None:
    fix = "the knot vector has one entry per pole plus degree + 1, multiplicities written out"
    if degree < 1 or n < degree + 1:
        raise GeometryError(f"a B-spline of degree {degree} with {n} poles", fix="it needs degree + 1")
    if len(knots) != n + degree + 1:
        raise OptionError(f"{len(knots)} knots for {n} control points of degree {degree}", fix=fix)
    if (np.diff(knots) < 0.0).any() or not knots[degree] < knots[n]:
        raise GeometryError("the knots of a B-spline do not grow", fix=fix)
    inner = knots[(knots > knots[degree]) & (knots < knots[n])]
    if (inner[degree:] == inner[:-degree]).any():
        raise GeometryError(f"an inner knot has a multiplicity above the degree {degree}", fix=fix)
