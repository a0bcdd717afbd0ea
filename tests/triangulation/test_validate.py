"""Every kind of damage to a triangulation is found and named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate
from triangulation.shapes import boundary_of, circle


@pytest.fixture
def mesh():
    """A disk with a hole, 400 interior points."""
    boundary = boundary_of(circle(40), circle(12, 0.3, hole=True))
    r, turn = np.random.default_rng(0).uniform(0, 1, (2, 400))
    r = np.sqrt(0.15 + 0.75 * r)
    interior = np.stack([r * np.cos(7 * turn), r * np.sin(7 * turn)], axis=1)
    return constrained_delaunay(np.concatenate([boundary.points, interior]), boundary)


def changed(mesh, name, index, value):
    """The mesh with one entry of one array replaced."""
    array = getattr(mesh, name).copy()
    array[index] = value
    return replace(mesh, **{name: array})


def found(mesh, text, **options):
    problems = validate(mesh, **options)
    assert any(text in p for p in problems), problems


def inner_edge(mesh):
    """Some (t, i) whose neighbour is a triangle."""
    return tuple(np.argwhere(mesh.neighbours >= 0)[7])


def rim_edge(mesh):
    """Some (t, i) that lies on a segment."""
    return tuple(np.argwhere(mesh.neighbours < 0)[7])


def test_sound_mesh_has_no_problems(mesh):
    assert validate(mesh, delaunay=True) == ()


@pytest.mark.parametrize("value", [-1, 10**6])
def test_corner_out_of_range(mesh, value):
    found(changed(mesh, "triangles", (5, 1), value), "triangle 5 names a point that does not exist")


@pytest.mark.parametrize("value", [-53, 10**6])
def test_neighbour_out_of_range(mesh, value):
    found(changed(mesh, "neighbours", (5, 1), value), "triangle 5 names a neighbour or segment")


def test_array_of_the_wrong_shape(mesh):
    found(replace(mesh, neighbours=mesh.neighbours[:-1]), "must be (n, 2)")


def test_no_triangles(mesh):
    empty = np.empty((0, 3), np.int32)
    found(replace(mesh, triangles=empty, neighbours=empty), "no triangles")


def test_point_that_is_not_finite(mesh):
    found(changed(mesh, "points", (60, 0), np.nan), "point 60 is not finite")


def test_boundary_node_that_moved(mesh):
    found(changed(mesh, "points", (3, 0), mesh.points[3, 0] * (1 + 1e-15)), "not the boundary's nodes")


def test_clockwise_triangle(mesh):
    found(changed(mesh, "triangles", 4, mesh.triangles[4, ::-1]), "triangle 4 is not counter-clockwise")


def test_triangle_of_no_area(mesh):
    a, b = next((t[i], t[i - 1]) for t in mesh.triangles for i in range(3) if t[i] >= 52)
    found(changed(mesh, "points", a, mesh.points[b]), "is not counter-clockwise")


def test_point_moved_across_an_edge(mesh):
    v = 60
    ring = mesh.triangles[(mesh.triangles == v).any(axis=1)]
    far = mesh.points[52 + np.argmax(np.linalg.norm(mesh.points[52:] - mesh.points[v], axis=1))]
    assert len(ring) > 2
    found(changed(mesh, "points", v, far), "is not counter-clockwise")


def test_neighbour_that_does_not_answer(mesh):
    t, i = inner_edge(mesh)
    other = next(u for u in range(len(mesh.triangles)) if u != t and u not in mesh.neighbours[t])
    found(changed(mesh, "neighbours", (t, i), other), "do not name each other")


def test_neighbours_exchanged(mesh):
    t, i = inner_edge(mesh)
    j = next(j for j in range(3) if j != i and mesh.neighbours[t, j] >= 0)
    row = mesh.neighbours[t].copy()
    row[[i, j]] = row[[j, i]]
    found(changed(mesh, "neighbours", t, row), "do not name each other")


def test_segment_code_on_an_inner_edge(mesh):
    t, i = inner_edge(mesh)
    broken = changed(mesh, "neighbours", (t, i), -1)
    found(broken, "do not name each other")
    found(broken, "does not run along that edge")
    found(broken, "segment 0 is an edge more than once")


def test_segment_codes_exchanged(mesh):
    (t, i), (u, j) = np.argwhere(mesh.neighbours < 0)[[2, 9]]
    array = mesh.neighbours.copy()
    array[t, i], array[u, j] = array[u, j], array[t, i]
    found(replace(mesh, neighbours=array), "does not run along that edge")


def test_segment_of_the_wrong_direction(mesh):
    segments = mesh.boundary.segments.copy()
    segments[6] = segments[6, ::-1]
    found(replace(mesh, boundary=replace(mesh.boundary, segments=segments)), "does not run along that edge")


def test_segment_that_is_missing(mesh):
    t, i = rim_edge(mesh)
    s = -1 - mesh.neighbours[t, i]
    found(changed(mesh, "neighbours", (t, i), -1 - (s + 1) % 52), f"segment {s} is no edge")


def test_segment_that_was_not_recovered(mesh):
    found(replace(mesh, unrecovered=np.array([3], np.int32)), "segment 3 was not recovered")


def test_triangle_lost(mesh):
    found(without(mesh, 30), "name")


def test_triangle_lost_with_all_traces(mesh):
    """Neighbours of the lost triangle claim a segment there."""
    broken = without(mesh, 30, code=-1)
    found(broken, "does not run along that edge")


def without(mesh, t, code=None):
    """The mesh without triangle t; edges towards it lead to ``code``, or to whatever has its number now."""
    keep = np.arange(len(mesh.triangles)) != t
    neighbours = mesh.neighbours[keep].copy()
    if code is not None:
        neighbours[neighbours == t] = code
    neighbours[neighbours > t] -= 1
    return replace(mesh, triangles=mesh.triangles[keep], neighbours=neighbours)


def test_triangle_twice(mesh):
    twice = replace(
        mesh,
        triangles=np.concatenate([mesh.triangles, mesh.triangles[:1]]),
        neighbours=np.concatenate([mesh.neighbours, mesh.neighbours[:1]]),
    )
    found(twice, "directed edge that another triangle has too")


def test_unused_point(mesh):
    lonely = replace(mesh, points=np.concatenate([mesh.points, [[0.9, 0.0]]]))
    found(lonely, f"point {len(mesh.points)} belongs to no triangle")


def test_part_of_the_region_lost():
    """Two disks, one of them forgotten: every triangle left is sound."""
    boundary = boundary_of(circle(8), circle(8, x=5.0))
    both = constrained_delaunay(boundary.points, boundary)
    keep = both.triangles.max(axis=1) < 8
    number = np.append(np.cumsum(keep) - 1, 0)
    neighbours = np.where(both.neighbours >= 0, number[np.maximum(both.neighbours, -1)], both.neighbours)[keep]
    broken = replace(both, triangles=both.triangles[keep], neighbours=neighbours.astype(np.int32))
    found(broken, "segment 8 is no edge")


def test_edge_cut_open(mesh):
    """Both sides of an edge that ends at the boundary claim a segment of their own that runs along it."""
    ends = np.stack([np.roll(mesh.triangles, -1, axis=1), np.roll(mesh.triangles, -2, axis=1)])
    t, i = np.argwhere((mesh.neighbours >= 0) & ((ends < 52).sum(axis=0) == 1))[0]
    u = mesh.neighbours[t, i]
    j = int(np.flatnonzero(mesh.neighbours[u] == t)[0])
    a, b = mesh.triangles[t, (i + 1) % 3], mesh.triangles[t, (i + 2) % 3]
    boundary = replace(
        mesh.boundary,
        points=mesh.points,
        segments=np.concatenate([mesh.boundary.segments, [[a, b], [b, a]]]).astype(np.int32),
    )
    neighbours = mesh.neighbours.copy()
    neighbours[t, i], neighbours[u, j] = -53, -54
    found(replace(mesh, neighbours=neighbours, boundary=boundary), "does not start and end exactly one segment")


def fan(first, n, centre):
    """Triangles and neighbours of a fan about ``centre`` over nodes first .. first + n."""
    s = np.arange(n)
    triangles = np.stack([np.full(n, centre), first + s, first + (s + 1) % n], axis=1)
    neighbours = np.stack([-1 - first - s, first + (s + 1) % n, first + (s - 1) % n], axis=1)
    return triangles.astype(np.int32), neighbours.astype(np.int32)


def hexagon():
    """A hexagon with its centre."""
    boundary = boundary_of(circle(6))
    return constrained_delaunay(np.concatenate([boundary.points, [[0.0, 0.0]]]), boundary)


def test_two_sheets_that_share_a_node():
    """Two fans about one centre, one over the other."""
    boundary = boundary_of(circle(6), circle(6, 0.5))
    (a, b), (c, d) = fan(0, 6, 12), fan(6, 6, 12)
    sheets = replace(
        hexagon(),
        points=np.concatenate([boundary.points, [[0.0, 0.0]]]),
        triangles=np.concatenate([a, c]),
        neighbours=np.concatenate([b, d]),
        boundary=boundary,
    )
    found(sheets, "V - E + F is 1, but 2 part(s) with 2 loop(s) have 2")


def test_fan_that_winds_twice():
    """Ten triangles about a centre over five corners, twice: only the angle about the centre tells."""
    boundary = boundary_of(np.concatenate([circle(5), circle(5)]))
    triangles, neighbours = fan(0, 10, 10)
    wound = replace(
        hexagon(),
        points=np.concatenate([boundary.points, [[0.0, 0.0]]]),
        triangles=triangles,
        neighbours=neighbours,
        boundary=boundary,
    )
    found(wound, "triangles around point 10 overlap")


def test_edge_that_is_not_delaunay():
    boundary = boundary_of([(0, 0), (2, -0.3), (4, 0), (2, 0.3)])
    mesh = constrained_delaunay(boundary.points, boundary)
    assert set(mesh.triangles[0]) & set(mesh.triangles[1]) == {1, 3}
    long = replace(
        mesh,
        triangles=np.array([(0, 1, 2), (0, 2, 3)], np.int32),
        neighbours=np.array([(-2, 1, -1), (-3, -4, 0)], np.int32),
    )
    assert validate(long) == ()
    found(long, "corner inside its circle", delaunay=True)
