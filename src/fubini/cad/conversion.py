"""Curves that fubini has no kind of: exactly where there is an exact form, else to a stated tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fubini.cad.spacecurve import SpaceSpline

Float = NDArray[np.float64]

#: Point, first and second derivative (3, 3) at a parameter.
Evaluate = Callable[[float], Float]

_DEGREE = 5
_MOST_PIECES = 4096
#: Where in a piece the distance is measured; a Hermite quintic errs most around the middle.
_PROBES = (0.08, 0.25, 0.4, 0.5, 0.6, 0.75, 0.92)


def parabola(apex: Float, x: Float, y: Float, focal: float, first: float, last: float) -> SpaceSpline:
    """``apex + u^2 / (4 focal) x + u y`` over [first, last]: a Bezier curve of degree 2, same parameter."""

    def blossom(a: float, b: float) -> Float:
        return apex + a * b / (4.0 * focal) * x + (a + b) / 2.0 * y

    poles = np.array([blossom(first, first), blossom(first, last), blossom(last, last)])
    return SpaceSpline("parabola", 2, None, poles, None)


def hyperbola(center: Float, x: Float, y: Float, first: float, last: float) -> SpaceSpline:
    """``center + x cosh u + y sinh u`` over [first, last]: a rational Bezier curve of degree 2.

    The middle pole is the meeting point of the end tangents, its weight cosh((last - first) / 2).
    """

    def point(u: float) -> Float:
        return math.cosh(u) * x + math.sinh(u) * y

    weight = math.cosh((last - first) / 2.0)
    middle = point((first + last) / 2.0) / weight
    poles = center + np.array([point(first), middle, point(last)])
    return SpaceSpline("hyperbola", 2, None, poles, np.array([1.0, weight, 1.0]))


def hermite_spline(kind: str, evaluate: Evaluate, first: float, last: float, tolerance: float) -> SpaceSpline:
    """Quintic Hermite pieces, halved until each stays within ``tolerance`` (model units) of the curve.

    The distance is taken between equal parameters, which bounds the true one from above. When the
    budget of pieces ends first, ``conversion`` of the result says how far it got.
    """
    done: list[tuple[float, float, Float]] = []
    todo = [tuple(pair) for pair in _quarters(first, last)][::-1]
    worst = 0.0
    while todo:
        a, b = todo.pop()
        poles = _piece(evaluate(a), evaluate(b), b - a)
        error = _distance(poles, evaluate, a, b)
        middle = (a + b) / 2.0
        if error > tolerance and len(done) + len(todo) < _MOST_PIECES and a < middle < b:
            todo += [(middle, b), (a, middle)]
            continue
        worst = max(worst, error)
        done.append((a, b, poles))
    breaks = np.array([first, *(b for _, b, _ in done)])
    knots = np.concatenate([[first], np.repeat(breaks, _DEGREE), [last]])
    poles = np.concatenate([done[0][2][:1], *(p[1:] for _, _, p in done)])
    return SpaceSpline(kind, _DEGREE, knots, poles, None, first, last, worst)


def _quarters(first: float, last: float) -> Float:
    cuts = np.linspace(first, last, 5)
    return np.stack([cuts[:-1], cuts[1:]], axis=1)


def _piece(start: Float, end: Float, h: float) -> Float:
    """Bezier poles (6, 3) that match place, first and second derivative at both ends."""
    p0, p5 = start[0], end[0]
    p1, p4 = p0 + h / 5.0 * start[1], p5 - h / 5.0 * end[1]
    p2 = 2.0 * p1 - p0 + h * h / 20.0 * start[2]
    p3 = 2.0 * p4 - p5 + h * h / 20.0 * end[2]
    return np.array([p0, p1, p2, p3, p4, p5])


def _distance(poles: Float, evaluate: Evaluate, a: float, b: float) -> float:
    """Largest distance between the piece and the curve at equal parameters."""
    worst = 0.0
    for s in _PROBES:
        row = poles
        while len(row) > 1:
            row = (1.0 - s) * row[:-1] + s * row[1:]
        worst = max(worst, float(np.linalg.norm(row[0] - evaluate(a + s * (b - a))[0])))
    return worst
