"""Generators of sample points before and after the optimiser, on the faces of the comparison.

    python benchmarks/generators.py               # numpy, scipy, numba, matplotlib: about five minutes
    python benchmarks/generators.py --quick       # 2,000 triangles alone, half a minute
    python benchmarks/generators.py --render      # table and picture again from generators.csv

Small implementations of what the paper reviews: Poisson-disk sampling (scipy), Lloyd's relaxation, bubble packing,
a quadtree, forces in bars as in DistMesh, the hexagonal lattice; and of the mapping, the paper's four sets in the
cells as they are and the family SP(n, m) with n and m chosen from the wanted edge length. All but the mapping get
the boundary nodes of fubini and answer with interior points; the points are triangulated by the constrained Delaunay
triangulation and handed to ``optimise``.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay, cKDTree

sys.path.insert(0, str(Path(__file__).parent))

import peers
import tables

import regions  # of tests/
from fubini.cells import decompose
from fubini.optimise import OptimiseOptions, optimise
from fubini.pipeline.attempts import MOVES, MOVES_EACH
from fubini.pipeline.pattern import pattern_nodes, pattern_points, settle_points
from fubini.quality import flawed, skewness
from fubini.region import Region
from fubini.sampling.interior import lattice_points
from fubini.sampling.mapping import map_points
from fubini.sampling.reference import quincunx
from fubini.triangulation.constrained import constrained_delaunay

OUT = Path(__file__).with_name("generators.csv")
Float = np.ndarray
COUNTS = (2_000, 20_000)
#: The number of triangles is matched within this share.
MATCHED = 0.1
#: Points nearer than this share of the size to a boundary node are left out.
CLEAR = 0.6
COLUMNS = (
    "face", "count", "generator", "triangles", "flawed", "worst_skew", "mean_skew", "seconds", "after", "flawed_after",
    "excess", "worst_after", "mean_after", "moves", "optimise",
)  # fmt: skip


class Place:
    """A face and its boundary nodes at a size: what is inside, and what is clear of the boundary."""

    def __init__(self, region: Region, size: float) -> None:
        self.region, self.size = region, size
        self.boundary, self.sizing, _ = regions.discretise(region, size)
        self.nodes = self.boundary.points
        self.near = cKDTree(self.nodes)
        self.low, self.high = region.bounding_box

    def clear(self, points: Float, share: float = CLEAR) -> Float:
        """The points inside that keep the share of the wanted size from all boundary nodes."""
        distance, node = self.near.query(points)
        points = points[distance > share * np.minimum(self.boundary.size[node], self.size)]
        return points[self.region.contains(points)]

    def random(self, rng: np.random.Generator) -> Float:
        """Random points inside, as many as a hexagonal lattice of this size has there."""
        wanted = self.region.area / (2.0 * peers.TRIANGLE * self.size**2) - 0.5 * len(self.nodes)
        box = float(np.prod(self.high - self.low))
        tries = rng.uniform(self.low, self.high, (math.ceil(max(wanted, 4.0) * box / self.region.area), 2))
        return self.clear(tries, 0.5)


def poisson_disk(place: Place) -> Float:
    """Maximal Poisson-disk sampling by dart throwing (Bridson; scipy), of the density of the hexagonal lattice."""
    from scipy.stats import qmc

    radius = 0.78 * place.size
    engine = qmc.PoissonDisk(2, radius=radius, l_bounds=place.low, u_bounds=place.high, rng=np.random.default_rng(1))
    return place.clear(engine.fill_space(), 0.78)


def lloyd(place: Place, rounds: int = 40) -> Float:
    """Centroidal Voronoi tessellation by Lloyd's method: cells are integrated on a grid, boundary nodes stand still."""
    points = place.random(np.random.default_rng(1))
    step = place.size / 5.0
    x, y = (np.arange(a + step / 2, b, step) for a, b in zip(place.low, place.high, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    grid = grid[place.region.contains(grid)]
    for _ in range(rounds):
        _, owner = cKDTree(np.concatenate([points, place.nodes])).query(grid)
        n = np.bincount(owner, minlength=len(points))[: len(points)]
        sums = [np.bincount(owner, grid[:, k], minlength=len(points))[: len(points)] for k in (0, 1)]
        points = np.where(n[:, None] > 0, np.stack(sums, axis=1) / np.maximum(n, 1)[:, None], points)
    return place.clear(points, 0.4)


def pushed(place: Place, points: Float, pairs: np.ndarray, forces: Float, step: float) -> Float:
    """Points moved by ``step`` times the forces on them, where that stays inside.

    forces (k, 2) act on the first of each of the pairs (k, 2), and reversed on the second. Numbers from
    ``len(points)`` on are boundary nodes, which stand still.
    """
    moved = points.copy()
    for k in (0, 1):
        on, off = (np.bincount(ends, forces[:, k], len(points) + len(place.nodes)) for ends in pairs.T)
        moved[:, k] += step * (on - off)[: len(points)]
    return np.where(place.region.contains(moved)[:, None], moved, points)


def bubbles(place: Place, rounds: int = 90) -> Float:
    """Bubble packing (Shimada): forces between bubbles in contact, crowded ones removed, gaps filled."""
    points, h = place.random(np.random.default_rng(1)), place.size
    for turn in range(rounds):
        everyone = np.concatenate([points, place.nodes])
        pairs = cKDTree(everyone).query_pairs(1.5 * h, output_type="ndarray")
        pairs = pairs[pairs[:, 0] < len(points)]
        apart = everyone[pairs[:, 1]] - everyone[pairs[:, 0]]
        length = np.maximum(np.hypot(*apart.T), 1e-9 * h)
        w = length / h
        force = (1.25 * w**3 - 2.375 * w**2 + 1.125) * h / length
        points = pushed(place, points, pairs[:, ::-1], force[:, None] * apart, 0.15)
        if turn % 10 == 9 and turn < rounds - 20:
            crowd = np.bincount(pairs.ravel(), np.tile(2.0 - w, (2, 1)).T.ravel(), len(everyone))[: len(points)]
            points = _population(place, points, crowd)
    return place.clear(points, 0.5)


def _population(place: Place, points: Float, crowd: Float) -> Float:
    """Without every other crowded bubble, and with a new one in every wide gap (six touching neighbours make 6)."""
    kept = points[~((crowd > 7.5) & (np.arange(len(points)) % 2 == 0))]
    everyone = np.concatenate([kept, place.nodes])
    triangles = everyone[Delaunay(everyone).simplices]
    a, b, c = triangles.transpose(1, 0, 2)
    sides = [np.hypot(*(p - q).T) for p, q in ((a, b), (b, c), (c, a))]
    p, q = b - a, c - a
    area = 0.5 * np.abs(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
    radius = sides[0] * sides[1] * sides[2] / np.maximum(4.0 * area, 1e-300)
    return np.concatenate([kept, place.clear(triangles[radius > 0.95 * place.size].mean(axis=1))])


def quadtree(place: Place) -> Float:
    """Corners of a quadtree whose leaves are no larger than the size wanted there."""
    root = place.size * 2.0 ** math.ceil(math.log2(float(np.ptp(place.region.bounding_box, axis=0).max()) / place.size))
    corners, side = np.array([place.low - 0.37 * place.size]), 2.0 * root
    leaves = []
    while len(corners):
        distance, node = place.near.query(corners + side / 2)
        wanted = np.minimum(place.size, place.boundary.size[node] + 0.35 * distance)
        leaf = side <= 1.001 * wanted
        leaves += [corners[leaf] + side * np.array(k) for k in ((0, 0), (1, 0), (0, 1), (1, 1))]
        side /= 2.0
        corners = (corners[~leaf][:, None] + side * np.array([(0, 0), (1, 0), (0, 1), (1, 1)])).reshape(-1, 2)
    points = np.concatenate(leaves)
    return place.clear(np.unique(np.round(points / (1e-6 * place.size)), axis=0) * (1e-6 * place.size))


def bars(place: Place, rounds: int = 80) -> Float:
    """Forces in the bars of the triangulation, as in DistMesh (Persson, Strang); boundary nodes stand still."""
    points, h = place.clear(lattice(place), CLEAR), place.size
    points = points + np.random.default_rng(1).uniform(-0.2, 0.2, points.shape) * h
    at = np.full_like(points, np.inf)
    for _ in range(rounds):
        everyone = np.concatenate([points, place.nodes])
        if np.abs(points - at).max(initial=0.0) > 0.1 * h:
            at = points.copy()
            triangles = Delaunay(everyone).simplices
            triangles = triangles[place.region.contains(everyone[triangles].mean(axis=1))]
            edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
        apart = everyone[edges[:, 0]] - everyone[edges[:, 1]]
        length = np.hypot(*apart.T)
        wanted = 1.2 * math.sqrt((length**2).mean())
        pull = np.maximum(wanted - length, 0.0) / length
        points = pushed(place, points, edges, pull[:, None] * apart, 0.2)
    return place.clear(points, 0.5)


def lattice(place: Place) -> Float:
    """The hexagonal lattice, clear of the boundary, with nothing else."""
    return lattice_points(place.boundary, place.size)


def mapped(place: Place) -> Float:
    """SP(n, m) in every cell, n and m so that its triangles are of the wanted size."""
    points = []
    for cell in decompose(place.region):
        ends = np.linspace(cell.a, cell.b, 33)
        sides = cell.b - cell.a, float((cell.s(ends) - cell.r(ends)).mean())
        across, along = sides if cell.axis == 0 else sides[::-1]
        n = max(2, 1 + round(across / place.size))
        m = max(2, 1 + round(along / (math.sqrt(3.0) * place.size)))
        points.append(map_points(cell, quincunx(n, m)))
    return np.concatenate(points)


FREE: dict[str, Callable[[Place], Float]] = {
    "Poisson disk": poisson_disk, "Lloyd": lloyd, "bubble packing": bubbles, "quadtree": quadtree,
    "bars (DistMesh)": bars, "hexagonal lattice": lattice,
}  # fmt: skip
SETS = ("SP13", "SP41", "ASP20", "ASP48")
MAPPING = "mapping SP(n, m)"
NAMES = (*FREE, MAPPING, *SETS)


def first_mesh(name: str, region: Region, size: float):
    """The constrained Delaunay triangulation of a generator's points, the tracks, and the CPU seconds of the points."""
    place = Place(region, size)
    outline = place.sizing.outlines[0]
    started = time.process_time()
    if name in FREE:
        boundary, inside = place.boundary, FREE[name](place)
    else:
        if name in SETS:
            settled = pattern_points(region, outline, name)
        else:
            settled = settle_points(mapped(place), region, outline)
        boundary = place.sizing.boundary(0, pattern_nodes(len(place.sizing.ends), [outline], [settled]))
        inside = settled.inside
    seconds = time.process_time() - started
    return constrained_delaunay(np.concatenate([boundary.points, inside]), boundary), outline.tracks, seconds


def matched_mesh(name: str, region: Region, count: int):
    """``first_mesh`` with about the wanted number of triangles; the paper's sets come as they are."""
    size = math.sqrt(region.area / count / peers.TRIANGLE)
    for _ in range(4):
        start, tracks, seconds = first_mesh(name, region, size)
        if name in SETS or abs(len(start.triangles) / count - 1) < MATCHED:
            break
        size *= math.sqrt(len(start.triangles) / count)
    return start, tracks, seconds


def improve(start, tracks):
    """Outcome of the optimiser, with the budget that the pipeline gives it, and its CPU seconds."""
    started = time.process_time()
    outcome = optimise(start, tracks, OptimiseOptions(budget=MOVES, budget_each=MOVES_EACH))
    return outcome, time.process_time() - started


def one(name: str, face: str, count: int) -> dict:
    """Figures before and after."""
    start, tracks, seconds = matched_mesh(name, peers.FACES[face](), count)
    outcome, optimising = improve(start, tracks)
    before, after = (t.points[t.triangles] for t in (start, outcome.triangulation))
    return {
        "face": face, "count": count, "generator": name, "triangles": len(before), "flawed": int(flawed(before).sum()),
        "worst_skew": float(skewness(before).min()), "mean_skew": float(skewness(before).mean()), "seconds": seconds,
        "after": len(after), "flawed_after": int(flawed(after).sum()), "excess": outcome.excess,
        "worst_after": float(skewness(after).min()), "mean_after": float(skewness(after).mean()),
        "moves": sum(outcome.moves.values()), "optimise": optimising,
    }  # fmt: skip


def measure(counts: list[int]) -> list[dict]:
    """All rows; the compiled code is loaded before the first."""
    one("hexagonal lattice", "wrench", 200)
    rows = []
    for count in counts:
        for face in peers.FACES:
            for name in NAMES:
                if name in SETS and count != counts[0]:
                    continue
                rows.append(one(name, face, count))
                print("  ".join(f"{v:.4g}" if isinstance(v, float) else str(v) for v in rows[-1].values()), flush=True)
    return rows


def summary(rows: list[dict]) -> str:
    """All faces together, by generator and count."""
    body = []
    for name in NAMES:
        for count in sorted({r["count"] for r in rows}):
            own = [r for r in rows if r["generator"] == name and r["count"] == count]
            if not own:
                continue
            total = {k: sum(r[k] for r in own) for k in ("triangles", "flawed", "after", "excess", "moves", "seconds")}
            body.append([
                name, f"{count:,.0f}" if name not in SETS else "as it is", f"{total['triangles']:,.0f}",
                f"{100 * total['flawed'] / total['triangles']:.2f} %", f"{min(r['worst_skew'] for r in own):.1f}",
                f"{total['seconds']:.2g}", f"{total['moves']:,.0f}", f"{total['after']:,.0f}",
                f"{total['excess']:.0f}", f"{min(r['worst_after'] for r in own):.1f}",
                f"{sum(r['mean_after'] * r['after'] for r in own) / total['after']:.1f}",
                f"{sum(r['optimise'] for r in own):.2g}",
            ])  # fmt: skip
    head = (
        "points", "wanted", "triangles", "flawed before", "worst skewness before", "CPU s", "moves", "triangles after",
        "flawed after", "worst skewness after", "mean skewness after", "CPU s of the optimiser",
    )  # fmt: skip
    return tables.table(head, body)


def sheet(path: Path, face: str = "quarter disk", count: int = 300) -> None:
    """Before and after of every generator, flawed triangles red."""
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    names = (*FREE, MAPPING, "SP41")
    figure = Figure(figsize=(9.5, 11.0), layout="constrained")
    grid = figure.subplots(len(names) // 2, 4)
    for axes, name in zip(grid.reshape(-1, 2), names):
        start, tracks, _ = matched_mesh(name, peers.FACES[face](), count)
        outcome, _ = improve(start, tracks)
        for place, mesh, when in zip(axes, (start, outcome.triangulation), (name, "optimised")):
            corners = mesh.points[mesh.triangles]
            bad = flawed(corners)
            colours = np.where(bad, "#d9483b", "#dce6ee")
            place.add_collection(PolyCollection(corners, facecolors=colours, edgecolors="#41617f", linewidths=0.4))
            place.autoscale_view()
            place.set_aspect("equal")
            place.set_axis_off()
            place.set_title(f"{when}: {len(corners)}, {bad.sum()} flawed", fontsize=8)
    tables.save(figure, path)


def main() -> None:
    """Measure, then render."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--counts", default=",".join(map(str, COUNTS)))
    parser.add_argument("--quick", action="store_true", help="2,000 triangles; writes nothing")
    parser.add_argument("--render", action="store_true", help="no measuring: table and picture from generators.csv")
    asked = parser.parse_args()
    if asked.quick:
        print(summary(measure([2_000])))
        return
    if not asked.render:
        tables.write_rows(OUT, COLUMNS, measure([int(c) for c in asked.counts.split(",")]))
    rows = tables.read_rows(OUT, ("face", "generator"))
    text = summary(rows)
    (tables.ROOT / "docs" / "benchmarks" / "sampling.table").write_text(text)
    tables.replace_block(tables.ROOT / "benchmarks" / "README.md", "sampling", text)
    sheet(tables.ROOT / "docs" / "images" / "sampling.png")


if __name__ == "__main__":
    main()
