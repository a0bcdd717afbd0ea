"""Curves of a drawing (DXF, SVG) in its plane, a point being one complex number x + i y.

Only what turning a drawing into faces needs: ends, sample points, affine maps. Every curve keeps its
kind through any affine map: a line a line, an ellipse an ellipse, a spline a spline. No CAD kernel here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Complex = NDArray[np.complex128]

#: Semi-axes that differ less than this (relative) are one radius.
ROUND = 1e-10


@dataclass(frozen=True)
class Affine:
    """The map z -> a z + b conj(z) + c; a similarity when b = 0."""

    a: complex = 1.0
    b: complex = 0.0
    c: complex = 0.0

    def __call__(self, z: ArrayLike) -> Complex:
        """Image of the points z (any shape)."""
        z = np.asarray(z, np.complex128)
        image: Complex = self.a * z + self.b * z.conj() + self.c
        return image

    def direction(self, v: complex) -> complex:
        """Image of a vector."""
        return self.a * v + self.b * v.conjugate()


@dataclass(frozen=True)
class Line:
    """A straight segment."""

    start: complex
    end: complex
    kind = "line"

    def affine(self, f: Affine) -> Line:
        """Image under f."""
        return Line(complex(f(self.start)), complex(f(self.end)))

    def points(self, fineness: int = 1) -> Complex:
        """Sample points along the curve, both ends included."""
        return np.linspace(self.start, self.end, 2 * fineness + 1).astype(np.complex128)


@dataclass(frozen=True)
class Ellipse:
    """An arc of the ellipse z(t) = centre + axis (cos t + i ratio sin t), t from first to first + sweep.

    ``abs(ratio)`` <= 1 and 0 < ``sweep`` <= 2 pi; a negative ratio runs clockwise. Build it with ``ellipse``.
    """

    centre: complex
    axis: complex
    ratio: float
    first: float
    sweep: float

    @property
    def kind(self) -> str:
        """ "circle" when both semi-axes agree, else "ellipse"."""
        return "circle" if abs(abs(self.ratio) - 1) < ROUND else "ellipse"

    def at(self, t: ArrayLike) -> Complex:
        """Points at the angles t."""
        t = np.asarray(t, float)
        return np.asarray(self.centre + self.axis * (np.cos(t) + 1j * self.ratio * np.sin(t)))

    @property
    def closed(self) -> bool:
        """Whether the arc is the whole ellipse."""
        return self.sweep > 2 * math.pi - 1e-12

    @property
    def start(self) -> complex:
        """First point."""
        return complex(self.at(self.first))

    @property
    def end(self) -> complex:
        """Last point; the first one bit for bit when closed."""
        return self.start if self.closed else complex(self.at(self.first + self.sweep))

    def affine(self, f: Affine) -> Ellipse:
        """Image under f, with its own principal axes."""
        p, q = f.direction(self.axis), f.direction(1j * self.ratio * self.axis)
        return ellipse(complex(f(self.centre)), p, q, self.first, self.sweep)

    def points(self, fineness: int = 1) -> Complex:
        """Sample points every five degrees or closer, both ends included."""
        n = 2 * fineness * max(1, math.ceil(self.sweep / math.radians(10)))
        return self.at(self.first + self.sweep * np.linspace(0, 1, n + 1))


def ellipse(centre: complex, p: complex, q: complex, first: float, sweep: float) -> Ellipse:
    """The arc centre + p cos t + q sin t for t from first to first + sweep (either sign).

    p and q are any pair of conjugate semi-diameters; the result stands on the principal axes.
    """
    if sweep < 0:
        q, first, sweep = -q, -first, -sweep
    dot = (p * q.conjugate()).real
    # a circle has no principal axes: leave the given ones alone
    turn = 0.5 * math.atan2(2 * dot, abs(p) ** 2 - abs(q) ** 2)
    if abs(abs(p) - abs(q)) < ROUND * abs(p) and abs(dot) < ROUND * abs(p) ** 2:
        turn = 0.0
    p, q = p * math.cos(turn) + q * math.sin(turn), q * math.cos(turn) - p * math.sin(turn)
    first -= turn
    if abs(q) > abs(p) * (1 + ROUND):
        p, q, first = q, -p, first - math.pi / 2
    side = math.copysign(1.0, (p.conjugate() * q).imag)
    return Ellipse(centre, p, side * min(1.0, abs(q) / abs(p)), first, min(sweep, 2 * math.pi))


@dataclass(frozen=True)
class Spline:
    """A clamped, non-periodic B-spline; one span without inner knots is a Bezier curve.

    Attributes
    ----------
    knots : (n + degree + 1,), the first and last degree + 1 of them equal.
    poles : (n,) complex.
    weights : (n,) positive, or None when not rational.
    """

    degree: int
    knots: NDArray[np.float64]
    poles: Complex
    weights: NDArray[np.float64] | None = None

    @property
    def kind(self) -> str:
        """ "bezier" for a single span, else "bspline"."""
        return "bezier" if len(self.poles) == self.degree + 1 else "bspline"

    @property
    def start(self) -> complex:
        """First pole."""
        return complex(self.poles[0])

    @property
    def end(self) -> complex:
        """Last pole."""
        return complex(self.poles[-1])

    def affine(self, f: Affine) -> Spline:
        """Image under f (weights stay)."""
        return Spline(self.degree, self.knots, f(self.poles), self.weights)

    def at(self, t: ArrayLike) -> Complex:
        """Points at the parameters t."""
        from scipy.interpolate import BSpline

        if self.weights is None:
            return np.asarray(BSpline(self.knots, self.poles, self.degree)(t))
        top = BSpline(self.knots, self.poles * self.weights, self.degree)(t)
        return np.asarray(top / BSpline(self.knots, self.weights, self.degree)(t))

    def points(self, fineness: int = 1) -> Complex:
        """Sample points, 16 a span, both ends included."""
        breaks = np.unique(self.knots)
        share = np.arange(16 * fineness) / (16 * fineness)
        t = (breaks[:-1, None] + np.diff(breaks)[:, None] * share).ravel()
        return np.concatenate([self.at(t), [self.poles[-1]]])


Curve = Line | Ellipse | Spline


def bezier(*poles: complex) -> Spline:
    """The Bezier curve of the given poles."""
    k = len(poles) - 1
    return Spline(k, np.repeat([0.0, 1.0], k + 1), np.array(poles, complex))


def bspline(degree: int, knots: ArrayLike, poles: ArrayLike, weights: ArrayLike | None = None) -> Spline:
    """A B-spline of any knot vector; one whose ends are not clamped is clamped by inserting knots (exact).

    Raises ValueError when the counts do not fit together.
    """
    t, z = np.asarray(knots, float), np.asarray(poles, complex)
    w = None if weights is None or len(np.asarray(weights)) == 0 else np.asarray(weights, float)
    if len(t) != len(z) + degree + 1 or (w is not None and len(w) != len(z)) or np.any(np.diff(t) < 0):
        raise ValueError(f"{len(t)} knots, {len(z)} poles and degree {degree} make no spline")
    if w is not None and (np.any(w <= 0) or not np.all(np.isfinite(w))):
        raise ValueError("a weight is not positive")
    if w is not None and np.ptp(w) <= 1e-14 * w.max():
        w = None
    first, last = t[degree], t[len(z)]
    if t[0] == first and t[-1] == last:
        return Spline(degree, t, z, w)
    t, z, w = _clamped(degree, t, z, w, float(first), float(last))
    return Spline(degree, t, z, w)


def periodic_bspline(degree: int, knots: ArrayLike, poles: ArrayLike, weights: ArrayLike | None = None) -> Spline:
    """A closed B-spline of n poles given once and the n + 1 knots of one period, cut open at the first."""
    t, z = np.asarray(knots, float), np.asarray(poles, complex)
    n, period = len(z), t[-1] - t[0]
    if len(t) != n + 1 or degree > n or not period > 0:
        raise ValueError(f"{len(t)} knots, {n} poles and degree {degree} make no closed spline")
    unrolled = np.concatenate([t[n - degree : n] - period, t, t[1 : degree + 1] + period])
    w = None if weights is None or not len(np.asarray(weights)) else np.asarray(weights, float)
    return bspline(degree, unrolled, np.append(z, z[:degree]), None if w is None else np.append(w, w[:degree]))


def _clamped(
    degree: int, t: NDArray[np.float64], z: Complex, w: NDArray[np.float64] | None, first: float, last: float
) -> tuple[NDArray[np.float64], Complex, NDArray[np.float64] | None]:
    """Knots, poles and weights over [first, last] with full multiplicity at both ends."""
    from scipy.interpolate import BSpline

    weight = np.ones(len(z)) if w is None else w
    homogeneous = BSpline(t, np.stack([z.real * weight, z.imag * weight, weight], axis=1), degree)
    for knot in (first, last):
        missing = degree - int(np.count_nonzero(homogeneous.t == knot))
        if missing > 0:
            homogeneous = homogeneous.insert_knot(knot, missing)
    t, h = homogeneous.t, homogeneous.c
    # before `degree` equal knots stands the pole that the curve passes through
    begin = int(np.searchsorted(t, first, "right")) - degree - 1
    end = int(np.searchsorted(t, last, "left")) - 1
    h = h[begin : end + 1]
    middle = t[(t > first) & (t < last)]
    knots = np.concatenate([np.full(degree + 1, first), middle, np.full(degree + 1, last)])
    return knots, (h[:, 0] + 1j * h[:, 1]) / h[:, 2], None if w is None else h[:, 2]


def bulge_arc(start: complex, end: complex, bulge: float) -> Curve:
    """The arc from start to end whose included angle is 4 atan(bulge), counter-clockwise when positive."""
    if bulge == 0:
        return Line(start, end)
    angle = 4 * math.atan(bulge)
    centre = (start + end) / 2 + 1j * (end - start) / 2 * (1 - bulge**2) / (2 * bulge)
    return ellipse(centre, start - centre, 1j * (start - centre), 0.0, angle)


def length_scale(curves: list[Curve]) -> float:
    """Diagonal of the bounding box of all sample points."""
    z = np.concatenate([c.points() for c in curves])
    return math.hypot(float(np.ptp(z.real)), float(np.ptp(z.imag)))


def matching(curve: Curve, start: complex, end: complex) -> Curve:
    """The curve brought to other ends by the one similarity (turn, scale, shift) that takes its ends there.

    Equal ends close the curve, whose own ends are then taken to be all but equal.
    """
    if (curve.start, curve.end) == (start, end):
        return curve
    if isinstance(curve, Line):
        return Line(start, end)
    if start == end:
        return _closed(curve, start)
    a = (end - start) / (curve.end - curve.start)
    moved = curve.affine(Affine(a, 0, start - a * curve.start))
    return _with_ends(moved, start, end) if isinstance(moved, Spline) else moved


def _with_ends(curve: Spline, start: complex, end: complex) -> Spline:
    poles = curve.poles.copy()
    poles[0], poles[-1] = start, end
    return Spline(curve.degree, curve.knots, poles, curve.weights)


def _closed(curve: Ellipse | Spline, at: complex) -> Ellipse | Spline:
    """The curve closed at the given point, which lies within the gap tolerance of both of its ends."""
    if isinstance(curve, Spline):
        return _with_ends(curve, at, at)
    whole = Ellipse(curve.centre, curve.axis, curve.ratio, curve.first, 2 * math.pi)
    return whole.affine(Affine(1, 0, at - whole.start))
