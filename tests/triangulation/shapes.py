"""Boundaries and point sets for the tests of the triangulation."""

from __future__ import annotations

import numpy as np

from fubini.triangulation.value import FREE, ON_CURVE, Boundary


def boundary_of(*loops) -> Boundary:
    """Boundary of closed loops, each an (n, 2) list of nodes with the region on its left."""
    points = np.concatenate([np.asarray(loop, float) for loop in loops])
    segments = []
    first = 0
    for loop in loops:
        node = first + np.arange(len(loop))
        segments.append(np.stack([node, np.roll(node, -1)], axis=1))
        first += len(loop)
    return boundary_with(points, np.concatenate(segments))


def boundary_with(points, segments) -> Boundary:
    """Boundary of given nodes and segments."""
    n, k = len(points), len(segments)
    return Boundary(
        points=np.asarray(points, float),
        kind=np.full(n, ON_CURVE, np.uint8),
        size=np.ones(n),
        angle=np.full(n, 180.0),
        segments=np.asarray(segments, np.int32).reshape(-1, 2),
        track=np.full(k, -1, np.int32),
        t=np.zeros((k, 2)),
        mode=np.full(k, FREE, np.uint8),
    )


def circle(n, radius=1.0, x=0.0, y=0.0, *, hole=False):
    """n nodes on a circle, counter-clockwise, or clockwise for a hole."""
    turn = 2 * np.pi * np.arange(n) / n * (-1 if hole else 1)
    return np.stack([x + radius * np.cos(turn), y + radius * np.sin(turn)], axis=1)


def star(rng, n, spread=0.8, hole=False, radius=1.0):
    """Random star-shaped polygon about the origin."""
    turn = 2 * np.pi * (np.arange(n) + rng.uniform(0, 0.9, n)) / n * (-1 if hole else 1)
    r = radius * rng.uniform(1 - spread, 1, n)
    return np.stack([r * np.cos(turn), r * np.sin(turn)], axis=1)


def rectangle(width, height, nx, ny):
    """Nodes of a rectangle from the origin, nx edges along x and ny along y on each side."""
    x, y = width * np.arange(nx) / nx, height * np.arange(ny) / ny
    return np.concatenate(
        [
            np.stack([x, np.zeros(nx)], axis=1),
            np.stack([np.full(ny, float(width)), y], axis=1),
            np.stack([width - x, np.full(nx, float(height))], axis=1),
            np.stack([np.zeros(ny), height - y], axis=1),
        ]
    )


def hexagonal(n, margin=0.6):
    """About n points of a hexagonal lattice inside the unit square, ``margin`` spacings from its sides."""
    h = np.sqrt(2 / (np.sqrt(3) * n))
    rows = np.arange(margin * h, 1 - margin * h, h * np.sqrt(3) / 2)
    return np.concatenate(
        [
            np.stack(np.broadcast_arrays(np.arange(h * (margin + j % 2 / 2), 1 - margin * h, h), y), axis=1)
            for j, y in enumerate(rows)
        ]
    )


def inside(loops, points):
    """Which points (n, 2) lie inside the loops (even-odd rule)."""
    x, y = np.asarray(points, float).T
    odd = np.zeros(len(x), bool)
    for loop in loops:
        a, b = np.asarray(loop, float), np.roll(np.asarray(loop, float), -1, axis=0)
        for (ax, ay), (bx, by) in zip(a, b):
            if ay != by:
                odd ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) * (bx - ax) / (by - ay))
    return odd


def canonical(triangles):
    """Triangles as a sorted list, each beginning with its smallest corner."""
    t = np.asarray(triangles, int)
    first = np.argmin(t, axis=1)
    t = np.take_along_axis(t, (first[:, None] + np.arange(3)) % 3, axis=1)
    return t[np.lexsort(t.T[::-1])]
