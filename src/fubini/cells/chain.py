"""Chains: limit functions of consecutive edges joined into one function."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves import BSpline, LimitFunction

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Chain:
    """A continuous function over [breaks[0], breaks[-1]]: limit ``i`` between breaks i and i + 1.

    Attributes
    ----------
    limits : limit functions (k), in ascending order of their coordinate.
    breaks : (k + 1,); inner ones are the coordinates of the vertices where two edges meet.
    edges : CAD edge index (k) of each limit function.

    Called with coordinates (n,) or a scalar. At a vertex of the boundary the value is that of the
    vertex bit for bit; coordinates outside are clipped.
    """

    limits: tuple[LimitFunction, ...]
    breaks: Float
    edges: tuple[int, ...]

    @property
    def domain(self) -> tuple[float, float]:
        """First and last coordinate."""
        return float(self.breaks[0]), float(self.breaks[-1])

    def __call__(self, x: ArrayLike) -> Any:
        v = np.asarray(x, np.float64)
        flat = np.clip(v.ravel(), self.breaks[0], self.breaks[-1])
        y = np.empty_like(flat)
        piece = np.clip(np.searchsorted(self.breaks, flat, side="right") - 1, 0, len(self.limits) - 1)
        for i in np.unique(piece):
            mine = piece == i
            y[mine] = self.limits[i](flat[mine])
        return y.reshape(v.shape) if v.ndim else float(y[0])

    @cached_property
    def smooth_breaks(self) -> Float:
        """Sorted coordinates between which the function is smooth: the breaks and the spline knots."""
        found = [self.breaks]
        for limit in self.limits:
            if isinstance(limit.curve, BSpline):
                found.append(limit.curve.point(limit.curve.chain.breaks[1:-1])[:, limit.axis])
        low, high = self.domain
        x = np.unique(np.concatenate(found))
        return x[(x >= low) & (x <= high)]
