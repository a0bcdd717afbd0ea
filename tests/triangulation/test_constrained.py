"""Constrained Delaunay triangulation: certificates first, slow oracles second."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay

from fubini.errors import GeometryError, OptionError
from fubini.predicates import in_circle, orientation
from fubini.triangulation._kernels_cdt import delaunay, rank_points
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate
from regions import simple_polygon
from triangulation.shapes import (
    boundary_of,
    boundary_with,
    canonical,
    circle,
    hexagonal,
    inside,
    rectangle,
    star,
)


def triangulate(loops, interior=()):
    """Triangulation of loops and interior points that must be valid, complete and Delaunay."""
    boundary = boundary_of(*loops)
    points = np.concatenate([boundary.points, np.reshape(interior, (-1, 2))])
    mesh = constrained_delaunay(points, boundary)
    assert validate(mesh, delaunay=True) == ()
    return mesh


def same(a, b):
    return np.array_equal(a.triangles, b.triangles) and np.array_equal(a.neighbours, b.neighbours)


# --- certificates on many shapes


@pytest.mark.parametrize("seed", range(60))
def test_random_stars_with_holes(seed):
    rng = np.random.default_rng(seed)
    spread = rng.uniform(0, 0.95)
    loops = [star(rng, rng.integers(8, 120), spread)]
    if seed % 2:
        loops.append(star(rng, rng.integers(8, 40), 0.5, hole=True, radius=0.6 * (1 - spread)))
    squeeze = (1.0, 10.0 ** -rng.integers(0, 5))
    interior = rng.uniform(-1, 1, (rng.integers(0, 400), 2))
    mesh = triangulate([loop * squeeze for loop in loops], interior[inside(loops, interior)] * squeeze)
    assert len(mesh.dropped) == 0


@pytest.mark.parametrize("seed", range(12))
def test_random_tours(seed):
    rng = np.random.default_rng(seed)
    tour = simple_polygon(rng, 30)
    if np.sum(tour[:, 0] * np.roll(tour[:, 1], -1) - tour[:, 1] * np.roll(tour[:, 0], -1)) < 0:
        tour = tour[::-1]
    interior = rng.random((200, 2))
    triangulate([tour])
    triangulate([tour], interior[inside([tour], interior)])


@pytest.mark.parametrize("ratio", [10, 2000, 1e6])
@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_slot(ratio, turn):
    """A long slot, with more nodes on one side than on the other, also turned so that nothing is collinear exactly."""
    nodes = np.concatenate(
        [
            np.stack([np.linspace(0, 1, 301)[:-1], np.zeros(300)], axis=1),
            np.stack([np.linspace(1, 0, 18), np.full(18, 1 / ratio)], axis=1),
            [(0.0, 0.0)],
        ]
    )[:-1]
    nodes = np.concatenate([nodes[:300], [(1.0, 0.0)], nodes[300:]])
    c, s = np.cos(turn), np.sin(turn)
    triangulate([nodes @ np.array([(c, s), (-s, c)])])


def test_narrow_bridges_between_holes():
    holes = [circle(24, 0.2499, x, y, hole=True) for x in (0.5, 1.0, 1.5) for y in (0.5, 1.0, 1.5)]
    triangulate([rectangle(2, 2, 5, 5), *holes])


def test_comb_whose_segments_cross_hundreds_of_delaunay_edges():
    """Long straight sides between two rows of dense nodes that see each other better."""
    teeth = np.linspace(0, 1, 201)
    upper = np.stack([teeth[::-1], 1e-4 + 1e-4 * (np.arange(201) % 2)], axis=1)
    mesh = triangulate([np.concatenate([[(0, 0), (1, 0)], upper])])
    assert len(mesh.triangles) == 201


def test_near_degenerate_slivers():
    """Points a few ulps off a straight side."""
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 1, 60))
    lower = np.stack([t, 0.1 + 0.3 * t], axis=1)
    lower[:, 1] -= np.spacing(lower[:, 1]) * (1 + rng.integers(0, 3, 60))
    corners = np.concatenate([[(0.0, 0.1)], lower[1:-1], [(1.0, 0.4), (0.0, 1.0)]])
    turns = orientation(np.roll(corners, 1, axis=0), corners, np.roll(corners, -1, axis=0))
    assert set(turns.tolist()) == {-1, 1}
    triangulate([corners])


def test_smallest_regions():
    assert len(triangulate([[(0, 0), (1, 0), (0, 1)]]).triangles) == 1
    assert len(triangulate([[(0, 0), (1e-9, 0), (1e-9, 1e9), (0, 1e9)]]).triangles) == 2
    assert len(triangulate([[(1e6, 1e6), (1e6 + 1e-6, 1e6), (1e6, 1e6 + 1e-6)]]).triangles) == 1


def test_cocircular_points():
    triangulate([circle(64)], [(0, 0)])
    triangulate([circle(64), circle(64, 0.5, hole=True)])
    assert len(triangulate([circle(200)]).triangles) == 198


@pytest.mark.parametrize("lattice", ["square", "hexagonal", "quincunx"])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_lattices(lattice, offset):
    if lattice == "hexagonal":
        points = hexagonal(900)
    else:
        x, y = np.meshgrid(np.arange(1, 30) / 30, np.arange(1, 30) / 30)
        points = np.stack([x.ravel(), y.ravel()], axis=1)
        if lattice == "quincunx":
            points = points[(np.arange(29)[:, None] + np.arange(29)).ravel() % 2 == 0]
    mesh = triangulate([rectangle(1, 1, 20, 20) + offset], points + offset)
    assert len(mesh.triangles) == 2 * len(mesh.points) - 80 - 2


def test_interior_points_in_lines():
    x = np.linspace(0.01, 0.99, 80)
    triangulate([rectangle(1, 1, 1, 1)], np.stack([x, np.full(80, 0.5)], axis=1))
    triangulate([rectangle(1, 1, 1, 1)], np.stack([x, x], axis=1))


coordinates = st.integers(-6, 6)


@settings(max_examples=150, deadline=None)
@given(st.sets(st.tuples(coordinates, coordinates), max_size=60), st.integers(1, 5))
def test_any_points_of_a_small_lattice(chosen, nodes):
    """Cocircular and collinear all the time."""
    loop = rectangle(16, 16, nodes, nodes) - 8
    hole = [(6.5, 6.5), (6.5, 7.5), (7.5, 7.5), (7.5, 6.5)]
    mesh = triangulate([loop, hole], sorted(chosen))
    assert len(mesh.points) == 4 * nodes + 4 + len(chosen)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0, 0.9), st.integers(8, 60), st.integers(4, 20), st.integers(0, 100))
def test_any_star_with_a_hole(seed, spread, outer, inner, count):
    rng = np.random.default_rng(seed)
    loops = [star(rng, outer, spread), star(rng, inner, 0.3, hole=True, radius=0.4 * (1 - spread))]
    interior = rng.uniform(-1, 1, (count, 2))
    triangulate(loops, interior[inside(loops, interior)])


# --- oracles


def empty_circle_triangles(points):
    """All triangles (sorted corners) whose closed circle holds no other point: Delaunay by definition."""
    n = len(points)
    found = []
    for i in range(n):
        for j in range(i + 1, n):
            k = np.arange(j + 1, n)
            turn = orientation(points[i], points[j], points[k])
            for c, side in zip(k[turn != 0], turn[turn != 0]):
                others = np.setdiff1d(np.arange(n), (i, j, c))
                if (side * in_circle(points[i], points[j], points[c], points[others]) < 0).all():
                    found.append((i, j, int(c)))
    return found


@pytest.mark.parametrize("seed", range(6))
def test_every_circle_is_empty_by_definition(seed):
    points = np.random.default_rng(seed).random((24, 2))
    hull = ConvexHull(points).vertices
    order = np.concatenate([hull, np.setdiff1d(np.arange(24), hull)])
    mesh = triangulate([points[hull]], points[order[len(hull) :]])
    assert sorted(tuple(sorted(t)) for t in mesh.triangles.tolist()) == empty_circle_triangles(points[order])


@pytest.mark.parametrize("n", [10, 300, 5000])
def test_same_triangles_as_qhull(n):
    points = np.random.default_rng(n).random((n, 2))
    hull = ConvexHull(points).vertices
    order = np.concatenate([hull, np.setdiff1d(np.arange(n), hull)])
    mesh = triangulate([points[hull]], points[order[len(hull) :]])
    wanted = Delaunay(points[order]).simplices
    wanted = {tuple(sorted(t)) for t in wanted.tolist()}
    assert {tuple(sorted(t)) for t in mesh.triangles.tolist()} == wanted


@pytest.mark.parametrize("seed", range(8))
def test_same_triangles_as_triangle(seed):
    """Shewchuk's Triangle on a star with a hole; in general position there is one answer only."""
    triangle = pytest.importorskip("triangle")
    rng = np.random.default_rng(seed)
    loops = [star(rng, 80, 0.7), star(rng, 20, 0.3, hole=True, radius=0.25)]
    interior = rng.uniform(-1, 1, (300, 2))
    interior = interior[inside(loops, interior)]
    mesh = triangulate(loops, interior)
    theirs = triangle.triangulate(
        {"vertices": mesh.points.copy(), "segments": mesh.boundary.segments, "holes": [(0.0, 0.0)]}, "p"
    )
    assert np.array_equal(canonical(mesh.triangles), canonical(theirs["triangles"]))


