"""Sizes of single parts, of curves and from a field: obtained, and still certified."""

from __future__ import annotations

import numpy as np
import pytest

import fubini
import random_regions
import regions
from fubini.errors import OptionError
from fubini.quality import growth_rates
from fubini.region import Loop, Region


def mesh_of(region, size, **options):
    mesh = fubini.mesh(regions.model_of(region), size, **options)
    assert mesh.certificate.certified
    return mesh


def on_edge(mesh, edge):
    ends = mesh.points[mesh.segments[mesh.edge_of_segment == edge]]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def test_edge_size_and_segments_are_met():
    mesh = mesh_of(regions.square(), 0.2, edge_size={0: 0.02}, edge_segments={2: 31})
    assert on_edge(mesh, 0).max() < 0.03
    assert len(on_edge(mesh, 0)) == pytest.approx(50, abs=5)
    assert len(on_edge(mesh, 2)) >= 31
    assert on_edge(mesh, 1).max() > 0.08


def test_face_size_fills_its_face_only():
    square = regions.square()
    model = regions.model_of(square, square.transform(np.eye(2), (3.0, 0.0)))
    mesh = fubini.mesh(model, 0.2, face_size={1: 0.04})
    assert mesh.certificate.certified
    counts = np.bincount(mesh.face_of_triangle)
    assert counts[1] == pytest.approx(1 / (3**0.5 / 4 * 0.04**2), rel=0.12)
    assert counts[0] < 100


def test_vertex_size_grades_away_from_its_vertex():
    mesh = mesh_of(regions.square(), 0.2, vertex_size={0: 0.005})
    lengths = on_edge(mesh, 0)
    assert min(lengths) < 0.01
    assert max(lengths) > 0.1
    assert len(mesh.triangles) < 1500


@pytest.mark.parametrize("number", [24, 64, 200])
def test_segments_per_turn_on_a_full_circle(number):
    region = regions.Region.from_loops([regions.loop([(-2, -2), (2, -2), (2, 2), (-2, 2)]), regions.circle(0, 0, 1)])
    mesh = mesh_of(region, 1.0, segments_per_turn=number)
    assert number <= len(on_edge(mesh, 4)) <= 1.35 * number + 4


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_chord_tolerance_is_kept(tolerance):
    mesh = mesh_of(regions.quarter_disk(), 0.5, chord_tolerance=tolerance)
    middle = mesh.points[mesh.segments[mesh.edge_of_segment == 1]].mean(axis=1)
    assert (1.0 - np.linalg.norm(middle, axis=1)).max() < 1.1 * tolerance
    assert len(middle) < 2.0 * np.pi / 2 / np.sqrt(8 * tolerance) + 8


def test_size_field_is_followed_inside():
    def field(p):
        return 0.01 + 0.25 * np.hypot(p[:, 0] - 0.5, p[:, 1] - 0.5)

    mesh = mesh_of(regions.square(), 0.15, size_field=field)
    corners = mesh.points[mesh.triangles]
    length = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)
    ratio = length / np.minimum(0.15, field(corners.mean(axis=1)))
    assert np.percentile(ratio, 99) < 1.7
    assert 0.6 < np.median(ratio) < 1.25


@pytest.mark.parametrize(
    "options",
    [
        {"edge_size": {99: 0.1}}, {"edge_size": {"rim": 0.1}}, {"face_size": {5: 0.1}}, {"vertex_size": {77: 1.0}},
        {"edge_size": {0: -1.0}}, {"segments_per_turn": 2}, {"chord_tolerance": 0.0}, {"size_field": 3},
        {"size_field": lambda p: 0.1}, {"size_field": lambda p: -np.ones(len(p))},
    ],
)  # fmt: skip
def test_senseless_sizes_of_parts_are_refused(options):
    with pytest.raises(OptionError):
        fubini.mesh(regions.model_of(regions.square()), 0.2, **options)


