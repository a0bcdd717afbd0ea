"""Boundary integrals for area and moments, see ``Curve.area_moments``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Moments = tuple[float, float, float, float, float, float]


def segment_moments(a: Float, b: Float) -> Moments:
    """Share of the straight segment from a (2,) to b (2,), closed form."""
    x0, y0 = a.tolist()
    x1, y1 = b.tolist()
    # x dy - y dx is constant along a segment; written with differences it does not cancel
    g = x0 * (y1 - y0) - y0 * (x1 - x0)
    return (
        g / 2,
        g * (x0 + x1) / 6,
        g * (y0 + y1) / 6,
        g * (x0 * x0 + x0 * x1 + x1 * x1) / 12,
        g * (2 * x0 * y0 + x0 * y1 + x1 * y0 + 2 * x1 * y1) / 24,
        g * (y0 * y0 + y0 * y1 + y1 * y1) / 12,
    )


def integrand(p: Float, d: Float) -> Float:
    """The six integrands (n, 6) at points p (n, 2), counted from the origin, with derivatives d (n, 2)."""
    x, y = p[:, 0], p[:, 1]
    g = x * d[:, 1] - y * d[:, 0]
    return np.stack([g / 2, x * g / 3, y * g / 3, x * x * g / 4, x * y * g / 4, y * y * g / 4], axis=1)


def add(*shares: Moments) -> Moments:
    """Sum of shares."""
    return tuple(map(sum, zip(*shares, strict=True)))  # type: ignore[return-value]
