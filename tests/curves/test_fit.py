"""Bezier fits of point chains."""

import math

import numpy as np
import pytest

from fubini.curves import Bezier, fit_bezier
from fubini.errors import GeometryError, OptionError


def check(fit, points, tolerance):
    """The certificate: error as claimed, joints that meet in data points, smooth but at corners."""
    points = np.asarray(points, float)
    distance = np.min([c.closest(points)[1] for c in fit.curves], axis=0)
    assert distance.max() <= fit.error * (1 + 1e-9) + 1e-15
    assert fit.error <= tolerance
    assert (fit.curves[0].start == points[0]).all()
    assert (fit.curves[-1].end == points[-1]).all()
    corners = points[list(fit.corners)] if fit.corners else np.empty((0, 2))
    closed = (points[0] == points[-1]).all()
    joints = list(zip(fit.curves[:-1], fit.curves[1:])) + ([(fit.curves[-1], fit.curves[0])] if closed else [])
    for a, b in joints:
        assert (a.end == b.start).all()
        assert (points == a.end).all(axis=1).any()
        if not (corners == a.end).all(axis=1).any():
            d, e = a.derivative(1.0), b.derivative(0.0)
            assert abs(d[0] * e[1] - d[1] * e[0]) < 1e-9 * np.hypot(*d) * np.hypot(*e)
            assert d @ e > 0


def test_a_cubic_is_found_again():
    curve = Bezier([(0, 0), (1, 2), (3, 2), (4, 0.5)])
    q = curve.point(np.linspace(0, 1, 60) ** 1.3)
    fit = fit_bezier(q, 1e-10)
    check(fit, q, 1e-10)
    assert len(fit.curves) == 1
    assert np.abs(fit.curves[0].poles - curve.poles).max() < 1e-8


@pytest.mark.parametrize(("tolerance", "most"), [(1e-2, 8), (1e-3, 16), (1e-4, 28)])
def test_a_wave(tolerance, most):
    x = np.linspace(0, 2 * math.pi, 150)
    q = np.stack([x, np.sin(2 * x)], axis=1)
    fit = fit_bezier(q, tolerance)
    check(fit, q, tolerance)
    assert len(fit.curves) <= most
    assert fit.corners == (0, 149)


def test_a_closed_circle_has_no_corner():
    u = np.linspace(0, 2 * math.pi, 200)
    q = np.stack([np.cos(u), np.sin(u)], axis=1)
    q[-1] = q[0]
    fit = fit_bezier(q, 1e-3)
    check(fit, q, 1e-3)
    assert fit.corners == ()
    assert len(fit.curves) <= 8


def test_a_square_with_a_rounded_side():
    u = np.linspace(-math.pi / 2, math.pi / 2, 60)
    side = np.linspace(0, 1, 20)[1:, None]
    q = np.concatenate(
        [
            [(0.0, 0.0)],
            side * (2, 0),
            np.stack([2 + 0.8 * np.cos(u), 1 + np.sin(u)], axis=1)[1:-1],
            [(2.0, 2.0)],
            (2, 2) - side * (2, 0),
            (0, 2) - side * (0, 2),
        ]
    )
    fit = fit_bezier(q, 1e-3)
    check(fit, q, 1e-3)
    # the half ellipse meets the sides smoothly; the other two corners stay, the joint included
    assert {tuple(q[i]) for i in fit.corners} == {(0.0, 0.0), (0.0, 2.0)}
    marked = fit_bezier(q, 1e-3, corners=[0, 19, 78, 97])
    check(marked, q, 1e-3)
    assert set(marked.corners) == {0, 19, 78, 97, len(q) - 1}


def test_corners_alone_give_straight_pieces():
    q = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]
    fit = fit_bezier(q, 1e-9)
    check(fit, q, 1e-9)
    assert len(fit.curves) == 4
    assert fit.curves[0].poles == pytest.approx(np.array([(0, 0), (1 / 3, 0), (2 / 3, 0), (1, 0)]))


def test_repeated_points_and_scales():
    x = np.linspace(0, 3, 40)
    q = np.repeat(np.stack([x, np.cos(x)], axis=1), 2, axis=0)
    for scale in (1e-6, 1.0, 1e6):
        fit = fit_bezier(q * scale, 1e-3 * scale)
        check(fit, q * scale, 1e-3 * scale)
        assert len(fit.curves) == len(fit_bezier(q, 1e-3).curves)
    assert fit.corners == (0, 78)


def test_noise_needs_many_pieces_and_the_budget_holds():
    rng = np.random.default_rng(0)
    q = np.cumsum(rng.normal(size=(80, 2)), axis=0)
    check(fit_bezier(q, 1e-6, corners=[]), q, 1e-6)
    few = fit_bezier(q, 1e-6, corners=[], max_pieces=5)
    assert len(few.curves) == 5
    assert few.error > 1e-6


def test_invalid_input_is_refused():
    q = [(0, 0), (1, 0), (2, 1)]
    for points in ([], [(0, 0)], [(1, 1), (1, 1)], [(0, 0), (1, math.nan)], [(0, 0, 0), (1, 1, 1)]):
        with pytest.raises(GeometryError):
            fit_bezier(points, 0.1)
    for tolerance in (0, -1, math.nan, math.inf):
        with pytest.raises(OptionError, match="tolerance"):
            fit_bezier(q, tolerance)
    with pytest.raises(OptionError, match="corner_angle"):
        fit_bezier(q, 0.1, corner_angle=0)
    with pytest.raises(OptionError, match="corner 3"):
        fit_bezier(q, 0.1, corners=[3])
    with pytest.raises(OptionError, match="max_pieces"):
        fit_bezier(q, 0.1, max_pieces=0)
