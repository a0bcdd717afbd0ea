"""Local operations keep the arrays consistent, and do what their drawings say."""

from __future__ import annotations

import numpy as np
import pytest

from fubini.predicates import in_circle, orientation
from fubini.triangulation import _kernels_topology as topology
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate
from fubini.triangulation.value import Triangulation
from triangulation.shapes import boundary_of, circle, inside, rectangle


class Mesh:
    """Writable copies of a triangulation's arrays with room for more triangles."""

    def __init__(self, triangulation: Triangulation, room: int = 8) -> None:
        self.count = len(triangulation.triangles)
        self.boundary = triangulation.boundary
        self.points = triangulation.points.copy()
        self.triangles = np.full((self.count + room, 3), -7, np.int32)
        self.triangles[: self.count] = triangulation.triangles
        self.neighbours = np.full((self.count + room, 3), -7, np.int32)
        self.neighbours[: self.count] = triangulation.neighbours
        self.vertex_triangle = np.empty(len(self.points), np.int32)
        topology.fill_vertex_triangle(self.triangles, self.count, self.vertex_triangle)

    @property
    def arrays(self):
        return self.triangles, self.neighbours, self.vertex_triangle

    def value(self):
        m = self.count
        return Triangulation(self.points, self.triangles[:m].copy(), self.neighbours[:m].copy(), self.boundary)

    def is_sound(self):
        assert validate(self.value()) == ()
        for v, t in enumerate(self.vertex_triangle):
            assert v in self.triangles[t]

    def convex(self, t, i):
        """Whether edge i of t can be flipped."""
        u = self.neighbours[t, i]
        if u < 0:
            return False
        p, a, b = (self.points[self.triangles[t, (i + k) % 3]] for k in range(3))
        d = self.points[self.triangles[u, list(self.neighbours[u]).index(t)]]
        return orientation(p, a, d) > 0 and orientation(p, d, b) > 0


@pytest.fixture
def mesh():
    boundary = boundary_of(circle(20), circle(6, 0.2, hole=True))
    rng = np.random.default_rng(0)
    r, turn = rng.uniform(0.25, 0.95, 150), rng.uniform(0, 7, 150)
    interior = np.stack([r * np.cos(turn), r * np.sin(turn)], axis=1)
    return Mesh(constrained_delaunay(np.concatenate([boundary.points, interior]), boundary))


def test_flip_exchanges_the_diagonal(mesh):
    t, i = next((t, i) for t in range(mesh.count) for i in range(3) if mesh.convex(t, i))
    u = mesh.neighbours[t, i]
    p, a, b = (mesh.triangles[t, (i + k) % 3] for k in range(3))
    d = mesh.triangles[u, list(mesh.neighbours[u]).index(t)]
    assert topology.flip(*mesh.arrays, t, i) == u
    assert mesh.triangles[t].tolist() == [p, a, d]
    assert mesh.triangles[u].tolist() == [p, d, b]
    mesh.is_sound()


def test_many_flips_and_back_by_legalising(mesh):
    before = {tuple(sorted(t)) for t in mesh.triangles[: mesh.count].tolist()}
    rng = np.random.default_rng(1)
    flips = 0
    for t, i in zip(rng.integers(0, mesh.count, 2000), rng.integers(0, 3, 2000)):
        if mesh.convex(t, i):
            topology.flip(*mesh.arrays, t, i)
            flips += 1
    assert flips > 500
    mesh.is_sound()
    assert {tuple(sorted(t)) for t in mesh.triangles[: mesh.count].tolist()} != before
    stack = np.empty(100_000, np.int32)
    stack[: mesh.count] = np.arange(mesh.count)
    report, made = topology.legalise(mesh.points, *mesh.arrays, stack, mesh.count)
    assert report == topology.DONE
    assert made > 100
    mesh.is_sound()
    assert {tuple(sorted(t)) for t in mesh.triangles[: mesh.count].tolist()} == before


def test_legalise_keeps_to_its_budget(mesh):
    rng = np.random.default_rng(1)
    for t, i in zip(rng.integers(0, mesh.count, 500), rng.integers(0, 3, 500)):
        if mesh.convex(t, i):
            topology.flip(*mesh.arrays, t, i)
    stack = np.arange(mesh.count + 3, dtype=np.int32)
    assert topology.legalise(mesh.points, *mesh.arrays, stack, mesh.count) == (topology.OUT_OF_BUDGET, 3)
    mesh.is_sound()


