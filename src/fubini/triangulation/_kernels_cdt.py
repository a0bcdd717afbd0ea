"""Constrained Delaunay triangulation of a region in one compiled call.

Inside, vertices are numbered by *rank*, their place in the order of insertion, so that neighbours in the plane
are mostly neighbours in memory; ranks n, n + 1, n + 2 are the corners of a far triangle around all points. As the
segments of a closed boundary separate those corners from the region, they leave no trace in it.
"""

from __future__ import annotations

import numpy as np

from fubini._jit import inner, kernel
from fubini._kernels_predicates import orient
from fubini.triangulation._kernels_extract import extract
from fubini.triangulation._kernels_order import insertion_order
from fubini.triangulation._kernels_rest import cut_out, fit_in
from fubini.triangulation._kernels_strip import between
from fubini.triangulation._kernels_topology import (
    DONE,
    find_edge,
    flip,
    legalise,
    legalise_star,
    locate,
    split_triangle,
)

#: The far corners lie this many extents away: then a hull edge is missing only where the hull is nearly flat.
FAR = 1024.0

#: Neighbour of the far triangle: smaller than the code of any segment.
NOTHING = -(2**31) + 1

#: What ``triangulate`` reports, as bits, besides LEAKED and CONTRADICTED: why nothing was done.
NOT_FINITE, NOT_A_POINT, NOT_DELAUNAY = 4, 8, 16


@kernel(allocates=True)
def rank_points(points):
    """Points (n + 3, 2) by rank, the far corners behind them, and order (n,), the index of each rank.

    points : (n, 2), finite, n > 0.
    """
    n = points.shape[0]
    low_x, low_y = points[0, 0], points[0, 1]
    high_x, high_y = low_x, low_y
    for i in range(n):
        low_x, high_x = min(low_x, points[i, 0]), max(high_x, points[i, 0])
        low_y, high_y = min(low_y, points[i, 1]), max(high_y, points[i, 1])
    extent = max(high_x - low_x, high_y - low_y)
    if extent == 0.0:
        extent = 1.0
    order = insertion_order(points, low_x, low_y, extent)
    ranked = np.empty((n + 3, 2))
    for rank in range(n):
        ranked[rank, 0], ranked[rank, 1] = points[order[rank], 0], points[order[rank], 1]
    far = FAR * extent
    ranked[n, 0], ranked[n, 1] = low_x - far, low_y - far
    ranked[n + 1, 0], ranked[n + 1, 1] = low_x + far, low_y - far
    ranked[n + 2, 0], ranked[n + 2, 1] = low_x, low_y + far
    return ranked, order


@kernel(allocates=True)
def delaunay(points, order):
    """Delaunay triangulation of the ranked points (n + 3, 2) in the far triangle, inserted one by one.

    Of points with equal coordinates one is inserted, under the lowest index (``order`` is changed for that);
    the others have -1 in vertex_triangle. Returns triangles (c, 3), neighbours (c, 3) and vertex_triangle.
    """
    n = order.shape[0]
    triangles = np.empty((2 * n + 1, 3), np.int32)
    neighbours = np.empty((2 * n + 1, 3), np.int32)
    vertex_triangle = np.empty(n + 3, np.int32)
    for i in range(3):
        triangles[0, i], neighbours[0, i] = n + i, NOTHING
        vertex_triangle[n + i] = 0
    count = 1
    t = np.int64(0)
    for p in range(n):
        x, y = points[p, 0], points[p, 1]
        t, _ = locate(points, triangles, neighbours, t, x, y, triangles.shape[0])
        twin = np.int64(-1)
        for i in range(3):
            v = np.int64(triangles[t, i])
            if points[v, 0] == x and points[v, 1] == y:
                twin = v
        if twin >= 0:
            vertex_triangle[p] = -1
            if order[p] < order[twin]:
                order[p], order[twin] = order[twin], order[p]
            continue
        split_triangle(triangles, neighbours, vertex_triangle, t, p, count, count + 1)
        count += 2
        legalise_star(points, triangles, neighbours, vertex_triangle, t)
    return triangles[:count], neighbours[:count], vertex_triangle


