"""What every curve promises: ends, derivatives, pieces, images, tracks."""

import math

import numpy as np
import pytest
from hypothesis import given, settings

from curves.kinds import curves, rational_circle, samples, size
from fubini import tracks
from fubini.curves import Bezier, BSpline, CircularArc, EllipticalArc, Line, track
from fubini.errors import GeometryError, OptionError

SAMPLES = samples()
T = np.linspace(0, 1, 41)


@pytest.fixture(params=SAMPLES.values(), ids=SAMPLES.keys())
def curve(request):
    return request.param


def smooth(curve, t, h):
    """The parameters further than h from a knot of a B-spline."""
    if isinstance(curve, BSpline):
        t = t[np.abs(t[:, None] - curve.chain.breaks).min(axis=1) > h]
    return t


def test_arrays_are_frozen_copies():
    p = np.array([0.0, 1.0])
    line = Line(p, (1, 2))
    p[0] = 5
    assert line.start[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        line.start[0] = 1


def test_shapes_and_ends(curve):
    assert curve.point(0.3).shape == (2,)
    assert curve.derivative(0.3).shape == curve.second_derivative(0.3).shape == (2,)
    assert curve.point(T).shape == curve.derivative(T).shape == curve.second_derivative(T).shape == (41, 2)
    assert curve.curvature(T).shape == (41,)
    assert isinstance(curve.curvature(0.3), float)
    assert (curve.point(0) == curve.start).all()
    assert (curve.point(T)[[0, -1]] == [curve.start, curve.end]).all()
    assert np.abs(curve.point(T)[7] - curve.point(T[7])).max() <= 1e-15 * size(curve)


def test_stored_ends_come_back_bit_for_bit():
    a, b = (0.1 + 1e-9, 0.7 - 1e-9), (1e-9, -0.3)
    spline = (2, [0, 0, 0, 1, 2, 2, 2], [(0, 0), (1, 1), (2, 0), (3, 0)], None)
    made = [
        CircularArc((0, 0), 1, 0, 1, a, b),
        EllipticalArc((0, 0), (1, 0), (0, 2), 0, 1, a, b),
        Bezier([(0, 0), (1, 1), (2, 0)], start=a, end=b),
        BSpline(*spline, start=a, end=b),
        BSpline.from_domain(*spline, 0.5, 2, start=a, end=b),
    ]
    for c in made:
        r = c.reverse()
        left, right = c.split(0.4)
        assert (c.point([0.0, 1.0]) == [a, b]).all()
        assert (r.point([0.0, 1.0]) == [b, a]).all()
        assert (left.start == c.start).all()
        assert (right.end == c.end).all()
        assert (left.end == right.start).all()
        assert (c.start == c.transform(np.eye(2)).start).all()


def test_closed():
    assert SAMPLES["circle"].is_closed
    assert SAMPLES["mirrored ellipse"].is_closed
    assert rational_circle().is_closed
    assert not SAMPLES["arc"].is_closed


def test_derivatives_agree_with_differences(curve):
    h = 1e-4
    t = smooth(curve, T[1:-1], 2 * h)
    scale = size(curve) * 2e3  # the samples' high derivatives
    for f, g in ((curve.point, curve.derivative), (curve.derivative, curve.second_derivative)):
        difference = (8 * (f(t + h) - f(t - h)) - f(t + 2 * h) + f(t - 2 * h)) / (12 * h)
        assert np.abs(difference - g(t)).max() < scale * 1e-11 + 1e-5 * h * np.abs(g(t)).max()


def test_curvature_of_a_circle():
    arc = SAMPLES["arc"]
    assert np.abs(arc.curvature(T) - 1 / 3).max() < 1e-15
    assert np.abs(arc.reverse().curvature(T) + 1 / 3).max() < 1e-15
    circle = rational_circle(2.0)
    assert np.abs(circle.curvature(T) - 0.5).max() < 1e-13


def test_trim_split_reverse_agree_pointwise(curve):
    t0, t1 = 0.17, 0.83
    piece = curve.trim(t0, t1)
    eps = 4e-15 * size(curve)
    assert type(piece) is type(curve)
    assert np.abs(piece.point(T) - curve.point(t0 + T * (t1 - t0))).max() < eps
    left, right = curve.split(0.4)
    assert (left.end == right.start).all()
    assert np.abs(left.point(T) - curve.point(0.4 * T)).max() < eps
    assert np.abs(right.point(T) - curve.point(0.4 + 0.6 * T)).max() < eps
    assert np.abs(curve.reverse().point(T) - curve.point(1 - T)).max() < eps
    assert np.abs(curve.reverse().reverse().point(T) - curve.point(T)).max() < eps


def test_trim_rejects_what_is_no_piece(curve):
    for t0, t1 in ((0.5, 0.5), (0.6, 0.4), (-0.1, 0.5), (0.5, 1.1), (0, math.nan)):
        with pytest.raises(OptionError, match="trim"):
            curve.trim(t0, t1)


MATRICES = [[[0, -2], [2, 0]], [[1, 0], [0, -1]], [[1, 0.5], [0.2, 3]], [[-1, 2], [1, 0.1]]]


@pytest.mark.parametrize("matrix", MATRICES)
def test_transform_is_the_affine_image(curve, matrix):
    m, o = np.array(matrix, float), np.array([5.0, -7.0])
    image = curve.transform(m, o)
    wanted = curve.point(T) @ m.T + o
    assert np.abs(image.point(T) - wanted).max() < 1e-14 * np.abs(wanted).max()
    moved = image.curvature(T[1:-1])
    if isinstance(curve, CircularArc):
        similar = abs(m[:, 0] @ m[:, 1]) < 1e-12
        assert isinstance(image, CircularArc if similar else EllipticalArc)
        # the side to which a curve bends changes with a mirror image
        assert (np.sign(moved) == np.sign(np.linalg.det(m)) * np.sign(curve.curvature(T[1:-1]))).all()


def test_consecutive_images_meet_bit_for_bit():
    p = (0.1, 0.7)
    a, b = Line((0, 0), p), CircularArc((0.1, 0.2), 0.5, math.pi / 2, 1, start=p)
    m, o = [[0.3, 0.7], [-0.2, 1.1]], (1 / 3, 1e5 / 7)
    assert (a.transform(m, o).end == b.transform(m, o).start).all()


def test_tracks_agree_with_curves():
    builder = tracks.TrackBuilder()
    far = [c.transform(np.eye(2), (1e6, -1e6)) for c in SAMPLES.values()]
    every = [*SAMPLES.values(), *far]
    numbers = [track(builder, c) for c in every]
    table = builder.build()
    t = np.linspace(0, 1, 1001)
    for k, c in zip(numbers, every):
        p = tracks.evaluate(table, k, t)
        assert np.abs(p - c.point(t)).max() <= 1e-15 * size(c)
        assert (p[[0, -1]] == [c.start, c.end]).all()


@given(curves)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_bounding_box_encloses_and_touches(curve):
    low, high = curve.bounding_box()
    p = curve.point(np.linspace(0, 1, 2001))
    slack = 1e-14 * size(curve)
    assert (p >= low - slack).all()
    assert (p <= high + slack).all()
    # tight to second order in the sampling step
    step = np.abs(np.diff(p, axis=0)).max()
    assert (np.abs(p.min(axis=0) - low) <= step).all()
    assert (np.abs(p.max(axis=0) - high) <= step).all()


def test_bounding_box_of_a_circle_is_exact():
    low, high = CircularArc((1, 2), 0.5, 0.3, 0.3 + 2 * math.pi).bounding_box()
    assert np.abs(low - [0.5, 1.5]).max() < 1e-15
    assert np.abs(high - [1.5, 2.5]).max() < 1e-15


def test_invalid_input_is_refused():
    nan, square = math.nan, [(0, 0), (1, 0), (1, 1), (0, 1)]
    for make in (
        lambda: Line((0, 0), (0, 0)),
        lambda: Line((0, nan), (1, 0)),
        lambda: Line((0, 0, 0), (1, 0, 0)),
        lambda: Line("ab", (1, 0)),
        lambda: CircularArc((0, 0), 0, 0, 1),
        lambda: CircularArc((0, 0), -1, 0, 1),
        lambda: CircularArc((0, 0), 1, 1, 1),
        lambda: CircularArc((0, 0), 1, 0, 6.3),
        lambda: CircularArc((0, 0), 1, 0, math.inf),
        lambda: EllipticalArc((0, 0), (1, 2), (2, 4), 0, 1),
        lambda: Bezier([(0, 0)]),
        lambda: Bezier([(1, 1), (1, 1)]),
        lambda: Bezier([(0, 0), (1, 1)], [1, 0]),
        lambda: Bezier([(0, 0), (1, 1)], [1, 1, 1]),
        lambda: BSpline(3, [0, 0, 0, 1, 1, 1], square[:3]),
        lambda: BSpline(2, [0, 0, 0, 2, 1, 3, 3], square),
        lambda: BSpline(1, [0, 0, 1, 1, 2, 2], square),
        lambda: BSpline.from_domain(2, [0, 0, 0, 1, 2, 2, 2], square, None, 1, 3),
    ):
        with pytest.raises(GeometryError):
            make()
    with pytest.raises(OptionError, match="knots"):
        BSpline(2, [0, 0, 0, 1, 1, 1], square)


def test_from_domain_is_the_exact_piece():
    rng = np.random.default_rng(3)
    knots, poles, w = [0, 1, 2, 3, 4, 4.5, 6, 7, 8, 9], rng.random((6, 2)), rng.random(6) + 0.3
    whole = BSpline(3, knots, poles, w)
    low, high = whole.domain
    assert (low, high) == (3, 6)
    for u0, u1 in ((3.2, 5.9), (3, 4.5), (4, 4.2), (3, 6)):
        piece = BSpline.from_domain(3, knots, poles, w, u0, u1)
        t = (u0 + T * (u1 - u0) - low) / (high - low)
        assert np.abs(piece.point(T) - whole.point(t)).max() < 1e-14
        assert piece.domain == pytest.approx((u0, u1), rel=1e-15)


def test_b_spline_against_scipy():
    from scipy.interpolate import BSpline as Reference

    rng = np.random.default_rng(5)
    for degree in (1, 2, 3, 5, 8):
        n = degree + 6
        knots = np.cumsum(rng.random(n + degree + 1))
        w, poles = rng.random(n) + 0.1, rng.random((n, 2))
        u = knots[degree] + T * (knots[n] - knots[degree])
        h = Reference(knots, np.c_[poles * w[:, None], w], degree)(u)
        assert np.abs(BSpline(degree, knots, poles, w).point(T) - h[:, :2] / h[:, 2:]).max() < 1e-14


def test_circle_as_rational_b_spline_equals_the_arc():
    spline, arc = rational_circle(2.0, (1, -3)), CircularArc((1, -3), 2.0, 0, 2 * math.pi)
    p = spline.point(np.linspace(0, 1, 101))
    assert np.abs(np.hypot(*(p - [1, -3]).T) - 2).max() < 2e-15
    assert spline.length() == pytest.approx(arc.length(), rel=1e-13)
    moments = np.array([c.area_moments((0.3, 0.2)) for c in (spline, arc)])
    assert np.abs(moments[0] - moments[1]).max() < 1e-14 * moments.max()
    t = spline.turning_points(0)
    assert t == pytest.approx([0.5], abs=1e-15)
    assert spline.turning_points(1) == pytest.approx([0.25, 0.75], abs=1e-15)
