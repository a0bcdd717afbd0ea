"""The signs of the predicates against rational arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fubini.predicates import in_circle, orientation


def sign(value):
    return (value > 0) - (value < 0)


def exact(points):
    """Points as fractions, relative to the last one."""
    rows = [[Fraction(float(v)) for v in p] for p in points]
    return [(x - rows[-1][0], y - rows[-1][1]) for x, y in rows[:-1]]


def exact_orientation(a, b, c):
    (ax, ay), (bx, by) = exact((a, b, c))
    return sign(ax * by - ay * bx)


def exact_in_circle(a, b, c, d):
    p, q, r = [(x, y, x * x + y * y) for x, y in exact((a, b, c, d))]
    return sign(
        p[2] * (q[0] * r[1] - q[1] * r[0]) + q[2] * (r[0] * p[1] - r[1] * p[0]) + r[2] * (p[0] * q[1] - p[1] * q[0])
    )


def agree(function, oracle, *points):
    got = function(*points)
    wanted = [oracle(*row) for row in zip(*points)]
    wrong = np.flatnonzero(got != wanted)
    assert len(wrong) == 0, [p[wrong[0]].tolist() for p in points]
    return got


def nudged(rng, points, ulps=2):
    """Each coordinate moved by a few units in the last place."""
    steps = rng.integers(-ulps, ulps + 1, points.shape)
    return points + steps * np.spacing(np.abs(points))


FRAMES = [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-6, 1e6), (0.37, 0.1), (1e3, -1e6)]


@pytest.mark.parametrize(("scale", "offset"), FRAMES)
def test_orientation_of_nearly_collinear_points(scale, offset):
    rng = np.random.default_rng(1)
    a, b = rng.uniform(-1, 1, (2, 1500, 2))
    c = a + (b - a) * rng.uniform(-2, 2, (1500, 1))
    signs = agree(orientation, exact_orientation, *(nudged(rng, scale * p + offset) for p in (a, b, c)))
    assert {-1, 1} <= set(signs.tolist())


@pytest.mark.parametrize(("scale", "offset"), FRAMES)
def test_in_circle_of_nearly_cocircular_points(scale, offset):
    rng = np.random.default_rng(2)
    turn = np.sort(rng.uniform(0, 2 * np.pi, (4, 1000)), axis=0)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=2)
    signs = agree(in_circle, exact_in_circle, *(nudged(rng, scale * p + offset, 1) for p in circle))
    assert {-1, 1} <= set(signs.tolist())


@pytest.mark.parametrize(("scale", "offset"), FRAMES)
def test_in_circle_of_turned_squares_is_often_a_tie(scale, offset):
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-1, 1, (2, 400))
    corners = [scale * np.stack(p, axis=1) + offset for p in ((x, y), (-y, x), (-x, -y), (y, -x))]
    signs = agree(in_circle, exact_in_circle, *corners)
    if offset == 0.0:
        assert not signs.any()


@pytest.mark.parametrize("h", [1.0, 0.1, np.sqrt(3) / 7, 1e-6 / 3])
def test_in_circle_on_lattices(h):
    rng = np.random.default_rng(4)
    cells = rng.integers(-3, 4, (4, 1500, 2))
    points = np.stack([h * (cells[..., 0] + 0.5 * (cells[..., 1] % 2)), h * np.sqrt(3) / 2 * cells[..., 1]], axis=2)
    signs = agree(in_circle, exact_in_circle, *points)
    assert set(signs.tolist()) == {-1, 0, 1}


def test_in_circle_where_coordinates_differ_by_many_magnitudes():
    rng = np.random.default_rng(5)
    points = rng.uniform(-1, 1, (4, 500, 2)) * 10.0 ** rng.integers(-6, 7, (4, 500, 2))
    points[3, ::2] = points[0, ::2]
    agree(in_circle, exact_in_circle, *points)
    agree(orientation, exact_orientation, *points[:3])


coordinate = st.one_of(
    st.integers(-8, 8).map(float),
    st.integers(-8, 8).map(lambda k: 1e6 + 0.1 * k),
    st.integers(-8, 8).map(lambda k: 1e-6 * k),
    st.floats(-1e6, 1e6).filter(lambda v: v == 0 or abs(v) > 1e-30),
)
point = st.tuples(coordinate, coordinate)


@settings(max_examples=500, deadline=None)
@given(st.lists(point, min_size=4, max_size=4))
def test_signs_of_any_points(points):
    a, b, c, d = points
    assert orientation(a, b, c) == exact_orientation(a, b, c)
    assert in_circle(a, b, c, d) == exact_in_circle(a, b, c, d)


@settings(max_examples=200, deadline=None)
@given(st.lists(point, min_size=4, max_size=4))
def test_signs_change_with_the_order_of_the_points(points):
    a, b, c, d = points
    assert orientation(a, b, c) == orientation(b, c, a) == -orientation(b, a, c)
    assert in_circle(a, b, c, d) == in_circle(b, c, a, d) == -in_circle(b, a, c, d)


def test_shapes_broadcast_and_empty_input_is_fine():
    assert orientation((0, 0), (1, 0), np.zeros((2, 3, 2)) + (0, 1)).shape == (2, 3)
    assert orientation(np.empty((0, 2)), (1, 0), (0, 1)).shape == (0,)
    assert in_circle((0, 0), (1, 0), (0, 1), np.empty((0, 2))).shape == (0,)