def test_legalise_leaves_ties_and_segments_alone():
    boundary = boundary_of(rectangle(3, 1, 3, 1))
    square = Mesh(constrained_delaunay(boundary.points, boundary))
    before = square.triangles.copy()
    stack = np.empty(100, np.int32)
    stack[: square.count] = np.arange(square.count)
    assert topology.legalise(square.points, *square.arrays, stack, square.count) == (topology.DONE, 0)
    assert np.array_equal(square.triangles, before)


def test_split_triangle_inserts_a_vertex(mesh):
    t = 11
    p = len(mesh.points)
    mesh.points = np.concatenate([mesh.points, [mesh.points[mesh.triangles[t]].mean(axis=0)]])
    mesh.vertex_triangle = np.append(mesh.vertex_triangle, np.int32(-1))
    topology.split_triangle(*mesh.arrays, t, p, mesh.count, mesh.count + 1)
    mesh.count += 2
    assert [mesh.triangles[s, 0] for s in (t, mesh.count - 2, mesh.count - 1)] == [p, p, p]
    mesh.is_sound()


def test_edge_is_illegal_is_the_in_circle_test(mesh):
    rng = np.random.default_rng(1)
    for t, i in zip(rng.integers(0, mesh.count, 300), rng.integers(0, 3, 300)):
        if mesh.convex(t, i):
            topology.flip(*mesh.arrays, t, i)
    seen = set()
    for t in range(mesh.count):
        for i in range(3):
            u = mesh.neighbours[t, i]
            wanted = False
            if u >= 0:
                d = mesh.triangles[u, list(mesh.neighbours[u]).index(t)]
                wanted = bool(in_circle(*mesh.points[mesh.triangles[t]], mesh.points[d]) > 0)
            assert topology.edge_is_illegal(mesh.points, mesh.triangles, mesh.neighbours, t, i) == wanted
            seen.add(wanted)
    assert seen == {True, False}


def test_locate_finds_the_triangle_or_says_what_blocks(mesh):
    loops = (circle(20), circle(6, 0.2, hole=True))
    targets = np.random.default_rng(2).uniform(-1.1, 1.1, (400, 2))
    reports = set()
    for target, is_inside in zip(targets, inside(loops, targets)):
        t, report = topology.locate(mesh.points, mesh.triangles, mesh.neighbours, 0, *target, 1000)
        reports.add(np.sign(report))
        assert report <= 0
        corners = mesh.points[mesh.triangles[t]]
        sides = [orientation(corners[i - 2], corners[i - 1], target) for i in range(3)]
        if report == topology.DONE:
            assert is_inside
            assert min(sides) >= 0
        else:
            a, b = mesh.boundary.points[mesh.boundary.segments[-1 - report]]
            assert orientation(a, b, target) < 0
    assert reports == {0, -1}


def test_locate_keeps_to_its_budget(mesh):
    left = int(mesh.vertex_triangle[10])
    _, report = topology.locate(mesh.points, mesh.triangles, mesh.neighbours, left, 0.98, 0.01, 2)
    assert report == topology.OUT_OF_BUDGET


def test_locate_in_a_corner_and_on_an_edge(mesh):
    v = 40
    t, report = topology.locate(mesh.points, mesh.triangles, mesh.neighbours, 0, *mesh.points[v], 1000)
    assert report == topology.DONE
    assert v in mesh.triangles[t]


def test_find_edge_finds_all_edges_and_no_others(mesh):
    n = len(mesh.points)
    half_edge = {}
    for t in range(mesh.count):
        for i in range(3):
            half_edge[int(mesh.triangles[t, (i + 1) % 3]), int(mesh.triangles[t, (i + 2) % 3])] = 3 * t + i
    for a in range(n):
        for b in range(n):
            if a != b:
                found = topology.find_edge(*mesh.arrays, a, b)
                assert found == half_edge.get((a, b), -1)


def test_fill_vertex_triangle_marks_unused_vertices():
    triangles = np.array([(0, 1, 2), (2, 1, 4)], np.int32)
    out = np.empty(5, np.int32)
    topology.fill_vertex_triangle(triangles, 2, out)
    assert out.tolist() == [0, 1, 1, -1, 1]