def test_parts_are_selected_by_name_text_and_predicate():
    region = regions.square()
    by_name = mesh_of(region, 0.2, names={"floor": "edge 0"}, edge_size={"floor": 0.02})
    by_text = mesh_of(region, 0.2, edge_size={"edges 0": 0.02})
    by_place = mesh_of(region, 0.2, edge_size={lambda x, y, z: y < 1e-9: 0.02})
    by_number = mesh_of(region, 0.2, edge_size={0: 0.02})
    for mesh in (by_name, by_text, by_place):
        np.testing.assert_array_equal(mesh.points, by_number.points)
    corner = mesh_of(region, 0.2, vertex_size={lambda x, y, z: x + y < 0.1: 0.005})
    np.testing.assert_array_equal(corner.points, mesh_of(region, 0.2, vertex_size={0: 0.005}).points)
    finer = mesh_of(region, 0.2, face_size={lambda x, y, z: x < 2: 0.05})
    np.testing.assert_array_equal(finer.points, mesh_of(region, 0.2, face_size={0: 0.05}).points)


def test_of_several_wishes_the_finest_is_met():
    mesh = mesh_of(regions.square(), 0.2, edge_size={0: 0.1, "0-1": 0.03}, edge_segments={"2,3": 9, 2: 31, "2": 5})
    assert on_edge(mesh, 0).max() < 0.05
    assert on_edge(mesh, 1).max() < 0.05
    assert len(on_edge(mesh, 2)) >= 31 > len(on_edge(mesh, 3)) >= 9


@pytest.mark.parametrize("turn", [3, 10, 30])
def test_turn_of_a_full_circle(turn):
    region = regions.Region.from_loops([regions.loop([(-2, -2), (2, -2), (2, 2), (-2, 2)]), regions.circle(0, 0, 1)])
    mesh = mesh_of(region, 1.0, turn=turn)
    assert len(on_edge(mesh, 4)) == pytest.approx(360 / turn, rel=0.06)


GRADED = [
    (regions.gear, 0.3, {}),
    (lambda: regions.slot(0.02), 1.0, {}),
    (regions.square, 0.2, {"edge_size": {0: 0.005}}),
    (regions.square, 0.2, {"vertex_size": {0: 0.002}}),
    (regions.plate, 0.5, {}),
    (regions.square, 0.2, {"size_field": lambda p: 0.01 + 0.25 * np.hypot(p[:, 0] - 0.5, p[:, 1] - 0.5)}),
]


@pytest.mark.parametrize(("make", "size", "options"), GRADED)
@pytest.mark.parametrize("growth", [1.3, 1.5, 2.0])
def test_neighbours_stay_within_the_growth_limit(make, size, options, growth):
    mesh = mesh_of(make(), size, growth=growth, **options)
    rates = growth_rates(mesh.points, mesh.triangles)
    assert (rates > growth).sum() <= (0.01 * len(rates) if growth == 1.3 else 0)
    assert rates.max() < 1.25 * growth


NARROW = [
    *((regions.random_polygon(seed), (10, 30, 60)[seed % 3]) for seed in (5006, 5014, 5025, 5039, 5052, 5091, 6010)),
    *((random_regions.random_region(seed), (10, 25, 50, 15)[seed % 4]) for seed in (5003, 5006, 5018, 5035)),
]


@pytest.mark.parametrize(("region", "share"), NARROW)
def test_neighbours_stay_within_the_growth_limit_where_boundary_nodes_decide(region, share):
    mesh = mesh_of(region, region.diagonal / share)
    sound = mesh.quality["skewness"] > 45.0  # the triangle of an unavoidable corner is as long as its angle makes it
    assert growth_rates(mesh.points, mesh.triangles[sound]).max() <= 1.5


def longest_edge(mesh):
    corners = mesh.points[mesh.triangles]
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()


@pytest.mark.parametrize(
    ("region", "share"), [(random_regions.random_region(5007), 15), (regions.random_polygon(5033), 60)]
)
def test_a_large_growth_limit_does_not_make_edges_longer_than_allowed(region, share):
    size = region.diagonal / share
    mesh = mesh_of(region, size, growth=2.0)
    assert longest_edge(mesh) <= 1.7 * size
    assert mesh.certificate.longest_edge == pytest.approx(longest_edge(mesh), rel=1e-12)


@pytest.mark.parametrize("seed", range(5000, 5010))
def test_the_largest_growth_limit_works(seed):
    """Sizes that grow faster than distance must not shrink the legs of sharp corners for ever."""
    region = regions.random_polygon(seed)
    mesh = mesh_of(region, region.diagonal / 30, growth=3.0)
    assert mesh.certificate.longest_edge <= 1.7 * mesh.size


