"""Solver formats, read back by readers of their own: the same nodes, elements and names at both orders."""

from __future__ import annotations

import re

import meshio
import numpy as np
import pytest

import fubini
from fubini.errors import ExportError, OptionError
from fubini.export.inp import safe_names
from fubini.export.layout import flatten, layout
from fubini.quality import areas
from handmade import box
from materials import BELOW, NAMES, TILTED, two_materials

ORDERS = pytest.mark.parametrize("order", [1, 2])


@pytest.fixture(scope="module")
def meshes():
    return {order: fubini.mesh(two_materials(), 0.3, names=NAMES, order=order) for order in (1, 2)}


def read_inp(path):
    """Nodes, elements, and sets of an input deck: ``(points, {id: (type, nodes)}, elsets, nsets, surfaces)``."""
    points, elements, elsets, nsets, surfaces = {}, {}, {}, {}, {}
    keyword, options = "", {}
    for line in path.read_text().splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            keyword, *rest = [p.strip() for p in line[1:].split(",")]
            options = dict(p.split("=") for p in rest)
            continue
        fields = [f.strip() for f in line.split(",") if f.strip()]
        if keyword == "NODE":
            assert all(len(f) <= 20 for f in fields)
            points[int(fields[0])] = tuple(map(float, fields[1:]))
        elif keyword == "ELEMENT":
            elements[int(fields[0])] = (options["TYPE"], tuple(map(int, fields[1:])))
            elsets.setdefault(options["ELSET"], set()).add(int(fields[0]))
        elif keyword in ("ELSET", "NSET"):
            groups = elsets if keyword == "ELSET" else nsets
            for f in fields:
                groups.setdefault(options[keyword], set()).update([int(f)] if f.isdigit() else elsets[f])
        elif keyword == "SURFACE":
            assert options["TYPE"] == "ELEMENT"
            surfaces.setdefault(options["NAME"], []).append((int(fields[0]), fields[1]))
    return points, elements, elsets, nsets, surfaces


def read_unv(path):
    """Points, elements and groups of a universal file."""
    points, elements, groups = {}, {}, {}
    blocks = re.findall(r"^    -1\n +(\d+)\n(.*?)^    -1\n", path.read_text(), flags=re.S | re.M)
    for kind, body in blocks:
        lines = body.splitlines()
        while lines:
            head = [int(x) for x in lines.pop(0).split()]
            if kind == "2411":
                points[head[0]] = tuple(float(x) for x in lines.pop(0).split())
            elif kind == "2412":
                if head[1] in (11, 22):
                    lines.pop(0)
                elements[head[0]] = (head[1], tuple(int(x) for x in lines.pop(0).split()))
                assert len(elements[head[0]][1]) == head[5]
            else:
                name, items = lines.pop(0), []
                while len(items) < 4 * head[7]:
                    items += [int(x) for x in lines.pop(0).split()]
                groups[name] = {(items[i], items[i + 1]) for i in range(0, len(items), 4)}
    return points, elements, groups


