"""Any mesh is judged by the same figures."""

from __future__ import annotations

import json

import meshio
import numpy as np
import pytest
import trimesh

from fubini.errors import InputError
from fubini.report import check, check_table
from handmade import bad_square, box, grid, one_face, square, wedge


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply", ".glb", ".vtu", ".vtk"])
def test_agrees_with_the_certificate(tmp_path, suffix):
    for name, mesh in (("box", box(3)), ("bad", bad_square())):
        mesh.save(tmp_path / f"{name}{suffix}")
        found = check(tmp_path / f"{name}{suffix}")
        wanted = mesh.certificate
        assert (found.triangles, found.flawed) == (wanted.triangles, wanted.flawed)
        assert found.points == len(mesh.points)
        assert found.valid is wanted.certified
        assert found.worst_skew == pytest.approx(wanted.worst_skew, abs=1e-4)
        assert found.worst_aspect_ratio == pytest.approx(wanted.worst_aspect_ratio, rel=1e-4)
        assert (found.min_angle, found.max_angle) == pytest.approx((wanted.min_angle, wanted.max_angle), abs=1e-4)
        assert found.worst_at == pytest.approx(wanted.faces[0].worst_at, abs=1e-5) or name == "box"


def test_topology_of_a_box_and_a_square(tmp_path):
    closed = check(box(3))
    assert (closed.boundary_loops, closed.boundary_edges, closed.nonmanifold_edges) == (0, 0, 0)
    assert closed.area == pytest.approx(6.0)
    assert closed.faces == 6
    box(2).save(tmp_path / "box.vtu")
    assert check(tmp_path / "box.vtu").faces == 6
    flat = check(square(3))
    assert (flat.boundary_loops, flat.boundary_edges) == (1, 12)


def test_spoiled_topology():
    points, triangles = grid(2)
    points = np.pad(points, ((0, 0), (0, 1)))
    spoiled = np.concatenate([triangles, triangles[:1], [[0, 1, 8]]])
    spoiled[1] = spoiled[1][[0, 2, 1]]
    found = check(trimesh.Trimesh(points, spoiled, process=False))
    assert found.duplicate_triangles == 1
    assert found.nonmanifold_edges > 0
    assert found.misoriented_edges > 0
    line = check(trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], process=False))
    assert (line.degenerate_triangles, line.flawed, line.valid) == (1, 1, False)
    assert json.loads(json.dumps(line.to_json(), allow_nan=False))["worst_aspect_ratio"] is None


def test_two_holes_are_two_loops():
    points, triangles = grid(7)
    inner = np.isin(triangles, [18, 45]).any(1)  # all triangles around two nodes
    found = check(trimesh.Trimesh(np.pad(points, ((0, 0), (0, 1))), triangles[~inner], process=False))
    assert found.boundary_loops == 3


def test_a_sharp_corner_of_the_outline_excuses_one():
    found = check(wedge(15.0))
    assert (found.flawed, found.unavoidable, found.excess, found.valid) == (1, 1, 0, True)
    h = np.tan(np.radians(7.5))
    corners = [(0.0, 0.0), (1.0, -h), (1.0, h)]
    split = check(one_face(corners, [*corners, (1.0, 0.0)], [(0, 1, 3), (0, 3, 2)]))
    assert (split.flawed, split.unavoidable, split.excess, split.valid) == (2, 1, 1, False)


def test_inner_nodes_are_no_corners():
    """A fan of slivers around an inner node of a cone-like cap is not excused."""
    assert check(bad_square()).unavoidable == 0


def test_stricter_bounds():
    assert check(box(2)).valid
    assert not check(box(2), min_skew=64.0).valid
    assert not check(box(2), max_aspect_ratio=1.2).valid


def test_other_cells_are_counted(tmp_path):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0]])
    mixed = meshio.Mesh(points, [("triangle", [[0, 1, 2]]), ("quad", [[1, 4, 5, 3]]), ("line", [[0, 1]])])
    mixed.write(tmp_path / "mixed.vtu")
    found = check(tmp_path / "mixed.vtu")
    assert (found.triangles, found.other_cells) == (1, 1)
    flat = meshio.Mesh(points[:, :2], [("triangle", [[0, 1, 2]])])
    assert check(flat).triangles == 1


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty.stl", b""),
        ("text.vtu", b"hello"),
        ("text.glb", b"hello"),
        ("what.xyzzy", b"hello"),
        ("none.obj", b"v 0 0 0\n"),
        ("nan.obj", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
    ],
)
def test_unreadable_files_are_named(tmp_path, name, content, capfd):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=name.replace(".", r"\.")):
        check(tmp_path / name)
    assert capfd.readouterr().out == ""


def test_missing_file_and_other_things():
    with pytest.raises(InputError, match="no such file"):
        check("nowhere.stl")
    with pytest.raises(InputError, match="no triangle mesh"):
        check(42)
    with pytest.raises(InputError, match="not there"):
        check(meshio.Mesh(np.zeros((3, 3)), [("triangle", [[0, 1, 7]])]))


def test_text():
    text = check_table(check(bad_square()))
    assert "NOT valid" in text
    assert "1 boundary loop," in text
    assert "closed" in check_table(check(box(2)))
