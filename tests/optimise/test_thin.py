"""Faces of one size have hardly more triangles than their area asks for, and hardly worse ones for it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import fubini
import regions
from fubini._jit import kernel
from fubini.optimise import OptimiseOptions, refine_within, thinned
from fubini.optimise._kernels_thin import thin
from fubini.optimise._kernels_words import state_of, work_of
from fubini.optimise.loop import refine_and_optimise
from fubini.optimise.state import ROOMS, build_state, read_state, scratch_space
from fubini.quality import areas, growth_rates, skewness, squared_lengths
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate
from optimise.outlines import boundary, polygon

SLOT = [polygon(np.array(c)) for c in ([(0, 0), (10, 0), (10, 6), (0, 6)], [(2, 2), (2, 4), (8, 4), (8, 2)])]
ASKED = OptimiseOptions()


def skew(tri):
    return skewness(tri.points[tri.triangles])


def size_of(region, wanted):
    return math.sqrt(region.area / wanted / (math.sqrt(3.0) / 4.0))


def crowded(h):
    """A face with points inside for 0.87 of its size, as if that were what came of it."""
    made, tracks = boundary(SLOT, h)
    start = constrained_delaunay(made.points, made)
    room = refine_and_optimise(start, tracks, h, 0.5, ASKED)[0].room
    return replace(refine_and_optimise(start, tracks, 0.87 * h, 0.5, ASKED)[0], room=room)


@pytest.mark.parametrize(
    ("region", "wanted"),
    [
        (regions.slot(2.0), 145.5), (regions.slot(2.0), 104), (regions.slot(2.0), 137), (regions.slot(2.0), 179.4),
        (regions.square(), 100), (regions.square(), 132), (regions.quarter_disk(), 104), (regions.gear(), 1562),
    ],
)  # fmt: skip
def test_a_face_of_one_size_has_at_most_a_tenth_more_triangles_than_its_area_asks_for(region, wanted):
    mesh = fubini.mesh(regions.model_of(region), size_of(region, wanted))
    assert mesh.certificate.certified
    assert len(mesh.triangles) <= 1.1 * wanted
    assert mesh.certificate.faces[0].avoidable_skew > 59.9
    assert mesh.certificate.faces[0].longest_edge <= 1.7 * mesh.size


@pytest.mark.parametrize("h", [0.8, 0.6])
def test_nodes_are_taken_out_until_triangles_are_few_enough(h):
    start = crowded(h)
    done = thinned(start, h, ASKED)
    before, after = start.triangulation, done.triangulation
    assert len(before.triangles) > 1.15 * start.room
    assert len(after.triangles) < min(1.12 * start.room, len(before.triangles) - 8)
    assert validate(after) == ()
    np.testing.assert_array_equal(
        after.points[: len(after.boundary.points)], before.points[: len(before.boundary.points)]
    )
    assert after.boundary is before.boundary
    corners = after.points[after.triangles]
    np.testing.assert_allclose(areas(corners).sum(), areas(before.points[before.triangles]).sum(), rtol=1e-13)
    assert skew(after).min() >= min(60.0, skew(before).min()) - 1e-9
    assert skew(after).mean() >= skew(before).mean() - 3.0
    assert np.sqrt(squared_lengths(corners).max()) <= 1.7 * h
    assert (growth_rates(after.points, after.triangles) > ASKED.growth).sum() <= (
        growth_rates(before.points, before.triangles) > ASKED.growth
    ).sum()
    assert thinned(start, h, ASKED).triangulation.points.tobytes() == after.points.tobytes()


def test_nothing_is_taken_out_where_more_is_asked_for_or_nothing_is_known():
    start = crowded(0.8)
    assert thinned(start, 0.8, ASKED, None) is start
    for other in ({"room": 0}, {"excess": 1}, {"room": len(start.triangulation.triangles)}, {"room": 99}):
        same = replace(start, **other)
        assert thinned(same, 0.8, ASKED) is same
    # a core beside it with room to spare makes up for what is too many
    number = len(start.triangulation.triangles)
    assert thinned(start, 0.8, ASKED, (number, 2.0 * number)) is start


def test_sizes_asked_of_edges_are_no_excess():
    """Edges that ask for less than the size of the face get the triangles that they ask for."""
    region, size = regions.square(), size_of(regions.square(), 140)
    finer = fubini.mesh(regions.model_of(region), size, edge_size={"0-3": 0.8 * size})
    assert len(finer.triangles) > 1.15 * 140


def test_room_is_told_where_one_size_is_wanted():
    made, tracks = boundary(SLOT, 0.8)
    start = constrained_delaunay(made.points, made)
    area = areas(start.points[start.triangles]).sum() / (math.sqrt(3.0) / 4.0)
    first, _ = refine_and_optimise(start, tracks, 0.8, 0.5, ASKED)
    assert first.room == int(area / 0.64)
    assert refine_and_optimise(start, tracks, 1.3, 0.5, ASKED)[0].room == 0
    assert refine_and_optimise(start, tracks, 0.8, 0.5, ASKED, np.full(len(start.points), 0.5))[0].room == 0


def test_nodes_stay_where_taking_them_out_leaves_poor_triangles():
    made, tracks = boundary(SLOT, 0.8)
    start = constrained_delaunay(made.points, made)
    first, even = refine_and_optimise(start, tracks, 0.8, 0.5, ASKED)
    number = len(first.triangulation.triangles)

    def core(fewer):
        """A core with too many triangles: it leaves so many less for what lies around it."""
        return 1000, 1000.0 / 1.095 + (number - fewer) / 1.095 - first.room

    few, _ = refine_within(start, tracks, 0.8, 0.5, ASKED, core(4))
    assert len(few.triangulation.triangles) < number and few.thinned and not few.poor
    forced, _ = refine_and_optimise(start, tracks, 0.8, 0.5, ASKED, core=core(150))
    assert forced.thinned and (forced.poor or forced.excess)
    same, also = refine_within(start, tracks, 0.8, 0.5, ASKED, core(150))
    assert same.triangulation.points.tobytes() == first.triangulation.points.tobytes() and also == even


def test_nodes_are_taken_out_where_arrays_had_to_grow():
    made, tracks = boundary(SLOT, 0.1)
    start = constrained_delaunay(made.points, made)
    first, _ = refine_and_optimise(start, tracks, 0.1, 0.5, ASKED)
    number = len(first.triangulation.triangles)
    assert number > 2 * ROOMS[0]
    core = (20000, 20000.0 / 1.095 + (number - 100) / 1.095 - first.room)
    fewer, _ = refine_and_optimise(start, tracks, 0.1, 0.5, ASKED, core=core)
    assert fewer.thinned and len(fewer.triangulation.triangles) < number


def test_nodes_are_taken_out_before_smoothing_where_there_is_less_room():
    made, tracks = boundary(SLOT, 0.8)
    start = constrained_delaunay(made.points, made)
    first, _ = refine_and_optimise(start, tracks, 0.8, 0.5, ASKED)
    number = len(first.triangulation.triangles)
    core = (1000, 1000.0 / 1.095 + (number - 8) / 1.095 - first.room)
    fewer, _ = refine_and_optimise(start, tracks, 0.8, 0.5, ASKED, core=core)
    assert fewer.thinned and not first.thinned
    assert len(fewer.triangulation.triangles) <= number - 8
    assert validate(fewer.triangulation) == ()
    assert skew(fewer.triangulation).min() > 50.0
    roomy, _ = refine_and_optimise(start, tracks, 0.8, 0.5, ASKED, core=(0, float(number)))
    assert not roomy.thinned
    assert roomy.triangulation.points.tobytes() == first.triangulation.points.tobytes()


def state_of_points(number, seed):
    """A state of a Delaunay triangulation of random points in the slotted face, and how it is read."""
    made, tracks = boundary(SLOT, 0.6)
    inside = np.random.default_rng(seed).random((number, 2)) * (10.0, 6.0)
    hole = (np.abs(inside - (5.0, 3.0)) < (3.1, 1.1)).all(1)
    clear = ~hole & (np.abs(inside - (5.0, 3.0)) < (4.9, 2.9)).all(1)
    start = constrained_delaunay(np.concatenate([made.points, inside[clear]]), made)
    return start, build_state(start, tracks, ASKED, 10)


@kernel
def thinned_to(S, W, most):
    return thin(state_of(S), work_of(W), most)


@pytest.mark.parametrize("seed", range(3))
def test_nodes_taken_out_leave_a_delaunay_triangulation_of_the_others(seed):
    """Down to a third of the triangles, and then as far as it goes: to the triangulation of the boundary alone."""
    start, state = state_of_points(120, seed)
    for most in (len(start.triangles) // 3, 0):
        taken = thinned_to(state.words, scratch_space().words, most)
        left = read_state(state, start).mesh
        assert taken > 0
        assert validate(left, delaunay=True) == ()
        assert len(left.triangles) <= most or len(left.points) == len(left.boundary.points)
        np.testing.assert_array_equal(left.boundary.points, start.boundary.points)
        assert {tuple(p) for p in left.points} <= {tuple(p) for p in start.points}
        np.testing.assert_allclose(areas(left.points[left.triangles]).sum(), 48.0)
    assert len(left.triangles) == len(start.triangles) - 2 * (len(start.points) - len(start.boundary.points))


def test_the_node_with_least_room_goes_first():
    start, state = state_of_points(60, 7)
    first = len(start.boundary.points)
    room = np.bincount(start.triangles.ravel(), np.repeat(areas(start.points[start.triangles]), 3))
    assert thinned_to(state.words, scratch_space().words, len(start.triangles) - 2) == 1
    left = {tuple(p) for p in read_state(state, start).mesh.points}
    gone = [v for v in range(len(start.points)) if tuple(start.points[v]) not in left]
    assert gone == [first + int(np.argmin(room[first:]))]
