"""Plane models of many faces that share edges, none of them chosen: wedges about a vertex, lines across a square,
slices of a disk, triangles between random points.

A seed stands for one model; neighbours share their edges exactly, so each generator returns a list of regions.
"""

from __future__ import annotations

import math
from itertools import accumulate, pairwise

import numpy as np

from fubini.curves import CircularArc, Curve, Line
from fubini.region import Loop, Region

Place = tuple[float, float]


def fan(angles, lengths=None, arcs=()) -> list[Region]:
    """Wedges of these ``angles`` (degrees) about the origin, neighbours sharing an edge.

    ``lengths`` are those of the edges from the origin (one more than angles, 1 by default); wedges whose number is in
    ``arcs`` end in an arc where their two edges are equally long.
    """
    turns = np.radians([0.0, *accumulate(angles)])
    lengths = lengths or [1.0] * len(turns)
    ends = [(r * math.cos(a), r * math.sin(a)) for r, a in zip(lengths, turns.tolist(), strict=True)]
    out = []
    for k in range(len(angles)):
        far: Curve = Line(ends[k], ends[k + 1])
        if k in arcs and lengths[k] == lengths[k + 1]:
            far = CircularArc((0.0, 0.0), lengths[k], float(turns[k]), float(turns[k + 1]))
        out.append(_closed(Line((0.0, 0.0), ends[k]), far, Line(ends[k + 1], (0.0, 0.0))))
    return out


def random_fan(seed: int) -> list[Region]:
    """Two to six wedges of 0.1 to 120 degrees, outer ends straight or arcs, edges equally long or not."""
    rng = np.random.default_rng(seed)
    while True:
        count = int(rng.integers(2, 7))
        angles = np.exp(rng.uniform(math.log(0.1), math.log(120.0), count))
        if angles.sum() < 350.0:
            break
    equal = rng.random() < 0.5
    lengths = [1.0] * (count + 1) if equal else rng.uniform(0.4, 1.0, count + 1).tolist()
    arcs = {k for k in range(count) if rng.random() < 0.5}
    return fan(angles.tolist(), lengths, arcs)


def neighbourly_fan(seed: int) -> list[Region]:
    """The first random fan from this seed on, in strides of 100,000, with no corner too wide for those beside it.

    Where two wedges meet, the wider corner is at most five times as wide as the other, or the other has three degrees.
    """
    regions = random_fan(seed)
    while not all(max(pair) <= 5.0 * min(pair) or min(pair) >= 3.0 for pair in _pairs(regions)):
        seed += 100_000
        regions = random_fan(seed)
    return regions


def _pairs(regions: list[Region]) -> list[tuple[float, float]]:
    """Angles of the two corners at either end of every edge that two wedges share."""
    out = []
    for before, after in pairwise(regions):
        around = [{tuple(c.point): c.angle for c in region.corners()} for region in (before, after)]
        out += [(around[0][place], around[1][place]) for place in around[0].keys() & around[1].keys()]
    return sorted(out)


def arrangement(seed: int) -> list[Region]:
    """The cells of 3 to 9 random lines in the unit square."""
    rng = np.random.default_rng(seed)
    points: list[Place] = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    cells, cuts = [[0, 1, 2, 3]], {}
    for _ in range(int(rng.integers(3, 10))):
        (px, py), turn = rng.uniform(0.1, 0.9, 2), rng.uniform(0.0, math.pi)
        nx, ny = -math.sin(turn), math.cos(turn)
        cuts.clear()
        cells = [part for cell in cells for part in _cut(cell, points, cuts, (nx, ny, -nx * px - ny * py))]
    return [_polygon([points[v] for v in cell]) for cell in cells]


def _cut(cell: list[int], points: list[Place], cuts: dict, line: tuple[float, float, float]) -> list[list[int]]:
    """A convex cell on either side of a line; ``cuts`` keeps the points on edges that are cut already."""
    nx, ny, c = line
    height = [nx * points[v][0] + ny * points[v][1] + c for v in cell]
    if min(height) >= 0.0 or max(height) <= 0.0:
        return [cell]
    left, right = [], []
    for k, v in enumerate(cell):
        w, h, g = cell[(k + 1) % len(cell)], height[k], height[(k + 1) % len(cell)]
        (left if h > 0.0 else right).append(v)
        if (h > 0.0) != (g > 0.0):
            edge = (min(v, w), max(v, w))
            if edge not in cuts:
                s, (ax, ay), (bx, by) = h / (h - g), points[v], points[w]
                cuts[edge] = len(points)
                points.append((ax + s * (bx - ax), ay + s * (by - ay)))
            left.append(cuts[edge])
            right.append(cuts[edge])
    return [left, right]


def pizza(seed: int) -> list[Region]:
    """Three to twelve slices of the unit disk, the narrowest of half a degree or more."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 13))
    share = np.exp(rng.uniform(math.log(0.5), math.log(90.0), count))
    share *= 360.0 / share.sum()
    turns = np.radians([0.0, *accumulate(share)])
    ends = [(math.cos(a), math.sin(a)) for a in turns.tolist()]
    ends[-1] = ends[0]
    return [
        _closed(
            Line((0.0, 0.0), ends[k]),
            CircularArc((0.0, 0.0), 1.0, float(turns[k]), float(turns[k + 1])),
            Line(ends[k + 1], (0.0, 0.0)),
        )
        for k in range(count)
    ]


def delaunay(seed: int) -> list[Region]:
    """The Delaunay triangles of 5 to 30 random points, those on the convex hull are slivers as often as not."""
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(seed)
    points = rng.uniform(0.0, 1.0, (int(rng.integers(5, 31)), 2))
    triangles = Delaunay(points).simplices.tolist()
    return [_polygon([tuple(points[v].tolist()) for v in corners]) for corners in triangles]


def _polygon(points: list[Place]) -> Region:
    return _closed(*(Line(p, points[(k + 1) % len(points)]) for k, p in enumerate(points)))


def _closed(*curves: Curve) -> Region:
    return Region.from_loops([Loop.closed(curves, 1e-12)])
