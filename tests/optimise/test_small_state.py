"""Small states share their arrays: nothing of one face may reach the next."""

from __future__ import annotations

import numpy as np

import fubini
import regions
from fubini.optimise import state as states
from fubini.optimise._kernels_state import State


def digest(mesh):
    return [array.tobytes() for array in (mesh.points, mesh.triangles, mesh.segments, mesh.t_of_segment)]


def test_meshes_do_not_depend_on_what_was_meshed_before():
    plate, gear = regions.model_of(regions.plate()), regions.model_of(regions.gear())
    alone = digest(fubini.mesh(plate, 0.3))
    fubini.mesh(gear, 0.12)
    assert digest(fubini.mesh(plate, 0.3)) == alone


def test_small_and_large_arrays_give_the_same_mesh(monkeypatch):
    model = regions.model_of(regions.plate(4))
    small = digest(fubini.mesh(model, 0.3))
    monkeypatch.setattr(states, "SMALL", 1)
    assert digest(fubini.mesh(model, 0.3)) == small


def test_what_is_counted_and_marked_starts_at_zero():
    for name in ("mark", "moved", "tried", "counts"):
        State(*states._small_arrays(), *[None] * 4)._asdict()[name][:] = 7
    state = State(*states._small_arrays(), *[None] * 4)
    assert not any(np.any(getattr(state, name)) for name in ("mark", "moved", "tried", "counts"))
