"""The mesh as values of other libraries: names and node orders."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import fubini
from fubini.errors import DependencyError, ExportError
from handmade import box
from materials import NAMES, TILTED, two_materials

ORDERS = pytest.mark.parametrize("order", [1, 2])
SIDES = [(0, 1), (1, 2), (2, 0)]


@pytest.fixture(scope="module")
def meshes():
    return {order: fubini.mesh(two_materials(), 0.3, names=NAMES, order=order) for order in (1, 2)}


@ORDERS
def test_skfem(meshes, order):
    skfem = pytest.importorskip("skfem")
    mesh = meshes[order]
    found = mesh.to_skfem()
    assert isinstance(found, skfem.MeshTri2 if order == 2 else skfem.MeshTri1)
    assert set(found.subdomains) == {"steel", "copper alloy"}
    assert set(found.boundaries) == set(mesh.boundaries)
    for name, rows in mesh.regions.items():
        np.testing.assert_array_equal(found.subdomains[name], rows)
    for name, rows in mesh.boundaries.items():
        ours = {frozenset(p) for p in mesh.segments[rows].tolist()}
        assert {frozenset(p) for p in found.facets[:, found.boundaries[name]].T.tolist()} == ours
    np.testing.assert_array_equal(found.p[:, : mesh.triangles.max() + 1].T, mesh.points[: mesh.triangles.max() + 1, :2])
    mapping = found._mapping()
    middle = mapping.F(np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5]]))  # sides 0-1, 1-2, 2-0
    wanted = mesh.points[mesh.triangles][:, SIDES].mean(axis=2) if order == 1 else mesh.points[mesh.midsides]
    theirs, ours = middle.transpose(1, 2, 0), wanted[..., :2]  # scikit-fem sorts the corners of each triangle
    distance = np.linalg.norm(theirs[:, :, None] - ours[:, None], axis=3)
    assert distance.min(axis=1).max() < 1e-14


def test_skfem_in_a_tilted_plane():
    pytest.importorskip("skfem")
    mesh = fubini.mesh(two_materials(TILTED), 0.4, order=2)
    found = mesh.to_skfem()
    straight = mesh.points[mesh.triangles]
    ours = np.linalg.norm(np.cross(straight[:, 1] - straight[:, 0], straight[:, 2] - straight[:, 0]), axis=1)
    corners = found.p[:, found.t[:3]]
    (ux, uy), (vx, vy) = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    np.testing.assert_allclose(np.abs(ux * vy - uy * vx), ours, rtol=1e-9)


def test_skfem_refuses_solids():
    pytest.importorskip("skfem")
    with pytest.raises(ExportError, match="one plane"):
        box(2).to_skfem()


@ORDERS
def test_meshio(meshes, order):
    mesh = meshes[order]
    found = mesh.to_meshio()
    kinds = ("triangle", "line") if order == 1 else ("triangle6", "line3")
    assert [c.type for c in found.cells] == [*kinds, "vertex"]
    np.testing.assert_array_equal(found.cells[0].data, mesh.nodes)
    assert set(found.cell_sets) == {*mesh.regions, *mesh.boundaries, "tip"}
    for name, rows in mesh.regions.items():
        np.testing.assert_array_equal(found.cell_sets[name][0], rows)
    for name, rows in mesh.boundaries.items():
        np.testing.assert_array_equal(found.cells[1].data[found.cell_sets[name][1]][:, :2], mesh.segments[rows])
    np.testing.assert_array_equal(found.points[found.cells[2].data[found.cell_sets["tip"][2], 0]], [[2, 1, 0]])
    np.testing.assert_array_equal(found.cell_data["edge"][1], mesh.edge_of_segment)


@ORDERS
def test_dolfinx(meshes, order):
    mesh = meshes[order]
    found = mesh.to_dolfinx_arrays()
    assert found.degree == order
    assert found.points.shape == (len(mesh.points), 2)
    np.testing.assert_array_equal(found.cells[:, :3], mesh.triangles)
    if order == 2:  # the middle opposite to corner i is node 3 + i
        for i in range(3):
            side = SIDES.index(((i + 1) % 3, (i + 2) % 3))
            np.testing.assert_array_equal(found.cells[:, 3 + i], mesh.midsides[:, side])
    for name, tag in found.regions.items():
        np.testing.assert_array_equal(np.flatnonzero(found.cell_tags == tag), mesh.regions[name])
    for name, tag in found.boundaries.items():
        ours = {frozenset(p) for p in mesh.segments[mesh.boundaries[name]].tolist()}
        assert {frozenset(p) for p in found.facets[found.facet_tags == tag].tolist()} == ours


def test_dolfinx_keeps_space():
    assert fubini.mesh(two_materials(TILTED), 0.5).to_dolfinx_arrays().points.shape[1] == 3


@ORDERS
def test_pyvista(meshes, order):
    pytest.importorskip("pyvista")
    mesh = meshes[order]
    found = mesh.to_pyvista()
    assert set(found.celltypes.tolist()) == {5 if order == 1 else 22}
    np.testing.assert_array_equal(found.points, mesh.points)
    np.testing.assert_array_equal(found.cell_connectivity.reshape(-1, 3 * order), mesh.nodes)
    assert list(found.field_data["regions"]) == ["steel", "copper alloy"]
    np.testing.assert_array_equal(found.cell_data["face"], mesh.face_of_triangle)
    np.testing.assert_array_equal(np.flatnonzero(found.cell_data["region"] == 0), mesh.regions["steel"])
    np.testing.assert_array_equal(
        found.field_data["boundary:clamped"][:, :2], mesh.segments[mesh.boundaries["clamped"]]
    )


@pytest.mark.parametrize(("module", "method"), [("skfem", "to_skfem"), ("pyvista", "to_pyvista")])
def test_missing_packages_are_named(monkeypatch, meshes, module, method):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(DependencyError, match=r"fubini\[(fem|pyvista)\]"):
        getattr(meshes[1], method)()
