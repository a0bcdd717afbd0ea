"""Arc length by integration along the parameter."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fubini.quadrature import adaptive

Float = NDArray[np.float64]


def arc_length(derivative: Callable[[Float], Float], breaks: Float, t0: float, t1: float) -> float:
    """Length of a curve, smooth between ``breaks``, from t0 to t1 to 1e-13 relative; negative backwards."""

    def speed(t: Float) -> Float:
        d = derivative(t)
        return np.hypot(d[:, 0], d[:, 1])

    low, high = min(t0, t1), max(t0, t1)
    if low == high:
        return 0.0
    inner = breaks[(breaks > low) & (breaks < high)]
    length = float(adaptive(speed, np.array([low, *inner, high]), 1e-13)[0])
    return length if t1 > t0 else -length
