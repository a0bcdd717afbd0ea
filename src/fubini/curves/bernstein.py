"""Polynomials in Bernstein form on [0, 1]; coefficients c (..., d + 1, m), m values at once."""

from __future__ import annotations

import functools
import itertools
import math

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

#: Halvings of [0, 1] after which a root counts as found.
_DEPTH = 52
#: Newton and bisection steps for one root; bisection alone needs 53.
_STEPS = 64


def jet(c: Float, u: Float, order: int) -> list[Float]:
    """Value and derivatives up to ``order`` (at most 2) of c (n, d + 1, m) at u (n,): each (n, m).

    De Casteljau's scheme: convex combinations only.
    """
    degree = c.shape[-2] - 1
    u1 = u[:, None, None]
    u0 = 1.0 - u1
    result = [np.zeros((len(u), c.shape[-1])) for _ in range(order + 1)]
    for left in range(degree, -1, -1):  # degree of what is left: its differences give that derivative
        if left <= order:
            d = c
            for _ in range(left):
                d = d[:, 1:] - d[:, :-1]
            result[left] = math.perm(degree, left) * d[:, 0]
        if left:
            c = u0 * c[:, :-1] + u1 * c[:, 1:]
    return result


def split(c: Float, u: float) -> tuple[Float, Float]:
    """Coefficients over [0, u] and over [u, 1] of c (d + 1, m)."""
    left, right = [c[0]], [c[-1]]
    while len(c) > 1:
        c = (1.0 - u) * c[:-1] + u * c[1:]
        left.append(c[0])
        right.append(c[-1])
    return np.array(left), np.array(right[::-1])


def restrict(c: Float, u0: float, u1: float) -> Float:
    """Coefficients over [u0, u1] of c (d + 1, m)."""
    if u1 < 1.0:
        c = split(c, u1)[0]
    return split(c, u0 / u1)[1] if u0 > 0.0 else c


@functools.cache
def _binomials(degree: int) -> Float:
    return np.array([math.comb(degree, i) for i in range(degree + 1)], float)


def product(a: Float, b: Float) -> Float:
    """Coefficients (n, da + db + 1) of the products of a (n, da + 1) and b (n, db + 1)."""
    da, db = a.shape[1] - 1, b.shape[1] - 1
    a, b = a * _binomials(da), b * _binomials(db)
    result = np.zeros((len(a), da + db + 1))
    for i in range(da + 1):
        result[:, i : i + db + 1] += a[:, i : i + 1] * b
    return result / _binomials(da + db)


def derivative(c: Float) -> Float:
    """Coefficients (n, d) of the derivatives of c (n, d + 1)."""
    return (c.shape[1] - 1) * (c[:, 1:] - c[:, :-1])


def sign_changes(c: Float) -> list[float]:
    """Parameters in [0, 1], sorted, among which is every one where c (d + 1,) changes sign.

    Interval halving by the sign changes of the coefficients (no more roots than changes), then a
    bracketed root-find. Values below the rounding error of the coefficients count as zero; where the
    polynomial nearly vanishes without a certain change of sign, extra parameters may be among the result.
    """
    tiny = 4.0 * len(c) * np.finfo(float).eps * float(np.abs(c).max(initial=0.0))
    found: list[float] = []
    stack = [(0.0, 1.0, [float(x) for x in c], 0)]
    while stack:
        a, b, p, depth = stack.pop()
        signs = [x > 0.0 for x in p if abs(x) > tiny]
        changes = sum(s != t for s, t in itertools.pairwise(signs))
        if abs(p[0]) <= tiny:
            found.append(a)
        if abs(p[-1]) <= tiny:
            found.append(b)
        if changes == 0:
            continue
        if changes == 1 and abs(p[0]) > tiny and abs(p[-1]) > tiny:
            found.append(a + (b - a) * _bracketed(p))
        elif depth >= _DEPTH:
            found.append((a + b) / 2.0)
        else:
            left, right = _halve(p)
            middle = (a + b) / 2.0
            stack += [(a, middle, left, depth + 1), (middle, b, right, depth + 1)]
    return sorted(found)


def _halve(p: list[float]) -> tuple[list[float], list[float]]:
    left, right = [p[0]], [p[-1]]
    while len(p) > 1:
        p = [(x + y) / 2.0 for x, y in itertools.pairwise(p)]
        left.append(p[0])
        right.append(p[-1])
    return left, right[::-1]


def _bracketed(p: list[float]) -> float:
    """The root in [0, 1] of a polynomial whose ends differ in sign: Newton, bisection where it strays."""
    low, high, degree = 0.0, 1.0, len(p) - 1
    rising = p[-1] > 0.0
    u = p[0] / (p[0] - p[-1])
    for _ in range(_STEPS):
        q = p
        while len(q) > 2:
            q = [(1.0 - u) * x + u * y for x, y in itertools.pairwise(q)]
        value, slope = (1.0 - u) * q[0] + u * q[1], degree * (q[1] - q[0])
        if value == 0.0:
            return u
        if (value < 0.0) == rising:
            low = u
        else:
            high = u
        step = -value / slope if slope != 0.0 else math.inf
        if not low < u + step < high or abs(step) > (high - low) / 2.0:
            step = (low + high) / 2.0 - u
        u += step
        if abs(step) <= 1e-16 or not low < u < high:
            break
    return u
