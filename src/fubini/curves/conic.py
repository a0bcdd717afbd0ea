"""Circular and elliptical arcs: ``center + major cos u + minor sin u``, the angle u affine in t."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fubini.curves import moments
from fubini.curves.base import NOISE, Curve, Float, affine, frozen, other
from fubini.curves.nearest import Table, nearest, sample
from fubini.curves.quadrature import arc_length
from fubini.errors import GeometryError
from fubini.quadrature import fixed

_TURN = 2.0 * math.pi

#: A map this close (relative) to a similarity takes circles to circles.
_SIMILAR = 1e-13


class Conic(Curve):
    """What circular and elliptical arcs share; ``major`` and ``minor`` are conjugate half-diameters."""

    center: Float
    major: Float
    minor: Float
    angle0: float
    angle1: float

    def _place(self, start: ArrayLike | None, end: ArrayLike | None) -> None:
        """Check the angles and store the ends; a full turn without a stored end closes bit for bit."""
        sweep = self.angle1 - self.angle0
        if not math.isfinite(sweep) or sweep == 0.0 or abs(sweep) > _TURN * (1 + NOISE):
            raise GeometryError(
                f"an arc from angle {self.angle0!r} to {self.angle1!r}",
                at=self.center.tolist(),
                fix="its angles must be finite and differ by at most one turn",
            )
        full = abs(abs(sweep) - _TURN) <= _TURN * NOISE
        a = self._point(np.asarray(0.0)) if start is None else start
        b = (a if full else self._point(np.asarray(1.0))) if end is None else end
        self._store(start=frozen(a, (2,), "start"), end=frozen(b, (2,), "end"))

    def _angle(self, t: Float) -> Float:
        return self.angle0 + t * (self.angle1 - self.angle0)

    def _point(self, t: Float) -> Float:
        u = self._angle(t)[..., None]
        return self.center + np.cos(u) * self.major + np.sin(u) * self.minor

    def _derivative(self, t: Float) -> Float:
        u = self._angle(t)[..., None]
        return (self.angle1 - self.angle0) * (np.cos(u) * self.minor - np.sin(u) * self.major)

    def _second_derivative(self, t: Float) -> Float:
        u = self._angle(t)[..., None]
        return -((self.angle1 - self.angle0) ** 2) * (np.cos(u) * self.major + np.sin(u) * self.minor)

    def _cut(self, t: float) -> float:
        return self.angle1 if t == 1.0 else self.angle0 + t * (self.angle1 - self.angle0)

    def _extreme(self, axis: int) -> tuple[float, float]:
        """r and phi of ``coordinate = center + r cos(u - phi)``."""
        a, b = float(self.major[axis]), float(self.minor[axis])
        return math.hypot(a, b), math.atan2(b, a)

    def turning_points(self, axis: int) -> Float:
        other(axis)
        r, phi = self._extreme(axis)
        low, high = sorted((self.angle0, self.angle1))
        first, last = math.ceil((low - phi) / math.pi), math.floor((high - phi) / math.pi)
        sweep = self.angle1 - self.angle0
        t = np.array(sorted((phi + k * math.pi - self.angle0) / sweep for k in range(first, last + 1)))
        # a swing of r (1 - cos h) that rounding hides is no turn
        size = abs(float(self.center[axis])) + r
        hidden = NOISE * size / r if r > 0.0 else 2.0
        swing = 2.0 * np.sin(np.minimum(t, 1.0 - t) * abs(sweep) / 2.0) ** 2
        return t[(t > 0.0) & (t < 1.0) & (swing > hidden)]

    def _invert(self, axis: int, values: Float, t0: float | Float, t1: float | Float) -> Float:
        r, phi = self._extreme(axis)
        sweep = self.angle1 - self.angle0
        # the half turn between two extremes that holds the stretch: cos(u - phi) = (-1)^k cos s, 0 <= s <= pi
        k = np.floor((self.angle0 + sweep * (t0 + t1) / 2 - phi) / math.pi)
        cosine = (values - self.center[axis]) / np.where(k % 2 == 0, r, -r)
        s = np.arccos(np.clip(cosine, -1.0, 1.0))
        return np.clip((phi + k * math.pi + s - self.angle0) / sweep, t0, t1)

    def area_moments(self, origin: ArrayLike = (0.0, 0.0)) -> moments.Moments:
        o = np.asarray(origin, np.float64)
        # trigonometric polynomials of degree 4 over at most a quarter turn: 16 nodes are exact to rounding
        parts = max(1, math.ceil(abs(self.angle1 - self.angle0) / (math.pi / 2) - 1e-9))

        def integrand(t: Float) -> Float:
            return moments.integrand(self._point(t) - o, self._derivative(t))

        inner = fixed(integrand, np.linspace(0.0, 1.0, parts + 1), 16).sum(axis=0)
        ends = self._point(np.array([0.0, 1.0])) - o
        return moments.add(
            tuple(inner.tolist()),
            moments.segment_moments(self.start - o, ends[0]),
            moments.segment_moments(ends[1], self.end - o),
        )


@dataclass(frozen=True, init=False, eq=False)
class CircularArc(Conic):
    """Arc of a circle from ``angle0`` to ``angle1`` (radians).

    Counter-clockwise when the angle grows; up to a full turn.
    """

    center: Float
    radius: float
    angle0: float
    angle1: float
    start: Float
    end: Float
    kind = "circle"

    def __init__(
        self,
        center: ArrayLike,
        radius: float,
        angle0: float,
        angle1: float,
        start: ArrayLike | None = None,
        end: ArrayLike | None = None,
    ) -> None:
        c, r = frozen(center, (2,), "center"), float(radius)
        if not (r > 0.0 and math.isfinite(r)):
            raise GeometryError(f"a circle of radius {radius!r}", at=c.tolist())
        self._store(center=c, radius=r, angle0=float(angle0), angle1=float(angle1))
        self._store(major=frozen((r, 0.0), (2,), "major"), minor=frozen((0.0, r), (2,), "minor"))
        self._place(start, end)

    def length(self, t0: float = 0.0, t1: float = 1.0) -> float:
        return (t1 - t0) * abs(self.angle1 - self.angle0) * self.radius

    def closest(self, points: ArrayLike) -> tuple[Float, Float]:
        q = np.asarray(points, np.float64).reshape(-1, 2)
        d = q - self.center
        sweep = self.angle1 - self.angle0
        ahead = (np.arctan2(d[:, 1], d[:, 0]) - self.angle0) * math.copysign(1.0, sweep)
        t = np.mod(ahead, _TURN) / abs(sweep)
        # past the end: the nearer of the two ends
        to_start = np.hypot(*(q - self.start).T)
        to_end = np.hypot(*(q - self.end).T)
        t = np.where(t <= 1.0, t, np.where(to_start <= to_end, 0.0, 1.0))
        gap = q - self.point(t)
        return t, np.hypot(gap[:, 0], gap[:, 1])

    def trim(self, t0: float, t1: float) -> CircularArc:
        self._check_trim(t0, t1)
        u0, u1 = self._cut(t0), self._cut(t1)
        return CircularArc(self.center, self.radius, u0, u1, self.point(t0), self.point(t1))

    def reverse(self) -> CircularArc:
        return CircularArc(self.center, self.radius, self.angle1, self.angle0, self.end, self.start)

    def transform(self, matrix: ArrayLike, offset: ArrayLike = (0.0, 0.0)) -> Curve:
        m, o = np.asarray(matrix, np.float64), np.asarray(offset, np.float64)
        center, ends = affine(m, o, self.center), (affine(m, o, self.start), affine(m, o, self.end))
        scale = math.sqrt(abs(m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]))
        mirror = math.copysign(1.0, m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0])
        skew = max(abs(m[0, 0] - mirror * m[1, 1]), abs(m[0, 1] + mirror * m[1, 0]))
        if skew <= _SIMILAR * scale:
            turn = math.atan2(m[1, 0], m[0, 0])
            angles = turn + mirror * self.angle0, turn + mirror * self.angle1
            return CircularArc(center, self.radius * scale, *angles, *ends)
        major, minor = self.radius * m[:, 0], self.radius * m[:, 1]
        return EllipticalArc(center, major, minor, self.angle0, self.angle1, *ends)


@dataclass(frozen=True, init=False, eq=False)
class EllipticalArc(Conic):
    """Arc ``center + major cos u + minor sin u`` from ``angle0`` to ``angle1`` (radians, up to a full turn).

    ``major`` and ``minor`` (2,) are two conjugate half-diameters, commonly the half-axes; with ``minor``
    to the right of ``major`` a growing angle runs clockwise.
    """

    center: Float
    major: Float
    minor: Float
    angle0: float
    angle1: float
    start: Float
    end: Float
    kind = "ellipse"

    def __init__(
        self,
        center: ArrayLike,
        major: ArrayLike,
        minor: ArrayLike,
        angle0: float,
        angle1: float,
        start: ArrayLike | None = None,
        end: ArrayLike | None = None,
    ) -> None:
        c, a, b = frozen(center, (2,), "center"), frozen(major, (2,), "major"), frozen(minor, (2,), "minor")
        if abs(a[0] * b[1] - a[1] * b[0]) <= NOISE * math.hypot(*a) * math.hypot(*b):
            raise GeometryError("the half-diameters of an ellipse are parallel or vanish", at=c.tolist())
        self._store(center=c, major=a, minor=b, angle0=float(angle0), angle1=float(angle1))
        self._place(start, end)

    def length(self, t0: float = 0.0, t1: float = 1.0) -> float:
        return arc_length(self._derivative, np.linspace(0.0, 1.0, 5), t0, t1)

    def closest(self, points: ArrayLike) -> tuple[Float, Float]:
        return nearest(self, self._table, points)

    @cached_property
    def _table(self) -> Table:
        return sample(self._point, np.linspace(0.0, 1.0, 17))

    def trim(self, t0: float, t1: float) -> EllipticalArc:
        self._check_trim(t0, t1)
        u0, u1 = self._cut(t0), self._cut(t1)
        return EllipticalArc(self.center, self.major, self.minor, u0, u1, self.point(t0), self.point(t1))

    def reverse(self) -> EllipticalArc:
        return EllipticalArc(self.center, self.major, self.minor, self.angle1, self.angle0, self.end, self.start)

    def transform(self, matrix: ArrayLike, offset: ArrayLike = (0.0, 0.0)) -> EllipticalArc:
        m, o = np.asarray(matrix, np.float64), np.asarray(offset, np.float64)
        zero = np.zeros(2)
        return EllipticalArc(
            affine(m, o, self.center),
            affine(m, zero, self.major),
            affine(m, zero, self.minor),
            self.angle0,
            self.angle1,
            affine(m, o, self.start),
            affine(m, o, self.end),
        )
