"""States share their arrays: nothing of one face may reach the next."""

from __future__ import annotations

import numpy as np
import pytest

import fubini
import regions
from fubini.optimise import OptimiseOptions
from fubini.optimise import state as states
from fubini.optimise._kernels_state import State
from fubini.tracks import NO_TRACKS
from fubini.triangulation.constrained import constrained_delaunay


def digest(mesh):
    return [array.tobytes() for array in (mesh.points, mesh.triangles, mesh.segments, mesh.t_of_segment)]


def test_meshes_do_not_depend_on_what_was_meshed_before():
    plate, gear = regions.model_of(regions.plate()), regions.model_of(regions.gear())
    alone = digest(fubini.mesh(plate, 0.3))
    fubini.mesh(gear, 0.12)
    assert digest(fubini.mesh(plate, 0.3)) == alone


@pytest.mark.parametrize("rooms", [(1,), (20_000,), (100, 400, 20_000)])
def test_kept_arrays_of_any_length_and_new_ones_give_the_same_mesh(monkeypatch, rooms):
    model = regions.model_of(regions.plate(4))
    meshes = [digest(fubini.mesh(model, size)) for size in (0.3, 0.05)]
    monkeypatch.setattr(states, "ROOMS", rooms)
    assert [digest(fubini.mesh(model, size)) for size in (0.3, 0.05)] == meshes


def test_what_is_counted_and_marked_starts_at_zero():
    boundary, sizing, _ = regions.discretise(regions.plate(4), 0.3)
    start, tracks = constrained_delaunay(boundary.points, boundary), sizing.outlines[0].tracks
    for passing in (True, False):
        for _ in range(2):
            state = states.build_state(start, tracks, OptimiseOptions(), 100, passing=passing)
            assert not any(np.any(getattr(state, name)) for name in ("mark", "moved", "tried"))
            assert np.count_nonzero(state.counts) == 4  # nodes, triangles, segments, the state of the random numbers
            for name in ("mark", "moved", "tried", "counts"):
                getattr(state, name)[:] = 7


def test_the_words_of_kept_states_are_those_of_their_arrays():
    boundary, sizing, _ = regions.discretise(regions.plate(4), 0.3)
    start = constrained_delaunay(boundary.points, boundary)
    for tracks in (sizing.outlines[0].tracks, NO_TRACKS):
        for spare, room in ((100, states.ROOMS[0]), (3000, states.ROOMS[1])):
            state = states.build_state(start, tracks, OptimiseOptions(), spare, passing=True)
            assert len(state.points) == room
            assert state.words.tolist() == State(*state).words.tolist()