@inner(allocates=True)
def find_segments(triangles, neighbours, vertex_triangle, order, segments):
    """Half-edges (k,) of the segments (k, 2), -1 where one is no edge; how many are; rank (n,) of indices.

    A rank is -1 where the point equals an earlier one.
    """
    rank = np.empty(order.shape[0], np.int32)
    for r in range(order.shape[0]):
        rank[order[r]] = r if vertex_triangle[r] >= 0 else -1
    half_edge = np.empty(segments.shape[0], np.int64)
    found = 0
    for s in range(segments.shape[0]):
        a, b = rank[segments[s, 0]], rank[segments[s, 1]]
        half_edge[s] = find_edge(triangles, neighbours, vertex_triangle, a, b) if min(a, b) >= 0 else -1
        found += half_edge[s] >= 0
    return half_edge, found, rank


@inner
def crossing_edges(points, triangles, neighbours, vertex_triangle, a, b, queue):
    """Collect the edges (right end, left end) that the segment from a to b crosses into queue (room, 2).

    Returns their number, or -1 where a vertex lies on the segment or a segment stops the walk. Turns about a
    to the triangle that b is seen through, then goes from triangle to triangle.
    """
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    t = np.int64(vertex_triangle[a])
    i = 0
    seen = False
    for _ in range(triangles.shape[0]):
        i = 0 if triangles[t, 0] == a else (1 if triangles[t, 1] == a else 2)
        right, left = triangles[t, (i + 1) % 3], triangles[t, (i + 2) % 3]
        side = orient(ax, ay, bx, by, points[right, 0], points[right, 1])
        ahead = (bx - ax) * (points[right, 0] - ax) + (by - ay) * (points[right, 1] - ay)
        if side == 0.0 and ahead > 0.0:
            return -1
        if side < 0.0 and orient(ax, ay, bx, by, points[left, 0], points[left, 1]) > 0.0:
            seen = True
            break
        t = np.int64(neighbours[t, (i + 1) % 3])
        if t < 0:
            return -1
    if not seen:
        return -1
    for count in range(queue.shape[0]):
        queue[count, 0], queue[count, 1] = triangles[t, (i + 1) % 3], triangles[t, (i + 2) % 3]
        u = np.int64(neighbours[t, i])
        if u < 0:
            return -1
        j = 0 if neighbours[u, 0] == t else (1 if neighbours[u, 1] == t else 2)
        d = triangles[u, j]
        if d == b:
            return count + 1
        side = orient(ax, ay, bx, by, points[d, 0], points[d, 1])
        if side == 0.0:
            return -1
        t, i = u, (j + 1) % 3 if side > 0.0 else (j + 2) % 3
    return -1


@inner
def recover_segment(points, triangles, neighbours, vertex_triangle, a, b, queue, touched):
    """Make a - b an edge by flipping the edges that cross it (Sloan 1993); returns whether that succeeded.

    A crossing edge whose two triangles form no strictly convex quadrilateral waits at the end of the queue.
    Changed triangles are marked in touched (cap,) uint8.
    """
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    count = crossing_edges(points, triangles, neighbours, vertex_triangle, a, b, queue)
    room = queue.shape[0]
    head = 0
    for _ in range(16 * count * count + 16):
        if count <= 0:
            break
        right, left = np.int64(queue[head, 0]), np.int64(queue[head, 1])
        head = (head + 1) % room
        count -= 1
        edge = find_edge(triangles, neighbours, vertex_triangle, right, left)
        if edge < 0:
            return False
        t, i = edge // 3, edge % 3
        u = np.int64(neighbours[t, i])
        j = 0 if neighbours[u, 0] == t else (1 if neighbours[u, 1] == t else 2)
        p, d = triangles[t, i], triangles[u, j]
        px, py, dx, dy = points[p, 0], points[p, 1], points[d, 0], points[d, 1]
        behind = (head + count) % room
        if (
            orient(px, py, points[right, 0], points[right, 1], dx, dy) <= 0.0
            or orient(px, py, dx, dy, points[left, 0], points[left, 1]) <= 0.0
        ):
            queue[behind, 0], queue[behind, 1] = right, left
            count += 1
            continue
        flip(triangles, neighbours, vertex_triangle, t, i)
        touched[t], touched[u] = 1, 1
        p_left = orient(ax, ay, bx, by, px, py)
        d_left = orient(ax, ay, bx, by, dx, dy)
        if p_left * d_left < 0.0:
            queue[behind, 0], queue[behind, 1] = (d, p) if p_left > 0.0 else (p, d)
            count += 1
    return count == 0


