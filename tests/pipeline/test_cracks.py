"""Cracks: two lips with nodes of their own, single tips, at both orders; certified, named, written, and open."""

from __future__ import annotations

import meshio
import numpy as np
import pytest

import fubini
from fubini.errors import OptionError
from fubini.measure import closes_up
from fubini.model import Edge, Face, Frame, Model
from fubini.region import Loop, Region
from materials import FLAT, square, two_materials
from meshes import area, edge_uses

ORDERS = pytest.mark.parametrize("order", [1, 2])


def doubled(mesh):
    """Places that more than one node has."""
    places, count = np.unique(mesh.points, axis=0, return_counts=True)
    return places[count > 1], count[count > 1]


def lip(mesh, name):
    return set(mesh.segments[mesh.boundaries[name]].ravel().tolist())


@ORDERS
def test_a_crack_inside(order):
    model = square(((-0.5, 0), (0.5, 0)))
    closed = fubini.mesh(model, 0.2, names={"slit": "edge 5"}, order=order)
    mesh = fubini.mesh(model, 0.2, names={"slit": "edge 5", "tip": "vertex 5"}, cracks="slit", order=order)
    assert mesh.certificate.certified and area(mesh) == pytest.approx(4.0, rel=1e-13)
    assert set(closed.boundaries) == {"slit", "outer"} and set(mesh.boundaries) == {"slit+", "slit-", "outer"}
    assert set(edge_uses(mesh)[1].tolist()) == {1, 2}
    assert closes_up(mesh.triangles, boundary_sides(mesh), len(mesh.points))
    upper, lower = lip(mesh, "slit+"), lip(mesh, "slit-")
    tips = upper & lower
    assert sorted(mesh.points[list(tips)][:, 0].tolist()) == [-0.5, 0.5]
    assert mesh.points[mesh.named_points["tip"]].tolist() == [[-0.5, 0, 0]]
    places, count = doubled(mesh)
    assert set(count.tolist()) == {2} and np.all(places[:, 1] == 0) and np.all(np.abs(places[:, 0]) < 0.5)
    segments = len(mesh.boundaries["slit+"])
    assert len(places) == (segments - 1 if order == 1 else 2 * segments - 1)
    for nodes, side in ((upper - tips, 1), (lower - tips, -1)):  # the crack runs along +x: + is above it
        of = np.isin(mesh.triangles, list(nodes)).any(axis=1)
        assert (side * mesh.points[mesh.triangles[of]].mean(axis=1)[:, 1] > 0).all()
    if order == 2:
        mids = [set(mesh.segment_midsides[mesh.boundaries[f"slit{s}"]].tolist()) for s in "+-"]
        assert not mids[0] & mids[1]


def boundary_sides(mesh):
    """Sides that one triangle has, as it runs."""
    sides = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])
    _, at, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    once = sides[count[at.ravel()] == 1]
    rims = mesh.segments[np.unique(np.concatenate(list(mesh.boundaries.values())))]
    assert np.array_equal(np.unique(np.sort(once, axis=1), axis=0), np.unique(np.sort(rims, axis=1), axis=0))
    return once


def test_a_coarse_crack_opens_too():
    mesh = fubini.mesh(square(((-0.5, 0), (0.5, 0))), 9.0, cracks=5)
    assert mesh.certificate.certified and len(mesh.boundaries["edge_5+"]) == 2
    assert len(doubled(mesh)[0]) == 1


@ORDERS
def test_cracks_from_the_outline_and_cracks_that_branch(order):
    arms = [((-1, 0), (0, 0)), ((0, 0), (0.6, 0.5)), ((0, 0), (0.6, -0.5))]
    mesh = fubini.mesh(square(*arms), 0.25, cracks="edges 5-7", order=order)
    assert mesh.certificate.certified
    places, count = doubled(mesh)
    at = {tuple(p[:2]): c for p, c in zip(places.tolist(), count.tolist(), strict=True)}
    assert at[0.0, 0.0] == 3  # three sectors about the branch
    assert at[-1.0, 0.0] == 2  # the mouth opens
    assert (0.6, 0.5) not in at and (0.6, -0.5) not in at
    outer = mesh.segments[mesh.boundaries["outer"]]
    assert len(np.unique(outer)) == len(outer) + 1  # the outline is one open chain now


def test_an_interface_parts_two_faces():
    mesh = fubini.mesh(two_materials(), 0.3, cracks="edge 1")
    assert mesh.certificate.certified
    left, right = (set(mesh.triangles[mesh.regions[f"face_{i}"]].ravel().tolist()) for i in range(2))
    assert not left & right
    assert lip(mesh, "face_0|face_1+") <= left and lip(mesh, "face_0|face_1-") <= right
    assert mesh.points[sorted(lip(mesh, "face_0|face_1-"))][:, 0] == pytest.approx(1.0)