@ORDERS
@pytest.mark.parametrize(
    ("elements", "kind"), [("auto", "CPS"), ("plane strain", "CPE"), ("axisymmetric", "CAX"), ("shell", "S")]
)
def test_inp(tmp_path, meshes, order, elements, kind):
    mesh = meshes[order]
    mesh.save(tmp_path / "a.inp", elements=elements)
    points, cells, elsets, nsets, surfaces = read_inp(tmp_path / "a.inp")
    found = np.array([points[i + 1] for i in range(len(mesh.points))])
    np.testing.assert_allclose(found, mesh.points, rtol=0, atol=1e-13)
    assert {t for t, _ in cells.values()} == {f"{kind}{3 * order}"}
    nodes = np.array([cells[i + 1][1] for i in range(len(mesh.triangles))]) - 1
    np.testing.assert_array_equal(nodes, mesh.nodes)
    assert set(elsets) == {"steel", "copper_alloy", "EALL"}
    assert set(nsets) == {"clamped", "outer", "hole_1", "steel|copper_alloy", "tip"}
    assert elsets["EALL"] == set(range(1, len(mesh.triangles) + 1))
    assert elsets["steel"] == set((mesh.regions["steel"] + 1).tolist())
    first = 3 if kind == "S" else 1
    for name, rows in mesh.boundaries.items():
        ends = mesh.segments[rows]
        middle = [] if order == 1 else mesh.segment_midsides[rows].tolist()
        safe = name.replace(" ", "_")
        assert nsets[safe] == {i + 1 for i in [*ends.ravel().tolist(), *middle]}
        sides = [(cells[e][1], int(s[1:]) - first) for e, s in surfaces[safe]]
        assert {frozenset((c[s], c[(s + 1) % 3])) for c, s in sides} == {frozenset(p) for p in (ends + 1).tolist()}
        if order == 2:
            assert {c[3 + s] for c, s in sides} == {i + 1 for i in middle}


@ORDERS
@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_msh(tmp_path, meshes, order, version):
    mesh = meshes[order]
    mesh.save(tmp_path / "a.msh", version=version)
    found = meshio.read(tmp_path / "a.msh")
    cell, line = ("triangle", "line") if order == 1 else ("triangle6", "line3")
    numbers = found.points.view([("", float)] * 3).ravel()
    order_of = np.searchsorted(np.sort(mesh.points.copy().view([("", float)] * 3).ravel()), numbers)
    assert sorted(order_of.tolist()) == list(range(len(mesh.points)))
    tags = {name: tuple(v) for name, v in found.field_data.items()}
    assert {n for n, (_, dim) in tags.items() if dim == 2} == set(mesh.regions)
    assert {n for n, (_, dim) in tags.items() if dim == 1} == set(mesh.boundaries)
    assert {n for n, (_, dim) in tags.items() if dim == 0} == {"tip"}
    assert len({tag for tag, _ in tags.values()}) == len(tags)
    cells, physical = found.cells_dict, found.cell_data_dict["gmsh:physical"]
    for name, rows in mesh.regions.items():
        ours = mesh.points[mesh.nodes[rows]]
        theirs = found.points[cells[cell][physical[cell] == tags[name][0]]]
        np.testing.assert_array_equal(sort_rows(theirs), sort_rows(ours))
    segments = mesh.segments if order == 1 else np.column_stack([mesh.segments, mesh.segment_midsides])
    for name, rows in mesh.boundaries.items():
        theirs = found.points[cells[line][physical[line] == tags[name][0]]]
        np.testing.assert_array_equal(sort_rows(theirs), sort_rows(mesh.points[segments[rows]]))
    np.testing.assert_array_equal(found.points[cells["vertex"][0, 0]], [2, 1, 0])


def sort_rows(places):
    flat = np.asarray(places, float).reshape(len(places), -1)
    return flat[np.lexsort(flat.T)]


@ORDERS
def test_unv(tmp_path, meshes, order):
    mesh = meshes[order]
    mesh.save(tmp_path / "a.unv")
    points, elements, groups = read_unv(tmp_path / "a.unv")
    np.testing.assert_array_equal([points[i + 1] for i in range(len(points))], mesh.points)
    cells = {i: n for i, (kind, n) in elements.items() if kind in (41, 42)}
    around = [0, 1, 2] if order == 1 else [0, 3, 1, 4, 2, 5]
    np.testing.assert_array_equal([cells[i + 1] for i in range(len(cells))], mesh.nodes[:, around] + 1)
    assert set(groups) == {*mesh.regions, *mesh.boundaries, "tip"}
    for name, rows in mesh.regions.items():
        assert groups[name] == {(8, i + 1) for i in rows.tolist()}
    for name, rows in mesh.boundaries.items():
        members = [elements[i] for kind, i in groups[name] if kind == 8]
        assert {kind for kind, _ in members} == {11 if order == 1 else 22}
        assert {(n[0], n[-1]) for _, n in members} == {tuple(p) for p in (mesh.segments[rows] + 1).tolist()}
        if order == 2:
            assert {n[1] for _, n in members} == set((mesh.segment_midsides[rows] + 1).tolist())
    assert groups["tip"] == {(7, int(mesh.named_points["tip"][0]) + 1)}


