"""The moves one by one on small meshes, and the closed valid region against sampling."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fubini._jit import kernel
from fubini.errors import OptionError
from fubini.optimise import OptimiseOptions, optimise
from fubini.optimise._kernels_region import region_point
from fubini.optimise.options import implied_aspect_ratio
from fubini.quality import aspect_ratios, corner_limit, flawed, skewness
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.value import FREE, LOCKED, Boundary, Triangulation
from optimise.outlines import arc, boundary, certify, line, polygon

ALONE = OptimiseOptions(improve=0.0)


@kernel
def find_point(rx, ry, tau, scratch):
    return region_point(rx, ry, rx.shape[0], tau, scratch)


def lowest_skewness(ring, points):
    """Least skewness (n,) of the triangles between points (n, 2) and the edges of the ring."""
    a, b = ring, np.roll(ring, -1, 0)
    least = np.full(len(points), np.inf)
    for p, q in zip(a, b, strict=True):
        corners = np.stack([np.broadcast_to(p, points.shape), np.broadcast_to(q, points.shape), points], 1)
        least = np.minimum(least, skewness(corners))
    return least


@pytest.mark.parametrize("bound", [45.0, 52.0, 60.0])
def test_the_closed_region_is_found_exactly_where_sampling_finds_it(bound):
    rng = np.random.default_rng(4)
    grid = np.stack(np.meshgrid(np.linspace(-1.2, 1.2, 161), np.linspace(-1.2, 1.2, 161)), -1).reshape(-1, 2)
    seen = [0, 0]
    for _ in range(60):
        k = int(rng.integers(4, 9))
        angle = 2 * np.pi * (np.arange(k) + 0.5 * rng.random(k)) / k
        ring = (1.0 - 0.5 * rng.random(k))[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
        scratch = np.empty((6 * k, 4))
        found, x, y = find_point(*np.ascontiguousarray(ring.T), math.tan(math.radians(bound)), scratch)
        sampled = lowest_skewness(ring, grid).max() > bound
        seen[found] += 1
        if found:
            assert lowest_skewness(ring, np.array([[x, y]]))[0] > bound - 1e-6
        else:
            assert not sampled
    assert min(seen) > 3


def square_with(inner, h=1.0, mode=FREE):
    """The square of side 2 with sides cut to about h, and inner nodes."""
    made, tracks = boundary([polygon(np.array([(0, 0), (2, 0), (2, 2), (0, 2.0)]))], h, mode)
    return constrained_delaunay(np.concatenate([made.points, np.atleast_2d(inner)]), made), tracks


def test_a_node_in_the_wrong_place_is_relocated():
    start, tracks = square_with((1.55, 1.5))
    assert flawed(start.points[start.triangles]).any()
    outcome = optimise(start, tracks, ALONE)
    certify(outcome, start, tracks)
    assert outcome.excess == 0 and outcome.moves["relocation"] + outcome.moves["flip"] >= 1
    assert len(outcome.triangulation.points) == len(start.points)


def test_a_wrong_diagonal_is_flipped():
    made, tracks = boundary([polygon(np.array([(0, 0), (2, -0.55), (4, 0), (2, 0.55)]) * [0.45, 1.0])], 5.0, LOCKED)
    points = made.points
    long = Triangulation(
        points,
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        np.array([[-2, 1, -1], [-3, -4, 0]], np.int32),
        made,
    )
    assert flawed(points[long.triangles]).all()
    outcome = optimise(long, tracks, ALONE)
    certify(outcome, long, tracks)
    assert outcome.moves["flip"] == 1 and outcome.flawed_after == 0


def test_two_nodes_where_one_has_room_become_one():
    start, tracks = square_with([(0.95, 1.0), (1.05, 1.01)], 3.0, LOCKED)
    outcome = optimise(start, tracks, ALONE)
    certify(outcome, start, tracks)
    assert outcome.excess == 0
    assert outcome.moves["deletion"] + outcome.moves["collapse"] >= 1
    assert len(outcome.triangulation.points) == 5


def test_a_node_slides_on_its_arc_and_stays_exactly_on_it():
    loops = [[line((0, 0), (1, 0)), arc((0, 0), 1.0, 0.0, math.pi / 2), line((0, 1), (0, 0))]]
    made, tracks = boundary(loops, 0.75)
    t = made.t.copy()
    moving = int(np.flatnonzero((made.track == 1) & (made.kind == 1))[0])
    before = int(np.flatnonzero(made.segments[:, 1] == moving)[0])
    t[moving, 0] = t[before, 1] = 0.2
    points = made.points.copy()
    points[moving] = (math.cos(0.1 * math.pi), math.sin(0.1 * math.pi))
    moved = Boundary(points, made.kind, made.size, made.angle, made.segments, made.track, t, made.mode)
    start = constrained_delaunay(points, moved)
    assert flawed(start.points[start.triangles]).any()
    outcome = optimise(start, tracks, OptimiseOptions(improve=0.0, allow_splits=True))
    edge = outcome.triangulation.boundary
    on_arc = edge.points[edge.segments[edge.track == 1, 0]]
    np.testing.assert_allclose(np.hypot(*on_arc.T), 1.0, rtol=1e-15)
    assert outcome.excess == 0 and outcome.moves["slide"] >= 1


def test_boundary_nodes_too_many_are_merged_away():
    made, tracks = boundary([polygon(np.array([(0, 0), (2, 0), (2, 2), (0, 2.0)]))], 1.0)
    points = np.insert(made.points, 2, (1.08, 0.0), axis=0)
    k = len(made.kind)
    kind, angle = np.insert(made.kind, 2, 1), np.insert(made.angle, 2, 180.0)
    segments = np.stack([np.arange(k + 1), (np.arange(k + 1) + 1) % (k + 1)], 1).astype(np.int32)
    t = np.insert(made.t, 2, (0.54, 1.0), axis=0)
    t[1, 1] = 0.54
    more = Boundary(
        points, kind, np.full(k + 1, 1.0), angle, segments, np.insert(made.track, 2, 0), t, np.zeros(k + 1, np.uint8)
    )
    start = constrained_delaunay(np.concatenate([points, [(1.0, 1.0)]]), more)
    assert flawed(start.points[start.triangles]).any()
    outcome = optimise(start, tracks, ALONE)
    certify(outcome, start, tracks)
    assert outcome.excess == 0


def test_implied_aspect_ratio_is_the_largest_of_that_skewness():
    x, y = np.meshgrid(np.linspace(0.5, 1.6, 600), np.linspace(0.05, 1.6, 900))
    corners = np.zeros((x.size, 3, 2))
    corners[:, 1, 0] = 1.0
    corners[:, 2, 0], corners[:, 2, 1] = x.ravel(), y.ravel()
    skew, ratio = skewness(corners), aspect_ratios(corners)
    for bound in (30.0, 45.0, 60.0):
        largest = ratio[skew >= bound].max()
        assert largest <= implied_aspect_ratio(bound) < 1.01 * largest
    assert implied_aspect_ratio(45.0) == pytest.approx(1.8608, abs=1e-4)
    assert corner_limit(45.0) == pytest.approx(24.295, abs=1e-3)


@pytest.mark.parametrize(
    "bad", [{"min_skew": 0.0}, {"min_skew": 90.0}, {"max_aspect_ratio": 1.0}, {"budget": -1}, {"growth": 1.0}]
)
def test_options_that_make_no_sense_are_refused(bad):
    with pytest.raises(OptionError, match=next(iter(bad))):
        OptimiseOptions(**bad)
