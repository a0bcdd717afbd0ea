"""CAD edges as plain curves in space, and their exact projection into the plane of a face.

Orthogonal projection is affine: lines stay lines, conics keep their conjugate half-diameters, and
the poles of a spline are simply projected, weights and knots unchanged. A curve lying in the plane
is therefore carried over without any loss.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.curves import Bezier, BSpline, CircularArc, Curve, EllipticalArc, Line
from fubini.model import Frame

Float = NDArray[np.float64]

#: A circle tilted less than this (1 - cosine) projects to a circle in double precision.
_UNTILTED = 1e-15


def project(frame: Frame, points: Float) -> Float:
    """Plane coordinates (n, 2) of points (n, 3): equal points give equal results, however many there are."""
    d = points - frame.origin
    flat = np.empty((*d.shape[:-1], 2))
    flat[..., 0], flat[..., 1] = _dot(d, frame.x_axis), _dot(d, frame.y_axis)
    return flat


def height(frame: Frame, points: Float) -> Float:
    """Signed distances (n,) of points (n, 3) from the plane."""
    return _dot(points - frame.origin, frame.normal)


def _dot(d: Float, axis: Float) -> Float:
    return d[..., 0] * axis[0] + d[..., 1] * axis[1] + d[..., 2] * axis[2]


#: Ends moved by more than this, times the extent of a spline, bend it; what is less makes no visible step.
_BENT = 1e-4


@dataclass(frozen=True)
class SpaceCurve(ABC):
    """A curve in space over the range of its CAD edge.

    ``kind`` is the kind of the CAD curve, ``conversion`` the largest distance between the two.
    """

    kind: str

    @property
    def conversion(self) -> float:
        """Largest distance from the CAD curve; 0 when exact."""
        return 0.0

    @abstractmethod
    def leaves(self, frame: Frame) -> float:
        """Bound of the distance from the plane of ``frame``."""

    @abstractmethod
    def to_plane(self, frame: Frame, start: Float, end: Float) -> Curve:
        """The projected curve with the given stored ends (2,)."""


@dataclass(frozen=True)
class SpaceLine(SpaceCurve):
    """Straight edge between two points (2, 3)."""

    points: Float

    def leaves(self, frame: Frame) -> float:
        return float(np.abs(height(frame, self.points)).max())

    def to_plane(self, frame: Frame, start: Float, end: Float) -> Curve:
        return Line(start, end)


@dataclass(frozen=True)
class SpaceConic(SpaceCurve):
    """``center + x cos u + y sin u`` for u from ``first`` to ``last``; x, y (3,) are half-diameters."""

    center: Float
    x: Float
    y: Float
    first: float
    last: float

    def leaves(self, frame: Frame) -> float:
        n = frame.normal
        return float(abs(height(frame, self.center))) + math.hypot(self.x @ n, self.y @ n)

    def to_plane(self, frame: Frame, start: Float, end: Float) -> Curve:
        center = project(frame, self.center)
        x, y = project(frame, frame.origin + self.x), project(frame, frame.origin + self.y)
        cosine = float(x[0] * y[1] - x[1] * y[0]) / float(np.linalg.norm(np.cross(self.x, self.y)))
        if self.kind != "circle" or 1.0 - abs(cosine) > _UNTILTED:
            return EllipticalArc(center, x, y, self.first, self.last, start, end)
        turn, way = math.atan2(x[1], x[0]), math.copysign(1.0, cosine)
        radius = float(np.linalg.norm(self.x))
        return CircularArc(center, radius, turn + way * self.first, turn + way * self.last, start, end)


@dataclass(frozen=True)
class SpaceSpline(SpaceCurve):
    """Bezier or B-spline over [first, last]; ``knots`` is the full vector, or None for a Bezier curve.

    ``error`` is the distance from the CAD curve that this one stands for.
    """

    degree: int
    knots: Float | None
    poles: Float
    weights: Float | None
    first: float = 0.0
    last: float = 1.0
    error: float = 0.0

    @property
    def conversion(self) -> float:
        return self.error

    def leaves(self, frame: Frame) -> float:
        return float(np.abs(height(frame, self.poles)).max())

    def to_plane(self, frame: Frame, start: Float, end: Float) -> Curve:
        flat = project(frame, self.poles)
        if self.knots is None:
            share = np.linspace(0.0, 1.0, len(flat))
            return Bezier(_led_to(flat, share, flat[0], flat[-1], start, end), self.weights, start=start, end=end)
        piece = BSpline.from_domain(self.degree, self.knots, flat, self.weights, self.first, self.last)
        mean = np.array([piece.knots[i + 1 : i + 1 + piece.degree].mean() for i in range(len(piece.poles))])
        low, high = piece.domain
        poles = _led_to(piece.poles, (mean - low) / (high - low), piece.start, piece.end, start, end)
        return BSpline(piece.degree, piece.knots, poles, piece.weights, start=start, end=end)


def _led_to(poles: Float, share: Float, first: Float, last: Float, start: Float, end: Float) -> Float:
    """Control points (n, 2) moved so that a curve from ``first`` to ``last`` runs from ``start`` to ``end``.

    ``share`` (n,) holds the mean of the knots of each, over the domain: what is linear in them is linear in the
    parameter. CAD edges may miss their vertices by their tolerance, and a curve that jumps there has no mesh.
    """
    moved = np.stack([start - first, end - last])
    if np.abs(moved).max() <= _BENT * np.ptp(poles, axis=0).max():
        return poles
    bent: Float = poles + (1.0 - share)[:, None] * moved[0] + share[:, None] * moved[1]
    return bent