def visible(loops, p, q):
    """Whether the open segment p - q crosses no edge of the loops properly and touches no node."""
    for loop in loops:
        a, b = loop, np.roll(loop, -1, axis=0)
        sides = orientation(p, q, a) * orientation(p, q, b)
        across = orientation(a, b, p) * orientation(a, b, q)
        if ((sides < 0) & (across < 0)).any():
            return False
    return True


@pytest.mark.parametrize("seed", range(3))
def test_no_vertex_that_can_be_seen_lies_in_a_circle(seed):
    """The definition of a constrained Delaunay triangulation, against all vertices, not only neighbours."""
    rng = np.random.default_rng(seed)
    loops = [star(rng, 40, 0.85), star(rng, 9, 0.2, hole=True, radius=0.1)]
    interior = rng.uniform(-0.8, 0.8, (60, 2))
    mesh = triangulate(loops, interior[inside(loops, interior)])
    hidden = 0
    for t in mesh.triangles:
        corners = mesh.points[t]
        for v in np.setdiff1d(np.flatnonzero(in_circle(*corners, mesh.points) > 0), t):
            assert not visible(loops, corners.mean(axis=0), mesh.points[v])
            hidden += 1
    assert hidden > 0


# --- invariance and determinism


@pytest.mark.parametrize("exponent", [-20, -3, 1, 40])
def test_powers_of_two_change_nothing(exponent):
    rng = np.random.default_rng(1)
    loop, interior = star(rng, 50, 0.7), 0.25 * rng.uniform(-1, 1, (500, 2))
    interior = interior[inside([loop], interior)]
    assert same(triangulate([loop], interior), triangulate([loop * 2.0**exponent], interior * 2.0**exponent))


