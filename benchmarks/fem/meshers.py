"""One solver, the meshes of several generators: error and time side by side.

    python benchmarks/fem/meshers.py              # in the environment of compare.py: about three minutes
    python benchmarks/fem/meshers.py --render     # tables and plot again from solve.csv

Two problems with known solutions, first and second order, meshes of fubini, Gmsh (Frontal-Delaunay with its
optimiser) and Triangle (33 degrees) at the same number of triangles, solved by scikit-fem: Kirsch's plate with a hole
(a quarter, plane stress; see ``plate.py``) and -div grad u = 12 x y on the quarter disk, u = 0 on its boundary. At
second order fubini and Gmsh put mid-side nodes on the curves; Triangle knows no curves, its mid-side nodes lie on
chords. Writes ``solve.csv`` beside this file, and the documentation's tables and plot.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
from pathlib import Path

import numpy as np
import skfem
from skfem.helpers import dot, grad

sys.path.insert(0, str(Path(__file__).parent.parent))
sys.path.insert(0, str(Path(__file__).parent))

import peers
import plate
import tables

import fubini
import regions  # of tests/

OUT = Path(__file__).with_name("solve.csv")
COUNTS = (500, 2_000, 8_000, 32_000)
#: The size is matched when the number of triangles is within this share; a time is the median of so many runs.
MATCHED, SEARCHES, RUNS = 0.02, 12, 3
COLUMNS = (
    "problem", "order", "tool", "count", "triangles", "unknowns", "l2", "energy", "concentration", "mesh", "solve",
)  # fmt: skip
TITLES = {"plate": "plate with a hole, plane stress", "disk": "Poisson's equation on the quarter disk"}
STYLES = {"fubini": "fubini", "gmsh": "gmsh 6 + Laplace2D", "triangle": "triangle q33"}


def by_fubini(region, size: float, order: int):
    """Points (n, 2), cells (m, 3 or 6) and CPU seconds of the mesh alone."""
    model = regions.model_of(region)
    mesh = fubini.mesh(model, size, order=order)
    stages = (*peers.MESHING, "second order")[: 2 + order]
    return mesh.points[:, :2], mesh.nodes, sum(mesh.cpu_seconds[stage] for stage in stages)


def by_gmsh(region, size: float, order: int):
    """The same by Gmsh."""
    import gmsh

    peers.prepare_gmsh(region, size, 6)
    with peers.Stopwatch() as watch:
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.optimize("Laplace2D")
        if order == 2:
            gmsh.model.mesh.setOrder(2)
    return *peers.mesh_of_gmsh(order), watch.cpu


def by_triangle(region, size: float, order: int):
    """The same by Triangle, whose mid-side nodes lie on chords, each opposite to a corner."""
    import triangle

    points, segments, holes = peers.polyline(region, size)
    data = {"vertices": points, "segments": segments} | ({"holes": holes} if len(holes) else {})
    options = f"pq33a{1.5 * peers.TRIANGLE * size * size:.17f}" + ("o2" if order == 2 else "")
    with peers.Stopwatch() as watch:
        mesh = triangle.triangulate(data, options)
    cells = mesh["triangles"]
    return mesh["vertices"], cells if order == 1 else cells[:, [0, 1, 2, 5, 3, 4]], watch.cpu


MESHERS = {"fubini": by_fubini, "gmsh": by_gmsh, "triangle": by_triangle}


def in_skfem(points: np.ndarray, cells: np.ndarray, order: int):
    """scikit-fem's mesh of the nodes that are used."""
    used, cells = np.unique(cells, return_inverse=True)
    kind = (skfem.MeshTri1, skfem.MeshTri2)[order - 1]
    return kind(np.ascontiguousarray(points[used].T), np.ascontiguousarray(cells.reshape(-1, 3 * order).T))


