"""Large faces: the core that is written down and the strip around it make one valid triangulation."""

from __future__ import annotations

import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

import fubini
import regions
from fubini.errors import GeometryError
from fubini.model import Frame
from fubini.pipeline.attempts import attempt
from fubini.pipeline.options import MeshOptions
from fubini.pipeline.strip import FaceMesh, strip_boundary, with_core
from fubini.sampling.interior import NO_CORE, lattice_points, lattice_with_core
from fubini.triangulation._kernels_cdt import triangulate
from fubini.triangulation._kernels_strip import between
from fubini.triangulation.constrained import (
    NO_PATCH,
    constrained_delaunay,
    delaunay_around,
    triangulate_all,
)
from fubini.triangulation.validate import validate
from fubini.triangulation.value import Triangulation
from handmade import FLAT_FRAME

CASES = {"plate": (regions.plate, 0.02), "gear": (regions.gear, 0.014), "slot": (regions.slot, 0.05)}


def written(mesh: FaceMesh, frame: Frame, first: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes inside and triangles, the boundary nodes numbered from 0 and the others from ``first``."""
    points, triangles = np.full((mesh.inner_nodes, 3), np.nan), np.full((mesh.triangle_count, 3), -1, np.int32)
    b, n, m = len(mesh.boundary.points), len(mesh.points), len(mesh.triangles)
    points[: n - b] = frame.to_space(mesh.points[b:])
    triangles[:m] = mesh.triangles + np.where(mesh.triangles < b, 0, first - b)
    axes = np.array([frame.origin, frame.x_axis, frame.y_axis])
    mesh.core.write(axes, first, first + n - b, points[n - b :], triangles[m:])
    return points, triangles


def joined(mesh: FaceMesh) -> Triangulation:
    """Strip and core as one triangulation, neighbours found edge by edge."""
    points, triangles = written(mesh, FLAT_FRAME, len(mesh.boundary.points))
    owner = {(t[i - 2], t[i - 1]): k for k, t in enumerate(triangles.tolist()) for i in range(3)}
    owner |= {(b, a): -1 - s for s, (a, b) in enumerate(mesh.boundary.segments.tolist())}
    neighbours = [[owner[t[i - 1], t[i - 2]] for i in range(3)] for t in triangles.tolist()]
    points = np.concatenate([mesh.boundary.points, points[:, :2]])
    return Triangulation(points, triangles, np.array(neighbours, np.int32), mesh.boundary)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("number", [0, 1])
def test_strip_and_core_are_one_valid_triangulation(name, number):
    make, size = CASES[name]
    boundary, sizing, _ = regions.discretise(make(), size)
    outcome, core = attempt(boundary, sizing.outlines[0], size, MeshOptions(), number, None)
    assert outcome.excess == 0
    mesh = joined(with_core(outcome.triangulation, core))
    assert validate(mesh) == ()
    assert (mesh.boundary.track >= 0).all()
    assert core.triangles > 0.5 * len(mesh.triangles)


def test_core_is_a_plain_lattice_with_a_closed_rim():
    size = 0.02
    boundary, _, _ = regions.discretise(regions.plate(), size)
    lattice = lattice_with_core(boundary, size, 0.35, (0.0, 0.0), 0)
    outside, core = lattice.points, lattice.core
    points, triangles = np.empty((core.nodes, 3)), np.empty((core.triangles, 3), np.int32)
    core.write(np.eye(3)[[2, 0, 1]] * [[0.0], [1.0], [1.0]], 0, len(core.on_rim), points, triangles)
    points = np.concatenate([core.on_rim, points[:, :2]])
    p = points[triangles]
    sides = np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2)
    assert np.abs(sides / size - 1.0).max() < 1e-9
    assert set(triangles.ravel()) == set(range(len(points)))
    alone = {tuple(e) for t in triangles.tolist() for e in zip(t, t[1:] + t[:1], strict=True)}
    alone = {e for e in alone if e[::-1] not in alone}
    assert alone == set(map(tuple, core.rim.tolist()))
    assert sorted(core.rim[:, 0]) == sorted(core.rim[:, 1])
    every = np.concatenate([points, outside])
    assert sorted(every.tolist()) == sorted(lattice_points(boundary, size).tolist())
    distance = np.min(np.linalg.norm(core.on_rim[:, None] - boundary.points[None], axis=2), axis=1)
    assert distance.min() > 1.2 * size


def test_the_core_is_written_into_space():
    boundary, sizing, _ = regions.discretise(regions.plate(), 0.03)
    outcome, core = attempt(boundary, sizing.outlines[0], 0.03, MeshOptions(), 0, None)
    mesh = with_core(outcome.triangulation, core)
    oblique = Frame(np.array([3.0, 4, 5]), np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0]))
    flat, triangles = written(mesh, FLAT_FRAME, 1000)
    points, same = written(mesh, oblique, 1000)
    assert (points == oblique.to_space(flat[:, :2])).all()
    assert (triangles == same).all()
    n = len(mesh.boundary.points)
    assert set(np.unique(triangles)) == set(range(n)) | set(range(1000, 1000 + mesh.inner_nodes))


def test_small_faces_have_no_core():
    boundary, _, _ = regions.discretise(regions.plate(), 0.2)
    lattice = lattice_with_core(boundary, 0.2, 0.35, (0.0, 0.0), 4000)
    assert lattice.core is None
    assert (lattice.points == lattice_points(boundary, 0.2)).all()


def test_memory_of_a_large_face():
    """Arrays are written once, where they stay: 32 bytes a triangle are shipped, the check of edges needs 18 more."""
    model = regions.model_of(regions.quarter_disk())
    fubini.mesh(model, 0.01)  # what is compiled or read once is not counted
    tracemalloc.start()
    try:
        mesh = fubini.mesh(model, 0.0025)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(mesh.triangles) > 250_000
    assert peak < 100 * len(mesh.triangles)


def test_quality_of_a_large_face():
    mesh = fubini.mesh(regions.model_of(regions.quarter_disk()), 0.0095)
    assert mesh.certificate.certified
    assert mesh.certificate.mean_skew > 88.0
    assert mesh.certificate.worst_skew > 49.0


@pytest.mark.parametrize("least", [1, NO_CORE], ids=["core", "no core"])
@pytest.mark.parametrize("make", [regions.plate, regions.gear, regions.quarter_disk, regions.slot])
def test_a_triangulation_around_a_patch_is_the_whole_one(make, least):
    """As a slow oracle: all points triangulated, nothing known beforehand."""
    region = make()
    for share, turn in ((0.02, 0.0), (0.05, 0.3), (0.2, 1.0)):
        size = share * region.diagonal
        boundary, _, _ = regions.discretise(region, size)
        direction = (math.cos(turn), math.sin(turn))
        lattice = lattice_with_core(boundary, size, 0.35, (0.2, 0.4), least, direction)
        whole = boundary if lattice.core is None else strip_boundary(boundary, lattice.core, size)
        points = np.concatenate([whole.points, lattice.points])
        mesh = delaunay_around(points, whole, boundary, lattice.patch)
        assert validate(mesh, delaunay=True) == ()
        assert {sorted_corners(t) for t in mesh.triangles} == {
            sorted_corners(t) for t in constrained_delaunay(points, whole).triangles
        }
        assert share > 0.02 or len(lattice.patch.triangles) > 0.1 * len(mesh.triangles)


@pytest.mark.parametrize(
    ("make", "share", "walked"),
    [
        (regions.quarter_disk, 0.05, "all"),
        (regions.slot, 0.03, "all"),
        (regions.gear, 0.02, "all"),  # edges of the lattice reach into the teeth, and nodes by themselves
        (regions.gear, 0.05, "all"),  # nothing does
        (regions.plate, 0.02, "part"),  # one loop of the rim around several of the boundary
        (regions.slot, 0.1, "nothing"),
    ],
)
def test_a_strip_is_walked_along(make, share, walked):
    """It comes out as if nothing were known; where loops are no pairs the walk says what it leaves."""
    region = make()
    size = share * region.diagonal
    boundary, _, _ = regions.discretise(region, size)
    lattice = lattice_with_core(boundary, size, 0.35, (0.2, 0.4), NO_CORE, (math.cos(0.3), math.sin(0.3)))
    patch, fixed, outer = lattice.patch, len(boundary.points), len(boundary.segments)
    points = np.concatenate([boundary.points, lattice.points[patch.nodes - fixed]])
    segments = patch.segments
    assert np.array_equal(points, patch.points) and np.array_equal(segments[:outer], boundary.segments)
    if make is regions.gear:
        ends = set(segments[outer:].ravel()) | set(patch.hanging.ravel())
        assert (len(patch.hanging) > 0, len(ends) < len(patch.nodes)) == (share < 0.05, share < 0.05)
    some, _, left, hanging = between(points, segments, fixed, outer, patch.hanging)
    assert walked == ("nothing" if not len(some) else "part" if len(left) else "all")
    if walked == "part":
        assert 0 < len(left) < 0.2 * len(segments)  # the walk goes on behind the narrow places
        assert np.array_equal(hanging[: len(patch.hanging)], patch.hanging)
        assert (left >= len(segments) + len(patch.hanging)).any()  # where a piece ends
    triangles, neighbours, *_, status = triangulate(points, segments, fixed, outer, patch.hanging, *NO_PATCH)
    assert status == 0
    whole = triangulate_all(points, segments, fixed)[0]
    assert {sorted_corners(t) for t in triangles} == {sorted_corners(t) for t in whole}
    if walked == "all":  # elsewhere the rim touches itself, which no boundary may
        boundary = replace(boundary, points=points, segments=segments)
        assert validate(Triangulation(points, triangles, neighbours, boundary), delaunay=True) == ()
    backwards = np.concatenate([boundary.segments[:outer, ::-1], segments[outer:]])
    assert not len(between(points, backwards, fixed, outer, patch.hanging)[0])


@pytest.mark.parametrize("seed", range(24))
def test_pieces_of_a_strip_overlap_nothing(seed):
    """Polygons whose parts are narrow: pieces, and what is left, make a valid triangulation with all that is asked."""
    region = regions.random_polygon(seed)
    size = 0.02 * region.diagonal
    boundary, _, _ = regions.discretise(region, size)
    lattice = lattice_with_core(boundary, size, 0.35, (0.2, 0.4), NO_CORE)
    points = np.concatenate([boundary.points, lattice.points])
    found = delaunay_around(points, boundary, boundary, lattice.patch)
    assert validate(found, delaunay=True) == () and not len(found.unrecovered)


def sorted_corners(triangle: np.ndarray) -> tuple[int, ...]:
    return tuple(sorted(triangle.tolist()))


def test_a_patch_mends_no_boundary():
    boundary, _, _ = regions.discretise(regions.square(), 0.1)
    lattice = lattice_with_core(boundary, 0.1, 0.35, (0.0, 0.0), NO_CORE)
    points = np.concatenate([boundary.points, lattice.points])
    clockwise = replace(boundary, segments=boundary.segments[:, ::-1].copy())
    segments = np.concatenate([clockwise.segments, lattice.patch.segments[len(clockwise.segments) :]])
    with pytest.raises(GeometryError, match="do not enclose"):
        delaunay_around(points, clockwise, clockwise, replace(lattice.patch, segments=segments))
