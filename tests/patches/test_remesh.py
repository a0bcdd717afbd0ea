"""A CAD exporter's triangles in, the same surface of certified triangles out."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

import fubini
from fubini.cli import main
from fubini.errors import InputError, OptionError
from fubini.patches import facet_model, read_facets
from meshes import apart, area, edge_uses, volume

trimesh = pytest.importorskip("trimesh")

BOX = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7), (0, 1, 5), (0, 5, 4), (1, 2, 6), (1, 6, 5)]
BOX += [(2, 3, 7), (2, 7, 6), (3, 0, 4), (3, 4, 7)]
CORNERS = np.array([(0, 0, 0), (3, 0, 0), (3, 2, 0), (0, 2, 0), (0, 0, 1), (3, 0, 1), (3, 2, 1), (0, 2, 1)], float)


def grid(n, z=0.0, skip=()):
    """Points and triangles of n x n unit squares; those in ``skip`` are left out."""
    points = np.array([(x, y, z) for y in range(n + 1) for x in range(n + 1)], float)
    triangles = []
    for y in range(n):
        for x in range(n):
            a = y * (n + 1) + x
            if (x, y) not in skip:
                triangles += [(a, a + 1, a + n + 2), (a, a + n + 2, a + n + 1)]
    return points, np.array(triangles)


def test_box_of_loose_triangles_is_closed():
    """Corners given once for every triangle, as an STL file holds them."""
    points = CORNERS[np.array(BOX)].reshape(-1, 3)
    mesh = fubini.remesh((points, np.arange(36).reshape(-1, 3)), 0.4)
    assert mesh.certificate.certified and len(mesh.model.faces) == 6 and len(mesh.model.edges) == 12
    assert trimesh.Trimesh(mesh.points, mesh.triangles, process=False).is_watertight
    assert volume(mesh) == pytest.approx(6.0, rel=1e-12) and apart(mesh) > 0.05


def test_runs_of_one_line_become_one_edge_and_holes_are_kept():
    model = facet_model(read_facets(grid(5, skip={(2, 2), (3, 2)})))
    (face,) = model.faces
    assert len(face.region.outer.curves) == 4 and len(face.region.holes) == 1
    assert len(face.region.holes[0].curves) == 4
    assert face.region.area == pytest.approx(23.0, rel=1e-13)


def test_holes_that_meet_in_a_point():
    mesh = fubini.remesh(grid(4, skip={(1, 1), (2, 2)}), 0.5)
    assert area(mesh) == pytest.approx(14.0, rel=1e-12)
    assert mesh.certificate.certified and apart(mesh) > 0.05
    assert any("outline touches itself" in note for note in mesh.certificate.notes)


def test_a_wall_on_a_plate_shares_the_nodes_of_its_foot():
    points, triangles = grid(4)
    wall = np.array([(x, 2, 1) for x in (1, 2, 3)], float)
    foot, top = [11, 12, 13], [25, 26, 27]
    more = [(foot[k], foot[k + 1], top[k + 1]) for k in (0, 1)] + [(foot[k], top[k + 1], top[k]) for k in (0, 1)]
    mesh = fubini.remesh((np.concatenate([points, wall]), np.concatenate([triangles, more])), 0.4)
    edges, uses = edge_uses(mesh)
    ends = mesh.points[edges[uses == 3]]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(2.0, rel=1e-12)
    assert area(mesh) == pytest.approx(18.0, rel=1e-12) and len(mesh.model.faces) == 2
    assert mesh.certificate.certified


def test_a_prism_keeps_every_corner_of_its_polygon():
    n = 40
    ring = [(math.cos(2 * math.pi * k / n), math.sin(2 * math.pi * k / n)) for k in range(n)]
    points = np.array([(x, y, z) for z in (0.0, 2.0) for x, y in ring])
    caps = [(0, k + 1, k) for k in range(1, n - 1)] + [(n, n + k, n + k + 1) for k in range(1, n - 1)]
    sides = [(k, (k + 1) % n, n + (k + 1) % n) for k in range(n)] + [(k, n + (k + 1) % n, n + k) for k in range(n)]
    mesh = fubini.remesh((points, caps + sides), 0.3)
    assert len(mesh.model.faces) == n + 2 and len(mesh.model.vertices) == 2 * n
    assert set(edge_uses(mesh)[1].tolist()) == {2} and mesh.certificate.certified
    assert volume(mesh) == pytest.approx(n * math.sin(2 * math.pi / n), rel=1e-12)


@pytest.mark.parametrize("far", [0.0, 1000.0])
def test_export_of_build123d(tmp_path, far):
    """Slivers in, none out; the volume of what was given is kept, in single precision too."""
    b3d = pytest.importorskip("build123d")
    part = b3d.Box(4, 3, 2) - b3d.Pos(1, 0, 0) * b3d.Cylinder(0.6, 5) - b3d.Pos(-1, 0.5, 0) * b3d.Box(0.5, 1, 5)
    path = tmp_path / "in.stl"
    b3d.export_stl(b3d.Pos(far, far, 0) * part, str(path), tolerance=0.05, angular_tolerance=0.3)
    given = trimesh.load(path)
    from fubini.quality import skewness

    assert given.is_watertight and skewness(given.vertices[given.faces]).min() < 10.0
    mesh = fubini.remesh(path, 0.5)
    solid = trimesh.Trimesh(mesh.points, mesh.triangles, process=False)
    assert mesh.certificate.certified and mesh.certificate.unavoidable == 0
    assert solid.is_watertight and solid.is_winding_consistent
    assert solid.volume == pytest.approx(given.volume, rel=1e-6 if not far else 1e-3)


def test_command(tmp_path):
    path = tmp_path / "box.stl"
    trimesh.Trimesh(CORNERS, BOX, process=False).export(path)
    out = tmp_path / "out.stl"
    result = CliRunner().invoke(main, ["remesh", str(path), "-o", str(out), "--size", "0.5", "--json", "-"])
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert data["certified"] and "12 triangles form 6 planar patches" in data["notes"]
    assert trimesh.load(out).is_watertight
    missing = CliRunner().invoke(main, ["remesh", str(tmp_path / "none.stl"), "-o", str(out)])
    assert missing.exit_code == 2 and "no such file" in missing.stderr


def test_the_same_bytes_again():
    first, second = (fubini.remesh((CORNERS, BOX), 0.5) for _ in range(2))
    assert first.points.tobytes() == second.points.tobytes()
    assert first.triangles.tobytes() == second.triangles.tobytes()


@pytest.mark.parametrize(
    "source",
    [
        (np.zeros((3, 3)), [(0, 1, 2)]),
        (CORNERS, np.empty((0, 3), int)),
        (CORNERS, [(0, 1, 9)]),
        (CORNERS[:, :2], BOX),
        (np.full((3, 3), np.nan), [(0, 1, 2)]),
        42,
    ],
)
def test_what_is_no_surface(source):
    with pytest.raises(InputError):
        fubini.remesh(source, 1.0)


def test_options_are_checked():
    with pytest.raises(OptionError, match="unknown option 'colour'"):
        fubini.remesh((CORNERS, BOX), 1.0, colour="red")


def test_faces_of_a_solid_with_sharp_corners_that_share_a_leg():
    """Three faces of 15, 45 and 45 degrees meet in one vertex."""
    a, b = np.radians([15.0, 45.0])
    x = np.cos(b)
    y = (x - x * np.cos(a)) / np.sin(a)
    corners = np.array([(0, 0, 0), (np.cos(a), np.sin(a), 0), (1, 0, 0), (x, y, np.sqrt(1 - x * x - y * y))])
    mesh = fubini.remesh((corners, np.array([(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)])), 0.3)
    assert mesh.certificate.certified and mesh.certificate.flawed == mesh.certificate.unavoidable == 2
    assert len(mesh.triangles) < 200


def test_the_size_picked_for_many_small_faces_makes_no_million_triangles():
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(subdivisions=2)
    mesh = fubini.remesh((ball.vertices, ball.faces))
    assert mesh.certificate.certified
    assert 80_000 < len(mesh.triangles) < 130_000  # a fortieth of a facet would make 240,000