@pytest.mark.parametrize("seed", [5031, 5032, 5011])
def test_legs_of_sharp_corners_meet_what_their_edges_ask(seed):
    region = regions.random_polygon(seed)
    size = region.diagonal / 30
    ends = np.flatnonzero([corner.angle < 50.0 for corner in region.corners()])
    assert len(ends)
    for sharp in ends[:2].tolist():
        mesh = mesh_of(region, size, edge_size={sharp: 0.2 * size})
        assert on_edge(mesh, sharp).max() <= 1.7 * 0.2 * size
        many = mesh_of(region, size, edge_segments={sharp: 12})
        length = on_edge(many, sharp)
        assert length.max() <= 1.7 * length.sum() / 12
    field = mesh_of(region, size, size_field=lambda p: np.full(len(p), 0.4 * size))
    assert longest_edge(field) <= 1.7 * 0.4 * size


def inlaid(seed: int) -> list[Region]:
    """A random polygon, and the frame around it that shares its edges."""
    inner = regions.random_polygon(seed, 8, 16).loops[0]
    starts = np.array([curve.start for curve in inner.curves])
    low, high = starts.min(axis=0), starts.max(axis=0)
    margin = 0.3 * (high - low).max()
    (x0, y0), (x1, y1) = low - margin, high + margin
    hole = Loop(tuple(curve.reverse() for curve in reversed(inner.curves)))
    outer = regions.loop([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    return [Region.from_loops([inner]), Region.from_loops([outer, hole])]


@pytest.mark.parametrize("seed", [13, 17, 21])
def test_the_growth_limit_holds_across_faces(seed):
    parts = inlaid(seed)
    mesh = fubini.mesh(parts, parts[0].diagonal / 20)
    assert mesh.certificate.certified
    sound = mesh.quality["skewness"] > 45.0
    assert growth_rates(mesh.points, mesh.triangles[sound]).max() <= 1.5


@pytest.mark.parametrize(
    ("make", "low"), [(regions.quarter_disk, 110), (regions.square, 160), (regions.annulus_quarter, 160)]
)
def test_small_faces_get_hardly_more_triangles_than_their_area_asks_for(make, low):
    region = make()
    asked = np.geomspace(low, 800, 24)
    meshes = [mesh_of(region, (region.area / count / (3**0.5 / 4)) ** 0.5) for count in asked]
    share = np.array([len(mesh.triangles) for mesh in meshes]) / asked
    assert share.max() < 1.1
    assert 1.0 < share.mean() < 1.06
    assert np.mean([mesh.quality["skewness"].mean() for mesh in meshes]) > 83.5
    assert all(mesh.certificate.certified and mesh.certificate.longest_edge < 1.7 * mesh.size for mesh in meshes)


@pytest.mark.parametrize("make", [regions.quarter_disk, regions.plate, regions.gear, regions.annulus_quarter])
@pytest.mark.parametrize("count", [2000, 6000])
def test_uniform_sizes(make, count):
    """The number of triangles is that of the area, no edge is long, the mean is good."""
    region = make()
    size = (region.area / count / (3**0.5 / 4)) ** 0.5
    mesh = mesh_of(region, size)
    assert len(mesh.triangles) == pytest.approx(count, rel=0.12)
    corners = mesh.points[mesh.triangles]
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() < 1.6 * size
    skew, ratio = mesh.quality["skewness"], mesh.quality["aspect_ratio"]
    assert skew.mean() > (81.5 if count == 2000 else 85.0)
    assert ratio.mean() < (1.033 if count == 2000 else 1.016)
    assert growth_rates(mesh.points, mesh.triangles).max() < 1.5


@pytest.mark.parametrize("make", [lambda: regions.random_polygon(76), lambda: regions.slot(2.0)])
def test_the_size_of_the_only_face_counts_as_that_of_the_mesh(make):
    """Nodes on its edges ask for no more, and neither its edges nor its triangles are told apart from uniform ones."""
    region = make()
    size = region.diagonal / 10
    whole, face = mesh_of(region, 0.6 * size), mesh_of(region, size, face_size={0: 0.6 * size})
    np.testing.assert_array_equal(face.points, whole.points)
    np.testing.assert_array_equal(face.triangles, whole.triangles)
    assert face.certificate.longest_edge <= 1.7 * 0.6 * size
