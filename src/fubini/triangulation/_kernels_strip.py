"""The strip between the boundary of a region and a patch of known triangles inside, triangulated by walking along both.

A boundary loop and the loop of the patch's rim that faces it are sewn together: from an edge b - r between the two, the
next triangle takes either the next edge of the boundary or the next one of the rim. When both loops are back at their
start with every triangle the right way round, the angles at every node add up to what they should (all triangles
together have the angle sum of the strip, and no node can have less than its share), so none overlap.
What comes out is made Delaunay by flips, and nodes that lie by themselves between the loops are put in.

Loops are not always pairs: where the region is narrow there is no patch between two parts of its boundary, and one loop
of the rim goes around several. The walk then fails, and what lies between these loops is left to be triangulated as if
nothing were known.
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel
from fubini._kernels_predicates import orient
from fubini.triangulation._kernels_topology import (
    DONE,
    edge_is_illegal,
    legalise,
    legalise_star,
    locate,
    split_triangle,
)

TURN = 2.0 * math.pi
#: how much longer the next triangle's new edge may be where it takes an edge of the boundary, in two attempts: from the
#: mouth of a tooth that no patch reaches into the walk has to go all around it first
EAGER = (1.0, 2.0)


@inner
def edges_by_ends(edges, outer, fixed, following, arriving, other):
    """The edge that leaves each boundary node into following (n,); those of the rim that arrive at a node as a list.

    arriving (n,) : one of the edges from ``outer`` on that end at a node, or -1; other (k,) : the next of that list.
    Whether all is as it should be: no boundary node that several edges leave, no rim at the boundary.
    """
    for v in range(following.shape[0]):
        following[v] = arriving[v] = -1
    for s in range(edges.shape[0]):
        a, b = edges[s, 0], edges[s, 1]
        if s >= outer:
            if min(a, b) < fixed:
                return False
            other[s] = arriving[b]
            arriving[b] = s
        elif following[a] >= 0 or max(a, b) >= fixed:
            return False
        else:
            following[a] = s
    return True


@inner
def square(points, a, b):
    """Square of the distance of two points."""
    x, y = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1]
    return x * x + y * y


@inner
def turn_left(points, edges, arriving, other, r, x):
    """The edge of the rim that arrives at node r, the first counter-clockwise from the direction of node x; or -1."""
    best, least = arriving[r], math.inf
    if best < 0 or other[best] < 0:
        return best
    ux, uy = points[x, 0] - points[r, 0], points[x, 1] - points[r, 1]
    s = best
    while s >= 0:
        y = edges[s, 0]
        vx, vy = points[y, 0] - points[r, 0], points[y, 1] - points[r, 1]
        angle = math.atan2(ux * vy - uy * vx, ux * vx + uy * vy)
        angle = angle if angle > 0.0 else angle + TURN
        if angle < least:
            best, least = s, angle
        s = other[s]
    return best


@inner
def nearest_rim(points, arriving, other, fixed, b):
    """The node nearest to b of those at which one edge of the rim arrives; -1 where there is none."""
    best, least = -1, math.inf
    for r in range(fixed, points.shape[0]):
        if arriving[r] >= 0 and other[arriving[r]] < 0:
            d = square(points, b, r)
            if d < least:
                best, least = r, d
    return best


@inner
def sew(points, edges, triangles, neighbours, m, lists, sewn, b0, r0, eager):
    """Triangles from the m-th on between the loops of boundary node b0 and of node r0 of the rim; their new number.

    sewn (k,) : of the edges that are passed the half-edges of the triangles there, else -1. eager : square of how much
    longer a new edge may be where an edge of the boundary is passed. Returns -1 where the loops do not fit together.
    """
    following, arriving, other = lists
    first, b, r = m, b0, r0
    x = r0  # where the rim was before r: at the start any direction will do, as one edge arrives there
    while True:
        s, e = following[b], turn_left(points, edges, arriving, other, r, x)
        if s < 0 or e < 0:
            return -1
        along, beside = sewn[s] < 0, sewn[e] < 0
        if not along and not beside:
            break
        c, q = edges[s, 1], edges[e, 0]
        if along and beside and square(points, c, r) > eager * square(points, b, q):
            along = False
        turned = False
        while True:
            d = c if along else q
            # counter-clockwise b, c, r or b, q, r
            if orient(points[b, 0], points[b, 1], points[d, 0], points[d, 1], points[r, 0], points[r, 1]) > 0.0:
                break
            if turned or sewn[e if along else s] >= 0:
                return -1
            along, turned = not along, True
        triangles[m, 0], triangles[m, 1], triangles[m, 2] = b, d, r
        neighbours[m, 1] = m - 1
        if along:
            neighbours[m, 2], neighbours[m, 0] = -1 - s, m + 1
            sewn[s], b = 3 * m + 2, c
        else:
            neighbours[m, 0], neighbours[m, 2] = -1 - e, m + 1
            sewn[e], x, r = 3 * m, r, q
        m += 1
    if b != b0 or r != r0 or m == first:
        return -1
    neighbours[first, 1] = m - 1
    neighbours[m - 1, 0 if neighbours[m - 1, 0] == m else 2] = first
    return m


@inner
def sew_loop(points, edges, triangles, neighbours, m, lists, sewn, fixed, b):
    """``sew`` between the loop of boundary node b and the one of the rim nearest to it, which takes two attempts."""
    r = nearest_rim(points, lists[1], lists[2], fixed, b)
    if r < 0:
        return -1
    for eager in EAGER:
        end = sew(points, edges, triangles, neighbours, m, lists, sewn, b, r, eager)
        if end >= 0:
            return end
        for s in range(edges.shape[0]):
            if sewn[s] >= 3 * m:
                sewn[s] = -1
    return -1


@inner
def twin_of(s, k):
    """The edge that goes the other way, of edges from k on that go both ways one behind the other."""
    return k + ((s - k) ^ 1)


@inner
def sew_loops(points, edges, triangles, neighbours, lists, sewn, fixed, outer):
    """``sew_loop`` for every loop of the boundary: the number of triangles.

    The edges of a loop that does not fit to the rim have -2 in ``sewn`` afterwards, those of the rim that are left -1.
    """
    m, following = 0, lists[0]
    for s in range(outer):
        if sewn[s] == -1:
            end = sew_loop(points, edges, triangles, neighbours, m, lists, sewn, fixed, edges[s, 0])
            if end >= 0:
                m = end
                continue
            while s >= 0 and sewn[s] == -1:
                sewn[s] = -2
                s = np.int64(following[edges[s, 1]])
    return m


@inner(allocates=True)
def left_over(points, edges, sewn, k):
    """The first k edges that are not sewn, then those of the others of which only the other way is; whether they may
    enclose a region.
    """
    left, count, area = np.empty(edges.shape[0], np.int32), 0, 0.0
    for s in range(edges.shape[0]):
        if sewn[s] < 0 and (s < k or sewn[twin_of(s, k)] >= 0):
            a, b = edges[s, 0], edges[s, 1]
            left[count], count = s, count + 1
            area += points[a, 0] * points[b, 1] - points[a, 1] * points[b, 0]
    return left[:count], count == 0 or area > 0.0


@inner(allocates=True)
def legalise_strip(points, triangles, neighbours, vertex_triangle, m, hanging):
    """Make m triangles between loops Delaunay: DONE or OUT_OF_BUDGET.

    Each is tested against the one before, and where half-edges are hanging; these are joined, two by two.
    """
    stack, count = np.empty(16 * m + 64, np.int32), 0
    for t in range(m):
        for i in range(3):
            vertex_triangle[triangles[t, i]] = t
        if edge_is_illegal(points, triangles, neighbours, t, 1):
            stack[count] = t
            count += 1
    for h in range(0, hanging.shape[0], 2):
        if min(hanging[h], hanging[h + 1]) < 0:  # left, or at what is left
            continue
        half, twin = np.int64(hanging[h]), np.int64(hanging[h + 1])
        neighbours[half // 3, half % 3], neighbours[twin // 3, twin % 3] = twin // 3, half // 3
        if edge_is_illegal(points, triangles, neighbours, half // 3, half % 3):
            stack[count] = half // 3
            count += 1
    report, _ = legalise(points, triangles, neighbours, vertex_triangle, stack, count)
    return report


@inner
def put_in(points, triangles, neighbours, vertex_triangle, fixed, p, m):
    """Put node p into the m triangles, which stay Delaunay; whether it lies in one."""
    near, least = 0, math.inf
    for v in range(fixed):
        d = square(points, v, p)
        if d < least:
            near, least = v, d
    x, y = points[p, 0], points[p, 1]
    t, report = locate(points, triangles, neighbours, np.int64(vertex_triangle[near]), x, y, m)
    if report != DONE:
        return False
    split_triangle(triangles, neighbours, vertex_triangle, t, p, m, m + 1)
    legalise_star(points, triangles, neighbours, vertex_triangle, t)
    return True


@kernel(allocates=True)
def between(points, segments, fixed, outer, hanging):
    """Triangulation of the strip on the left of segments (k, 2), or of a part of it.

    The first ``fixed`` points are ends of the first ``outer`` segments, the boundary; the others of the rim, of edges
    hanging (h, 2) in the strip, both ways one behind the other, or of none. Returns triangles and neighbours (m, 3),
    none where the walk fails; left (r,), segments, and edges hanging from k on, that enclose what is not triangulated,
    nodes that lie by themselves among it then.
    """
    n, k = points.shape[0], segments.shape[0]
    edges = np.empty((k + hanging.shape[0], 2), np.int32)
    for s in range(edges.shape[0]):
        for i in range(2):
            edges[s, i] = segments[s, i] if s < k else hanging[s - k, i]
    room = edges.shape[0] + 2 * (n - fixed)
    triangles, neighbours = np.empty((room, 3), np.int32), np.empty((room, 3), np.int32)
    lists = np.empty(n, np.int32), np.empty(n, np.int32), np.empty(edges.shape[0], np.int32)
    sewn, vertex_triangle = np.empty(edges.shape[0], np.int32), np.empty(n, np.int32)
    none = triangles[:0], neighbours[:0], sewn[:0]
    if not edges_by_ends(edges, outer, fixed, *lists):
        return none
    for s in range(edges.shape[0]):
        sewn[s] = -1
    m = sew_loops(points, edges, triangles, neighbours, lists, sewn, fixed, outer)
    left, fit = left_over(points, edges, sewn, k)
    if m == 0 or not fit:
        return none
    if legalise_strip(points, triangles, neighbours, vertex_triangle, m, sewn[k:]) != DONE:
        return none
    if left.shape[0] > 0:
        return triangles[:m], neighbours[:m], left
    # a triangle stands on each edge that was passed
    if m != edges.shape[0]:
        return none
    for p in range(fixed, n):
        if lists[1][p] < 0:
            if not put_in(points, triangles, neighbours, vertex_triangle, fixed, p, m):
                return none
            m += 2
    return triangles[:m], neighbours[:m], left