def test_faces_that_touch_in_a_point_keep_it():
    """Two squares that share one corner only, where a crack of one of them ends."""
    a, b = square(((-1, 0), (0, 0))), square()
    shifted = Frame(np.array([-2.0, -1.0, 0]), FLAT.x_axis, FLAT.y_axis)  # its corner (1, 1) lies at (-1, 0)
    edges = a.edges | {10 + i: Edge(10 + i, "line", *((10 + e) if e != 3 else 0 for e in (v.start, v.end)))
                       for i, v in b.edges.items()}  # fmt: skip
    loop = b.faces[0].region.outer
    other = Face(1, Region(Loop(loop.curves, tuple(10 + e for e in loop.edges), loop.forward)), shifted)
    vertices = a.vertices | {10 + i: shifted.to_space(p[:2])[0] for i, p in b.vertices.items() if i != 3}
    model = Model("touching", (*a.faces, other), edges, vertices, diagonal=5.0)
    mesh = fubini.mesh(model, 0.3, cracks="edge 5")
    at = np.flatnonzero((mesh.points == [-1.0, 0, 0]).all(axis=1))
    assert len(at) == 2 and mesh.certificate.certified
    touching = [set(mesh.face_of_triangle[(mesh.triangles == node).any(axis=1)].tolist()) for node in at]
    assert sorted(map(len, touching)) == [1, 2]  # one lip keeps the node of the other square


@pytest.mark.parametrize("wrong", ["edge 0", "edge 99", "nothing", 3.5])
def test_what_is_no_crack_is_refused(wrong):
    with pytest.raises(OptionError, match="cracks"):
        fubini.mesh(square(((-0.5, 0), (0.5, 0))), 0.5, cracks=wrong)


@pytest.mark.parametrize("suffix", [".msh", ".inp", ".unv", ".mesh", ".npz"])
@ORDERS
def test_lips_arrive_in_files(tmp_path, suffix, order):
    model = square(((-0.5, 0), (0.5, 0)), names=[(5, "slit")])
    mesh = fubini.mesh(model, 0.3, cracks="slit", order=order)
    mesh.save(tmp_path / f"a{suffix}")
    fubini.mesh(model, 0.3, cracks=["slit"], order=order).save(tmp_path / f"b{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()
    if suffix == ".npz":
        assert np.load(tmp_path / "a.npz")["boundary_names"].tolist() == list(mesh.boundaries)
        return
    text = (tmp_path / f"a{suffix}").read_text()
    assert "slit+" in text and "slit-" in text
    if suffix == ".msh":
        found = meshio.read(tmp_path / "a.msh")
        assert len(found.points) == len(mesh.points)
        tag = found.field_data["slit-"][0]
        lines = found.cells_dict["line" if order == 1 else "line3"]
        own = lines[found.cell_data_dict["gmsh:physical"]["line" if order == 1 else "line3"] == tag]
        assert len(own) == len(mesh.boundaries["slit-"])


def sheared(x, y, upper):
    """Displacement out of plane about a crack along the negative x axis: harmonic, free on both lips."""
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    angle = np.where((y == 0.0) & (x < 0.0), np.where(upper, np.pi, -np.pi), angle)
    return np.sqrt(r) * np.sin(angle / 2)


@ORDERS
def test_a_free_crack_opens_as_theory_says(order):
    """Laplace's equation, the exact values on the outline: the jump across the lips converges to 2 sqrt(r)."""
    skfem = pytest.importorskip("skfem")
    from skfem.models.poisson import laplace

    errors = []
    for size in (0.2, 0.1):
        model = square(((-1, 0), (0, 0)), names=[(5, "slit")])
        mesh = fubini.mesh(model, size, cracks="slit", order=order, vertex_size={"vertex 5": size / 10})
        plane = mesh.to_skfem()
        basis = skfem.Basis(plane, (skfem.ElementTriP1(), skfem.ElementTriP2())[order - 1])
        # the slit runs towards +x, so its left lip is the upper one
        dofs = {s: basis.get_dofs(f"slit{s}").flatten() for s in "+-"}
        x, y = basis.doflocs
        exact = sheared(x, y, np.isin(np.arange(basis.N), dofs["+"]))
        fixed = basis.get_dofs("outer").flatten()
        matrix = laplace.assemble(basis)
        found = skfem.solve(*skfem.condense(matrix, x=exact, D=fixed))
        jump = {s: dict(zip(x[d].round(12), found[d], strict=True)) for s, d in dofs.items()}
        off = [abs(jump["+"][at] - jump["-"][at] - 2 * np.sqrt(-at)) for at in jump["+"]]
        assert len(jump["+"]) == len(jump["-"]) >= 10
        errors.append(max(off))
    assert errors[0] < 0.1 and errors[1] < 0.8 * errors[0]
