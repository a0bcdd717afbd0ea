"""Turning points, graph pieces, limit functions, crossings."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from curves.kinds import arcs, curves, rational_circle, samples, size, splines
from fubini.curves import Bezier, BSpline, CircularArc, EllipticalArc, Line
from fubini.errors import GeometryError, OptionError

axes = st.sampled_from([0, 1])


def towards_ends(low, high):
    """Values between two ends: even ones, and a crowd towards both, where tangents may be vertical."""
    small = np.geomspace(1e-16, 0.4, 40)
    s = np.concatenate([[0.0], np.linspace(0.01, 0.99, 25), small, 1 - small, [1.0]])
    return np.clip(np.unique(low + s * (high - low)), low, high)


def natural_distance(curve, t, points):
    """Distance of points from the curve's own position at t, stored ends left aside."""
    return np.hypot(*(curve._point(t) - points).T)


@given(curves, axes)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_limit_functions_are_backward_exact(curve, axis):
    scale = size(curve)
    pieces = curve.graph_pieces(axis)
    assert (pieces[0].start == curve.start).all()
    assert (pieces[-1].end == curve.end).all()
    for a, b in itertools.pairwise(pieces):
        assert (a.end == b.start).all()
    for piece in pieces:
        if piece.is_constant(axis, 1e-14 * scale):
            continue
        f = piece.limit(axis)
        a, b = f.domain
        x = towards_ends(a, b)
        y, t = f(x), f.parameter(x)
        for end in (piece.start, piece.end):
            assert f(end[axis]) == end[1 - axis]
        p = np.stack([x, y] if axis == 0 else [y, x], axis=1)
        assert natural_distance(piece, t, p).max() <= 1e-13 * scale
        assert piece.closest(p)[1].max() <= 1e-13 * scale
        # the right branch throughout: values that can be told apart have parameters in order
        apart = t[np.concatenate([[True], np.diff(x) > 1e-9 * (b - a)])]
        rising = piece.start[axis] < piece.end[axis]
        assert (np.diff(apart if rising else apart[::-1]) > 0).all()


@given(curves, axes, st.sampled_from([1e-6, 1e6]), st.sampled_from([0.0, 1e6]))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_limit_functions_at_other_scales(curve, axis, scale, offset):
    curve = curve.transform(scale * np.eye(2), (offset, -offset))
    for piece in curve.graph_pieces(axis):
        if piece.is_constant(axis, 1e-14 * size(curve)):
            continue
        f = piece.limit(axis)
        x = towards_ends(*f.domain)
        y = f(x)
        p = np.stack([x, y] if axis == 0 else [y, x], axis=1)
        assert natural_distance(piece, f.parameter(x), p).max() <= 1e-13 * size(curve)
        for end in (piece.start, piece.end):
            assert f(end[axis]) == end[1 - axis]


def test_limit_function_of_a_half_circle():
    upper = CircularArc((2, 1), 1.5, math.pi, 0).limit(0)
    x = np.linspace(*upper.domain, 101)
    assert upper(2.0) == 2.5
    assert np.abs(upper(x) - 1 - np.sqrt(np.maximum(2.25 - (x - 2) ** 2, 0))).max() < 1e-7
    assert upper.derivative(2.0) == pytest.approx(0, abs=1e-15)
    assert upper.derivative(2 + 1.5 * math.sqrt(0.5)) == pytest.approx(-1, rel=1e-14)
    # outside the domain: clipped
    assert upper(-9.0) == upper(upper.domain[0])
    assert upper.parameter(np.array([-9.0, 9.0])).tolist() == [0, 1]


def test_slope_is_infinite_at_a_vertical_tangent():
    f = Bezier([(0, 0), (0, 1), (1, 1)]).limit(0)
    assert f.derivative(0.0) == math.inf
    assert f(0.25) == pytest.approx(0.75, rel=1e-15)
    assert f.derivative(0.25) == pytest.approx(1, rel=1e-14)


def test_slopes_agree_with_differences():
    for curve in samples().values():
        for piece in curve.graph_pieces(0):
            if piece.is_constant(0, 1e-12):
                continue
            f = piece.limit(0)
            a, b = f.domain
            x = a + (b - a) * np.array([0.31, 0.52, 0.73])
            h = 1e-5 * (b - a)
            assert (f(x + h) - f(x - h)) / (2 * h) == pytest.approx(f.derivative(x), rel=1e-3, abs=1e-6)


def test_limit_refuses_what_is_no_function():
    with pytest.raises(GeometryError, match="turns back"):
        CircularArc((0, 0), 1, 0.5, 4).limit(0)
    with pytest.raises(GeometryError, match="same coordinate"):
        CircularArc((0, 0), 1, 0, 2 * math.pi).limit(0)
    with pytest.raises(GeometryError, match="same coordinate"):
        Line((1, 0), (1, 5)).limit(0)
    with pytest.raises(OptionError, match="axis"):
        Line((1, 0), (1, 5)).limit(2)