@inner
def cut_segments(neighbours, half_edge):
    """Replace neighbours across the k segments by codes: ``-1 - s`` on the left, ``-1 - k - s`` on the right.

    Half-edges that an earlier segment holds already become -1.
    """
    k = half_edge.shape[0]
    for s in range(k):
        if half_edge[s] < 0:
            continue
        t, i = half_edge[s] // 3, half_edge[s] % 3
        u = neighbours[t, i]
        if u < 0 and u >= -k:
            half_edge[s] = -1
            continue
        neighbours[t, i] = -1 - s
        if u >= 0:
            for j in range(3):
                if neighbours[u, j] == t:
                    neighbours[u, j] = -1 - k - s


@inner(allocates=True)
def recover_all(points, triangles, neighbours, vertex_triangle, segments, rank, half_edge):
    """Make the segments (k, 2) without a half-edge edges where that is possible, then legalise around them.

    Sets half_edge (k,) anew and cuts the segments. Of two segments that cross each other the earlier is lost.
    Returns DONE or OUT_OF_BUDGET.
    """
    count = triangles.shape[0]
    queue = np.empty((2 * count, 2), np.int32)
    touched = np.empty(count, np.uint8)
    for t in range(count):
        touched[t] = 0
    for s in range(segments.shape[0]):
        a, b = rank[segments[s, 0]], rank[segments[s, 1]]
        if half_edge[s] < 0 and min(a, b) >= 0 and a != b:
            recover_segment(points, triangles, neighbours, vertex_triangle, a, b, queue, touched)
    for s in range(segments.shape[0]):
        a, b = rank[segments[s, 0]], rank[segments[s, 1]]
        if min(a, b) >= 0:
            half_edge[s] = find_edge(triangles, neighbours, vertex_triangle, a, b)
    cut_segments(neighbours, half_edge)
    stack = np.empty(16 * count + 64, np.int32)
    waiting = 0
    for t in range(count):
        if touched[t]:
            stack[waiting] = t
            waiting += 1
    report, _ = legalise(points, triangles, neighbours, vertex_triangle, stack, waiting)
    # flips moved cut edges from slot to slot: their codes tell where they are now
    k = half_edge.shape[0]
    for t in range(count):
        for i in range(3):
            u = neighbours[t, i]
            if u < 0 and u >= -k and half_edge[-1 - u] >= 0:
                half_edge[-1 - u] = 3 * t + i
    return report


@inner
def refusal(points, segments):
    """NOT_FINITE or NOT_A_POINT where points or segments cannot be used, else 0."""
    n = points.shape[0]
    for v in range(n):
        if not (abs(points[v, 0]) < np.inf and abs(points[v, 1]) < np.inf):
            return NOT_FINITE
    for s in range(segments.shape[0]):
        if min(segments[s, 0], segments[s, 1]) < 0 or max(segments[s, 0], segments[s, 1]) >= n:
            return NOT_A_POINT
    return 0


