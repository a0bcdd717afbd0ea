"""Models of several faces in which sharp corners share edges: see docs/theory/corners.md, "Corners beside corners"."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import fubini
import random_networks
from fubini.optimise import OptimiseOutcome
from fubini.pipeline.ears import find_ears, with_ears, without_ears
from fubini.sampling.ratios import best_ratio, chained, largest_ratio, least_steps
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate
from fubini.triangulation.value import LOCKED
from random_networks import fan
from regions import discretise

WEDGES = [
    (2.5, 20, 2.5), (3.5, 35, 3.5), (1.5, 10, 1.5), (2.5, 25, 2.5), (0.76, 7.2, 24.78, 16.03), (5, 40, 3), (0.6, 3, 15),
    (0.625, 5), (0.5, 5), (100, 52, 4.33), (5, 15, 1.9),
]  # fmt: skip


@pytest.mark.parametrize("angles", WEDGES, ids=str)
def test_wedges_about_a_vertex_are_certified(angles):
    """Their legs and the segments beside them suit all faces, and none splits the leg of another."""
    c = fubini.mesh(fan(angles), 1 / 20).certificate
    assert c.certified
    assert not any(f.budget_exhausted for f in c.faces)
    assert c.flawed == c.unavoidable


@pytest.mark.parametrize(("angles", "wide"), [((0.5, 10, 0.5), 1), ((3, 5, 40, 1), 2), ((0.2, 15, 100), 1)])
def test_a_wedge_too_narrow_for_its_neighbour_leaves_flaws_in_that_one_alone(angles, wide):
    """Such a neighbour has no valid mesh with shared nodes: it is given up at once, others are none the worse."""
    faces = fubini.mesh(fan(angles), 1 / 20).certificate.faces
    excess = [f.excess for f in faces]
    assert 1 <= excess[wide] <= 4
    assert sum(excess) == excess[wide]
    assert not any(f.budget_exhausted for f in faces)


@pytest.mark.parametrize("family", ["arrangement", "pizza", "delaunay"])
def test_networks_keep_every_face_and_their_area(family):
    for seed in range(3):
        regions = getattr(random_networks, family)(seed)
        mesh = fubini.mesh(regions, 1 / 10)
        a, b, c = mesh.points[mesh.triangles][:, :, :2].transpose(1, 0, 2)
        (ux, uy), (vx, vy) = (b - a).T, (c - a).T
        outer = 1.0 if family == "arrangement" else sum(r.area for r in regions)
        assert sum(r.area for r in regions) == pytest.approx(outer, rel=1e-9)
        assert 0.5 * (ux * vy - uy * vx).sum() == pytest.approx(outer, rel=0.02)
        assert (ux * vy > uy * vx).all()
        if family == "arrangement":
            assert mesh.certificate.certified


def test_fans_of_corners_not_too_wide_for_each_other_are_certified():
    for seed in (0, 1, 2, 3, 4, 6, 7, 8, 9, 10):
        c = fubini.mesh(random_networks.neighbourly_fan(seed), (1 / 10, 1 / 20, 1 / 50)[seed % 3]).certificate
        assert c.certified, seed
        assert not any(f.budget_exhausted for f in c.faces)


def test_a_fan_gives_the_same_mesh_twice():
    first, second = (fubini.mesh(random_networks.random_fan(9), 1 / 10) for _ in range(2))
    assert np.array_equal(first.points, second.points) and np.array_equal(first.triangles, second.triangles)


def ear_boundary(locked):
    """A wedge of 20 degrees, ``locked`` the segments that may not be split."""
    corner = fan((20.0,))[0]
    boundary = discretise(corner, 0.2)[0]
    mode = boundary.mode.copy()
    at = np.flatnonzero((boundary.points == 0.0).all(axis=1))[0]
    both = np.flatnonzero((boundary.segments == at).any(axis=1))
    mode[both[:locked]] = LOCKED
    return replace(boundary, mode=mode)


@pytest.mark.parametrize("locked", [0, 1, 2])
def test_ears_are_cut_off_and_put_back(locked):
    boundary = ear_boundary(locked)
    ears = find_ears(boundary, 45.0, 2.0)
    assert len(ears) == (1 if locked else 0)
    if not locked:
        return
    cut = without_ears(boundary, ears)
    assert len(cut.points) == len(boundary.points) - 1 and np.count_nonzero(cut.track < 0) == 1
    outcome = OptimiseOutcome(constrained_delaunay(cut.points, cut))
    found = with_ears(outcome, boundary, ears).triangulation
    assert not validate(found)
    assert (found.boundary.track >= 0).all()
    assert rows_of(found.boundary) == rows_of(boundary)


def rows_of(boundary):
    """Places of the ends of all segments, their tracks and parameters, sorted."""
    rows = zip(boundary.points[boundary.segments].tolist(), boundary.track.tolist(), boundary.t.tolist(), strict=True)
    return sorted(rows)


def test_largest_ratio_is_that_of_valid_triangles():
    """Brute force: triangles about a node with equal angles, the longest ray that keeps them valid."""
    from fubini.quality import flawed

    for degrees in (30.0, 36.0, 50.0, 70.0):
        a = math.radians(degrees)
        rays = np.linspace(1.0, 4.0, 30001)
        shapes = np.zeros((len(rays), 3, 2))
        shapes[:, 1, 0] = 1.0
        shapes[:, 2] = np.column_stack([rays * math.cos(a), rays * math.sin(a)])
        longest = rays[~flawed(shapes)].max()
        assert largest_ratio(a, 1) == pytest.approx(longest, rel=1e-3)


def test_steps_beside_flat_walls_are_those_of_half_a_turn():
    assert 1.0 / least_steps(90.0)[2] == pytest.approx(16.307, abs=0.001)
    assert least_steps(20.0)[0] > least_steps(20.0)[1] > least_steps(20.0)[2]


def test_legs_stay_equal_unless_a_neighbour_needs_more():
    assert best_ratio(10.0, math.inf, math.inf) == 1.0
    assert best_ratio(10.0, 0.03, math.inf) == 1.0
    assert best_ratio(10.0, 0.017, math.inf) < 1.0 < best_ratio(10.0, math.inf, 0.017)
    assert best_ratio(10.0, 0.001, math.inf) == 1.0  # nothing helps


def test_ratios_are_passed_on_about_a_vertex_unless_they_contradict():
    a, b, c = (0, 0), (1, 0), (2, 1)
    assert chained([(a, b, 2.0), (b, c, 0.25)]) == {a: 1.0, b: 2.0, c: 0.5}
    assert chained([(b, c, 0.25), (a, b, 2.0)]) == {b: 1.0, c: 0.25, a: 0.5}
    assert chained([(a, b, 2.0), (b, c, 0.5), (c, a, 2.0)]) == {}
