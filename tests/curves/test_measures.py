"""Length, area moments, nearest points."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from curves.kinds import curves, rational_circle, samples, size
from fubini.curves import Bezier, BSpline, CircularArc, EllipticalArc, Line


@given(curves, st.floats(0.05, 0.95))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_length_is_additive_and_above_all_chords(curve, t):
    whole = curve.length()
    left, right = curve.split(t)
    assert curve.length(0, t) + curve.length(t, 1) == pytest.approx(whole, rel=1e-12)
    assert left.length() + right.length() == pytest.approx(whole, rel=1e-12)
    assert curve.length(1, 0) == -whole
    assert curve.length(t, t) == 0
    p = curve.point(np.linspace(0, 1, 4001))
    chords = np.hypot(*np.diff(p, axis=0).T).sum()
    assert chords <= whole * (1 + 1e-12) + 4001 * 2.3e-16 * size(curve)
    assert chords == pytest.approx(whole, rel=1e-4)


def test_known_lengths():
    assert CircularArc((0, 0), 2, 1, -2).length() == 6
    assert CircularArc((0, 0), 2, 1, -2).length(0.25, 0.75) == 3
    from scipy.special import ellipe

    ellipse = EllipticalArc((1, 1), (3, 0), (0, 1), 0, 2 * math.pi)
    assert ellipse.length() == pytest.approx(12 * ellipe(1 - 1 / 9), rel=1e-14)
    parabola = Bezier([(0, 0), (1, 0), (2, 4)])  # y = x^2
    assert parabola.length() == pytest.approx(math.sqrt(17) + math.asinh(4) / 4, rel=1e-14)
    cusp = Bezier([(0, 0), (1, 1), (0, 1), (1, 0)])  # speed vanishes inside
    assert cusp.length() == pytest.approx(cusp.length(0, 0.5) * 2, rel=1e-12)


def loop_moments(loop, origin=(0.0, 0.0)):
    return np.sum([c.area_moments(origin) for c in loop], axis=0)


def closed_polygon(points):
    return [Line(a, b) for a, b in zip(points, [*points[1:], points[0]])]


def test_moments_of_a_rectangle():
    loop = closed_polygon([(1, 2), (4, 2), (4, 4), (1, 4)])
    assert loop_moments(loop) == pytest.approx([6, 15, 18, 42, 45, 56], rel=1e-15)
    assert loop_moments(loop, (2.5, 3)) == pytest.approx([6, 0, 0, 4.5, 0, 2], rel=1e-15, abs=1e-15)


def test_moments_of_a_triangle():
    loop = closed_polygon([(0, 0), (1, 0), (0, 1)])
    assert loop_moments(loop) == pytest.approx([1 / 2, 1 / 6, 1 / 6, 1 / 12, 1 / 24, 1 / 12], rel=1e-15)


def ellipse_moments(c, a, b):
    """Closed form for the region c + r (a cos u + b sin u), 0 <= r <= 1."""
    area = math.pi * (a[0] * b[1] - a[1] * b[0])
    second = area / 4 * (np.outer(a, a) + np.outer(b, b)) + area * np.outer(c, c)
    return [area, area * c[0], area * c[1], second[0, 0], second[0, 1], second[1, 1]]


@pytest.mark.parametrize("start", [0.0, 1.3, -5.0])
def test_moments_of_disk_and_ellipse(start):
    disk = CircularArc((2, -1), 1.5, start, start + 2 * math.pi)
    assert disk.area_moments() == pytest.approx(ellipse_moments((2, -1), (1.5, 0), (0, 1.5)), rel=1e-14)
    centred = np.array(disk.area_moments((2, -1)))
    wanted = ellipse_moments((0, 0), (1.5, 0), (0, 1.5))
    assert np.abs(centred - wanted).max() < 1e-14 * wanted[0]
    a, b = np.array([2, 1.0]), np.array([-0.3, 0.4])
    oval = EllipticalArc((1, 3), a, b, start, start + 2 * math.pi)
    assert oval.area_moments() == pytest.approx(ellipse_moments((1, 3), a, b), rel=1e-14)
    assert oval.reverse().area_moments() == pytest.approx(-np.array(ellipse_moments((1, 3), a, b)), rel=1e-14)


def test_moments_of_a_rational_circle_match_far_from_the_origin():
    circle = rational_circle(2.0, (1e3, 2e3))
    local = np.array(circle.area_moments((1e3, 2e3)))
    wanted = np.array(ellipse_moments((0, 0), (2, 0), (0, 2)))
    assert np.abs(local - wanted).max() < 1e-12 * wanted[0]


def test_moments_of_a_parabola_segment():
    loop = [Bezier([(0, 0), (1, 0), (2, 4)]), Line((2, 4), (0, 4)), Line((0, 4), (0, 0))]
    # {0 <= x <= 2, x^2 <= y <= 4}
    wanted = [16 / 3, 4, 64 / 5, 64 / 15, 32 / 3, 256 / 7]
    assert loop_moments(loop) == pytest.approx(wanted, rel=1e-14)


@given(curves, st.floats(-2, 2), st.floats(-2, 2))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_moments_shift_split_and_turn_with_the_curve(curve, ox, oy):
    # closed by a line, the shares belong to a region: they shift by the parallel-axis rule
    if np.hypot(*(curve.end - curve.start)) < 1e-9:
        return
    loop = [curve, Line(curve.end, curve.start)]
    m, s = loop_moments(loop), loop_moments(loop, (ox, oy))
    a, mx, my, xx, xy, yy = m
    shifted = [
        a,
        mx - ox * a,
        my - oy * a,
        xx - 2 * ox * mx + ox * ox * a,
        xy - ox * my - oy * mx + ox * oy * a,
        yy - 2 * oy * my + oy * oy * a,
    ]
    scale = (size(curve) + 4) ** 4
    assert np.abs(s - shifted).max() < 1e-14 * scale
    parts = loop_moments([*curve.split(0.37), loop[1]])
    assert np.abs(parts - m).max() < 1e-14 * scale
    assert np.abs(loop_moments([curve, curve.reverse()])).max() < 1e-14 * scale


def test_moments_count_the_joint_to_a_stored_end():
    gap = 1e-3
    arc = CircularArc((0, 0), 1, 0, math.pi / 2, start=(1 + gap, 0), end=(0, 1 - gap))
    loop = [arc, Line((0, 1 - gap), (0, 0)), Line((0, 0), (1 + gap, 0))]
    assert loop_moments(loop)[0] == pytest.approx(math.pi / 4, rel=1e-14)
    apart = [c.transform(np.eye(2), (10, 20)) for c in loop]
    assert loop_moments(apart)[0] == pytest.approx(math.pi / 4, rel=1e-12)


@given(curves, st.integers(0, 2**32 - 1))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_nearest_points_against_dense_sampling(curve, seed):
    low, high = curve.bounding_box()
    span = high - low + 0.1
    q = low - span + np.random.default_rng(seed).random((40, 2)) * 3 * span
    t, d = curve.closest(q)
    assert ((t >= 0) & (t <= 1)).all()
    assert np.abs(np.hypot(*(curve.point(t) - q).T) - d).max() <= 1e-14 * (size(curve) + span.max())
    dense = curve.point(np.linspace(0, 1, 3001))
    oracle = np.hypot(q[:, None, 0] - dense[:, 0], q[:, None, 1] - dense[:, 1]).min(axis=1)
    assert (d <= oracle + 1e-14 * size(curve)).all()
    # the sampling error of the oracle: half a step along the curve
    step = np.hypot(*np.diff(dense, axis=0).T).max()
    assert (d >= oracle - step).all()


@given(curves)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_points_on_the_curve_are_found(curve):
    t = np.random.default_rng(1).random(30)
    _, d = curve.closest(curve.point(t))
    assert d.max() <= 1e-14 * size(curve)


def test_nearest_points_at_ends_corners_and_centre():
    arc = CircularArc((0, 0), 1, 0, math.pi)
    t, d = arc.closest([(2, -1), (-2, -1), (0, 3), (0, 0)])
    assert t[:3] == pytest.approx([0, 1, 0.5])
    assert d == pytest.approx([math.sqrt(2), math.sqrt(2), 2, 1])
    corner = samples()["polyline"]
    t, d = corner.closest([(2, 0)])
    assert t == pytest.approx([1 / 3], abs=1e-12)
    assert d == pytest.approx([math.sqrt(1.25)])
    t, d = Line((1, 1), (1, 3)).closest([(0, 0), (4, 2), (1, 9)])
    assert t.tolist() == [0, 0.5, 1]
    assert d == pytest.approx([math.sqrt(2), 3, 6])
    assert Line((1, 1), (1, 3)).closest(np.empty((0, 2)))[0].shape == (0,)


def test_uneven_weights_and_speeds():
    lopsided = Bezier([(0, 0), (1, 3), (2, -3), (3, 0)], [1, 1e4, 1, 1e-3])
    q = np.random.default_rng(0).uniform(-1, 4, (50, 2))
    _, d = lopsided.closest(q)
    s = np.linspace(-16, 16, 20001)  # dense where the weights crowd the points
    dense = lopsided.point(1 / (1 + np.exp(-s)))
    oracle = np.hypot(q[:, None, 0] - dense[:, 0], q[:, None, 1] - dense[:, 1]).min(axis=1)
    assert (d <= oracle + 1e-12).all()
    knots = [0, 0, 0, 1e-5, 1, 1, 1]
    uneven = BSpline(2, knots, [(0, 0), (1, 0), (2, 1), (2, 2)])
    assert uneven.length() == pytest.approx(sum(c.length() for c in uneven.split(0.5)), rel=1e-12)
