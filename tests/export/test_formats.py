"""Every format is read back by an independent reader and gives the same triangles."""

from __future__ import annotations

import dataclasses

import meshio
import numpy as np
import pytest
import trimesh

from fubini.errors import ExportError
from fubini.export import WRITERS, flawed_after_rounding, formats, save
from fubini.export.obj import group_labels
from handmade import bad_square, box, square

DOUBLE = {".vtu", ".vtk", ".obj"}
SURFACES = [".glb", ".obj", ".ply", ".stl", ".vtk", ".vtu"]


def shift(mesh, by):
    return dataclasses.replace(mesh, points=mesh.points + by)


@pytest.mark.parametrize("suffix", SURFACES)
def test_reads_back(tmp_path, suffix):
    mesh = shift(box(3), [0.1, 1 / 3, 2.0])
    path = tmp_path / f"box{suffix}"
    mesh.save(path)
    if suffix in (".vtu", ".vtk"):
        found = meshio.read(path)
        assert [c.type for c in found.cells] == ["triangle"]
        points, triangles = found.points, found.cells[0].data
    else:
        found = trimesh.load(path, process=False, force="mesh")
        points, triangles = found.vertices, found.faces
    wanted = mesh.points[mesh.triangles]
    assert len(triangles) == len(mesh.triangles)
    if suffix == ".obj":  # grouped by face: here the order is that of the mesh
        assert points.dtype == np.float64
    np.testing.assert_allclose(
        np.asarray(points)[triangles],
        wanted,
        rtol=0 if suffix in DOUBLE else 1e-6,
        atol=0 if suffix in DOUBLE else 1e-7,
    )
    if suffix != ".stl":
        assert len(points) == len(mesh.points)
        assert trimesh.Trimesh(points, triangles, process=False).is_watertight
        assert trimesh.Trimesh(points, triangles, process=False).volume == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_face_array(tmp_path, suffix):
    mesh = box(2)
    mesh.save(tmp_path / f"a{suffix}")
    found = meshio.read(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(found.cell_data["face"][0].ravel(), mesh.face_of_triangle)
    assert found.points.dtype.itemsize == 8
    assert np.issubdtype(found.cell_data["face"][0].dtype, np.integer)


def test_ply_keeps_face(tmp_path):
    mesh = box(2)
    mesh.save(tmp_path / "a.ply")
    found = trimesh.load(tmp_path / "a.ply", process=False)
    np.testing.assert_array_equal(found.metadata["_ply_raw"]["face"]["data"]["face"].ravel(), mesh.face_of_triangle)


@pytest.mark.parametrize("suffix", formats())
def test_same_bytes_twice(tmp_path, suffix):
    mesh = square(2) if suffix == ".su2" else box(2)
    mesh.save(tmp_path / f"a{suffix}")
    mesh.save(tmp_path / f"b{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("suffix", formats())
def test_unreferenced_points_are_not_written(tmp_path, suffix):
    mesh = square(2)
    stray = np.concatenate([[[9.0, 9, 9]], mesh.points, [[8.0, 8, 8]]])
    padded = dataclasses.replace(mesh, points=stray, triangles=mesh.triangles + 1, segments=mesh.segments + 1)
    padded.save(tmp_path / f"a{suffix}")
    mesh.save(tmp_path / f"b{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


def test_stl_normals_point_outward(tmp_path):
    mesh = box(2)
    mesh.save(tmp_path / "a.stl")
    found = trimesh.load(tmp_path / "a.stl", process=False)
    outward = found.triangles_center - 0.5
    stored = found.face_normals
    assert ((outward * stored).sum(1) > 0.4).all()


def test_obj_groups(tmp_path):
    mesh = dataclasses.replace(box(1), face_names={1: "top lid", 2: "side", 3: "side"})
    mesh.save(tmp_path / "a.obj")
    lines = (tmp_path / "a.obj").read_text().splitlines()
    groups = [line[2:] for line in lines if line.startswith("g ")]
    assert groups == ["face_0", "top_lid", "side_2", "side_3", "face_4", "face_5"]
    assert group_labels(mesh)[1] == "top_lid"


def test_unknown_suffix_lists_the_valid(tmp_path):
    with pytest.raises(ExportError) as caught:
        save(square(), tmp_path / "a.xyz")
    assert all(suffix in str(caught.value) for suffix in WRITERS)
    assert "a.xyz" in str(caught.value)
    with pytest.raises(ExportError, match="no suffix"):
        save(square(), tmp_path / "a")
    assert not list(tmp_path.iterdir())


def test_suffix_in_capitals(tmp_path):
    save(square(), tmp_path / "a.STL")
    assert trimesh.load(tmp_path / "a.STL").faces.shape == (8, 3)


def test_conversions():
    mesh = box(2)
    other = mesh.to_trimesh()
    np.testing.assert_array_equal(other.faces, mesh.triangles)
    np.testing.assert_array_equal(other.vertices, mesh.points)
    np.testing.assert_array_equal(other.face_attributes["face"], mesh.face_of_triangle)
    third = mesh.to_meshio()
    np.testing.assert_array_equal(third.cells_dict["triangle"], mesh.triangles)
    np.testing.assert_array_equal(third.cell_data_dict["face"]["triangle"], mesh.face_of_triangle)


def test_empty_and_infinite_are_refused(tmp_path):
    mesh = square()
    empty = dataclasses.replace(mesh, triangles=np.empty((0, 3), np.int32), face_of_triangle=np.empty(0, np.int32))
    with pytest.raises(ExportError, match="no triangle"):
        empty.save(tmp_path / "a.stl")
    with pytest.raises(ExportError, match="not finite"):
        shift(mesh, np.inf).save(tmp_path / "a.obj")
    assert not list(tmp_path.iterdir())


def test_rounding_is_noticed():
    assert flawed_after_rounding(square(8)) == 0
    assert flawed_after_rounding(bad_square()) == 0
    assert flawed_after_rounding(shift(square(7), 4e6)) > 0
