"""What the walk of ``_kernels_strip`` leaves of a strip, cut out to be triangulated by itself, and fitted in again."""

from __future__ import annotations

import numpy as np

from fubini._jit import inner
from fubini.triangulation._kernels_strip import put_in, twin_of
from fubini.triangulation._kernels_topology import DONE, fill_vertex_triangle, legalise


@inner(allocates=True)
def nodes_of_rest(ends, sewn, n):
    """Nodes at ``ends`` (r, 2) and those in none of the triangles ``sewn``, ascending, and place (n,) among them."""
    place = np.zeros(n, np.int32)
    for t in range(sewn.shape[0]):
        for i in range(3):
            place[sewn[t, i]] = -1
    for s in range(ends.shape[0]):
        place[ends[s, 0]] = place[ends[s, 1]] = 0
    nodes, count = np.empty(n, np.int32), 0
    for v in range(n):
        if place[v] == 0:
            nodes[count], place[v] = v, count
            count += 1
    return nodes[:count], place


@inner(allocates=True)
def cut_out(points, segments, fixed, hanging, sewn, left):
    """Region that the edges ``left`` (r,) enclose, all nodes in no triangle of ``sewn`` (m, 3) in it: see ``between``.

    Returns its nodes (z,), ascending, their points (z, 2), its segments (r, 2) by place among them, and how many of
    the nodes are below ``fixed``.
    """
    k, ends = segments.shape[0], np.empty((left.shape[0], 2), np.int32)
    for s in range(left.shape[0]):
        for i in range(2):
            ends[s, i] = segments[left[s], i] if left[s] < k else hanging[left[s] - k, i]
    nodes, place = nodes_of_rest(ends, sewn, points.shape[0])
    some, first = np.empty((nodes.shape[0], 2)), 0
    for z in range(nodes.shape[0]):
        some[z, 0], some[z, 1] = points[nodes[z], 0], points[nodes[z], 1]
        first += nodes[z] < fixed
    for s in range(ends.shape[0]):
        ends[s, 0], ends[s, 1] = place[ends[s, 0]], place[ends[s, 1]]
    return nodes, some, ends, first


@inner
def name_nodes(nodes, dropped, corners):
    """Turn places among the nodes into these, in place: those dropped (d,), and corners (m, 3), which go on without."""
    d = 0
    for z in range(nodes.shape[0]):
        if d < dropped.shape[0] and dropped[d] == z:
            dropped[d] = nodes[z]
            d += 1
        else:
            nodes[z - d] = nodes[z]
    for t in range(corners.shape[0]):
        for i in range(3):
            corners[t, i] = nodes[corners[t, i]]


@inner(allocates=True)
def fit_in(points, fixed, k, hanging, sewn, beside, left, nodes, more, across, dropped):
    """Triangles ``sewn`` (m, 3), neighbours ``beside`` (m, 3), and those of what was cut out, as one.

    k, hanging : how many segments and hanging edges the strip has. nodes (z,), left (r,) : of ``cut_out``. more (a, 3),
    across (a, 3), dropped (d,) : its triangulation; nodes, more and dropped change. No triangles where it does not fit.
    """
    name_nodes(nodes, dropped, more)
    m, count = sewn.shape[0], sewn.shape[0] + more.shape[0]
    room = count + 2 * dropped.shape[0]
    triangles, neighbours = np.empty((room, 3), np.int32), np.empty((room, 3), np.int32)
    none = triangles[:0], neighbours[:0]
    half_edge = np.empty(hanging, np.int64)
    for t in range(m):
        for i in range(3):
            u = np.int64(beside[t, i])
            triangles[t, i], neighbours[t, i] = sewn[t, i], u
            if u < -k:
                half_edge[-1 - u - k] = 3 * t + i
    stack, waiting = np.empty(16 * room, np.int32), 0
    for t in range(m, count):
        for i in range(3):
            u = across[t - m, i]
            s = -1 if u >= 0 else left[-1 - u]
            triangles[t, i], neighbours[t, i] = more[t - m, i], u + m if u >= 0 else -1 - s
            if s >= k:  # hanging in the strip: the other side was sewn
                half = half_edge[twin_of(s, k) - k]
                neighbours[t, i], neighbours[half // 3, half % 3] = half // 3, t
                stack[waiting] = t
                waiting += 1
    vertex_triangle = np.empty(points.shape[0], np.int32)
    fill_vertex_triangle(triangles, count, vertex_triangle)
    report, _ = legalise(points, triangles, neighbours, vertex_triangle, stack, waiting)
    if report != DONE:
        return none
    for v in dropped:
        if not put_in(points, triangles, neighbours, vertex_triangle, fixed, np.int64(v), count):
            return none
        count += 2
    return triangles, neighbours
