"""Scikit-fem on exported files: theoretical rates on a curved domain, patch tests to rounding."""

from __future__ import annotations

import math

import meshio
import numpy as np
import pytest

import fubini
import regions
from materials import NAMES, two_materials

skfem = pytest.importorskip("skfem")

from skfem.helpers import dot, grad  # noqa: E402

ORDERS = pytest.mark.parametrize("order", [1, 2])
SIZES = (0.04, 0.02, 0.01)


def element(order):
    return skfem.ElementTriP1() if order == 1 else skfem.ElementTriP2()


def load(path):
    """The exported mesh as scikit-fem has it, every segment it names found again by its nodes."""
    found = meshio.read(path)
    order = 2 if "triangle6" in found.cells_dict else 1
    kind = skfem.MeshTri2 if order == 2 else skfem.MeshTri1
    cells = found.cells_dict["triangle6" if order == 2 else "triangle"]
    mesh = kind(found.points[:, :2].T.copy(), cells.T.copy())
    return mesh, order, found


def boundary_by_middle(mesh, found, name):
    """Facets whose middle is that of an exported line of this name."""
    tag = found.field_data[name][0]
    line = "line3" if "line3" in found.cells_dict else "line"
    lines = found.cells_dict[line][found.cell_data_dict["gmsh:physical"][line] == tag]
    wanted = found.points[lines[:, :2]].mean(axis=1)[:, :2]
    ends = mesh.p[:, mesh.facets[:2]].mean(axis=1).T
    distance = np.linalg.norm(wanted[:, None] - ends[None], axis=2)
    assert distance.min(axis=1).max() < 1e-14
    return distance.argmin(axis=1)


def solve(mesh, order, facets, conductivity, source, exact):
    """-div(k grad u) = f with u given on facets; ``conductivity``: per element."""
    basis = skfem.Basis(mesh, element(order), intorder=6)

    @skfem.BilinearForm
    def stiffness(u, v, w):
        return w.k * dot(grad(u), grad(v))

    @skfem.LinearForm
    def load_(v, w):
        return source(*w.x) * v

    k = basis.with_element(skfem.ElementTriP0()).interpolate(conductivity)
    matrix, rhs = stiffness.assemble(basis, k=k), load_.assemble(basis)
    fixed = basis.get_dofs(facets)
    start = np.zeros(basis.N)
    start[fixed.flatten()] = exact(*basis.doflocs[:, fixed.flatten()])
    return basis, skfem.solve(*skfem.condense(matrix, rhs, x=start, D=fixed))


def errors(basis, u, exact, gradient):
    """Errors in L2 and in energy."""

    @skfem.Functional
    def square(w):
        return (w.u - exact(*w.x)) ** 2

    @skfem.Functional
    def energy(w):
        gx, gy = gradient(*w.x)
        return (w.u.grad[0] - gx) ** 2 + (w.u.grad[1] - gy) ** 2

    found = basis.interpolate(u)
    return math.sqrt(square.assemble(basis, u=found)), math.sqrt(energy.assemble(basis, u=found))


def bubble(x, y):
    """(1 - r^2) x y: zero on the whole boundary of the quarter disk."""
    return (1 - x * x - y * y) * x * y


def bubble_gradient(x, y):
    return y - 3 * x * x * y - y**3, x - 3 * x * y * y - x**3


@ORDERS
def test_rates_on_the_quarter_disk(tmp_path, order):
    table = []
    for size in SIZES:
        ours = fubini.mesh(regions.model_of(regions.quarter_disk()), size, order=order)
        assert ours.certificate.certified
        ours.save(tmp_path / "disk.msh")
        mesh, found_order, found = load(tmp_path / "disk.msh")
        assert found_order == order
        facets = boundary_by_middle(mesh, found, "outer")
        np.testing.assert_array_equal(np.sort(facets), mesh.boundary_facets())
        basis, u = solve(
            mesh, order, facets, np.ones(mesh.nelements), lambda x, y: 12 * x * y, lambda x, y: np.zeros_like(x)
        )
        table.append((mesh.nelements**-0.5, *errors(basis, u, bubble, bubble_gradient)))
    h, l2, energy = np.log(np.array(table)).T
    assert np.polyfit(h, l2, 1)[0] == pytest.approx(order + 1, abs=0.1)
    assert np.polyfit(h, energy, 1)[0] == pytest.approx(order, abs=0.1)


@ORDERS
def test_patch_of_two_materials(order):
    """Flux through the named interface: a solution linear in each material is met to rounding."""
    mesh = fubini.mesh(two_materials(), 0.3, names=NAMES, order=order).to_skfem()
    conductivity = np.ones(mesh.nelements)
    conductivity[mesh.subdomains["copper alloy"]] = 4.0

    def exact(x, y):
        return np.where(x < 1, x, 1 + (x - 1) / 4)

    facets = np.concatenate([mesh.boundaries[n] for n in ("clamped", "outer", "hole_1")])
    np.testing.assert_array_equal(np.sort(facets), mesh.boundary_facets())
    basis, u = solve(mesh, order, facets, conductivity, lambda x, y: 0 * x, exact)
    assert np.abs(u - exact(*basis.doflocs)).max() < 1e-13
    between = mesh.boundaries["steel|copper alloy"]
    np.testing.assert_array_equal(mesh.p[0, mesh.facets[:, between]], 1.0)


@ORDERS
def test_linear_patch_on_curved_elements(order):
    mesh = fubini.mesh(regions.model_of(regions.plate()), 0.5, order=order).to_skfem()

    def exact(x, y):
        return 1 + 2 * x - 3 * y

    basis, u = solve(mesh, order, mesh.boundary_facets(), np.ones(mesh.nelements), lambda x, y: 0 * x, exact)
    assert np.abs(u - exact(*basis.doflocs)).max() < 1e-12
