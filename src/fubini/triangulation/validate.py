"""Checks that a triangulation is what it claims to be, independent of the code that made it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fubini import predicates
from fubini.triangulation.value import Triangulation

#: Angles around a node sum to a full turn within this (radians); a sheet too many adds a full turn.
ANGLE = 1.0


def validate(triangulation: Triangulation, *, delaunay: bool = False) -> tuple[str, ...]:
    """List everything that is wrong with a triangulation; empty when it is valid.

    Checked: finite points, the first of them the boundary's; indices in range; all triangles strictly
    counter-clockwise (exactly); neighbours that name each other across the same two nodes; each boundary segment on
    exactly one edge, in its direction; no unused node; closed loops; V - E + F = 2 C - L for C connected parts
    and L loops; no overlap around any node; with ``delaunay`` also that no vertex lies strictly inside the circle of
    the triangle across an edge that is not a segment (exactly).
    """
    problems = _indices(triangulation)
    if problems:  # the other checks would read outside the arrays
        return tuple(problems)
    problems += _geometry(triangulation)
    problems += _neighbours(triangulation)
    problems += _segments(triangulation)
    if not problems:
        problems += _topology(triangulation)
        problems += _stars(triangulation)
    if delaunay and not problems:
        problems += _delaunay(triangulation)
    return tuple(problems)


def _report(text: str, where: NDArray[np.intp]) -> list[str]:
    """One line about the first of the places, with the number of the others; none for no place."""
    if not len(where):
        return []
    more = f" (and {len(where) - 1} more)" if len(where) > 1 else ""
    return [text.format(int(where[0])) + more]


def _indices(tri: Triangulation) -> list[str]:
    """Shapes and ranges of all indices."""
    n, m, k = len(tri.points), len(tri.triangles), len(tri.boundary.segments)
    if tri.triangles.shape != (m, 3) or tri.neighbours.shape != (m, 3) or tri.points.shape != (n, 2):
        return ["points must be (n, 2), triangles and neighbours (m, 3)"]
    problems = ["there are no triangles"] if m == 0 else []
    wrong = ((tri.triangles < 0) | (tri.triangles >= n)).any(axis=1)
    problems += _report("triangle {} names a point that does not exist", np.flatnonzero(wrong))
    wrong = ((tri.neighbours < -k) | (tri.neighbours >= m)).any(axis=1)
    problems += _report("triangle {} names a neighbour or segment that does not exist", np.flatnonzero(wrong))
    wrong = ((tri.boundary.segments < 0) | (tri.boundary.segments >= len(tri.boundary.points))).any(axis=1)
    problems += _report("segment {} names a boundary node that does not exist", np.flatnonzero(wrong))
    return problems


def _geometry(tri: Triangulation) -> list[str]:
    """Points and orientation."""
    problems = _report("point {} is not finite", np.flatnonzero(~np.isfinite(tri.points).all(axis=1)))
    if problems:
        return problems
    fixed = len(tri.boundary.points)
    if len(tri.points) < fixed or not np.array_equal(tri.points[:fixed], tri.boundary.points):
        problems.append("the first points are not the boundary's nodes")
    corners = [tri.points[tri.triangles[:, i]] for i in range(3)]
    flat = np.flatnonzero(predicates.orientation(*corners) <= 0)
    return problems + _report("triangle {} is not counter-clockwise", flat)


def _edges(tri: Triangulation) -> tuple[NDArray[np.intp], NDArray[np.int32], NDArray[np.int32]]:
    """Triangle (3 m,), ends (3 m, 2) and neighbour (3 m,) of every half-edge, three for each triangle."""
    t = np.repeat(np.arange(len(tri.triangles)), 3)
    ends = tri.triangles[:, [1, 2, 2, 0, 0, 1]].reshape(-1, 2)
    return t, ends, tri.neighbours.reshape(-1)


def _neighbours(tri: Triangulation) -> list[str]:
    """Each neighbour names the triangle back across the same edge, and no two half-edges are equal."""
    t, ends, across = _edges(tri)
    inner = across >= 0
    t, a, b, u = t[inner], ends[inner, 0], ends[inner, 1], across[inner]
    mutual = np.zeros(len(t), bool)
    for j in range(3):
        back = (tri.triangles[u, (j + 1) % 3] == b) & (tri.triangles[u, (j + 2) % 3] == a)
        mutual |= back & (tri.neighbours[u, j] == t)
    problems = _report("triangle {} and a neighbour do not name each other across one edge", t[~mutual])
    key = ends[:, 0].astype(np.int64) * len(tri.points) + ends[:, 1]
    order = np.argsort(key, kind="stable")
    twice = order[1:][key[order[1:]] == key[order[:-1]]] // 3
    return problems + _report("triangle {} has a directed edge that another triangle has too", np.sort(twice))


def _segments(tri: Triangulation) -> list[str]:
    """Each segment exactly once, from its first node to its second with the triangle on the left."""
    t, ends, across = _edges(tri)
    rim = across < 0
    s = -1 - across[rim]
    wrong = (ends[rim] != tri.boundary.segments[s]).any(axis=1)
    problems = _report("triangle {} has a segment that does not run along that edge", t[rim][wrong])
    count = np.bincount(s, minlength=len(tri.boundary.segments))
    problems += _report("segment {} is no edge of the triangulation", np.flatnonzero(count == 0))
    problems += _report("segment {} is an edge more than once", np.flatnonzero(count > 1))
    return problems + _report("segment {} was not recovered", np.asarray(tri.unrecovered, np.intp))


def _topology(tri: Triangulation) -> list[str]:
    """Used nodes, closed loops, Euler's formula."""
    n, m, segments = len(tri.points), len(tri.triangles), tri.boundary.segments
    used = np.bincount(tri.triangles.reshape(-1), minlength=n) > 0
    problems = _report("point {} belongs to no triangle", np.flatnonzero(~used))
    starts, stops = np.bincount(segments[:, 0], minlength=n), np.bincount(segments[:, 1], minlength=n)
    open_ends = np.flatnonzero((starts != stops) | (starts > 1))
    problems += _report("point {} does not start and end exactly one segment of a loop", open_ends)
    if problems:
        return problems
    t, _, across = _edges(tri)
    inner = across >= 0
    parts = _components(m, t[inner], across[inner])
    loops = _components(n, segments[:, 0], segments[:, 1]) - int((starts == 0).sum())
    edges = int(inner.sum()) // 2 + int((~inner).sum())
    euler = n - edges + m
    if euler != 2 * parts - loops:
        return [f"V - E + F is {euler}, but {parts} part(s) with {loops} loop(s) have {2 * parts - loops}"]
    return []


