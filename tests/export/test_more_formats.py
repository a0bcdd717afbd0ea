"""MFEM, SU2, 3MF and STL by parts, read back; names that a format cannot hold as they are."""

from __future__ import annotations

import dataclasses
import re
import zipfile
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import trimesh

import fubini
from fubini.errors import ExportError, OptionError
from fubini.export import renamed
from fubini.export.obj import group_labels
from fubini.export.titles import titles
from fubini.quality import areas
from handmade import box, square
from materials import NAMES, TILTED, two_materials
from meshes import length

ORDERS = pytest.mark.parametrize("order", [1, 2])
OVERLAP = {"steel": "face 0", 'größe "x"': "face 1", "all": "faces 0-1", "clamped": "edge 3"}


@pytest.fixture(scope="module")
def meshes():
    return {order: fubini.mesh(two_materials(), 0.3, names=OVERLAP, order=order) for order in (1, 2)}


def read_mfem(path):
    """Coordinates of vertices or nodes, elements, segments, and both kinds of sets."""
    text = path.read_text()
    sections = dict(re.findall(r"^([a-z_]+)\n(.*?)(?=\n\n[a-z]|\n\nmfem|\Z)", text, flags=re.S | re.M))
    assert text.startswith("MFEM mesh v1.3\n\n") and text.endswith("\nmfem_mesh_end\n")

    def table(title):
        rows = sections[title].splitlines()
        assert int(rows[0]) == len(rows) - 1
        return np.array([[int(x) for x in row.split()] for row in rows[1:]])

    def sets(title):
        rows = sections[title].splitlines()[1:]
        found = {}
        for row in rows:
            name, numbers = re.fullmatch(r'"([^"]+)" (.*)', row).groups()
            count, *members = map(int, numbers.split())
            assert count == len(members)
            found[name] = members
        return found

    if "nodes" in sections:
        head, _, numbers = sections["nodes"].partition("\n\n")
        assert head.splitlines()[1:] == ["FiniteElementCollection: L2_T1_2D_P2", "VDim: 2", "Ordering: 1"]
        rows = text[text.index("Ordering: 1\n\n") + 13 :].partition("\n\n")[0].splitlines()
    else:
        rows = sections["vertices"].splitlines()[2:]
    points = np.array([[float(x) for x in row.split()] for row in rows])
    return points, table("elements"), table("boundary"), sets("attribute_sets"), sets("bdr_attribute_sets")


@ORDERS
def test_mfem(tmp_path, meshes, order):
    mesh = meshes[order]
    mesh.save(tmp_path / "a.mesh")
    points, elements, boundary, regions, boundaries = read_mfem(tmp_path / "a.mesh")
    assert set(elements[:, 1]) == {2} and set(boundary[:, 1]) == {1}
    np.testing.assert_array_equal(elements[:, 2:], mesh.triangles)
    if order == 1:
        np.testing.assert_array_equal(points, mesh.points[:, :2])
    else:  # row by row from corner 0: 0, 01, 1, 20, 12, 2
        nodes = np.column_stack([mesh.triangles, mesh.midsides])[:, [0, 3, 1, 5, 4, 2]]
        np.testing.assert_array_equal(points, mesh.points[nodes.ravel(), :2])
    for name, rows in mesh.regions.items():
        np.testing.assert_array_equal(np.flatnonzero(np.isin(elements[:, 0], regions[name.replace('"', "'")])), rows)
    for name, rows in mesh.boundaries.items():
        theirs = boundary[np.isin(boundary[:, 0], boundaries[name.replace('"', "'")]), 2:]
        assert {frozenset(p) for p in theirs.tolist()} == {frozenset(p) for p in mesh.segments[rows].tolist()}
        assert len(theirs) == len(rows)


def test_mfem_in_space_and_points_refused(tmp_path):
    fubini.mesh(two_materials(TILTED), 0.5).save(tmp_path / "a.mesh")
    assert "\n3\n" in (tmp_path / "a.mesh").read_text().partition("vertices")[2][:12]
    with pytest.raises(ExportError, match=r"named points tip"):
        fubini.mesh(two_materials(), 0.5, names=NAMES).save(tmp_path / "b.mesh")


def test_su2(tmp_path):
    mesh = fubini.mesh(two_materials(TILTED), 0.3, faces=[1], names={"far field": "edges 4-6"})
    mesh.save(tmp_path / "a.su2")
    found = meshio.read(tmp_path / "a.su2")
    np.testing.assert_array_equal(found.cells_dict["triangle"], mesh.triangles)
    flat = np.pad(found.points, ((0, 0), (0, 1)))
    assert areas(flat[mesh.triangles]) == pytest.approx(areas(mesh.points[mesh.triangles]), rel=1e-12)
    text = (tmp_path / "a.su2").read_text()
    marks = re.findall(r"MARKER_TAG= (\S+)\nMARKER_ELEMS= (\d+)\n", text)
    wanted = {"far field": "far_field", "edge_1": "edge_1", "hole_1": "hole_1", "outer": "outer"}
    assert marks == [(wanted[name], str(len(rows))) for name, rows in mesh.boundaries.items()]
    assert renamed(mesh, "a.su2") == {"far field": "far_field"}
    lines = found.points[found.cells_dict["line"]]
    assert np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum() == pytest.approx(
        sum(length(mesh, rows) for rows in mesh.boundaries.values())
    )