@inner(allocates=True)
def enclosed(points, segments, fixed):
    """``triangulate`` where nothing is known."""
    ranked, order = rank_points(points)
    triangles, neighbours, vertex_triangle = delaunay(ranked, order)
    half_edge, found, rank = find_segments(triangles, neighbours, vertex_triangle, order, segments)
    k = segments.shape[0]
    if found == k:
        cut_segments(neighbours, half_edge)
    elif recover_all(ranked, triangles, neighbours, vertex_triangle, segments, rank, half_edge) != DONE:
        none = triangles[:0]
        return none, none, vertex_triangle[:0], vertex_triangle[:0], NOT_DELAUNAY
    out, across, dropped, status = extract(triangles, neighbours, half_edge, order, fixed)
    lost = np.empty(k, np.int32)
    count = 0
    for s in range(k):
        if half_edge[s] < 0:
            lost[count] = s
            count += 1
    return out, across, dropped, lost[:count], status


@inner(allocates=True)
def completed(points, segments, fixed, hanging, sewn, beside, left):
    """Triangles and neighbours of a strip of which ``between`` has sewn a part; none where the rest does not fit."""
    nodes, some, ends, first = cut_out(points, segments, fixed, hanging, sewn, left)
    more, across, dropped, lost, status = enclosed(some, ends, first)
    if status != 0 or lost.shape[0] > 0:
        return sewn[:0], sewn[:0]
    k, h = segments.shape[0], hanging.shape[0]
    return fit_in(points, fixed, k, h, sewn, beside, left, nodes, more, across, dropped)


@inner(allocates=True)
def triangulated(points, segments, fixed, outer, hanging):
    """Constrained Delaunay triangulation of the region on the left of the segments (k, 2) of points (n, 2).

    Of the segments those from ``outer`` on are the rim of a patch, whose nodes come from ``fixed`` on; hanging (h, 2) :
    edges between these that are at least as good as any to begin with, both ways, one behind the other.
    Returns triangles (m, 3), neighbours (m, 3), dropped (d,) indices from ``fixed`` on of points left out,
    unrecovered (u,) segments that are no edges, and a status: 0 or bits named above.
    """
    none, nothing = np.empty((0, 3), np.int32), np.empty(0, np.int32)
    status = refusal(points, segments)
    if status:
        return none, none, nothing, nothing, status
    if outer < segments.shape[0]:
        out, across, left, ends = between(points, segments, fixed, outer, hanging)
        if left.shape[0] > 0:
            out, across = completed(points, segments, fixed, ends, out, across, left)
        if out.shape[0] > 0:
            return out, across, nothing, nothing, 0
    return enclosed(points, segments, fixed)


@inner(allocates=True)
def glue(triangles, neighbours, nodes, fixed, segments, patch, beside, half_edges):
    """A triangulation and a patch as one: triangles (m, 3) and neighbours (m, 3), those of the patch last.

    triangles (a, 3), neighbours (a, 3) : the former; node ``fixed + z`` is node nodes[z], and segment ``segments + e``
    the edge at half_edges[e] of the patch. patch (b, 3), beside (b, 3) : triangles and neighbours of the patch.
    """
    a, b = triangles.shape[0], patch.shape[0]
    corners, across = np.empty((a + b, 3), np.int32), np.empty((a + b, 3), np.int32)
    for t in range(b):
        for i in range(3):
            u = beside[t, i]
            corners[a + t, i], across[a + t, i] = patch[t, i], u + a if u >= 0 else u
    for t in range(a):
        for i in range(3):
            v, u = triangles[t, i], neighbours[t, i]
            corners[t, i] = v if v < fixed else nodes[v - fixed]
            if u < -segments:
                half = half_edges[-1 - u - segments]
                across[t, i] = a + half // 3
                across[a + half // 3, half % 3] = t
            else:
                across[t, i] = u
    return corners, across


@kernel(allocates=True)
def triangulate(points, segments, fixed, outer, hanging, nodes, patch, beside, half_edges):
    """``triangulated``, and glued to the patch of these ``nodes``, if there are any, unless it says that something is
    wrong or missing: see ``glue``.
    """
    out, across, dropped, lost, status = triangulated(points, segments, fixed, outer, hanging)
    if nodes.shape[0] > 0 and status == 0 and dropped.shape[0] == 0 and lost.shape[0] == 0:
        out, across = glue(out, across, nodes, fixed, outer, patch, beside, half_edges)
    return out, across, dropped, lost, status