@ORDERS
def test_vtu(tmp_path, meshes, order):
    mesh = meshes[order]
    mesh.save(tmp_path / "a.vtu")
    found = meshio.read(tmp_path / "a.vtu")
    np.testing.assert_array_equal(found.points, mesh.points)
    np.testing.assert_array_equal(found.cells[0].data, mesh.nodes)
    assert found.cells[0].type == ("triangle" if order == 1 else "triangle6")
    np.testing.assert_array_equal(found.cell_data["face"][0], mesh.face_of_triangle)
    np.testing.assert_array_equal(np.unique(found.cell_data["region"][0]), [0, 1])
    for name, rows in mesh.regions.items():
        np.testing.assert_array_equal(found.field_data[f"region:{name}"], rows)
    for name, rows in mesh.boundaries.items():
        np.testing.assert_array_equal(found.field_data[f"boundary:{name}"][:, :2], mesh.segments[rows])
    np.testing.assert_array_equal(found.field_data["point:tip"], mesh.named_points["tip"])


def test_vtu_opens_in_vtk(tmp_path, meshes):
    vtk = pytest.importorskip("vtkmodules.vtkIOXML")
    meshes[2].save(tmp_path / "a.vtu")
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "a.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetNumberOfCells() == len(meshes[2].triangles)
    names = {grid.GetFieldData().GetArrayName(i) for i in range(grid.GetFieldData().GetNumberOfArrays())}
    assert {"region:steel", "boundary:steel|copper alloy", "point:tip"} <= names


@ORDERS
def test_npz(tmp_path, meshes, order):
    mesh = meshes[order]
    mesh.save(tmp_path / "a.npz")
    found = np.load(tmp_path / "a.npz", allow_pickle=False)
    np.testing.assert_array_equal(found["points"], mesh.points)
    np.testing.assert_array_equal(found["triangles"], mesh.nodes)
    np.testing.assert_array_equal(found["edge"], mesh.edge_of_segment)
    assert found["segments"].shape == (len(mesh.segments), order + 1)
    for kind, groups in (("region", mesh.regions), ("boundary", mesh.boundaries), ("point", mesh.named_points)):
        assert found[f"{kind}_names"].tolist() == list(groups)
        start = found[f"{kind}_start"]
        for i, rows in enumerate(groups.values()):
            np.testing.assert_array_equal(found[f"{kind}_members"][start[i] : start[i + 1]], rows)


