"""Generators of plane regions for tests: classics, random polygons, random outlines of arcs and splines."""

from __future__ import annotations

import math

import numpy as np

from fubini.curves import BSpline, CircularArc, Curve, Line
from fubini.model import Edge, Face, Frame, Model
from fubini.region import Loop, Region
from fubini.sampling.boundary import BoundarySizing, EdgeNodes, Outline, SizeOptions
from fubini.sampling.network import Network
from fubini.triangulation.value import Boundary

TURN = 2 * math.pi


def polygon(*loops) -> Region:
    """Region of straight loops given by their corners."""
    return Region.from_loops([loop(p) for p in loops])


def loop(points) -> Loop:
    """Closed loop of lines through points (n, 2)."""
    p = [tuple(map(float, q)) for q in points]
    return Loop(tuple(Line(p[i], p[(i + 1) % len(p)]) for i in range(len(p))))


def circle(x: float, y: float, radius: float) -> Loop:
    """Loop of one full circle."""
    return Loop((CircularArc((x, y), radius, 0.0, TURN),))


def chain(*curves: Curve) -> Region:
    """Region bounded by one chain of curves."""
    return Region.from_loops([Loop.closed(tuple(curves), 1e-9)])


def quarter_disk() -> Region:
    return chain(Line((0, 0), (1, 0)), CircularArc((0, 0), 1.0, 0.0, math.pi / 2), Line((0, 1), (0, 0)))


def annulus_quarter() -> Region:
    return chain(
        Line((0.4, 0), (1, 0)), CircularArc((0, 0), 1.0, 0.0, math.pi / 2), Line((0, 1), (0, 0.4)),
        CircularArc((0, 0), 0.4, math.pi / 2, 0.0),
    )  # fmt: skip


def square() -> Region:
    return polygon([(0, 0), (1, 0), (1, 1), (0, 1)])


def plate(holes: int = 12) -> Region:
    radii = [0.3, 0.12, 0.2, 0.05, 0.15, 0.35, 0.08, 0.25, 0.1, 0.3, 0.18, 0.06]
    loops = [loop([(0, 0), (4, 0), (4, 3), (0, 3)])]
    loops += [circle(0.5 + k % 4 + 0.07 * (k // 4), 0.5 + k // 4, radii[k]) for k in range(holes)]
    return Region.from_loops(loops)


def gear(teeth: int = 24) -> Region:
    points = []
    for i in range(teeth):
        for part, radius in ((0, 0.85), (0.22, 0.85), (0.36, 1.0), (0.64, 1.0), (0.78, 0.85)):
            a = TURN * (i + part) / teeth
            points.append((radius * math.cos(a), radius * math.sin(a)))
    return Region.from_loops([loop(points), circle(0, 0, 0.25)])


def slot(width: float = 0.02) -> Region:
    """Plate 10 x 6 with a round-ended slot 4 long."""
    w = width / 2
    ends = (
        Line((3, 3 - w), (7, 3 - w)), CircularArc((7, 3), w, -math.pi / 2, math.pi / 2),
        Line((7, 3 + w), (3, 3 + w)), CircularArc((3, 3), w, math.pi / 2, 1.5 * math.pi),
    )  # fmt: skip
    return Region.from_loops([loop([(0, 0), (10, 0), (10, 6), (0, 6)]), Loop.closed(ends, 1e-9)])


def wedge(degrees: float) -> Region:
    a = math.radians(degrees)
    return chain(Line((0, 0), (1, 0)), CircularArc((0, 0), 1.0, 0.0, a), Line((math.cos(a), math.sin(a)), (0, 0)))


def spline_through(points, closed: bool = False) -> BSpline:
    """Cubic spline through points (n, 2)."""
    from scipy.interpolate import make_interp_spline

    p = np.asarray(points, float)
    t = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(p, axis=0).T))])
    fit = make_interp_spline(t, p, k=3)
    return BSpline(3, fit.t, fit.c)


def blob() -> Region:
    """Half-plane blob with one straight side."""
    a = np.linspace(0.0, math.pi, 14)
    r = 1 + 0.25 * np.sin(5 * a) + 0.15 * np.cos(3 * a)
    points = np.c_[r * np.cos(a), r * np.sin(a)]
    points[[0, -1], 1] = 0.0
    return chain(spline_through(points), Line(points[-1], points[0]))


def simple_polygon(rng: np.random.Generator, n: int) -> np.ndarray:
    """Corners (n, 2) of a random simple polygon: a random tour, uncrossed by reversals."""
    p = rng.random((n, 2))
    order = list(range(n))

    def side(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    crossed = True
    while crossed:
        crossed = False
        for i in range(n):
            for j in range(i + 2, n):
                if i == 0 and j == n - 1:
                    continue
                a, b, c, d = (p[order[k % n]] for k in (i, i + 1, j, j + 1))
                if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
                    order[i + 1 : j + 1] = order[i + 1 : j + 1][::-1]
                    crossed = True
    return p[order]


def random_polygon(seed: int, low: int = 10, high: int = 60) -> Region:
    """Random simple polygon; every third one with a small hole."""
    rng = np.random.default_rng(seed)
    points = simple_polygon(rng, int(rng.integers(low, high + 1)))
    outer = polygon(points)
    if seed % 3 == 0:
        spots = rng.random((400, 2))
        spots = spots[outer.contains(spots)]
        gap = [min(c.closest(s[None])[1][0] for c in outer.curves) for s in spots]
        k = int(np.argmax(gap))
        a = np.sort(rng.random(int(rng.integers(3, 8)))) * TURN
        if np.diff(a, append=a[0] + TURN).max() < 0.9 * math.pi:
            hole = spots[k] + 0.6 * gap[k] * np.c_[np.cos(a), np.sin(a)]
            return polygon(points, hole)
    return outer


def model_of(*regions: Region) -> Model:
    """A model of faces that share nothing, all in the xy plane."""
    faces, edges, vertices = [], {}, {}
    for i, region in enumerate(regions):
        loops = []
        for old in region.loops:
            base, n = len(edges), len(old.curves)
            for k, curve in enumerate(old.curves):
                edges[base + k] = Edge(base + k, curve.kind, base + k, base + (k + 1) % n)
                vertices[base + k] = np.array([*curve.start, 0.0])
            loops.append(Loop(old.curves, tuple(range(base, base + n)), (True,) * n))
        frame = Frame(np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
        faces.append(Face(i, Region(loops[0], tuple(loops[1:])), frame))
    return Model("test", tuple(faces), edges, vertices, diagonal=max(r.diagonal for r in regions))


def discretise(region: Region, size: float, **options) -> tuple[Boundary, BoundarySizing, EdgeNodes]:
    """Boundary of one region at an asked size, with the sizing and the nodes that it came from."""
    model = model_of(region)
    outline = Outline.of(model.faces[0].region, int)
    network = Network.of([outline], [(e.start, e.end) for e in model.edges.values()])
    sizing = BoundarySizing(network, SizeOptions(size, **options))
    nodes = sizing.resolve()
    return sizing.boundary(0, nodes), sizing, nodes