@given(curves, axes)
@settings(max_examples=150, deadline=None, derandomize=True)
def test_turning_points_against_dense_sampling(curve, axis):
    t = curve.turning_points(axis)
    assert ((t > 0) & (t < 1)).all()
    assert (np.diff(t) > 0).all()
    # between consecutive turns the coordinate is monotone, and it turns at each
    cuts = np.concatenate([[0.0], t, [1.0]])
    slack = 1e-14 * size(curve)
    way = []
    for a, b in itertools.pairwise(cuts):
        x = curve._point(a + (b - a) * np.linspace(0, 1, 301))[:, axis]
        way.append(np.sign(x[-1] - x[0]))
        assert (way[-1] * np.diff(x) >= -slack).all()
    assert all(u == -v for u, v in itertools.pairwise(way))


def test_turning_points_of_arcs_are_the_extremes():
    arc = CircularArc((0, 0), 1, -0.1, 7 * math.pi / 4)
    u = -0.1 + arc.turning_points(0) * (7 * math.pi / 4 + 0.1)
    assert u == pytest.approx([0, math.pi], abs=1e-15)
    assert len(CircularArc((0, 0), 1, 0, math.pi).turning_points(0)) == 0
    # an arc that ends a rounding error beyond its extreme does not turn
    assert len(CircularArc((0, 0), 1, -1e-9, math.pi + 1e-9).turning_points(0)) == 0
    assert len(CircularArc((0, 0), 1, -1e-6, math.pi + 1e-6).turning_points(0)) == 2


def test_turning_point_at_a_corner_and_at_a_knot():
    zigzag = BSpline(1, [0, 0, 1, 2, 3, 3], [(0, 0), (1, 0.5), (0, 2), (3, 1)])
    assert zigzag.turning_points(0) == pytest.approx([1 / 3, 2 / 3])
    assert zigzag.turning_points(1) == pytest.approx([2 / 3])
    assert rational_circle().turning_points(1) == pytest.approx([0.25, 0.75])


def test_an_inflection_is_no_turn():
    flat = Bezier([(0, 0), (1, 1), (1, 2), (2, 3)])  # dx/dt touches no zero
    assert len(flat.turning_points(0)) == 0
    touching = Bezier([(0, 0), (1, 1), (0, 2), (1, 3)])  # dx/dt = 3 (2t - 1)^2
    assert len(touching.turning_points(0)) == 0
    f = touching.limit(0)
    assert abs(touching.point(f.parameter(0.5))[0] - 0.5) < 1e-15


def test_vertical_stretches_become_pieces_of_their_own():
    curve = samples()["polyline"]
    pieces = curve.graph_pieces(0)
    assert [p.is_constant(0, 1e-12) for p in pieces] == [False, True, False]
    assert not any(p.is_constant(1, 1e-12) for p in pieces)
    vertical = Line((1, 0), (1 + 1e-13, 5))
    assert vertical.is_constant(0, 1e-12)
    assert not vertical.is_constant(1, 1e-12)


def test_a_turned_straight_spline_has_no_false_turns():
    # straight cubics in all directions, their control points rounded: nothing may wiggle
    for k in range(1, 40):
        c, s = math.cos(k * math.pi / 40), math.sin(k * math.pi / 40)
        base = Bezier([(x, 0) for x in (0, 0.3, 0.7, 1)]).transform([[c, -s], [s, c]], (1e3, -1e3))
        back = base.transform([[c, s], [-s, c]])
        assert len(back.turning_points(0)) == 0
        assert len(back.turning_points(1)) == 0
        assert back.is_constant(1, 1e-12)


@given(arcs(), axes)
@settings(max_examples=40, deadline=None, derandomize=True)
def test_reversed_and_mirrored_arcs_have_the_same_limits(curve, axis):
    mirror = np.diag([1.0, -1.0])
    pieces = curve.graph_pieces(axis)
    mirrored = curve.transform(mirror).transform(mirror).graph_pieces(axis)
    for others in (curve.reverse().graph_pieces(axis)[::-1], mirrored):
        assert len(others) == len(pieces)
        for piece, twin in zip(pieces, others):
            if piece.is_constant(axis, 1e-9):
                continue
            f, g = piece.limit(axis), twin.limit(axis)
            x = np.linspace(*f.domain, 20)[3:-3]
            slope = 1 + np.abs(f.derivative(x)).max()
            assert np.abs(f(x) - g(x)).max() <= 1e-14 * size(curve) * slope


@given(splines())
@settings(max_examples=30, deadline=None, derandomize=True)
def test_thin_ellipse_and_spline_constants(curve):
    squeezed = curve.transform([[1, 0], [0, 1e-15]])
    assert squeezed.is_constant(1, 1e-13)


def test_thin_ellipse():
    thin = EllipticalArc((0, 0), (1, 0), (0, 1e-6), 0, math.pi)
    f = thin.limit(0)
    x = towards_ends(*f.domain)
    assert np.abs(f(x) - 1e-6 * np.sqrt(np.maximum(1 - x * x, 0))).max() < 2e-14
