"""Small regions with known tracks, their crude boundaries, and the certificate that every outcome must meet."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fubini.optimise import OptimiseOutcome, refine
from fubini.quality import areas, flawed
from fubini.tracks import TrackBuilder, Tracks, evaluate
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate
from fubini.triangulation.value import CORNER, FREE, ON_CURVE, Boundary, Triangulation

LINE, CONIC = 0, 1


def line(p: Sequence[float], q: Sequence[float]) -> tuple:
    return (LINE, p, q)


def arc(centre: Sequence[float], r: float, u0: float, u1: float) -> tuple:
    """Arc about a centre between two angles in radians."""
    ends = [(centre[0] + r * math.cos(u), centre[1] + r * math.sin(u)) for u in (u0, u1)]
    return (CONIC, *ends, [*centre, r, 0.0, 0.0, r, u0, u1])


def polygon(points: NDArray) -> list[tuple]:
    return [line(points[i], points[(i + 1) % len(points)]) for i in range(len(points))]


def boundary(loops: list[list[tuple]], h: float, mode: int = FREE) -> tuple[Boundary, Tracks]:
    """Every edge cut uniformly to about h, at corners below 50 degrees after equal legs on both sides."""
    builder = TrackBuilder()
    tracks = [[builder.add(*edge) for edge in loop] for loop in loops]
    table = builder.build()
    rows: list[tuple] = []
    for loop in tracks:
        first = len(rows)
        angles = [_corner(table, loop[i - 1], loop[i]) for i in range(len(loop))]
        lengths = [_length(table, k) for k in loop]
        legs = [min(h, 0.34 * lengths[i], 0.34 * lengths[i - 1]) if angles[i] < 50.0 else 0.0 for i in range(len(loop))]
        for i, k in enumerate(loop):
            t = _cuts(lengths[i], h, legs[i], legs[(i + 1) % len(loop)], len(loop) == 1)
            for j in range(len(t) - 1):
                rows.append((k, t[j], t[j + 1], angles[i] if j == 0 else 180.0, j == 0, len(rows) + 1))
        rows[-1] = (*rows[-1][:5], first)
    track, t0, t1, angle, corner, end = (np.array(x) for x in zip(*rows, strict=True))
    points = evaluate(table, track, t0)
    segments = np.stack([np.arange(len(rows)), end], 1).astype(np.int32)
    reach = np.hypot(*(points[segments[:, 1]] - points[segments[:, 0]]).T)
    size = np.full(len(points), h)
    np.minimum.at(size, segments[:, 0], reach)
    np.minimum.at(size, segments[:, 1], reach)
    kind = np.where(corner, CORNER, ON_CURVE).astype(np.uint8)
    made = Boundary(
        points, kind, size, angle.astype(float), segments, track.astype(np.int32),
        np.stack([t0, t1], 1), np.full(len(rows), mode, np.uint8),
    )  # fmt: skip
    return made, table


def _length(table: Tracks, k: int) -> float:
    p = evaluate(table, k, np.linspace(0.0, 1.0, 200))
    return float(np.hypot(*np.diff(p, axis=0).T).sum())


def _corner(table: Tracks, before: int, after: int) -> float:
    p = evaluate(table, [before, before, after, after], [1.0 - 1e-6, 1.0, 0.0, 1e-6])
    u, v = p[0] - p[1], p[3] - p[2]
    angle = math.degrees(math.atan2(v[0] * u[1] - v[1] * u[0], v @ u)) % 360.0
    return 180.0 if abs(angle - 180.0) < 1e-3 else angle


def _cuts(length: float, h: float, first: float, last: float, closed: bool) -> NDArray:
    inner = np.linspace(first, length - last, max(1 + 3 * closed, round((length - first - last) / h)) + 1)
    s = np.concatenate([[0.0] * (first > 0.0), inner, [length] * (last > 0.0)]) / length
    s[0], s[-1] = 0.0, 1.0
    return s


def meshed(loops: list[list[tuple]], h: float, mode: int = FREE) -> tuple[Triangulation, Tracks]:
    """Frontal mesh of the region, nothing optimised."""
    made, table = boundary(loops, h, mode)
    return refine(constrained_delaunay(made.points, made), table, h), table


def star_polygon(seed: int, spikes: float = 0.55) -> NDArray:
    """Star-shaped polygon of 10 to 40 corners of any angle, radii between 1 - spikes and 1."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(10, 41))
    angle = 2 * np.pi * (np.arange(n) + 0.6 * rng.random(n)) / n
    radius = 1.0 - spikes * rng.random(n)
    return radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)


def certify(outcome: OptimiseOutcome, start: Triangulation, tracks: Tracks) -> None:
    """Everything that holds for every outcome, met or not."""
    tri = outcome.triangulation
    assert validate(tri) == ()
    edge = tri.boundary
    corners = tri.points[tri.triangles]
    total = areas(corners)
    assert total.min() > 0.0
    np.testing.assert_array_equal(edge.points, tri.points[: len(edge.points)])
    for end in (0, 1):
        here, wanted = tri.points[edge.segments[:, end]], evaluate(tracks, edge.track, edge.t[:, end])
        sliding = edge.kind[edge.segments[:, end]] == ON_CURVE
        np.testing.assert_array_equal(here[sliding], wanted[sliding])
        np.testing.assert_allclose(here, wanted, rtol=0.0, atol=1e-15)
    assert outcome.flawed_after == int(flawed(corners).sum())
    fixed = start.boundary.points[start.boundary.kind >= CORNER]
    assert {tuple(p) for p in fixed} <= {tuple(p) for p in edge.points}
    if (tracks.kinds == LINE).all():
        np.testing.assert_allclose(total.sum(), areas(start.points[start.triangles]).sum(), rtol=1e-12)
