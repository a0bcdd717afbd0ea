"""Gauss-Legendre integration along a parameter, fixed and adaptive."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

#: Halvings after which an interval is taken as it is: 2^-40 of a span holds nothing that counts.
_LEVELS = 40
#: Intervals at one level after which they are taken as they are.
_INTERVALS = 4096


@functools.cache
def gauss(order: int) -> tuple[Float, Float]:
    """Nodes and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(order)
    return (x + 1.0) / 2.0, w / 2.0


def fixed(f: Callable[[Float], Float], breaks: Float, order: int) -> Float:
    """Integrals of ``f`` (n,) -> (n, ...) over each interval between ``breaks``: (len(breaks) - 1, ...)."""
    x, w = gauss(order)
    h = np.diff(breaks)
    t = breaks[:-1, None] + h[:, None] * x
    values = f(t.ravel()).reshape(len(h), order, -1)
    return np.einsum("nkm,k,n->nm", values, w, h)


def adaptive(f: Callable[[Float], Float], breaks: Float, relative: float, order: int = 16) -> Float:
    """Integral of ``f`` (n,) -> (n, m) over all intervals: (m,).

    An interval is halved until its halves agree with it to ``relative`` of the integral of the absolute
    value, component by component.
    """
    a, b = breaks[:-1], breaks[1:]
    whole, absolute = _on(f, a, b, order)
    total = np.zeros(whole.shape[1])
    scale = absolute.sum(axis=0)
    for _ in range(_LEVELS):
        if len(a) > _INTERVALS:
            break
        middle = (a + b) / 2
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        halves = _on(f, a, b, order)[0]
        both = halves[: len(middle)] + halves[len(middle) :]
        bad = (np.abs(both - whole) > relative * scale).any(axis=1)
        total += both[~bad].sum(axis=0)
        if not bad.any():
            return total
        again = np.concatenate([bad, bad])
        a, b, whole = a[again], b[again], halves[again]
    return total + whole.sum(axis=0)


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


def _on(f: Callable[[Float], Float], a: Float, b: Float, order: int) -> tuple[Float, Float]:
    """Integrals (n, m) of f and of its absolute value over the intervals [a, b] (n,)."""
    x, w = gauss(order)
    h = (b - a)[:, None]
    values = f((a[:, None] + h * x).ravel()).reshape(len(a), order, -1)
    return h * np.einsum("nkm,k->nm", values, w), h * np.einsum("nkm,k->nm", np.abs(values), w)
