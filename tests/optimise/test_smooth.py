"""Smoothing: better triangles on the same boundary, a lattice left alone, derivatives right."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fubini.optimise import OptimiseOptions, even_out, smooth
from fubini.optimise import _kernels_degrees as degrees
from fubini.optimise import _kernels_pull as pulling
from fubini.optimise import _kernels_smooth as kernels
from fubini.optimise._kernels_state import LANE_NUMBERS, LANES
from fubini.quality import areas, aspect_ratios, flawed, growth_rates, skewness
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate
from fubini.triangulation.value import FROZEN, LOCKED, Boundary, Triangulation
from optimise.outlines import boundary, polygon

CORNERS = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
SQUARE = [polygon(CORNERS)]


def triangulated(h, inside):
    made, _ = boundary(SQUARE, h)
    return constrained_delaunay(np.concatenate([made.points, inside]), made)


@pytest.mark.parametrize("seed", range(3))
def test_random_points_become_a_good_mesh(seed):
    rng = np.random.default_rng(seed)
    start = triangulated(0.05, 0.03 + 0.94 * rng.random((330, 2)))
    done = smooth(start, rounds=12)
    assert validate(done, delaunay=True) == ()
    assert len(start.triangles) <= len(done.triangles) < 1.05 * len(start.triangles)
    n = len(start.boundary.points)
    np.testing.assert_array_equal(done.points[:n], start.points[:n])
    before, after = (t.points[t.triangles] for t in (start, done))
    assert areas(after).min() > 0.0
    assert areas(after).sum() == pytest.approx(1.0, abs=1e-12)
    assert skewness(after).mean() > skewness(before).mean() + 10.0
    assert skewness(after).min() > skewness(before).min() + 10.0
    assert aspect_ratios(after).mean() < 1.2 < aspect_ratios(before).mean()


def test_the_same_input_gives_the_same_mesh():
    start = triangulated(0.1, 0.03 + 0.94 * np.random.default_rng(5).random((80, 2)))
    a, b = smooth(start), smooth(start)
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.triangles, b.triangles)


def test_nothing_to_move():
    start = triangulated(0.5, np.empty((0, 2)))
    assert smooth(start) is start


def hexagon(x, y):
    """Six corners on the unit circle and a centre at (x, y)."""
    a = math.pi / 3 * np.arange(6)
    return np.array([*np.column_stack([np.cos(a), np.sin(a)]), (x, y)])


def smoothed(points, rounds):
    """The centre after so many rounds, its neighbours held fast, and whether anything changed."""
    i = np.arange(6)
    made = Boundary(
        points[:6], np.full(6, FROZEN, np.uint8), np.ones(6), np.full(6, 120.0),
        np.column_stack([i, np.roll(i, -1)]).astype(np.int32), np.full(6, -1, np.int32), np.zeros((6, 2)),
        np.full(6, LOCKED, np.uint8),
    )  # fmt: skip
    triangles = np.column_stack([np.full(6, 6), i, np.roll(i, -1)]).astype(np.int32)
    neighbours = np.column_stack([-1 - i, np.roll(i, -1), np.roll(i, 1)]).astype(np.int32)
    start = Triangulation(points, triangles, neighbours, made)
    done = smooth(start, rounds=rounds)
    return done.points[6], done is not start


def test_the_centre_of_a_hexagon_is_found():
    place, moved = smoothed(hexagon(0.3, -0.2), rounds=6)
    assert moved
    np.testing.assert_allclose(place, 0.0, atol=2e-2)
    place, moved = smoothed(hexagon(0.0, 0.0), rounds=6)
    assert not moved
    assert (place == 0.0).all()


def test_a_node_on_the_wrong_side_stays():
    place, moved = smoothed(hexagon(1.5, 0.0), rounds=1)
    assert not moved
    np.testing.assert_array_equal(place, (1.5, 0.0))


def lattice_square():
    """A square whose inside is a perfect lattice, but beside its sides."""
    h, (i, j) = 0.04, np.mgrid[-40:40, -40:40]
    inside = h * np.column_stack([(i + 0.5 * j).ravel(), (math.sqrt(0.75) * j).ravel()]) + 0.5
    inside = inside[(inside > 0.6 * h).all(1) & (inside < 1.0 - 0.6 * h).all(1)]
    return triangulated(h, inside), inside, h


def test_only_what_is_not_good_moves_and_what_is_beside_it():
    start, inside, h = lattice_square()
    n = len(start.boundary.points)
    deep = (inside > 6.0 * h).all(1) & (inside < 1.0 - 6.0 * h).all(1)
    done = smooth(start)
    still = (done.points[n:][: len(inside)] == inside).all(1)
    assert still[deep].all()
    assert (~still).sum() > 0.5 * n
    points = start.points.copy()
    v = n + int(np.argmin(((inside - 0.5) ** 2).sum(1)))
    points[v] += (0.3 * h, 0.2 * h)
    mended = smooth(replace(start, points=points))
    assert np.hypot(*(mended.points[v] - start.points[v])) < 0.05 * h
    near = np.hypot(*(inside - inside[v - n]).T) < 4.0 * h
    np.testing.assert_array_equal(mended.points[n:][: len(inside)][deep & ~near], inside[deep & ~near])


def test_a_scaled_square_gives_the_scaled_mesh():
    start, inside, _ = lattice_square()
    made, _ = boundary([polygon(64.0 * CORNERS)], 64.0 * 0.04)
    scaled = constrained_delaunay(np.concatenate([made.points, 64.0 * inside]), made)
    a, b = smooth(start), smooth(scaled)
    np.testing.assert_array_equal(64.0 * a.points, b.points)
    np.testing.assert_array_equal(a.triangles, b.triangles)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_angles_by_a_polynomial(scale):
    turns = np.linspace(0.0, 2.0 * math.pi, 721)[1:]
    for first in np.linspace(0.0, 6.0, 7):
        found = [
            degrees.angle_between.py_func(
                scale * math.cos(first), scale * math.sin(first), 2.0 * math.cos(first + a), 2.0 * math.sin(first + a)
            )
            for a in turns[:-1]
        ]
        np.testing.assert_allclose(found, turns[:-1], atol=2e-5)
    assert degrees.angle_between.py_func(1.0, 0.0, 3.0, 0.0) == pytest.approx(2.0 * math.pi)
    assert degrees.angle_between.py_func(0.0, 0.0, 0.0, 0.0) == pytest.approx(2.0 * math.pi)


@pytest.mark.parametrize("seed", range(3))
def test_flips_and_splits_even_out_the_triangles_at_nodes(seed):
    """Two rounds with such flips and splits in between, and two rounds without."""
    start = triangulated(0.05, 0.03 + 0.94 * np.random.default_rng(seed).random((330, 2)))

    def misfit(done):
        angle = np.full(len(done.points), 360.0)
        angle[: len(start.boundary.points)] = start.boundary.angle
        return np.abs(angle / np.bincount(done.triangles.ravel()) - 60.0).sum()

    apart, together = smooth(smooth(start, rounds=1), rounds=1), smooth(start, rounds=2)
    assert misfit(together) < misfit(apart) - 50.0
    assert skewness(together.points[together.triangles]).mean() > skewness(apart.points[apart.triangles]).mean()
    assert validate(together, delaunay=True) == ()


def cost_of(points, triangles):
    """Sum of the costs of triangles."""
    corners = points[triangles]
    d = (np.square(corners - np.roll(corners, 1, axis=1)).sum((1, 2)) / (4.0 * math.sqrt(3.0))) / areas(corners) - 1.0
    return float((np.sqrt(d + pulling.NEAR) + pulling.FAR * d**4).sum())


@pytest.fixture
def in_python(monkeypatch):
    """The functions that pulls are worked out with, not compiled."""
    for name in ("load_sides", "work_out", "bend"):
        monkeypatch.setattr(pulling, name, getattr(pulling, name).py_func)
    monkeypatch.setattr(pulling, "math", SimpleNamespace(sqrt=np.sqrt, inf=math.inf))  # nan of what is negative


def sums_of(points, triangles, active):
    """The sums (n, 6) of all nodes by these triangles, and whether none is upside down."""
    sums = np.zeros(6 * len(points))
    with np.errstate(invalid="ignore"):  # of triangles that are upside down
        valid = pulling.pull.py_func(points, triangles, active, len(active), sums, np.empty(LANE_NUMBERS))
    return sums.reshape(-1, 6), valid


def test_pulls_worked_out_together_are_those_of_one_triangle_after_the_other(in_python):
    """Of more triangles than are taken at a time, one of them upside down: its corners are to stay."""
    start = triangulated(0.15, 0.03 + 0.94 * np.random.default_rng(4).random((40, 2)))
    triangles = np.array(start.triangles)
    triangles[LANES + 3] = triangles[LANES + 3, ::-1]
    together, valid = sums_of(start.points, triangles, np.arange(len(triangles)))
    assert not valid
    assert len(triangles) % LANES and len(triangles) > 2 * LANES
    apart = sum(sums_of(start.points, triangles, np.array([t]))[0] for t in range(len(triangles)))
    assert np.flatnonzero(np.isinf(together[:, 2])).tolist() == sorted(triangles[LANES + 3].tolist())
    np.testing.assert_allclose(together, apart, rtol=1e-9)


@pytest.mark.parametrize(("x", "y"), [(0.1, 0.05), (-0.3, 0.2), (0.5, -0.25)])
def test_pulls_are_the_fall_of_the_cost(x, y, in_python):
    """At all nodes of a lopsided hexagon; the steps of its centre by them lead to the bottom."""
    points = np.concatenate([hexagon(0.0, 0.0)[:6], [(x, y)]])
    points[0] *= 1.4  # no symmetry
    triangles = np.array([(6, k, (k + 1) % 6) for k in range(6)], np.int32)

    def pulls():
        sums, valid = sums_of(points, triangles, np.arange(6))
        assert valid
        return sums

    e, found = 1e-6, pulls()
    for v in range(7):
        for axis in range(2):
            points[v, axis] += e
            ahead = cost_of(points, triangles)
            points[v, axis] -= 2.0 * e
            behind = cost_of(points, triangles)
            points[v, axis] += e
            assert found[v, axis] == pytest.approx((behind - ahead) / (2.0 * e), rel=1e-5, abs=1e-5)
    for _ in range(60):
        gx, gy, h, hxx, hxy, hyy = pulls()[6]
        step = np.linalg.solve([[hxx + h, hxy], [hxy, hyy + h]], (gx, gy))
        assert gx * step[0] + gy * step[1] >= 0.0
        points[6] += 0.7 * step
    assert np.hypot(gx, gy) < 1e-6
    here = cost_of(points, triangles)
    for k in range(8):
        aside = points.copy()
        aside[6] += 1e-3 * math.cos(k), 1e-3 * math.sin(k)
        assert cost_of(aside, triangles) > here


def test_what_turned_over_is_put_back(monkeypatch):
    """Two nodes of a square lattice thrown across their triangles by a wrong step; the others keep theirs."""
    start = triangulated(0.1, 0.03 + 0.94 * np.random.default_rng(8).random((80, 2)))
    n = len(start.boundary.points)
    points, was = start.points.copy(), np.zeros((len(start.points), 3))
    was[:, :2] = points
    points[[n, n + 9]] += 0.4
    points[n + 4] += 1e-4

    class Fake:
        tri, t = start.triangles, start.boundary.t

    Fake.points = points
    rim, active = np.zeros((n, 4), np.int32), np.arange(len(start.triangles))
    while kernels.put_back.py_func(Fake, active, len(active), rim, was.ravel()):
        pass
    assert areas(points[start.triangles]).min() > 0.0
    np.testing.assert_array_equal(points[[n, n + 9]], start.points[[n, n + 9]])
    assert (points[n + 4] != start.points[n + 4]).all()


@pytest.mark.parametrize("seed", range(3))
def test_neighbours_are_evened_out(seed):
    rng = np.random.default_rng(seed)
    coarse = smooth(triangulated(0.05, 0.03 + 0.94 * rng.random((330, 2))))
    done = even_out(coarse, OptimiseOptions(growth=1.35))
    before, after = (growth_rates(t.points, t.triangles) for t in (coarse, done))
    assert (before > 1.35).sum() > 2 * (after > 1.35).sum()
    assert after.max() <= 1.01 * before.max()  # it is the sum of squares that falls
    assert np.maximum(after - 1.35, 0.0).sum() < 0.5 * np.maximum(before - 1.35, 0.0).sum()
    assert validate(done) == ()
    np.testing.assert_array_equal(done.triangles, coarse.triangles)
    worst = [skewness(t.points[t.triangles]).min() for t in (coarse, done)]
    assert worst[1] >= min(50.0, worst[0])
    assert even_out(done, OptimiseOptions(growth=3.0)) is done


@pytest.mark.parametrize("bounds", [{"min_skew": 58.0}, {"max_aspect_ratio": 1.3}])
def test_evening_out_keeps_the_bounds(bounds):
    coarse = smooth(triangulated(0.05, 0.03 + 0.94 * np.random.default_rng(1).random((330, 2))))
    options = OptimiseOptions(growth=1.3, **bounds)
    done = even_out(coarse, options)
    assert done is not coarse
    before, after = (t.points[t.triangles] for t in (coarse, done))
    bad = flawed(after, options.min_skew, options.max_aspect_ratio)
    assert (skewness(after)[bad] >= skewness(before)[bad] - 1e-9).all()
    assert bad.sum() <= flawed(before, options.min_skew, options.max_aspect_ratio).sum()
