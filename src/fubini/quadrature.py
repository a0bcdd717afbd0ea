"""Gauss-Legendre integration over intervals, fixed and adaptive."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.errors import OptionError

Float = NDArray[np.float64]

#: Halvings after which an interval is taken as it is: 2^-40 of a span holds nothing that counts.
_LEVELS = 40

#: Intervals at one level, per given one, at which no more are halved.
_CROWD = 256


@functools.cache
def gauss(order: int) -> tuple[Float, Float]:
    """Nodes and weights (order,) on [0, 1]: exact for polynomials up to degree ``2 order - 1``."""
    if order < 1:
        raise OptionError(f"a Gauss rule of order {order!r}", fix="take an order of at least 1")
    x, w = np.polynomial.legendre.leggauss(order)
    nodes, weights = (x + 1.0) / 2.0, w / 2.0
    nodes.setflags(write=False)
    weights.setflags(write=False)
    return nodes, weights


def composite(breaks: ArrayLike, order: int) -> tuple[Float, Float]:
    """Nodes and weights of one Gauss rule on each interval between ``breaks`` (k + 1,): (k order,) each."""
    b = np.asarray(breaks, np.float64)
    x, w = gauss(order)
    h = np.diff(b)
    return (b[:-1, None] + h[:, None] * x).ravel(), (h[:, None] * w).ravel()


def fixed(f: Callable[[Float], Float], breaks: ArrayLike, order: int) -> Float:
    """Integrals of ``f`` (n,) -> (n,) or (n, m) over each interval between ``breaks``: (k, m)."""
    nodes, weights = composite(breaks, order)
    values = np.asarray(f(nodes), np.float64).reshape(len(nodes), -1)
    return (weights[:, None] * values).reshape(len(nodes) // order, order, -1).sum(axis=1)


def adaptive(f: Callable[[Float], Float], breaks: ArrayLike, relative: float, order: int = 16) -> Float:
    """Integral of ``f`` (n,) -> (n,) or (n, m) over all intervals between ``breaks``: (m,).

    An interval is halved until its halves agree with it to ``relative`` of the integral of the
    absolute value, component by component. Where the number of intervals explodes, rounding noise
    is being halved in vain; it is taken as it is.
    """
    b = np.asarray(breaks, np.float64)
    low, high = b[:-1], b[1:]
    whole, absolute = _on(f, low, high, order)
    total = np.zeros(whole.shape[1])
    scale = absolute.sum(axis=0)
    for _ in range(_LEVELS):
        if len(low) > _CROWD * (len(b) + 1):
            break
        middle = (low + high) / 2
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        halves = _on(f, low, high, order)[0]
        both = halves[: len(middle)] + halves[len(middle) :]
        bad = (np.abs(both - whole) > relative * scale).any(axis=1)
        total += both[~bad].sum(axis=0)
        if not bad.any():
            return total
        again = np.concatenate([bad, bad])
        low, high, whole = low[again], high[again], halves[again]
    return total + whole.sum(axis=0)


def _on(f: Callable[[Float], Float], low: Float, high: Float, order: int) -> tuple[Float, Float]:
    """Integrals (k, m) of f and of its absolute value over the intervals from ``low`` to ``high`` (k,)."""
    x, w = gauss(order)
    width = (high - low)[:, None]
    t = low[:, None] + width * x
    values = np.asarray(f(t.ravel()), np.float64).reshape(len(low), order, -1)
    return np.einsum("nkm,k->nm", values, w) * width, np.einsum("nkm,k->nm", np.abs(values), w) * width
