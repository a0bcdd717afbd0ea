"""Polishing and what makes room for it: slides, splits, steps of Newton; no bound is given up for it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fubini.optimise import OptimiseOptions, optimise, smooth
from fubini.optimise import _kernels_polish as kernels
from fubini.quality import aspect_ratios, skewness
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate
from fubini.triangulation.value import LOCKED
from optimise.outlines import arc, boundary, certify, line, meshed, polygon

DISK = [[line((0, 0), (1, 0)), arc((0, 0), 1.0, 0.0, math.pi / 2), line((0, 1), (0, 0))]]
SQUARE = [polygon(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]))]


def corners_of(triangulation):
    """Corners of all triangles (m, 3, 2)."""
    return triangulation.points[triangulation.triangles]


def test_steps_fall_as_the_cost_does():
    """Derivatives of the sum of eighth powers, where none of its terms is small enough to be left out."""
    angle = 2.0 * math.pi / 5 * np.arange(6)
    rx, ry = 1.6 * np.cos(angle), 0.7 * np.sin(angle)
    x, y, scale, e = 0.12, 0.07, math.tan(math.radians(85.0)), 1e-6
    squares = np.zeros(5)

    def cost(x, y):
        return kernels.cost_at.py_func(rx, ry, 5, x, y, scale, squares)[0]

    total, worst, gx, gy, hxx, hxy, hyy = kernels.slopes.py_func(rx - x, ry - y, 5, scale)
    assert total == pytest.approx(cost(x, y), rel=1e-6)
    corners = np.array([[(rx[q], ry[q]), (rx[q + 1], ry[q + 1]), (x, y)] for q in range(5)])
    assert math.sqrt(worst) == pytest.approx(scale / math.tan(math.radians(skewness(corners).min())), rel=1e-9)
    cost(x, y)
    np.testing.assert_allclose(np.sqrt(squares), scale / np.tan(np.radians(skewness(corners))), rtol=1e-9)
    assert gx == pytest.approx((cost(x - e, y) - cost(x + e, y)) / (2 * e), rel=1e-4)
    assert gy == pytest.approx((cost(x, y - e) - cost(x, y + e)) / (2 * e), rel=1e-4)
    assert hxx > 0.0 and hyy > 0.0 and hxx * hyy > hxy * hxy


@pytest.mark.parametrize(("kind", "expected"), [(0, [9, 4, 5, 8]), (1, [9, 4, 5])])
def test_corners_of_triangles_that_fall_short_wait_again(kind, expected, monkeypatch):
    """The second and the last of the triangles around a node that moved, inside or on the boundary; each corner once.

    Frozen nodes never do.
    """
    monkeypatch.setattr(kernels, "wait", kernels.wait.py_func)
    ring = [8, 4, 5, 6, 7] if kind == 0 else [8, 4, 5, 6, 7, 3]

    class State:
        kind, moved, queue = np.zeros(10, np.uint8), np.zeros(10, np.int32), np.zeros(8, np.int32)

    class Work:
        ring, px = None, np.array([0.5, 2.0, 1.0, 0.9, 1.5])

    State.kind[[7, 3]], State.kind[9] = 2, kind
    Work.ring = np.array(ring)
    tail = kernels.wait_again.py_func(State, Work, 9, 5, 0)
    assert State.queue[:tail].tolist() == expected
    assert kernels.wait_again.py_func(State, Work, 9, 5, tail) == tail


@pytest.mark.parametrize("name", ["square", "disk"])
def test_the_worst_triangles_are_raised_and_the_boundary_keeps_its_curves(name):
    start, tracks = meshed({"square": SQUARE, "disk": DISK}[name], 0.07)
    plain, done = (optimise(smooth(start, tracks), tracks, OptimiseOptions(improve=share)) for share in (0.0, 0.1))
    certify(done, start, tracks)
    before, after = (np.sort(skewness(corners_of(outcome.triangulation))) for outcome in (plain, done))
    assert after[0] > 63.5 and after[0] > before[0]
    assert (after < 65.9).sum() < (before < 65.9).sum()
    assert done.moves["slide"] + done.moves["relocation"] > 0


@pytest.mark.parametrize("bounds", [{"min_skew": 58.0}, {"max_aspect_ratio": 1.25}])
def test_polishing_keeps_tighter_bounds(bounds):
    start, tracks = meshed(SQUARE, 0.09)
    start = smooth(start, tracks)
    plain, done = (
        optimise(start, tracks, OptimiseOptions(improve=share, **bounds)).triangulation for share in (0.0, 0.1)
    )
    before, after = (skewness(corners_of(mesh)).min() for mesh in (plain, done))
    assert before > bounds.get("min_skew", 45.0)
    assert after > max(bounds.get("min_skew", 45.0), before - 1e-9)
    assert aspect_ratios(corners_of(done)).max() < bounds.get("max_aspect_ratio", 2.0)


def test_nodes_with_two_triangles_on_a_straight_edge_get_a_third():
    """Rows of squares above one another: right angles at every node of the boundary, whatever moves."""
    made, tracks = boundary(SQUARE, 0.2, LOCKED)
    inside = 0.2 * np.stack(np.meshgrid(np.arange(1, 10), np.arange(1, 10)), -1).reshape(-1, 2)
    start = constrained_delaunay(np.concatenate([made.points, inside]), made)

    def lonely(done):
        degree = np.bincount(done.triangles.ravel())[: len(made.points)]
        return int((degree[made.angle == 180.0] == 2).sum())

    still, done = smooth(start, tracks, rounds=1), smooth(start, tracks)
    assert validate(done) == ()
    assert lonely(still) > 0 and lonely(done) == 0
    np.testing.assert_array_equal(done.boundary.points, made.points)


def test_nodes_slide_where_their_segments_are_free_and_there_alone():
    rng = np.random.default_rng(3)
    inside = 0.1 + 1.8 * rng.random((120, 2))
    for mode in (0, LOCKED):
        made, tracks = boundary(SQUARE, 0.2, mode)
        start = constrained_delaunay(np.concatenate([made.points, inside]), made)
        done = smooth(start, tracks)
        moved = (done.boundary.points != made.points).any(1)
        assert moved.any() == (mode == 0)
        assert not moved[made.angle != 180.0].any()
        again = done.boundary.points
        assert (np.abs(again - 1.0).max(1) == 1.0).all()
        np.testing.assert_array_equal(done.boundary.t[:, 0][moved], done.boundary.t[:, 1][np.roll(moved, -1)])
        assert smooth(start).boundary is made or (smooth(start).boundary.points == made.points).all()
