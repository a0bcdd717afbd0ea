"""Curves, outlines and nesting of drawings: exact under affine maps, and independent of order and direction."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from fubini.cad.drawing import Affine, Ellipse, Line, bezier, bspline, bulge_arc, ellipse, matching, periodic_bspline
from fubini.cad.loops import find_outlines
from fubini.cad.nesting import faces_even_odd
from fubini.errors import GeometryError

number = st.floats(-3, 3)
vector = st.builds(complex, number, number)


@given(vector, vector, vector, st.floats(-6, 6), st.floats(-6.2, 6.2), vector, vector)
def test_an_affine_image_of_an_arc_is_the_arc_through_the_images(p, q, centre, first, sweep, a, b):
    area, scale = abs((p.conjugate() * q).imag), max(abs(p), abs(q))
    stretch = abs(abs(a) ** 2 - abs(b) ** 2)
    if area < 1e-2 * scale**2 or area < 1e-3 or stretch < 1e-2 or abs(sweep) < 1e-3:
        return
    arc, f = ellipse(centre, p, q, first, sweep), Affine(a, b, 1 - 2j)
    t = np.linspace(first, first + sweep, 9)
    given_points = centre + p * np.cos(t) + q * np.sin(t)
    assert abs(arc.at(np.linspace(arc.first, arc.first + arc.sweep, 9)) - given_points).max() < 1e-9
    image = arc.affine(f)
    assert abs(image.ratio) <= 1
    places = image.at(np.linspace(image.first, image.first + image.sweep, 9))
    assert abs(places - f(given_points)).max() < 1e-8 * (1 + abs(f(given_points)).max())


def test_a_turned_circle_stays_one():
    circle = ellipse(1 + 2j, 3, 3j, 0.5, 2 * math.pi)
    assert circle.closed
    assert circle.start == circle.end
    assert circle.affine(Affine(0, 2j, 1)).kind == "circle"
    assert circle.affine(Affine(1, 0.5, 0)).kind == "ellipse"


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
@pytest.mark.parametrize("rational", [False, True])
def test_an_unclamped_spline_is_clamped_without_a_change(degree, rational):
    rng = np.random.default_rng(degree)
    poles = rng.random(9) + 1j * rng.random(9)
    weights = 0.5 + rng.random(9) if rational else None
    knots = np.sort(rng.random(9 + degree + 1))
    spline = bspline(degree, knots, poles, weights)
    t = np.linspace(knots[degree], knots[9], 40)
    w = np.ones(9) if weights is None else weights
    expected = BSpline(knots, poles * w, degree)(t) / BSpline(knots, w, degree)(t)
    assert abs(spline.at(t) - expected).max() < 1e-13
    assert abs(spline.points()[[0, -1]] - expected[[0, -1]]).max() < 1e-13
    assert (spline.start, spline.end) == (spline.points()[0], spline.points()[-1])


def test_a_periodic_spline_closes_smoothly():
    poles = np.exp(2j * np.pi * np.arange(6) / 6)
    spline = periodic_bspline(3, np.arange(7.0), poles)
    assert spline.start == pytest.approx(spline.end)
    a, b = spline.at([1e-6, 6 - 1e-6]) - spline.start
    assert abs(a + b) < 1e-9
    # a sixth of a turn takes the curve into itself
    turned = spline.at(np.linspace(0, 5, 50)) * np.exp(2j * np.pi / 6)
    assert abs(turned - spline.at(np.linspace(1, 6, 50))).max() < 1e-14


@pytest.mark.parametrize("bad", [(2, [0, 0, 1, 1], [0, 1, 2], None), (1, [0, 0, 1, 1], [0, 1], [1, -1])])
def test_a_spline_whose_parts_do_not_fit_is_refused(bad):
    with pytest.raises(ValueError, match=r"spline|weight"):
        bspline(*bad)


@given(st.floats(-4, 4).filter(lambda b: abs(b) > 1e-3))
def test_a_bulge_is_the_tangent_of_a_quarter_of_the_angle(bulge):
    arc = bulge_arc(1 + 1j, 4 + 5j, bulge)
    assert isinstance(arc, Ellipse)
    assert (arc.start, arc.end) == (pytest.approx(1 + 1j, abs=1e-9), pytest.approx(4 + 5j, abs=1e-9))
    # the arrow of the arc over half of its chord, on the right of the chord when positive
    middle = arc.at(arc.first + arc.sweep / 2) - (2.5 + 3j)
    assert middle == pytest.approx(-1j * bulge * (3 + 4j) / 2, abs=1e-9)


def test_matching_brings_every_kind_to_new_ends():
    for curve in (bulge_arc(0, 2, 0.3), bezier(0, 1 + 1j, 2), ellipse(1, 1, 0.5j, math.pi, math.pi)):
        moved = matching(curve, curve.start + 1e-6j, curve.end + 1e-6)
        assert moved.kind == curve.kind
        assert abs(moved.start - curve.start - 1e-6j) + abs(moved.end - curve.end - 1e-6) < 1e-14
        assert abs(moved.points() - curve.points()).max() < 3e-6


def plate_and_holes():
    """A plate of four lines with two round holes, one of them of two arcs, and a pin in the other."""
    lines = [Line(a, b) for a, b in ((0, 10), (10, 10 + 6j), (10 + 6j, 6j), (6j, 0))]
    hole = ellipse(3 + 3j, 1, 1j, 0, 2 * math.pi)
    pin = ellipse(3 + 3j, 0.5, 0.5j, 0, 2 * math.pi)
    return [*lines, hole, pin, bulge_arc(6 + 3j, 8 + 3j, 1), bulge_arc(8 + 3j, 6 + 3j, 1)]


@given(st.permutations(range(8)), st.lists(st.booleans(), min_size=8, max_size=8))
@settings(max_examples=30, deadline=None)
def test_order_and_direction_of_the_curves_do_not_matter(order, turned):
    curves = plate_and_holes()

    def run(k):
        c = curves[k]
        if not turned[k]:
            return c
        if isinstance(c, Line):
            return Line(c.end, c.start)
        return ellipse(c.centre, c.axis, 1j * c.ratio * c.axis, c.first + c.sweep, -c.sweep)

    drawing = find_outlines([run(k) for k in order], 1e-5)
    assert len(drawing.groups) == 4
    faces = sorted(faces_even_odd(drawing.groups), key=lambda f: f.outer.area)
    assert [len(f.holes) for f in faces] == [0, 2]
    area = [f.outer.area + sum(h.area for h in f.holes) for f in faces]
    assert area == pytest.approx([math.pi / 4, 60 - 2 * math.pi], rel=2e-3)  # of the polygons
    for face in faces:
        assert face.outer.area > 0
        assert all(h.area < 0 for h in face.holes)


def test_a_figure_of_eight_falls_into_two_outlines_at_its_crossing():
    lines = [Line(0, 1 + 1j), Line(1 + 1j, 2 + 2j), Line(2 + 2j, 2j), Line(2j, 1 + 1j)]
    lines += [Line(1 + 1j, 2), Line(2, 0)]
    (group,) = find_outlines(lines, 1e-6).groups
    assert sorted(c.area for c in group.cells) == pytest.approx([1, 1])


def test_an_open_end_is_an_error_and_a_bridge_is_not():
    square = [Line(a, b) for a, b in ((0, 1), (1, 1 + 1j), (1 + 1j, 1j), (1j, 0))]
    inner = [Line(a, b) for a, b in ((0.4 + 0.4j, 0.6 + 0.4j), (0.6 + 0.4j, 0.5 + 0.6j), (0.5 + 0.6j, 0.4 + 0.4j))]
    drawing = find_outlines([*square, *inner, Line(0, 0.4 + 0.4j)], 1e-6)
    assert [len(g.cells) for g in drawing.groups] == [1, 1]
    assert "bound no area" in drawing.notes[0]
    with pytest.raises(GeometryError, match="meets nothing"):
        find_outlines([*square, Line(0, 0.4 + 0.4j)], 1e-6)
