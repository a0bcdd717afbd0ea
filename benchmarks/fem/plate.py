"""A plate with a hole in plane stress, solved from exported files by scikit-fem and CalculiX.

Run: ``python benchmarks/fem/plate.py``. The quarter of a plate of 8 x 8 with a hole of radius 1.

First table: Kirsch's tractions on the outer sides, so the exact solution is known; errors of displacement (L2) and
stress (energy) with their rates, and the stress concentration, which is 3. Second table: uniform tension, displacement
of the loaded corner by both solvers (``ccx`` where it is installed).
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import tempfile
from functools import partial
from pathlib import Path

import meshio
import numpy as np
import skfem
from skfem.helpers import ddot, sym_grad

import fubini
from fubini.curves import CircularArc, Line
from fubini.model import Edge, Face, Frame, Model
from fubini.region import Loop, Region

WIDTH, YOUNG, POISSON = 4.0, 1000.0, 0.3
NAMES = {"bottom": "edge 0", "right": "edge 1", "top": "edge 2", "left": "edge 3", "hole": "edge 4", "plate": "face 0"}
SIZES = (0.4, 0.2, 0.1, 0.05)
#: Gauss points of CalculiX: on curved elements the result depends on the rule.
RULE = 2


def model() -> Model:
    """The quarter plate in the first quadrant."""
    w = WIDTH
    curves = (
        Line((1, 0), (w, 0)), Line((w, 0), (w, w)), Line((w, w), (0, w)), Line((0, w), (0, 1)),
        CircularArc((0, 0), 1.0, math.pi / 2, 0.0),
    )  # fmt: skip
    region = Region(Loop.closed(curves, 1e-9))
    edges = {i: Edge(i, c.kind, i, (i + 1) % 5) for i, c in enumerate(region.curves)}
    vertices = {i: np.array([*c.start, 0.0]) for i, c in enumerate(region.curves)}
    frame = Frame(np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    return Model("plate", (Face(0, region, frame),), edges, vertices, diagonal=w * 2**0.5)


def load(path: Path):
    """An exported .msh in scikit-fem: the mesh, its order, and facets by name."""
    found = meshio.read(path)
    order = 2 if "triangle6" in found.cells_dict else 1
    cell, line = (("triangle", "line"), ("triangle6", "line3"))[order - 1]
    kind = (skfem.MeshTri1, skfem.MeshTri2)[order - 1]
    mesh = kind(found.points[:, :2].T.copy(), found.cells_dict[cell].T.copy())
    number = {(a, b): i for i, (a, b) in enumerate(np.sort(mesh.facets, axis=0).T.tolist())}
    # scikit-fem renumbers the nodes of second-order meshes: match facets by the middle of their ends
    where = {tuple(np.round(mesh.p[:, list(pair)].mean(axis=1), 12)): i for pair, i in number.items()}
    facets = {}
    for name, (tag, dim) in found.field_data.items():
        if dim == 1:
            lines = found.cells_dict[line][found.cell_data_dict["gmsh:physical"][line] == tag]
            middles = found.points[lines[:, :2]].mean(axis=1)[:, :2]
            facets[name] = np.array([where[tuple(np.round(p, 12))] for p in middles], np.int32)
    return mesh.with_boundaries(facets), order


def stress_of(strain):
    """Plane stress by Hooke's law."""
    factor = YOUNG / (1 - POISSON**2)
    trace = strain[0, 0] + strain[1, 1]
    return factor * np.array(
        [
            [(1 - POISSON) * strain[0, 0] + POISSON * trace, (1 - POISSON) * strain[0, 1]],
            [(1 - POISSON) * strain[1, 0], (1 - POISSON) * strain[1, 1] + POISSON * trace],
        ]
    )


def kirsch_stress(x, y):
    """Exact stress for unit tension along x at infinity, hole of radius 1."""
    q, t = 1 / (x * x + y * y), np.arctan2(y, x)
    xx = 1 - q * (1.5 * np.cos(2 * t) + np.cos(4 * t)) + 1.5 * q * q * np.cos(4 * t)
    yy = -q * (0.5 * np.cos(2 * t) - np.cos(4 * t)) - 1.5 * q * q * np.cos(4 * t)
    xy = -q * (0.5 * np.sin(2 * t) + np.sin(4 * t)) + 1.5 * q * q * np.sin(4 * t)
    return np.array([[xx, xy], [xy, yy]])


def kirsch_displacement(x, y):
    """Exact displacement."""
    r, t = np.hypot(x, y), np.arctan2(y, x)
    kappa, mu = (3 - POISSON) / (1 + POISSON), YOUNG / (2 * (1 + POISSON))
    across = r * (kappa + 1) * np.cos(t) + 2 / r * ((1 + kappa) * np.cos(t) + np.cos(3 * t)) - 2 / r**3 * np.cos(3 * t)
    along = r * (kappa - 3) * np.sin(t) + 2 / r * ((1 - kappa) * np.sin(t) + np.sin(3 * t)) - 2 / r**3 * np.sin(3 * t)
    return np.array([across, along]) / (8 * mu)


