"""Smoothing: better triangles on the same boundary, a lattice left alone, derivatives right."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fubini.optimise import OptimiseOptions, even_out, smooth
from fubini.optimise import _kernels_degrees as degrees
from fubini.optimise import _kernels_smooth as kernels
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


def test_angles_of_the_region_at_its_nodes():
    """A square with a notch: right angles outside, one of 270 degrees inside, straight elsewhere."""
    made, _ = boundary([polygon(np.array([(0, 0), (2, 0), (2, 2), (1, 2), (1, 1), (0, 1)], float))], 0.5)
    start = constrained_delaunay(made.points, made)
    sides = np.zeros((len(made.points), 4))
    degrees.boundary_sides.py_func(start.points, start.triangles, start.neighbours, len(start.triangles), sides)
    angles = [[degrees.angle_at.py_func(sides, v) for v in range(len(sides))] for _ in range(2)]
    np.testing.assert_allclose(np.degrees(angles), [made.angle, made.angle], atol=1e-9)
    assert {90, 180, 270} == set(made.angle.round().astype(int).tolist())


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


@pytest.mark.parametrize(("x", "y"), [(0.1, 0.05), (-0.3, 0.2), (0.5, -0.25)])
def test_steps_lead_downhill_and_vanish_at_the_bottom(x, y):
    ring = hexagon(0.0, 0.0)[[0, 1, 2, 3, 4, 5, 0]]
    ring[[0, 6]] *= 1.4  # no symmetry
    star = ring[:, 0].copy(), ring[:, 1].copy(), 6

    def step(x, y):
        total, gx, gy, hxx, hxy, hyy = kernels.slopes.py_func(*star, x, y)
        return total, (gx, gy), np.linalg.solve([[hxx, hxy], [hxy, hyy]], (gx, gy))

    def cost(x, y):
        return kernels.star_cost.py_func(*star, x, y)

    total, fall, _ = step(x, y)
    assert total == pytest.approx(cost(x, y), rel=1e-12)
    e = 1e-6
    gx = (cost(x + e, y) - cost(x - e, y)) / (2 * e)
    gy = (cost(x, y + e) - cost(x, y - e)) / (2 * e)
    assert fall == pytest.approx((-gx, -gy), rel=1e-6)
    for _ in range(60):  # to the bottom by these steps alone, damped
        _, fall, (dx, dy) = step(x, y)
        assert fall[0] * dx + fall[1] * dy >= 0.0
        x, y = x + 0.5 * dx, y + 0.5 * dy
    assert np.hypot(*fall) < 1e-6
    here = cost(x, y)
    for k in range(8):
        assert cost(x + 1e-3 * math.cos(k), y + 1e-3 * math.sin(k)) > here


@pytest.mark.parametrize("seed", range(3))
def test_neighbours_are_evened_out(seed):
    rng = np.random.default_rng(seed)
    coarse = smooth(triangulated(0.05, 0.03 + 0.94 * rng.random((330, 2))))
    done = even_out(coarse, OptimiseOptions(growth=1.35))
    before, after = (growth_rates(t.points, t.triangles) for t in (coarse, done))
    assert (before > 1.35).sum() > 2 * (after > 1.35).sum()
    assert after.max() <= before.max()
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
