"""Curves of every kind for the tests: fixed samples, and hypothesis strategies."""

import math

import numpy as np
from hypothesis import strategies as st

from fubini.curves import Bezier, BSpline, CircularArc, EllipticalArc, Line

HALF = math.sqrt(0.5)


def rational_circle(radius=1.0, center=(0.0, 0.0)):
    """A full circle as the usual quadratic B-spline of nine poles."""
    p = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    poles = np.asarray(center, float) + radius * np.array(p, float)
    knots = [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1]
    return BSpline(2, knots, poles, [1, HALF, 1, HALF, 1, HALF, 1, HALF, 1])


def samples():
    """One or two curves of each kind and degree, with names for the test report."""
    rng = np.random.default_rng(7)
    return {
        "line": Line((0.25, -1), (2, 1.5)),
        "arc": CircularArc((1, 2), 3, 0.4, 2.9),
        "clockwise arc": CircularArc((-1, 0.5), 0.7, 3.0, -2.5),
        "circle": CircularArc((1, 2), 0.5, 0.3, 0.3 + 2 * math.pi),
        "ellipse arc": EllipticalArc((1, -2), (3, 1), (-0.5, 1.5), 0.3, 4.4),
        "mirrored ellipse": EllipticalArc((0, 1), (2, 0), (0.1, -0.3), -1, -1 + 2 * math.pi),
        "cubic": Bezier([(0, 0), (2, 3), (-1, 3), (1, 0.2)]),
        "chord": Bezier([(0, 0), (1, 2)]),
        "rational quintic": Bezier(rng.random((6, 2)), rng.random(6) + 0.2),
        "clamped": BSpline(3, [0, 0, 0, 0, 1, 2, 2, 3.5, 3.5, 3.5, 3.5], rng.random((7, 2))),
        "unclamped": BSpline(3, [0, 1, 2, 3, 4, 4.5, 6, 7, 8, 9], rng.random((6, 2)), rng.random(6) + 0.3),
        "polyline": BSpline(1, [0, 0, 1, 2, 3, 3], [(0, 0), (1, 0.5), (1, 2), (0.5, 2.5)]),
        "rational circle": rational_circle(),
    }


def size(curve):
    """The largest coordinate that defines the curve: what rounding errors are relative to."""
    if isinstance(curve, CircularArc | EllipticalArc):
        return float((np.abs(curve.center) + np.hypot(curve.major, curve.minor)).max())
    return float(np.abs([curve.start, curve.end] if isinstance(curve, Line) else curve.poles).max())


_coordinate = st.floats(-1, 1)
_point = st.tuples(_coordinate, _coordinate)
_angle = st.floats(-7, 7)
_sweep = st.floats(1e-3, 2 * math.pi).flatmap(lambda a: st.sampled_from([a, -a]))


@st.composite
def arcs(draw):
    """Circular and elliptical arcs, also thin and tilted ones."""
    center, u, sweep = draw(_point), draw(_angle), draw(_sweep)
    if draw(st.booleans()):
        return CircularArc(center, draw(st.floats(1e-3, 10)), u, u + sweep)
    turn, ratio = draw(_angle), draw(st.floats(0.01, 1))
    c, s = math.cos(turn), math.sin(turn)
    return EllipticalArc(center, (c, s), (-ratio * s, ratio * c), u, u + sweep)


@st.composite
def splines(draw):
    """Bezier curves and B-splines up to degree 5, polynomial and rational, clamped and not."""
    seed = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    degree = draw(st.integers(2, 5))
    n = degree + 1 + draw(st.integers(0, 5))
    poles = seed.uniform(-1, 1, (n, 2))
    weights = seed.uniform(0.1, 5, n) if draw(st.booleans()) else None
    if draw(st.booleans()):
        return Bezier(poles[: degree + 1], None if weights is None else weights[: degree + 1])
    knots = np.cumsum(seed.uniform(0.05, 1, n + degree + 1))
    if draw(st.booleans()):
        knots[: degree + 1], knots[n:] = knots[degree], knots[n]
    return BSpline(degree, knots, poles, weights)


curves = st.one_of(arcs(), splines())