def solve(mesh, order: int, traction, loaded: tuple[str, ...], rule: int):
    """Displacements for a traction ``(x, y) -> (2, ...)``; symmetry on "left" and "bottom"."""
    element = skfem.ElementVector((skfem.ElementTriP1(), skfem.ElementTriP2())[order - 1])
    basis = skfem.Basis(mesh, element, intorder=rule)
    matrix = skfem.BilinearForm(lambda u, v, w: ddot(stress_of(sym_grad(u)), sym_grad(v))).assemble(basis)
    rhs = np.zeros(basis.N)
    for name in loaded:
        facets = skfem.FacetBasis(mesh, element, facets=mesh.boundaries[name], intorder=6)
        pull = partial(traction, name)
        work = skfem.LinearForm(lambda v, w, pull=pull: np.einsum("i...,i...->...", pull(*w.x), v))
        rhs += work.assemble(facets)
    fixed = np.concatenate([basis.get_dofs("left").all(["u^1"]), basis.get_dofs("bottom").all(["u^2"])])
    return basis, skfem.solve(*skfem.condense(matrix, rhs, D=fixed))


def kirsch(mesh, order: int) -> tuple[float, float, float]:
    """Errors in L2 and energy, and the stress concentration."""
    return kirsch_errors(mesh, order, solve_kirsch(mesh, order))


def solve_kirsch(mesh, order: int):
    """Displacements under Kirsch's tractions on the outer sides."""
    normal = {"right": 0, "top": 1}
    return solve(mesh, order, lambda name, x, y: kirsch_stress(x, y)[normal[name]], ("right", "top"), 6)[1]


def kirsch_errors(mesh, order: int, u) -> tuple[float, float, float]:
    """Errors of displacements u in L2 and energy, and their stress concentration."""
    element = skfem.ElementVector((skfem.ElementTriP1(), skfem.ElementTriP2())[order - 1])
    fine = skfem.Basis(mesh, element, intorder=8)
    found = fine.interpolate(u)

    def squares(w):
        off = w.u - kirsch_displacement(*w.x)
        return (off * off).sum(axis=0)

    def energy(w):
        off = stress_of(sym_grad(w.u)) - kirsch_stress(*w.x)
        return (off * off).sum(axis=(0, 1)) / YOUNG

    errors = [math.sqrt(skfem.Functional(f).assemble(fine, u=found)) for f in (squares, energy)]
    return errors[0], errors[1], _concentration(mesh, element, u)


def _concentration(mesh, element, u) -> float:
    """Stress along the load at the top of the hole, the mean of the elements that meet there."""
    node = int(np.linalg.norm(mesh.p[:, : mesh.t.max() + 1].T - [0, 1], axis=1).argmin())
    values = []
    for corner, place in enumerate(([0.0, 0.0], [1.0, 0.0], [0.0, 1.0])):
        cells = np.flatnonzero(mesh.t[corner] == node)
        if len(cells):
            at = skfem.Basis(mesh, element, elements=cells, quadrature=(np.array([place]).T, np.array([1.0])))
            values.append(stress_of(sym_grad(at.interpolate(u)))[0, 0].ravel())
    return float(np.concatenate(values).mean())


def tension(mesh, order: int) -> float:
    """Displacement along the load of the loaded corner on the axis, for unit tension."""
    basis, u = solve(mesh, order, lambda name, x, y: np.array([1 + 0 * x, 0 * x]), ("right",), RULE)
    corner = int(np.linalg.norm(mesh.p.T - [WIDTH, 0], axis=1).argmin())
    return float(u[basis.nodal_dofs[0, corner]])


def calculix(folder: Path, mesh: fubini.Mesh) -> float:
    """The same by ``ccx`` from the exported .inp.

    CalculiX expands plane-stress elements into solids whose thickness varies continuously, which stiffens
    them; plane strain with the constants that make both problems equal is free of that.
    """
    mesh.save(folder / "mesh.inp", elements="plane strain")
    young = YOUNG * (1 + 2 * POISSON) / (1 + POISSON) ** 2
    poisson = POISSON / (1 + POISSON)
    (folder / "plate.inp").write_text(
        f"*INCLUDE, INPUT=mesh.inp\n*MATERIAL, NAME=M\n*ELASTIC\n{young!r}, {poisson!r}\n"
        "*SOLID SECTION, ELSET=plate, MATERIAL=M\n1.0\n*BOUNDARY\nleft, 1, 1\nbottom, 2, 2\n*STEP\n*STATIC\n"
        "*DSLOAD\nright, P, -1.0\n*NODE PRINT, NSET=corner\nU\n*END STEP\n"
    )
    subprocess.run(["ccx", "plate"], cwd=folder, check=True, capture_output=True, timeout=300)
    row = re.search(r"^\s+\d+\s+(\S+)\s+\S+\s+\S+\s*$", (folder / "plate.dat").read_text(), flags=re.M)
    return float(row[1])


def main() -> None:
    """Both tables."""
    rows = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for order in (1, 2):
            before = None
            for size in SIZES:
                ours = fubini.mesh(model(), size, order=order, names=NAMES | {"corner": "vertex 1"})
                ours.save(folder / "plate.msh")
                mesh, _ = load(folder / "plate.msh")
                l2, energy, k = kirsch(mesh, order)
                h = mesh.nelements**-0.5
                text = f"T{3 * order}  {mesh.nelements:6d} triangles  L2 {l2:.3e}  energy {energy:.3e}  K {k:.4f}"
                if before:
                    step = math.log(before[0] / h)
                    text += f"  rates {math.log(before[1] / l2) / step:.2f} {math.log(before[2] / energy) / step:.2f}"
                print(text)
                before = (h, l2, energy)
                ccx = calculix(folder, ours) if shutil.which("ccx") else math.nan
                rows.append((order, mesh.nelements, tension(mesh, order), ccx))
    print()
    for order, count, ours, ccx in rows:
        apart = abs(ours / ccx - 1)
        print(f"T{3 * order}  {count:6d} triangles  scikit-fem {ours:.6e}  CalculiX {ccx:.6e}  apart {apart:.1e}")


if __name__ == "__main__":
    main()
