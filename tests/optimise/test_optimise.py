"""Certificates on outcomes: no avoidable flaw, a valid mesh, every boundary node on its curve."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fubini.optimise import OptimiseOptions, optimise
from fubini.quality import aspect_ratios, corner_limit, flawed, skewness
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.value import FREE, INTERIOR, LOCKED, SPLIT_ONLY, Triangulation
from optimise.outlines import arc, boundary, certify, line, meshed, polygon, star_polygon

PI = math.pi


def wedge(degrees: float) -> list[list[tuple]]:
    a = math.radians(degrees)
    end = (math.cos(a), math.sin(a))
    return [[line((0, 0), (1, 0)), arc((0, 0), 1.0, 0.0, a), line(end, (0, 0))]]


@pytest.mark.parametrize("first", range(2, 121, 17))
def test_wedges_of_every_degree_have_at_most_the_unavoidable_flaw(first):
    for degrees in range(first, min(first + 17, 121)):
        loops = wedge(degrees)
        start, tracks = meshed(loops, min(0.12, 0.8 * math.radians(degrees)))
        outcome = optimise(start, tracks, OptimiseOptions(improve=0.0))
        certify(outcome, start, tracks)
        assert outcome.excess == 0, degrees
        assert outcome.flawed_after <= (degrees < corner_limit())
        assert not outcome.budget_exhausted and outcome.worst == ()


REGIONS = {
    "square": [polygon(np.array([(0, 0), (1, 0), (1, 1), (0, 1)]))],
    "quarter disk": [[line((0, 0), (1, 0)), arc((0, 0), 1.0, 0.0, PI / 2), line((0, 1), (0, 0))]],
    "disk with hole": [[arc((0, 0), 1.0, 0.0, 2 * PI)], [arc((0.2, 0), 0.4, 2 * PI, 0.0)]],
    "crescent": [[arc((0, 0), 1.0, -PI / 2, PI / 2), line((0, 1), (0, 0.6)), arc((0, 0), 0.6, PI / 2, -PI / 2),
                  line((0, -0.6), (0, -1))]],
    "neck": [polygon(np.array([(0, 0), (1, 0), (1, 0.45), (1.3, 0.45), (1.3, 0), (2.3, 0), (2.3, 1), (1.3, 1),
                               (1.3, 0.55), (1, 0.55), (1, 1), (0, 1)]))],
    "concave arc": [[line((0, 0), (2, 0)), line((2, 0), (2, 1.3)), arc((1, 1.3), 1.0, 0.0, -PI),
                     line((0, 1.3), (0, 0))]],
}  # fmt: skip


@pytest.mark.parametrize("name", REGIONS)
@pytest.mark.parametrize("h", [0.3, 0.11, 0.04])
def test_regions_of_lines_and_arcs_are_certified(name, h):
    start, tracks = meshed(REGIONS[name], h)
    outcome = optimise(start, tracks)
    certify(outcome, start, tracks)
    sharp = int((start.boundary.angle < corner_limit()).sum())
    assert outcome.excess == 0 and outcome.flawed_after <= sharp


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.sampled_from([0.1, 0.16, 0.25]))
def test_star_polygons_with_a_crude_boundary_are_certified(seed, h):
    start, tracks = meshed([polygon(star_polygon(seed))], h)
    outcome = optimise(start, tracks)
    certify(outcome, start, tracks)
    assert outcome.excess == 0


def test_smooth_regions_reach_the_quality_goal_beyond_the_bound():
    for name in ("square", "quarter disk", "disk with hole"):
        start, tracks = meshed(REGIONS[name], 0.07)
        corners = (t := optimise(start, tracks).triangulation).points[t.triangles]
        plain = (p := optimise(start, tracks, OptimiseOptions(improve=0.0)).triangulation).points[p.triangles]
        assert skewness(corners).min() > 50.0 and aspect_ratios(corners).max() < 1.5, name
        assert skewness(corners).min() >= skewness(plain).min()


def test_the_same_seed_gives_the_same_bytes_and_a_good_mesh_is_returned_as_it_is():
    start, tracks = meshed([polygon(star_polygon(3))], 0.15)
    a, b = (optimise(start, tracks) for _ in range(2))
    assert a.moves == b.moves
    for name in ("points", "triangles", "neighbours"):
        assert getattr(a.triangulation, name).tobytes() == getattr(b.triangulation, name).tobytes()
    again = optimise(a.triangulation, tracks, OptimiseOptions(improve=0.0))
    assert again.triangulation is a.triangulation and sum(again.moves.values()) == 0


def test_input_arrays_are_left_alone():
    start, tracks = meshed([polygon(star_polygon(5))], 0.15)
    kept = [start.points.copy(), start.triangles.copy(), start.neighbours.copy(), start.boundary.t.copy()]
    optimise(start, tracks)
    for old, new in zip(kept, (start.points, start.triangles, start.neighbours, start.boundary.t), strict=True):
        np.testing.assert_array_equal(old, new)


def spoiled(start: Triangulation, seed: int, amount: float) -> Triangulation:
    """The same triangles with interior nodes moved at random, as far as no triangle turns over."""
    rng = np.random.default_rng(seed)
    points = start.points.copy()
    for v in range(len(start.boundary.points), len(points)):
        old = points[v].copy()
        points[v] += amount * rng.standard_normal(2)
        p = points[start.triangles[(start.triangles == v).any(1)]]
        u, w = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
        if (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]).min() <= 0.0:
            points[v] = old
    return Triangulation(points, start.triangles, start.neighbours, start.boundary)


@pytest.mark.parametrize("seed", range(4))
def test_spoiled_meshes_are_mended_without_touching_a_locked_boundary(seed):
    start, tracks = meshed(REGIONS["square"], 0.09, LOCKED)
    bad = spoiled(start, seed, 0.035)
    assert flawed(bad.points[bad.triangles]).sum() > 20
    outcome = optimise(bad, tracks)
    certify(outcome, bad, tracks)
    assert outcome.excess == 0 and outcome.flawed_before == flawed(bad.points[bad.triangles]).sum()
    np.testing.assert_array_equal(outcome.triangulation.boundary.points, start.boundary.points)
    assert outcome.moves["relocation"] > 0 and outcome.moves["boundary_split"] == 0


def test_no_budget_makes_no_move_and_says_so():
    start, tracks = meshed(REGIONS["square"], 0.09)
    bad = spoiled(start, 1, 0.035)
    outcome = optimise(bad, tracks, OptimiseOptions(budget=0, improve=0.0))
    certify(outcome, bad, tracks)
    assert outcome.budget_exhausted
    assert outcome.excess > 0 and len(outcome.worst) == outcome.excess
    few = optimise(bad, tracks, OptimiseOptions(budget=150, improve=0.0))
    assert few.budget_exhausted and few.flawed_after < bad.triangles.shape[0]


def thin(mode: int) -> tuple[Triangulation, object]:
    """A strip so coarse along its sides that only splitting them helps."""
    return meshed([polygon(np.array([(0, 0), (4, 0), (4, 0.3), (0, 0.3)]))], 1.0, mode)


def test_splits_of_shared_segments_are_reported_with_their_parameters():
    start, tracks = thin(SPLIT_ONLY)
    outcome = optimise(start, tracks)
    certify(outcome, start, tracks)
    assert outcome.excess == 0 and outcome.moves["boundary_split"] + outcome.moves["refinement"] > 0
    edge = outcome.triangulation.boundary
    fresh = len(edge.points) - len(start.boundary.points)
    assert len(outcome.splits) == fresh > 0
    old = {(int(k), float(t)) for k, t in zip(start.boundary.track, start.boundary.t[:, 0], strict=True)}
    assert old.isdisjoint(outcome.splits)
    assert {(k, t) for k, t in outcome.splits} <= {
        (int(k), float(t)) for k, t in zip(edge.track, edge.t[:, 0], strict=True)
    }
    assert set(edge.mode.tolist()) == {SPLIT_ONLY}


@pytest.mark.parametrize("options", [OptimiseOptions(allow_splits=False, budget=3000), OptimiseOptions(budget=3000)])
def test_segments_that_may_not_be_split_are_not(options):
    start, tracks = thin(FREE if not options.allow_splits else LOCKED)
    outcome = optimise(start, tracks, options)
    certify(outcome, start, tracks)
    assert outcome.excess > 0 and outcome.splits == ()
    np.testing.assert_array_equal(outcome.triangulation.boundary.points, start.boundary.points)
    np.testing.assert_array_equal(outcome.triangulation.boundary.mode, start.boundary.mode)


def test_tighter_bounds_hold_where_they_are_asked_for():
    start, tracks = meshed(REGIONS["square"], 0.08)
    outcome = optimise(start, tracks, OptimiseOptions(min_skew=50.0, max_aspect_ratio=1.35))
    corners = outcome.triangulation.points[outcome.triangulation.triangles]
    assert skewness(corners).min() > 50.0 and aspect_ratios(corners).max() < 1.35


def test_the_mesh_keeps_its_size():
    start, tracks = meshed(REGIONS["disk with hole"], 0.06)
    outcome = optimise(spoiled(start, 2, 0.02), tracks)
    assert abs(len(outcome.triangulation.triangles) / len(start.triangles) - 1.0) < 0.1
    assert (outcome.triangulation.boundary.kind != INTERIOR).all()


@pytest.mark.parametrize("degrees", [24.31, 24.35, 24.5, 24.8, 25.5])
def test_corners_only_just_avoidable_are_filled_by_a_valid_triangle(degrees):
    """The best triangle there has less margin than the moves ask for elsewhere: it must be kept, not traded away."""
    start, tracks = meshed(wedge(degrees), 0.12)
    bad = spoiled(start, 1, 0.02)
    outcome = optimise(bad, tracks)
    certify(outcome, bad, tracks)
    assert outcome.excess == 0 and outcome.flawed_after == 0


@pytest.mark.parametrize("seed", [0, 9, 30, 32, 43, 44, 56])
def test_what_rounding_alone_seems_to_lower_is_not_lowered_for_ever(seed):
    # a polygon as large as a few steps of floating point: new nodes come to lie beside where they are wanted
    rng = np.random.default_rng(seed)
    turn, reach = np.sort(rng.uniform(0.0, 2.0 * PI, 9)), rng.uniform(3.0, 12.0, 9)
    corners = 1.5 + np.rint(np.column_stack([reach * np.cos(turn), reach * np.sin(turn)])) * 2.0**-52
    made, tracks = boundary([polygon(corners)], 5.0, LOCKED)
    start = constrained_delaunay(np.concatenate([made.points, [(1.5, 1.5)]]), made)
    outcome = optimise(start, tracks, OptimiseOptions(improve=0.0, budget=200_000))
    assert not outcome.budget_exhausted