def test_same_bytes_every_time():
    rng = np.random.default_rng(2)
    loop, interior = circle(100), 0.6 * rng.uniform(-1, 1, (3000, 2))
    first = triangulate([loop], interior)
    for _ in range(3):
        again = triangulate([loop], interior)
        assert first.triangles.tobytes() == again.triangles.tobytes()
        assert first.neighbours.tobytes() == again.neighbours.tobytes()


@pytest.mark.parametrize("offset", [1e3, 1e6])
def test_far_from_the_origin(offset):
    rng = np.random.default_rng(3)
    loop, interior = star(rng, 80, 0.5), 0.3 * rng.uniform(-1, 1, (500, 2))
    triangulate([loop + offset], interior + offset)


def test_inputs_are_left_alone_and_results_cannot_be_changed():
    boundary = boundary_of(circle(12))
    points = np.concatenate([boundary.points, [(0.1, 0.2)]])
    points.flags.writeable = False
    mesh = constrained_delaunay(points, boundary)
    assert np.array_equal(mesh.points, points)
    for array in (mesh.points, mesh.triangles, mesh.neighbours):
        assert not array.flags.writeable
    assert mesh.triangles.dtype == mesh.neighbours.dtype == np.int32


@pytest.mark.parametrize("shape", ["cross", "columns", "spiral", "parabola", "cluster"])
def test_flips_stay_few_on_points_that_are_bad_for_a_hilbert_curve(shape):
    """About three flips a point in random order; hundreds along two crossing lines when inserted along the curve."""
    t = np.linspace(0, 6, 2000)
    rng = np.random.default_rng(0)
    points = {
        "cross": np.concatenate([np.stack([t, 0 * t], axis=1), np.stack([0 * t + 3, t - 3.001], axis=1)]),
        "columns": np.stack(np.meshgrid(np.arange(10.0), np.arange(400) * 1e-3), axis=-1).reshape(-1, 2),
        "spiral": np.stack([t * np.cos(20 * t), t * np.sin(20 * t)], axis=1),
        "parabola": np.stack([t, 0.1 * t * t], axis=1),
        "cluster": np.concatenate([1e-6 * rng.normal(size=(3000, 2)), rng.random((500, 2))]),
    }[shape]
    ranked, order = rank_points(points)
    n = len(points)
    assert sorted(order.tolist()) == list(range(n))
    # a new vertex has three edges and one more for each flip
    degrees = []
    for count in range(n // 4, n, n // 60):
        triangles, _, _ = delaunay(np.concatenate([ranked[:count], ranked[n:]]), np.arange(count))
        degrees.append((triangles == count - 1).sum())
    assert np.mean(degrees) < 10


# --- what cannot be done is said


def test_doubles_are_left_out():
    interior = [(0.2, 0.2), (0.5, 0.5), (0.2, 0.2), (0.0, 0.0), (0.2, 0.2)]
    mesh = triangulate([rectangle(1, 1, 2, 2)], interior)
    assert mesh.dropped.tolist() == [10, 11, 12]
    assert mesh.points[8:].tolist() == [[0.2, 0.2], [0.5, 0.5]]


def test_points_outside_the_region_are_left_out():
    loops = (rectangle(1, 1, 3, 3), circle(8, 0.2, 0.5, 0.5, hole=True))
    mesh = triangulate(loops, [(0.5, 0.5), (0.1, 0.1), (2.0, 0.3), (0.9, 0.9), (0.51, 0.5)])
    assert mesh.dropped.tolist() == [20, 22, 24]


def test_double_boundary_node_loses_its_segments():
    boundary = boundary_of([(0, 0), (1, 0), (1, 1), (1, 1), (0, 1)])
    mesh = constrained_delaunay(boundary.points, boundary)
    assert mesh.unrecovered.tolist() == [2, 3]


def test_point_on_a_segment_is_reported():
    boundary = boundary_of([(0, 0), (4, 0), (4, 4), (0, 4)])
    mesh = constrained_delaunay(np.concatenate([boundary.points, [(1.0, 4.0), (2, 2), (3, 2)]]), boundary)
    assert mesh.unrecovered.tolist() == [2]
    assert validate(mesh)


def test_node_on_a_slanted_segment_far_from_both_ends_is_reported():
    rng = np.random.default_rng(0)
    boundary = boundary_of([(-1, -1), (100, 40), (0, 60)])
    interior = np.concatenate([rng.uniform(0, 1, (200, 2)) * (40, 30) + (10, 12), [(100 - 50.5, 40 - 20.5)]])
    mesh = constrained_delaunay(np.concatenate([boundary.points, interior]), boundary)
    assert mesh.unrecovered.tolist() == [0]


def test_crossing_segments_are_reported():
    boundary = boundary_of([(0, 0), (2, 2), (2, 0), (0, 2)])
    mesh = constrained_delaunay(boundary.points, boundary)
    assert len(mesh.unrecovered) == 1
    assert mesh.unrecovered[0] in (0, 2)


def test_segment_given_twice_is_reported():
    boundary = boundary_of(circle(8))
    double = boundary_with(boundary.points, np.concatenate([boundary.segments, boundary.segments[3:4]]))
    assert constrained_delaunay(double.points, double).unrecovered.tolist() == [8]


def test_segment_from_a_node_to_itself_is_reported():
    boundary = boundary_of(circle(8))
    point = boundary_with(boundary.points, np.concatenate([boundary.segments, [[5, 5]]]))
    assert constrained_delaunay(point.points, point).unrecovered.tolist() == [8]


@pytest.mark.parametrize(
    "segments",
    [
        [(0, 1), (1, 2), (2, 3)],  # open
        [(1, 0), (2, 1), (3, 2), (0, 3)],  # clockwise
    ],
)
def test_segments_that_enclose_nothing_are_an_error(segments):
    points = np.array([(0, 0), (1, 0), (1, 1), (0, 1.0)])
    with pytest.raises(GeometryError, match="close the loops"):
        constrained_delaunay(points, boundary_with(points, segments))


def test_hole_of_the_wrong_sense_is_an_error():
    boundary = boundary_of(circle(20), circle(6, 0.3))
    with pytest.raises(GeometryError, match="holes clockwise"):
        constrained_delaunay(boundary.points, boundary)


def test_no_segments_give_no_triangles():
    points = np.random.default_rng(0).random((10, 2))
    mesh = constrained_delaunay(points, boundary_with(points[:0], []))
    assert len(mesh.triangles) == 0
    assert mesh.dropped.tolist() == list(range(10))


def test_points_all_in_one_line_or_one_place():
    boundary = boundary_of([(0, 0), (1, 1), (3, 3), (2, 2)])
    mesh = constrained_delaunay(boundary.points, boundary)
    assert len(mesh.unrecovered) > 0
    boundary = boundary_of([(5, 5), (5, 5), (5, 5)])
    assert len(constrained_delaunay(boundary.points, boundary).unrecovered) == 3


@pytest.mark.parametrize(
    "points", [np.zeros((2, 2)), np.zeros((5, 3)), [(0, 0), (1, 0), (np.nan, 1)], [(0, 0), (1, 0), (np.inf, 1)]]
)
def test_points_that_are_no_points_are_an_error(points):
    with pytest.raises(OptionError):
        constrained_delaunay(points, boundary_with(np.zeros((0, 2)), []))


def test_segments_of_unknown_points_are_an_error():
    points = np.eye(3)[:, :2]
    with pytest.raises(OptionError, match="indices of points"):
        constrained_delaunay(points, boundary_with(points, [(0, 1), (1, 2), (2, 3)]))
