"""Straight segments."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fubini.curves.base import Curve, Float, affine, frozen, other
from fubini.curves.moments import segment_moments
from fubini.errors import GeometryError


@dataclass(frozen=True, init=False, eq=False)
class Line(Curve):
    """The segment ``(1 - t) start + t end``."""

    start: Float
    end: Float
    kind = "line"

    def __init__(self, start: ArrayLike, end: ArrayLike) -> None:
        a, b = frozen(start, (2,), "start"), frozen(end, (2,), "end")
        if a[0] == b[0] and a[1] == b[1]:
            raise GeometryError("a line has no length", at=a.tolist(), fix="leave the degenerate edge out")
        self._store(start=a, end=b)

    def _point(self, t: Float) -> Float:
        s = t[..., None]
        return (1.0 - s) * self.start + s * self.end

    def _derivative(self, t: Float) -> Float:
        return np.broadcast_to(self.end - self.start, (*t.shape, 2)).copy()

    def _second_derivative(self, t: Float) -> Float:
        return np.zeros((*t.shape, 2))

    def bounding_box(self) -> tuple[Float, Float]:
        return np.minimum(self.start, self.end), np.maximum(self.start, self.end)

    def length(self, t0: float = 0.0, t1: float = 1.0) -> float:
        d = self.end - self.start
        return (t1 - t0) * math.hypot(d[0], d[1])

    def closest(self, points: ArrayLike) -> tuple[Float, Float]:
        q = np.asarray(points, np.float64).reshape(-1, 2)
        d = self.end - self.start
        d /= np.abs(d).max()  # so that tiny and huge segments neither underflow nor overflow
        along = ((q - self.start) @ d) / ((self.end - self.start) @ d)
        t = np.clip(along, 0.0, 1.0)
        gap = q - self.point(t)
        return t, np.hypot(gap[:, 0], gap[:, 1])

    def trim(self, t0: float, t1: float) -> Line:
        self._check_trim(t0, t1)
        return Line(self.point(t0), self.point(t1))

    def reverse(self) -> Line:
        return Line(self.end, self.start)

    def transform(self, matrix: ArrayLike, offset: ArrayLike = (0.0, 0.0)) -> Line:
        m, o = np.asarray(matrix, np.float64), np.asarray(offset, np.float64)
        return Line(affine(m, o, self.start), affine(m, o, self.end))

    def turning_points(self, axis: int) -> Float:
        other(axis)
        return np.empty(0)

    def _invert(self, axis: int, values: Float, t0: float | Float, t1: float | Float) -> Float:
        a, b = self.start[axis], self.end[axis]
        # counted from the nearer end, where the quotient is the most accurate
        from_a, from_b = values - a, b - values
        t = np.where(np.abs(from_a) <= np.abs(from_b), from_a / (b - a), 1.0 - from_b / (b - a))
        return np.clip(t, t0, t1)

    def area_moments(self, origin: ArrayLike = (0.0, 0.0)) -> tuple[float, float, float, float, float, float]:
        o = np.asarray(origin, np.float64)
        return segment_moments(self.start - o, self.end - o)
