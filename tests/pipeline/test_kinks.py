"""A kink inside one CAD edge is a corner of the mesh, while the edge stays one to all who speak of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import fubini
from fubini.cli.info import describe
from fubini.curves import Bezier, BSpline, Line
from fubini.quality import corner_limit
from fubini.region import Loop, Region
from random_regions import random_region

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
ELL = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
ZIGZAG = [(0, 1), (0.5, 1.3), (1, 0.8), (1.5, 1.2), (2, 1)]


def star(tips, degrees):
    """Corners of a star of radius 1 with tips of this angle."""
    half, step = math.radians(degrees / 2), math.pi / tips
    radii = 1.0, math.sin(half) / math.sin(math.pi - half - step)
    return [(radii[k % 2] * math.cos(k * step), radii[k % 2] * math.sin(k * step)) for k in range(2 * tips)]


def joined(points, degree=1):
    """Bezier pieces that share their ends as one B-spline, as full knots make it."""
    pieces = (len(points) - 1) // degree
    knots = np.concatenate([[0], np.repeat(np.arange(pieces + 1), degree), [pieces]])
    return BSpline(degree, knots, np.array(points, float))


def closed(points, degree=1):
    """Region inside one closed edge."""
    return Region(Loop((joined([*points, points[0]], degree),)))


def distance(mesh, points):
    """Largest distance from a point to the nearest node."""
    return max(float(np.hypot(*(mesh.points[:, :2] - p).T).min()) for p in points)


def two_sheets():
    """Two faces that share a zigzag, which the first runs along backwards."""
    zigzag = joined(ZIGZAG)
    low = Loop((Line((0, 0), (2, 0)), Line((2, 0), (2, 1)), zigzag.reverse(), Line((0, 1), (0, 0))))
    high = Loop((zigzag, Line((2, 1), (2, 2)), Line((2, 2), (0, 2)), Line((0, 2), (0, 1))))
    return [Region(low), Region(high)]


@pytest.mark.parametrize("corners", [SQUARE, ELL, star(5, 30), star(6, 15)], ids=["square", "L", "star", "sharp star"])
def test_polygons_that_are_one_edge_keep_their_corners(corners):
    sharp = sum(angle < corner_limit() for angle in Region.polygon(corners).corner_angles)
    for size in (10.0, 0.9, 0.2, 0.06):
        mesh = fubini.mesh(closed(corners), size, order=1 + (size < 0.5))
        c = mesh.certificate
        assert c.certified
        assert c.unavoidable == sharp
        assert c.flawed <= sharp
        assert distance(mesh, corners) < 1e-15
        assert c.area_error < 1e-14
        assert max(c.boundary_distance, c.chord_error) < 1e-15
        assert set(mesh.edge_of_segment.tolist()) == {0}
        assert mesh.t_of_segment[0, 0] == 0.0
        assert mesh.t_of_segment[-1, 1] == 1.0
        assert (mesh.t_of_segment[1:, 0] == mesh.t_of_segment[:-1, 1]).all()
        along = closed(corners).outer.curves[0].point(mesh.t_of_segment[:, 0])
        np.testing.assert_allclose(mesh.points[mesh.segments[:, 0], :2], along, atol=1e-14)


def test_one_edge_gives_the_mesh_of_many():
    corners = star(7, 40)[-4:] + star(7, 40)[:-4]
    start = min(range(14), key=lambda k: corners[k])
    corners = corners[start:] + corners[:start]
    one, many = fubini.mesh(closed(corners), 0.1), fubini.mesh(Region.polygon(corners), 0.1)
    assert (one.triangles == many.triangles).all()
    np.testing.assert_allclose(one.points, many.points, atol=1e-14)


@pytest.mark.parametrize("size", [10.0, 1.0, 0.3, 0.1])
@pytest.mark.parametrize(
    ("degree", "poles", "kinks"),
    [
        (2, [(0, 0), (1, 0.3), (2, 0), (1.5, 1), (1, 2), (0.5, 1)], [0, 2, 4]),
        (3, [(0, 0), (2, -1), (3, 1), (3, 3), (1, 2), (-1, 2)], [0, 3]),
    ],
)
def test_knots_of_full_multiplicity_are_corners(degree, poles, kinks, size):
    region = closed(poles, degree)
    mesh = fubini.mesh(region, size, order=2)
    assert mesh.certificate.certified
    assert distance(mesh, [poles[k] for k in kinks]) < 1e-15
    mids = mesh.points[mesh.segment_midsides, :2]
    assert region.curves[0].closest(mids)[1].max() < 1e-13


def test_a_slight_turn_is_no_corner():
    bent = [(0, 0), (1, 0), (2, math.tan(math.radians(0.5))), (2, 2), (0, 2)]
    mesh = fubini.mesh(closed(bent), 10.0)
    assert mesh.certificate.certified
    assert distance(mesh, [bent[k] for k in (0, 2, 3, 4)]) < 1e-15
    assert distance(mesh, bent[1:2]) > 0.1


def test_a_sharp_kink_has_equal_legs():
    tip = math.tan(math.radians(15))
    mesh = fubini.mesh(closed([(0, 1), (0, 0), (3, 0.4), (0, 0.4 + 3 * tip)]), 0.2)
    f = mesh.certificate.faces[0]
    assert mesh.certificate.certified
    assert f.flawed == f.unavoidable == 1
    assert f.corners[0].point == pytest.approx((3, 0.4, 0), abs=1e-15)
    at = mesh.segments[(mesh.points[mesh.segments, 0] == 3.0).any(axis=1)]
    assert len(at) == 2
    assert np.ptp(np.linalg.norm(np.diff(mesh.points[at], axis=1)[:, 0], axis=1)) < 1e-11


@pytest.mark.parametrize("size", [10.0, 0.5, 0.1])
def test_faces_share_the_nodes_of_an_edge_with_kinks(size):
    mesh = fubini.mesh(two_sheets(), size, order=2)
    assert mesh.certificate.certified
    assert distance(mesh, ZIGZAG) < 1e-15
    assert len(np.unique(mesh.points.round(12), axis=0)) == len(mesh.points)
    assert set(mesh.boundaries) == {"outer", "face_0|face_1"}
    assert sorted(set(mesh.edge_of_segment.tolist())) == list(range(7))
    assert mesh.certificate.area_error < 1e-14


def test_sizes_names_and_cracks_mean_the_whole_edge():
    model = fubini.load(two_sheets())
    (edge,) = (e.index for e in model.edges.values() if e.kind == "bspline")
    finer = fubini.mesh(model, 0.5, edge_size={edge: 0.05})
    on_edge = finer.edge_of_segment == edge
    assert on_edge.sum() == pytest.approx(model.faces[1].region.curves[0].length() / 0.05, rel=0.1)
    for count in (1, 9, 17):
        mesh = fubini.mesh(model, 10.0, edge_segments={edge: count}, names={"zigzag": f"edges {edge}"})
        assert len(mesh.boundaries["zigzag"]) == max(count, 4)
        assert mesh.certificate.certified
    end = model.edges[edge].end
    ends = fubini.mesh(model, 0.5, names={"end": f"vertices {end}"})
    assert (ends.points[ends.named_points["end"]] == model.vertices[end]).all()
    cracked = fubini.mesh(model, 0.5, cracks=edge)
    assert cracked.certificate.certified
    assert len(cracked.boundaries["face_0|face_1+"]) == len(cracked.boundaries["face_0|face_1-"]) >= 4


@pytest.mark.parametrize("pattern", ["SP13", "ASP20"])
def test_mapped_patterns_have_nodes_at_kinks_too(pattern):
    mesh = fubini.mesh(two_sheets(), pattern=pattern)
    assert mesh.certificate.certified
    assert distance(mesh, ZIGZAG) < 1e-15


def test_repeated_points_at_a_sharp_tip_leave_its_angle():
    tip = math.tan(math.radians(15))
    region = closed([(0, 0), (0, 0), (1, 0.3), (1, 0.3 + tip), (1, 0.3 + tip)])
    mesh = fubini.mesh(region, 0.1)
    assert mesh.certificate.certified
    assert mesh.certificate.unavoidable == sum(
        a < corner_limit() for a in Region.polygon([(0, 0), (1, 0.3), (1, 0.3 + tip)]).corner_angles
    )


@pytest.mark.parametrize("size", [1.0, 0.1, 0.03])
@pytest.mark.parametrize("air", [False, True])
def test_a_cusp_inside_a_curve_is_a_node(air, size):
    curve = Bezier([(0, 0), (1, 1), (0, 1), (1, 0)])
    around = [(1, 0), (1, 2), (0, 2), (0, 0)] if air else [(1, 0), (0, 0)]
    mesh = fubini.mesh(Region(Loop((curve, *(Line(a, b) for a, b in zip(around, around[1:]))))), size)
    assert mesh.certificate.certified
    assert mesh.certificate.unavoidable == (0 if air else 1)
    assert distance(mesh, [(0.5, 0.75)]) < 1e-15


def test_info_lists_kinks_as_corners():
    (face,) = describe(fubini.load(closed(star(6, 15))))["faces"]
    assert len(face["corners"]) == 12
    assert sum(corner["unavoidable"] for corner in face["corners"]) == 6
    assert face["loops"] == [[0]]


@pytest.mark.parametrize("seed", range(3))
def test_faces_without_kinks_are_meshed_as_they_are(seed):
    model = fubini.load(random_region(seed))
    assert model.faces_cut is model.faces
    assert model.numbering.parts(0) == {0: 1.0}
