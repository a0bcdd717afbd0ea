"""From a region or a CAD file to a certified mesh: the promises that hold for every mesh."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import fubini
import regions
from fubini.curves import Bezier, Line
from fubini.errors import GeometryError, OptionError
from fubini.pipeline.attempts import whole
from fubini.pipeline.options import MeshOptions
from fubini.quality import areas
from fubini.sampling.boundary import BoundarySizing, Outline, SizeOptions
from fubini.sampling.network import Network
from fubini.triangulation.constrained import constrained_delaunay
from random_regions import random_region

CASES = {
    "quarter disk": (regions.quarter_disk, 0.05),
    "plate": (regions.plate, 0.15),
    "gear": (regions.gear, 0.08),
    "blob": (regions.blob, 0.08),
    "slot": (regions.slot, 0.6),
    "slot 1 : 2000": (lambda: regions.slot(0.005), 1.0),
    "quarter annulus": (regions.annulus_quarter, 0.1),
}


def mesh_of(region, size, **options):
    return fubini.mesh(regions.model_of(region), size, **options)


def assert_promises(mesh):
    """Certified, watertight inside, every edge of the CAD covered, no unused node."""
    c = mesh.certificate
    assert c.certified, [f.reasons for f in c.faces]
    assert c.flawed <= c.unavoidable
    assert set(np.unique(mesh.triangles)) == set(range(len(mesh.points)))
    assert set(mesh.edge_of_segment.tolist()) == set(mesh.model.edges)


@pytest.mark.parametrize("name", CASES)
def test_classics_are_certified(name):
    make, size = CASES[name]
    assert_promises(mesh_of(make(), size))


@pytest.mark.parametrize("seed", range(12))
def test_random_polygons_are_certified_and_keep_their_area(seed):
    region = regions.random_polygon(seed)
    mesh = mesh_of(region, 0.08)
    assert_promises(mesh)
    assert areas(mesh.points[mesh.triangles]).sum() == pytest.approx(region.area, rel=1e-12)


@pytest.mark.parametrize("degrees", [1, 7, 15, 24, 25, 30, 49, 51, 60, 75, 90, 119])
def test_wedges_are_flawed_only_where_they_must_be(degrees):
    mesh = mesh_of(regions.wedge(degrees), 0.1)
    assert_promises(mesh)
    assert mesh.certificate.unavoidable == (degrees < 24.295)
    for corner in mesh.certificate.faces[0].corners:
        assert corner.angle == pytest.approx(degrees, abs=1e-6)
        assert np.allclose(corner.point, 0.0)


def test_size_larger_than_the_model_gives_the_coarsest_mesh():
    assert len(mesh_of(regions.square(), 100.0).triangles) == 2
    mesh = mesh_of(regions.quarter_disk(), 100.0)
    assert_promises(mesh)
    assert len(mesh.triangles) < 15


def test_count_follows_the_size():
    for size in (0.1, 0.03, 0.01):
        mesh = mesh_of(regions.square(), size)
        assert len(mesh.triangles) == pytest.approx(1 / (3**0.5 / 4 * size**2), rel=0.1)


def test_same_input_gives_the_same_bytes():
    a, b = (mesh_of(regions.plate(), 0.2) for _ in range(2))
    assert a.points.tobytes() == b.points.tobytes()
    assert a.triangles.tobytes() == b.triangles.tobytes()


@pytest.mark.parametrize("scale", [2.0**-20, 1024.0])
@pytest.mark.parametrize("make", [regions.gear, regions.plate, lambda: random_region(3), lambda: random_region(24)])
def test_a_power_of_two_scales_the_mesh_bit_for_bit(make, scale):
    region = make()
    size = region.diagonal / 20.0
    small, big = mesh_of(region, size), mesh_of(region.transform(np.eye(2) * scale, (0.0, 0.0)), size * scale)
    assert big.triangles.tobytes() == small.triangles.tobytes()
    assert big.points.tobytes() == (small.points * scale).tobytes()


def test_models_that_differ_by_rounding_get_the_same_mesh():
    """A live object and its STEP file differ in the last digits; ties must not fall differently."""
    rng = np.random.default_rng(1)
    points = np.array([(0, 0), (4, 0), (4, 3), (2, 3), (2, 1), (0, 1)], float) + (0.1, 0.7)
    a = mesh_of(regions.polygon(points), 0.15)
    b = mesh_of(regions.polygon(points + 1e-14 * rng.standard_normal(points.shape)), 0.15)
    assert a.triangles.tobytes() == b.triangles.tobytes()
    assert np.abs(a.points - b.points).max() < 1e-12


def test_corners_are_the_cad_vertices_to_the_last_bit():
    points = np.random.default_rng(5).random((3, 2)) + [(0, 0), (3, 0.1), (1.3, 2)]
    mesh = mesh_of(regions.polygon(points), 0.3)
    assert {tuple(p) for p in points} <= {tuple(p[:2]) for p in mesh.points}


def test_far_from_the_origin():
    assert_promises(mesh_of(regions.gear().transform(np.eye(2), (1e6, -2e6)), 0.1))


def test_segments_run_along_their_curves():
    mesh = mesh_of(regions.quarter_disk(), 0.1)
    arc = mesh.segments[mesh.edge_of_segment == 1]
    assert (arc[1:, 0] == arc[:-1, 1]).all()
    assert np.allclose(np.linalg.norm(mesh.points[np.unique(arc)], axis=1), 1.0, atol=1e-15 * 4)
    assert np.allclose(mesh.points[arc[0, 0]], [1, 0, 0])
    assert np.allclose(mesh.points[arc[-1, 1]], [0, 1, 0])


@pytest.mark.parametrize("pattern", ["SP13", "SP41", "ASP20", "ASP48"])
def test_patterns_of_the_paper_are_certified(pattern):
    assert_promises(mesh_of(regions.quarter_disk(), None, pattern=pattern))


def test_higher_bounds_are_kept():
    mesh = mesh_of(regions.plate(), 0.15, min_skew=50.0)
    assert_promises(mesh)
    assert mesh.quality["skewness"].min() > 50.0


def test_two_faces_are_meshed_apart():
    square = regions.square()
    model = regions.model_of(square, square.transform(np.eye(2), (3.0, 0.0)))
    mesh = fubini.mesh(model, 0.2)
    assert_promises(mesh)
    only = fubini.mesh(model, 0.2, faces=[1])
    assert set(only.face_of_triangle.tolist()) == {1}
    assert only.certificate.skipped_faces == 1


@pytest.mark.parametrize("size", [0.0, -1.0, float("nan"), float("inf"), 1e-9])
def test_senseless_sizes_are_refused(size):
    with pytest.raises(OptionError):
        mesh_of(regions.square(), size)


@pytest.mark.parametrize("options", [{"pattern": "SP7"}, {"min_skew": 80.0}, {"growth": 1.0}, {"colour": "red"}])
def test_senseless_options_are_refused_with_a_list(options):
    with pytest.raises(OptionError, match=r"use|options are"):
        mesh_of(regions.square(), 0.1, **options)


def test_unknown_face_and_name_are_refused():
    model = regions.model_of(regions.square())
    with pytest.raises(OptionError, match="face 7"):
        fubini.mesh(model, 0.1, faces=[7])
    with pytest.raises(OptionError, match="no planar face is named"):
        fubini.mesh(model, 0.1, select="lid")


def test_crossing_outline_names_face_and_place():
    bow = regions.Loop(regions.loop([(0, 0), (2, 2), (2, 0), (0, 3)]).curves)
    model = regions.model_of(regions.Region(bow))
    with pytest.raises(GeometryError, match="face 0") as caught:
        fubini.mesh(model, 0.3)
    assert len(caught.value.at) == 3


def test_a_boundary_whose_segments_cross_never_reaches_the_optimiser():
    """Two sides leave a notch of no width in one direction, one a hair above the other: told with the place."""
    tip, last = (0.312, 0.0294), (0.285, 0.02985)
    sides = [last, (0, 0.1), (0, -0.3), (0.5, -0.3), (0.5, 0.1), (0.38, 0.0478)]
    notch = Bezier([sides[-1], (0.3716, 0.0294), tip]), Bezier([tip, (0.3208, 0.0294), last])
    region = regions.chain(*notch, *(Line(p, q) for p, q in itertools.pairwise(sides)))
    assert region.validate() == ()
    for share in (6, 80):
        with pytest.raises(
            GeometryError, match=r"face 0: edge [01]: at .* the boundary crosses or touches itself"
        ) as caught:
            fubini.mesh(region, region.diagonal / share)
        assert caught.value.at == pytest.approx((*tip, 0.0), abs=1e-3)
    crossed = regions.polygon([(0, 0), (4, 0), (4, 4), (0, 4)])
    outline = Outline.of(crossed, lambda edge: 10 + edge)
    boundary = mesh_boundary(crossed)
    bow = replace(boundary, points=boundary.points[[0, 2, 1, 3]])
    with pytest.raises(GeometryError, match=r"edge 1[0-3]: .*crosses"):
        whole(constrained_delaunay(bow.points, bow), outline)


def mesh_boundary(region):
    """The boundary of a region at a size beyond it: its corners alone."""
    outline = Outline.of(region, lambda edge: edge)
    network = Network.of([outline], [(k, (k + 1) % len(region.edges)) for k in range(len(region.edges))])
    sizing = BoundarySizing(network, SizeOptions(10.0 * region.diagonal))
    return sizing.boundary(0, sizing.resolve())


def test_options_describe_a_gradient_from_the_growth():
    assert MeshOptions(growth=1.5).gradient == pytest.approx(0.35)


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int64])
def test_sizes_of_numpy_are_numbers(kind):
    assert mesh_of(regions.plate(), kind(1)).points.tobytes() == mesh_of(regions.plate(), 1.0).points.tobytes()


@pytest.mark.parametrize("size", [True, "1", [1.0], float("nan")])
def test_sizes_that_are_no_numbers_are_refused(size):
    with pytest.raises(OptionError, match="size is"):
        mesh_of(regions.plate(), size)


def test_an_empty_list_of_faces_is_refused():
    with pytest.raises(OptionError, match="list of faces is empty"):
        mesh_of(regions.plate(), 1.0, faces=[])


def test_sizes_beyond_the_model_give_one_coarsest_mesh():
    coarse = mesh_of(regions.plate(), 1e3)
    assert_promises(coarse)
    assert mesh_of(regions.plate(), 1e300).points.tobytes() == coarse.points.tobytes()


def test_values_print_as_one_line():
    mesh = mesh_of(regions.plate(), 1.0)
    for text in (repr(mesh), repr(mesh.model)):
        assert len(text.splitlines()) == 1
        assert len(text) < 200
    assert f"{len(mesh.triangles)} triangles" in repr(mesh)
    assert "1 planar faces" in repr(mesh.model)