def solve_plate(mesh, order: int):
    """Kirsch's plate: CPU seconds of the solution, unknowns, errors in L2 and energy, stress concentration."""
    rim = mesh.boundary_facets()
    x, y = mesh.p[:, mesh.facets[:2, rim]].mean(axis=1)
    sides = {"left": x, "right": plate.WIDTH - x, "bottom": y, "top": plate.WIDTH - y}
    mesh = mesh.with_boundaries({name: rim[np.abs(off) < 1e-9] for name, off in sides.items()})
    with peers.Stopwatch() as watch:
        u = plate.solve_kirsch(mesh, order)
    return watch.cpu, len(u), *plate.kirsch_errors(mesh, order, u)


def solve_disk(mesh, order: int):
    """Poisson's equation with the solution (1 - r^2) x y."""
    element = (skfem.ElementTriP1(), skfem.ElementTriP2())[order - 1]
    with peers.Stopwatch() as watch:
        basis = skfem.Basis(mesh, element, intorder=6)
        matrix = skfem.BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis)
        rhs = skfem.LinearForm(lambda v, w: 12 * w.x[0] * w.x[1] * v).assemble(basis)
        u = skfem.solve(*skfem.condense(matrix, rhs, D=basis.get_dofs(mesh.boundary_facets())))
    fine = skfem.Basis(mesh, element, intorder=8)
    found = fine.interpolate(u)

    def square(w):
        x, y = w.x
        return (w.u - (1 - x * x - y * y) * x * y) ** 2

    def energy(w):
        x, y = w.x
        off = w.u.grad[0] - (y - 3 * x * x * y - y**3), w.u.grad[1] - (x - 3 * x * y * y - x**3)
        return off[0] ** 2 + off[1] ** 2

    errors = [math.sqrt(skfem.Functional(f).assemble(fine, u=found)) for f in (square, energy)]
    return watch.cpu, len(u), *errors, math.nan


PROBLEMS = {
    "plate": (lambda: plate.model().faces[0].region, solve_plate), "disk": (regions.quarter_disk, solve_disk),
}  # fmt: skip


def one(problem: str, order: int, tool: str, count: int, factor: float) -> tuple[dict, float]:
    """A row, and triangles times size squared over the area."""
    region, solve = PROBLEMS[problem][0](), PROBLEMS[problem][1]
    best: tuple = (math.inf,)
    for _ in range(SEARCHES):
        size = math.sqrt(factor * region.area / count)
        made = MESHERS[tool](region, size, order)
        got = len(made[1])
        if abs(got / count - 1) < best[0]:
            best = (abs(got / count - 1), size, made)
        if best[0] < MATCHED:
            break
        # half a step: counts of small meshes jump
        factor *= math.sqrt(got / count) if factor != 4 / math.sqrt(3) else got / count
    _, size, (points, cells, seconds) = best
    mesh = in_skfem(points, cells, order)
    times = [seconds, *(MESHERS[tool](region, size, order)[2] for _ in range(RUNS - 1))]
    solved = [solve(mesh, order) for _ in range(RUNS if count <= COUNTS[1] else 1)]
    found = dict(zip(COLUMNS[5:9], solved[0][1:]))
    found |= {"mesh": statistics.median(times), "solve": statistics.median(s[0] for s in solved)}
    row = {"problem": problem, "order": order, "tool": tool, "count": count, "triangles": len(cells), **found}
    return row, len(cells) * size * size / region.area


def measure(counts: list[int]) -> list[dict]:
    """All rows."""
    rows = []
    for problem in PROBLEMS:
        for order in (1, 2):
            factor = dict.fromkeys(MESHERS, 4 / math.sqrt(3))
            for count in counts:
                for tool in MESHERS:
                    row, factor[tool] = one(problem, order, tool, count, factor[tool])
                    print("  ".join(f"{v:.4g}" if isinstance(v, float) else str(v) for v in row.values()), flush=True)
                    rows.append(row)
    return rows


def rate(rows: list[dict], key: str) -> float:
    """Slope of the error over the number of triangles to the power -1/2, by least squares."""
    h = [-0.5 * math.log(r["triangles"]) for r in rows]
    return float(np.polyfit(h, [math.log(r[key]) for r in rows], 1)[0])


