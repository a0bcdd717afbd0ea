"""Large faces: the core that is written down and the strip around it make one valid triangulation."""

from __future__ import annotations

import numpy as np
import pytest

import fubini
import regions
from fubini.pipeline.faces import attempt
from fubini.pipeline.options import MeshOptions
from fubini.sampling.interior import lattice_with_core
from fubini.triangulation.validate import validate

CASES = {"plate": (regions.plate, 0.02), "gear": (regions.gear, 0.014), "slot": (regions.slot, 0.05)}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("number", [0, 1])
def test_strip_and_core_are_one_valid_triangulation(name, number):
    make, size = CASES[name]
    boundary, sizing, _ = regions.discretise(make(), size)
    outcome = attempt(boundary, sizing.outlines[0], size, MeshOptions(), number, None)
    mesh = outcome.triangulation
    assert outcome.excess == 0
    assert validate(mesh) == ()
    assert (mesh.boundary.track >= 0).all()
    _, core = lattice_with_core(boundary, size, 0.35, (0.0, 0.0), 0)
    assert len(core.triangles) > 0.5 * len(mesh.triangles)


def test_core_is_a_plain_lattice_with_a_closed_rim():
    size = 0.02
    boundary, _, _ = regions.discretise(regions.plate(), size)
    points, core = lattice_with_core(boundary, size, 0.35, (0.0, 0.0), 0)
    p = points[core.triangles]
    sides = np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2)
    assert np.abs(sides / size - 1.0).max() < 1e-9
    assert sorted(core.rim[:, 0].tolist()) == sorted(core.rim[:, 1].tolist())
    assert sorted([*core.on_rim, *core.inside, *core.outside]) == list(range(len(points)))
    distance = np.min(np.linalg.norm(points[core.on_rim][:, None] - boundary.points[None], axis=2), axis=1)
    assert distance.min() > 2.2 * size


def test_small_faces_have_no_core():
    boundary, _, _ = regions.discretise(regions.plate(), 0.2)
    assert lattice_with_core(boundary, 0.2, 0.35, (0.0, 0.0), 4000)[1] is None


def test_quality_of_a_large_face():
    mesh = fubini.mesh(regions.model_of(regions.quarter_disk()), 0.0095)
    assert mesh.certificate.certified
    assert mesh.certificate.mean_skew > 88.0
    assert mesh.certificate.worst_skew > 49.0