def test_su2_refuses_what_it_would_lose(tmp_path):
    with pytest.raises(ExportError, match=r"names of 2 regions.*\.msh"):
        fubini.mesh(two_materials(), 0.5).save(tmp_path / "a.su2")
    with pytest.raises(ExportError, match="3 nodes only"):
        fubini.mesh(two_materials(), 0.5, faces=[0], order=2).save(tmp_path / "a.su2")
    with pytest.raises(ExportError, match="no marker inside"):
        fubini.mesh(two_materials(), 0.5, names={"all": "faces 0-1", "mid": "edge 1"}).save(tmp_path / "a.su2")
    with pytest.raises(ExportError, match="overlap"):
        fubini.mesh(two_materials(), 0.5, faces=[0], names={"a": "edge 0", "b": "edges 0,3"}).save(tmp_path / "a.su2")
    with pytest.raises(ExportError, match="one plane"):
        dataclasses.replace(box(2), regions={"all": np.arange(48)}).save(tmp_path / "a.su2")
    assert not list(tmp_path.iterdir())


def test_3mf(tmp_path):
    mesh = box(3)
    mesh.save(tmp_path / "a.3mf")
    with zipfile.ZipFile(tmp_path / "a.3mf") as archive:
        assert archive.testzip() is None
        root = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    space = {"m": "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"}
    points = [[float(v.get(c)) for c in "xyz"] for v in root.iterfind(".//m:vertex", space)]
    np.testing.assert_array_equal(points, mesh.points)
    triangles = root.findall(".//m:triangle", space)
    np.testing.assert_array_equal([[int(t.get(f"v{k}")) for k in (1, 2, 3)] for t in triangles], mesh.triangles)
    names = [b.get("name") for b in root.iterfind(".//m:base", space)]
    owner = np.array([names[int(t.get("p1"))] for t in triangles])
    np.testing.assert_array_equal(owner == "lid", mesh.face_of_triangle == 1)
    assert root.find(".//m:object", space).get("type") == "model"
    square().save(tmp_path / "b.3mf")
    with zipfile.ZipFile(tmp_path / "b.3mf") as archive:
        assert b'type="surface"' in archive.read("3D/3dmodel.model")


def test_3mf_by_its_own_library(tmp_path):
    lib3mf = pytest.importorskip("lib3mf")
    box(3).save(tmp_path / "a.3mf")
    model = lib3mf.Wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(tmp_path / "a.3mf"))
    assert reader.GetWarningCount() == 0
    objects = model.GetMeshObjects()
    assert objects.MoveNext()
    found = objects.GetCurrentMeshObject()
    assert (found.GetTriangleCount(), found.IsManifoldAndOriented()) == (108, True)


@pytest.mark.parametrize("solids", ["face", "region"])
def test_stl_with_one_solid_for_each_part(tmp_path, solids):
    mesh = box(3)
    mesh.save(tmp_path / "a.stl", solids=solids)
    found = trimesh.load(tmp_path / "a.stl", process=False)
    assert set(found.geometry) == {"face_0", "lid", "face_2", "face_3", "face_4", "face_5"}
    lid = found.geometry["lid"]
    wanted = mesh.points[mesh.triangles[mesh.face_of_triangle == 1]]
    np.testing.assert_array_equal(lid.vertices[lid.faces], wanted)
    assert sum(part.volume for part in found.geometry.values()) == pytest.approx(1.0, abs=1e-12)
    with pytest.raises(OptionError, match="one, face or region"):
        mesh.save(tmp_path / "a.stl", solids="edge")
    with pytest.raises(ExportError, match="overlap"):
        fubini.mesh(two_materials(), 0.5, names=OVERLAP).save(tmp_path / "b.stl", solids="region")


def test_titles_are_cut_and_stay_apart():
    found = titles(["x" * 50, "x" * 51, "x" * 38 + "_2", "X" * 60], 40, fold=True)
    assert all(len(t) == 40 for t in found.values())
    assert len({t.upper() for t in found.values()}) == 4
    assert found["x" * 50] == "x" * 40
    assert titles(["a", "A"], 9) == {"a": "a", "A": "A"}


@pytest.mark.parametrize("suffix", [".inp", ".unv", ".msh", ".mesh", ".vtu", ".npz"])
def test_long_and_strange_names_arrive_or_are_told(tmp_path, suffix):
    names = {"x" * 100 + "1": "face 0", "x" * 100 + "2": "face 1", "Größe: α|β": "edge 3", 'a "b" c': "edge 5"}
    mesh = fubini.mesh(two_materials(), 0.5, names=names)
    path = tmp_path / f"a{suffix}"
    mesh.save(path)
    told = renamed(mesh, path)
    title = {name: told.get(name, name) for name in (*mesh.regions, *mesh.boundaries)}
    assert len(set(title.values())) == len(title)
    cut = {".inp": {*names, *told}, ".unv": {n for n in title if len(n) > 40}, ".vtu": set(), ".npz": set()}
    assert set(told) == cut.get(suffix, {'a "b" c'})
    if suffix == ".vtu":
        assert {f"region:{n}" for n in mesh.regions} <= set(meshio.read(path).field_data)
    elif suffix == ".npz":
        assert np.load(path)["boundary_names"].tolist() == list(mesh.boundaries)
    else:
        text = path.read_text()
        assert all(t in text for t in title.values())
    if suffix == ".inp":  # the whole name stands in a comment
        assert all(f": {n.encode('ascii', 'backslashreplace').decode()}\n" in text for n in told)


def test_group_labels_stay_apart():
    mesh = dataclasses.replace(box(1), face_names={0: "side", 1: "side", 2: "side_0"})
    labels = list(group_labels(mesh).values())
    assert len(set(labels)) == 6 and labels[2] == "side_0"


def test_names_of_the_source_become_printable():
    pytest.importorskip("OCP")
    from cad.shapes import box as solid
    from cad.shapes import sub
    from fubini.cad import load, occ

    shape = solid()
    face, other = sub(shape, occ.FACE)[:2]
    model = load(shape, groups={"top\nside\t 1": face, " \n": other})
    assert [f.name for f in model.faces][:2] == ["top side 1", None]