@ORDERS
@pytest.mark.parametrize("suffix", [".inp", ".msh", ".unv", ".vtu", ".npz", ".vtk", ".3mf"])
def test_a_second_mesh_gives_the_same_bytes(tmp_path, meshes, order, suffix):
    again = fubini.mesh(two_materials(), 0.3, names=NAMES, order=order)
    meshes[order].save(tmp_path / f"a{suffix}")
    again.save(tmp_path / f"b{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@ORDERS
@pytest.mark.parametrize("frame", [TILTED, BELOW])
def test_local_plane(tmp_path, order, frame):
    mesh = fubini.mesh(two_materials(frame), 0.4, order=order)
    mesh.save(tmp_path / "a.inp", elements="plane stress")
    points, cells, *_ = read_inp(tmp_path / "a.inp")
    flat = np.array([points[i + 1] for i in range(len(points))])
    nodes = np.array([n for _, n in cells.values()]) - 1
    assert not flat[:, 2].any()
    a, b, c = (flat[nodes[:, k], :2] for k in range(3))
    double = np.linalg.det(np.stack([b - a, c - a], axis=1))
    assert (double > 0).all()
    np.testing.assert_allclose(np.sort(double) / 2, np.sort(areas(mesh.points[mesh.triangles])), rtol=1e-9)
    if order == 2:
        for k, (i, j) in enumerate([(0, 1), (1, 2), (2, 0)]):
            off = np.linalg.norm(flat[nodes[:, 3 + k]] - 0.5 * (flat[nodes[:, i]] + flat[nodes[:, j]]), axis=1)
            assert off.max() < 0.1
    if frame is BELOW:  # a plane of constant z keeps its x and y
        np.testing.assert_allclose(flat[:, :2], mesh.points[:, :2], atol=1e-13)


def test_a_box_is_written_as_shells(tmp_path):
    box(2).save(tmp_path / "a.inp")
    _, cells, elsets, *_ = read_inp(tmp_path / "a.inp")
    assert {t for t, _ in cells.values()} == {"S3"}
    assert set(elsets) == {"face_0", "lid", "face_2", "face_3", "face_4", "face_5", "EALL"}
    with pytest.raises(ExportError, match="one plane"):
        box(2).save(tmp_path / "b.inp", elements="plane strain")
    with pytest.raises(ExportError, match="one plane"):
        flatten(layout(box(1)))


def test_overlapping_regions(tmp_path):
    mesh = fubini.mesh(two_materials(), 0.4, names={"steel": "face 0", "plate": "faces 0-1"})
    mesh.save(tmp_path / "a.inp")
    _, cells, elsets, *_ = read_inp(tmp_path / "a.inp")
    assert elsets["plate"] == set(cells)
    assert elsets["steel"] == set((mesh.regions["steel"] + 1).tolist())
    with pytest.raises(ExportError, match=r"steel and plate overlap.*4\.1"):
        mesh.save(tmp_path / "a.msh")
    mesh.save(tmp_path / "a.msh", version="4.1")
    assert len(meshio.read(tmp_path / "a.msh").cells_dict["triangle"]) == len(mesh.triangles)
    mesh.save(tmp_path / "a.unv")
    groups = read_unv(tmp_path / "a.unv")[2]
    assert len(groups["plate"]) == len(mesh.triangles)
    with pytest.raises(ExportError, match="overlap"):
        mesh.to_dolfinx_arrays()


def test_names_that_sets_may_not_have():
    safe = safe_names(["a b", "a_b", "A,B", "3d", "größe", "x" * 200, "x" * 201, "EALL"], "EALL")
    assert list(safe.values())[:5] == ["a_b", "a_b_2", "A_B_3", "N_3d", "gr__e"]
    assert len({s.upper() for s in safe.values()}) == 8
    assert sorted(map(len, safe.values()))[-2:] == [80, 80]
    assert safe["EALL"] != "EALL"


@pytest.mark.parametrize("suffix", [".bdf", ".med", ".xdmf", ".exo"])
def test_formats_that_lose_names_are_refused(tmp_path, meshes, suffix):
    with pytest.raises(ExportError, match=r"lose the names.*: .*\.unv"):
        meshes[1].save(tmp_path / f"a{suffix}")
    assert not list(tmp_path.iterdir())


def test_options_are_checked(tmp_path, meshes):
    with pytest.raises(OptionError, match="options are elements"):
        meshes[1].save(tmp_path / "a.inp", version="4.1")
    with pytest.raises(OptionError, match="no options"):
        meshes[1].save(tmp_path / "a.obj", ascii=True)
    with pytest.raises(OptionError, match="plane strain"):
        meshes[1].save(tmp_path / "a.inp", elements="brick")
    with pytest.raises(OptionError, match=r"2\.2 or 4\.1"):
        meshes[1].save(tmp_path / "a.msh", version="4")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply", ".glb"])
def test_surface_formats_take_the_corners(tmp_path, meshes, suffix):
    for order in (1, 2):
        meshes[order].save(tmp_path / f"{order}{suffix}")
    assert (tmp_path / f"1{suffix}").read_bytes() == (tmp_path / f"2{suffix}").read_bytes()
