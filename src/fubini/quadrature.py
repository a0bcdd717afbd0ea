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

#: When this many intervals per given one (and some) are in disagreement, rounding noise is halved in vain.
_CROWD = 16


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
    absolute value, component by component; what still disagrees when singularities would be settled,
    or when the number of intervals explodes, is noise and taken as it is.
    """
    b = np.asarray(breaks, np.float64)
    low, high = b[:-1], b[1:]
    whole, size = _on(f, low, high, order)
    total = np.zeros(whole.shape[1])
    scale = size.sum(axis=0)
    for _ in range(_LEVELS):
        middle = (low + high) / 2
        left, right = _on(f, low, middle, order)[0], _on(f, middle, high, order)[0]
        good = (np.abs(left + right - whole) <= relative * scale).all(axis=1)
        total += (left + right)[good].sum(axis=0)
        if good.all() or (~good).sum() > _CROWD * (len(b) + 15):
            return total + (left + right)[~good].sum(axis=0)
        bad = ~good
        low, high = np.concatenate([low[bad], middle[bad]]), np.concatenate([middle[bad], high[bad]])
        whole = np.concatenate([left[bad], right[bad]])
    return total + whole.sum(axis=0)


def _on(f: Callable[[Float], Float], low: Float, high: Float, order: int) -> tuple[Float, Float]:
    """Integrals (k, m) of f and of its absolute value over the intervals from ``low`` to ``high`` (k,)."""
    x, w = gauss(order)
    width = (high - low)[:, None]
    t = low[:, None] + width * x
    values = np.asarray(f(t.ravel()), np.float64).reshape(len(low), order, -1)
    return np.einsum("nkm,k->nm", values, w) * width, np.einsum("nkm,k->nm", np.abs(values), w) * width
