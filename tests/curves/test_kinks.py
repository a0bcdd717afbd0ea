"""Kinks inside one spline: found where the tangent turns, and nowhere else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from curves.kinds import rational_circle, samples
from fubini.curves import Bezier, BSpline, Line
from fubini.curves.kinks import WHOLE, Stretch
from fubini.region import Loop, Region
from fubini.region.pieces import cut_curve


def polyline(points, ticks=None):
    """Polyline as one B-spline of degree 1 that passes its points at the given parameters."""
    ticks = np.arange(len(points)) if ticks is None else ticks
    return BSpline(1, [ticks[0], *ticks, ticks[-1]], points)


def turning(degrees, degree=3):
    """Two straight Bezier pieces of one B-spline that make this angle."""
    ways = [(math.cos(a), math.sin(a)) for a in np.radians([30.0, 30.0 + degrees])]
    steps = [np.arange(-degree, 0)[:, None] * ways[0], np.arange(degree + 1)[:, None] * ways[1]]
    return BSpline(degree, [0] * (degree + 1) + [1.5] * degree + [2] * (degree + 1), np.concatenate(steps) + (2.0, 1.0))


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_a_knot_where_the_tangent_turns_parts_the_curve_and_noise_of_an_exporter_does_not(degree):
    for degrees in (2.0, -30.0, 90.0, 179.0, 180.0):
        assert turning(degrees, degree).stretches == ((0.0, 0.75), (0.75, 1.0))
    for degrees in (0.0, 1e-9, 1e-3, 0.1, -0.9):
        assert turning(degrees, degree).stretches == WHOLE


def test_smooth_curves_have_none():
    for name, curve in samples().items():
        assert (curve.stretches == WHOLE) == (name != "polyline"), name
    assert rational_circle().stretches == WHOLE  # double knots at four places, smooth all the same


def test_repeated_points_of_a_polyline_are_one_kink_and_none_at_its_ends():
    points = [(0, 0), (0, 0), (1, 0), (1, 0), (1, 0), (1, 1), (0, 1), (0, 1)]
    curve = polyline(points, np.arange(8.0) / 7.0)
    spans = np.array([(1, 2), (4, 5), (5, 6)]) / 7.0
    np.testing.assert_allclose(np.array(curve.stretches), spans, atol=1e-15)
    np.testing.assert_allclose(np.array(curve.reverse().stretches), 1.0 - spans[::-1, ::-1], atol=1e-15)
    pieces = cut_curve(curve, curve.stretches)
    assert all(isinstance(piece, Line) for piece in pieces)
    assert [piece.start.tolist() for piece in pieces] == [[0, 0], [1, 0], [1, 1]]


def test_a_kink_across_a_piece_that_stands_still_in_rounding_is_one():
    noise = 1e-11 * np.array([(0, 0), (1, -2), (-2, 1), (0, 0)])
    poles = np.concatenate([[(0, 0), (1, 0), (2, 0)], (3, 0) + noise, [(3, 1), (3, 2), (3, 3)]])
    curve = BSpline(3, np.repeat([0, 2, 3, 5], [4, 3, 3, 4]), poles)
    assert curve.stretches == ((0.0, 0.4), (0.6, 1.0))


def test_control_points_that_coincide_at_a_knot_hide_no_kink():
    poles = [(0, 0), (1, 0), (2, 0), (2, 0), (2, 0), (2, 1), (2, 2)]  # the derivative vanishes on both sides
    curve = BSpline(3, [0] * 4 + [1] * 3 + [2] * 4, poles)
    assert curve.stretches == ((0.0, 0.5), (0.5, 1.0))
    straight = BSpline(3, [0] * 4 + [1] * 3 + [2] * 4, [(x + y, 0) for x, y in poles])
    assert straight.stretches == WHOLE


@pytest.mark.parametrize("moved", [0.0, 1e-15, -1e-12, 1e-9])
def test_a_cusp_inside_a_bezier_curve_is_a_kink(moved):
    curve = Bezier([(0, 0), (1 + moved, 1), (-moved, 1), (1, 0)])
    assert np.array(curve.stretches).ravel() == pytest.approx([0, 0.5, 0.5, 1], abs=1e-7)
    region = Region(Loop((*cut_curve(curve, curve.stretches), Line((1, 0), (0, 0)))))
    assert region.corner_angles.min() == pytest.approx(0.0, abs=1e-3)


def test_a_curve_that_stands_still_but_goes_on_has_no_kink():
    assert Bezier([(0, 0), (1, 1), (1, 1), (1, 1), (2, 3)]).stretches == WHOLE
    assert Bezier([(-1, -1), (1, 1), (-1, -1), (1, 1)]).stretches == WHOLE
    assert len(Bezier([(-1, -1), (3, 3), (-3, -3), (1, 1)]).stretches) == 3  # this one goes back, and on again


@pytest.mark.parametrize("curve", [c for c in samples().values() if c.kind == "bspline"])
def test_pieces_meet_and_make_up_the_curve(curve):
    stretches = (Stretch(0.0, 0.3), Stretch(0.3, 0.55), Stretch(0.55, 1.0))
    pieces = cut_curve(curve, stretches)
    ends = [curve.start, curve.point(0.3), curve.point(0.55), curve.end]
    for piece, (a, b), start, end in zip(pieces, stretches, ends, ends[1:]):
        assert (piece.start == start).all()
        assert (piece.end == end).all()
        t = np.linspace(0, 1, 9)
        np.testing.assert_allclose(piece.point(t), curve.point(a + t * (b - a)), atol=1e-13)
