"""Limit functions: a graph piece of a curve as a function of one coordinate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves.base import Curve, other
from fubini.errors import GeometryError

Float = NDArray[np.float64]

#: A graph piece may turn back by this, times the size of its coordinates: what is left after trimming.
_SWING = 1e-13


@dataclass(frozen=True, eq=False)
class LimitFunction:
    """The coordinate across ``axis`` as a function of the one along it, over one graph piece.

    Called with x (n,) or a scalar; x outside the domain is clipped to it. The ends come back bit for
    bit. In between the result is a point of the curve whose coordinate along the axis is x to 1e-13 of
    the curve's size, at vertical tangents too (where y itself is an ill-conditioned function of x).

    Raises ``GeometryError`` where the curve turns back along the axis or is constant in it.
    """

    curve: Curve
    axis: int

    def __post_init__(self) -> None:
        other(self.axis)
        if self.curve.start[self.axis] == self.curve.end[self.axis]:
            raise GeometryError(
                "a curve that starts and ends at the same coordinate is not a function of it",
                at=self.curve.start.tolist(),
                fix="take graph_pieces(axis) and leave out those that is_constant(axis, tolerance)",
            )
        turns = self.curve.turning_points(self.axis)
        if len(turns):
            p = self.curve.point(np.concatenate([[0.0], turns, [1.0]]))
            way, size = np.abs(np.diff(p[:, self.axis])).sum(), np.abs(p).max()
            if way - abs(p[-1, self.axis] - p[0, self.axis]) > _SWING * size:
                raise GeometryError(
                    "a curve that turns back is not a function of this coordinate",
                    at=p[1].tolist(),
                    fix="take graph_pieces(axis) first",
                )

    @property
    def domain(self) -> tuple[float, float]:
        """Lowest and highest coordinate along the axis."""
        a, b = float(self.curve.start[self.axis]), float(self.curve.end[self.axis])
        return (a, b) if a < b else (b, a)

    def parameter(self, x: ArrayLike) -> Any:
        """Curve parameters of coordinates x; 0 and 1 exactly at the ends."""
        v = np.asarray(x, np.float64)
        low, high = self.domain
        flat = np.clip(v.ravel(), low, high)
        t = self.curve._invert(self.axis, flat, 0.0, 1.0)
        t[flat == self.curve.start[self.axis]] = 0.0
        t[flat == self.curve.end[self.axis]] = 1.0
        return t.reshape(v.shape) if v.ndim else float(t[0])

    def __call__(self, x: ArrayLike) -> Any:
        p = self.curve.point(self.parameter(x))[..., 1 - self.axis]
        return p if p.ndim else float(p)

    def derivative(self, x: ArrayLike) -> Any:
        """Slope of the function; infinite at a vertical tangent."""
        d = self.curve.derivative(self.parameter(x))
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = d[..., 1 - self.axis] / d[..., self.axis]
        return slope if slope.ndim else float(slope)