def _components(n: int, a: NDArray[np.integer], b: NDArray[np.integer]) -> int:
    """Connected components of the graph of n nodes with edges a - b."""
    graph = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(n, n))
    return int(connected_components(graph, directed=False, return_labels=False))


def _stars(tri: Triangulation) -> list[str]:
    """The triangles around a node fill a full turn at an inner node, at most one at a node of the boundary."""
    p = tri.points[tri.triangles]
    angle = np.zeros(len(tri.points))
    for i in range(3):
        u, v = p[:, (i + 1) % 3] - p[:, i], p[:, (i + 2) % 3] - p[:, i]
        turn = np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], u[:, 0] * v[:, 0] + u[:, 1] * v[:, 1])
        angle += np.bincount(tri.triangles[:, i], turn, minlength=len(angle))
    return _report("the triangles around point {} overlap", np.flatnonzero(angle > 2 * np.pi + ANGLE))


def _delaunay(tri: Triangulation) -> list[str]:
    """No vertex strictly inside the circle of the triangle across an inner edge."""
    t, _, across = _edges(tri)
    inner = across >= 0
    t, u = t[inner], across[inner]
    corner = np.argmax(tri.neighbours[u] == t[:, None], axis=1)
    a, b, c = (tri.points[tri.triangles[t, i]] for i in range(3))
    inside = predicates.in_circle(a, b, c, tri.points[tri.triangles[u, corner]]) > 0
    return _report("triangle {} has a neighbour's corner inside its circle", t[inside])