def error_table(rows: list[dict], problem: str) -> str:
    """Errors and seconds of one problem, tool beside tool."""
    head = ["element", "triangles", "mesh", "L2 error", "energy error", "mesh CPU s", "solve CPU s"]
    if problem == "plate":
        head.insert(5, "stress concentration (3)")
    body = []
    for r in rows:
        if r["problem"] == problem:
            cells = [
                f"T{3 * int(r['order'])}", f"{r['triangles']:,.0f}", r["tool"], f"{r['l2']:.3e}", f"{r['energy']:.3e}",
                f"{r['mesh']:.4f}", f"{r['solve']:.2f}",
            ]  # fmt: skip
            if problem == "plate":
                cells.insert(5, f"{r['concentration']:.4f}")
            body.append(cells)
    return tables.table(tuple(head), body)


def summary_table(rows: list[dict]) -> str:
    """Rates, and errors at the largest count over fubini's."""
    body = []
    for problem in PROBLEMS:
        for order in (1, 2):
            group = [r for r in rows if r["problem"] == problem and r["order"] == order]
            last = {r["tool"]: r for r in group if r["count"] == max(q["count"] for q in group)}
            for tool in MESHERS:
                own = [r for r in group if r["tool"] == tool]
                share = [f"{last[tool][k] / last['fubini'][k]:.2f}" for k in ("l2", "energy")]
                rates = [f"{rate(own, k):.2f}" for k in ("l2", "energy")]
                times = [f"{statistics.median(r['mesh'] / r['solve'] for r in own):.3f}"]
                body.append([problem, f"T{3 * order}", tool, *rates, *share, *times])
    head = (
        "problem", "element", "mesh", "rate in L2", "rate in energy", "L2 error over fubini's",
        "energy error over fubini's", "mesh time over solve time",
    )  # fmt: skip
    return tables.table(head, body)


def plot(rows: list[dict], path: Path) -> None:
    """Energy error against triangles, and against the CPU time of mesh and solution."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 7.6), layout="constrained")
    grid = figure.subplots(2, 2)
    for column, problem in enumerate(PROBLEMS):
        for order, mark in ((1, "o"), (2, "s")):
            for tool, style in STYLES.items():
                own = [r for r in rows if (r["problem"], r["order"], r["tool"]) == (problem, order, tool)]
                wide = 2.2 if tool == "fubini" else 1.2
                look = {"color": tables.STYLES[style][0], "marker": mark, "ms": 4, "lw": wide}
                error = [r["energy"] for r in own]
                name = f"{tool}, T{3 * order}"
                grid[0, column].loglog([r["triangles"] for r in own], error, label=name, **look)
                grid[1, column].loglog([r["mesh"] for r in own], error, **look)
        grid[0, column].set_title(TITLES[problem], fontsize=10)
        grid[0, column].set_xlabel("triangles")
        grid[1, column].set_xlabel("CPU seconds of the mesh")
    for axes in grid.ravel():
        axes.set_ylabel("energy error")
        axes.grid(which="major", color="#dddddd", lw=0.6)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, frameon=False, fontsize=9)
    tables.save(figure, path)


def render(rows: list[dict]) -> None:
    """Tables and plot of the documentation."""
    for problem in PROBLEMS:
        (tables.ROOT / "docs" / "benchmarks" / f"solve_{problem}.table").write_text(error_table(rows, problem))
    summary = summary_table(rows)
    (tables.ROOT / "docs" / "benchmarks" / "solve_summary.table").write_text(summary)
    tables.replace_block(tables.ROOT / "benchmarks" / "README.md", "solve", summary)
    plot(rows, tables.ROOT / "docs" / "images" / "solve.png")


def main() -> None:
    """Measure, then render."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--counts", default=",".join(map(str, COUNTS)))
    parser.add_argument("--render", action="store_true", help="no measuring: tables and plot from solve.csv")
    asked = parser.parse_args()
    if not asked.render:
        tables.write_rows(OUT, COLUMNS, measure([int(c) for c in asked.counts.split(",")]))
    rows = tables.read_rows(OUT, ("problem", "tool"))
    render(rows)


if __name__ == "__main__":
    main()
