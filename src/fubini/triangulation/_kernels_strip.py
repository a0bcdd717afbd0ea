"""The strip between the boundary of a region and a patch of known triangles inside, triangulated by walking along both.

A boundary loop and the loop of the patch's rim that faces it are sewn together: from an edge b - r between the two, the
next triangle takes either the next edge of the boundary or the next one of the rim. When both loops are back at their
start with every triangle the right way round, the angles at every node add up to what they should (all triangles
together have the angle sum of the strip, and no node can have less than its share), so none overlap.
What comes out is made Delaunay by flips, and nodes that lie by themselves between the loops are put in.

Loops are not always pairs: where the region is narrow there is no patch between two parts of its boundary, and one loop
of the rim goes around several. The walk along all of a loop then fails. It is taken again in pieces, each of which ends
where the new edges become long, or where nothing fits, and what lies between them is left to be triangulated as if
nothing were known. Pieces overlap neither each other nor the boundary where what they leave is a region: the triangles
and that region together have its boundary.
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
#: square of the length of an edge at which a piece ends, over that of the longer edge that it lies between
REACH = 2.75


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
def nearest_rim(points, edges, arriving, other, sewn, fixed, b):
    """The node nearest to b of those at which one edge of the rim arrives, not yet passed; -1 where there is none."""
    best, least = -1, math.inf
    for r in range(fixed, points.shape[0]):
        if arriving[r] >= 0 and other[arriving[r]] < 0 and sewn[arriving[r]] < 0:
            d = square(points, b, r)
            if d < least:
                best, least = r, d
    return best


@inner
def is_nearest(points, fixed, b, r):
    """Whether no boundary node is nearer to r than b: nothing lies between the two if r is the one nearest to b."""
    least = square(points, b, r)
    for v in range(fixed):
        if square(points, v, r) < least:
            return False
    return True


@inner
def sew(points, edges, triangles, neighbours, m, lists, sewn, b0, r0, eager, reach):
    """Triangles from the m-th on between the loops of boundary node b0 and of node r0 of the rim.

    sewn (k,) : of the edges that are passed the half-edges of the triangles there, else -1. eager : square of how much
    longer a new edge may be where an edge of the boundary is passed. reach : see ``REACH``. Returns the new number of
    triangles, the nodes where the walk ends, and whether that is because no edge is left.
    """
    following, arriving, other = lists
    b, r = b0, r0
    x = r0  # where the rim was before r: at the start any direction will do, as one edge arrives there
    while True:
        s, e = following[b], turn_left(points, edges, arriving, other, r, x)
        if s < 0 or e < 0:
            return m, b, r, False
        along, beside = sewn[s] < 0, sewn[e] < 0
        if not along and not beside:
            return m, b, r, True
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
                return m, b, r, False
            along, turned = not along, True
        long = square(points, c, r) if along else square(points, b, q)
        if long > reach * max(square(points, b, c), square(points, q, r)):
            return m, b, r, False
        triangles[m, 0], triangles[m, 1], triangles[m, 2] = b, d, r
        neighbours[m, 1] = m - 1
        if along:
            neighbours[m, 2], neighbours[m, 0] = -1 - s, m + 1
            sewn[s], b = 3 * m + 2, c
        else:
            neighbours[m, 0], neighbours[m, 2] = -1 - e, m + 1
            sewn[e], x, r = 3 * m, r, q
        m += 1


@inner
def open_edge(neighbours, t):
    """The local edge of triangle t that leads to the next one, for the last that was sewn."""
    return 0 if neighbours[t, 0] == t + 1 else 2


@inner
def sew_loop(points, edges, triangles, neighbours, m, lists, sewn, fixed, b):
    """``sew`` all along the loop of boundary node b and the one of the rim nearest to it, in two attempts.

    The new number of triangles, -1 where the loops do not fit together.
    """
    r = nearest_rim(points, edges, lists[1], lists[2], sewn, fixed, b)
    if r < 0:
        return -1
    for eager in EAGER:
        end, last_b, last_r, done = sew(points, edges, triangles, neighbours, m, lists, sewn, b, r, eager, math.inf)
        if done and last_b == b and last_r == r and end > m:
            neighbours[m, 1] = end - 1
            neighbours[end - 1, open_edge(neighbours, end - 1)] = m
            return end
        for t in range(m, end):
            forget(neighbours, sewn, t)
    return -1


@inner
def forget(neighbours, sewn, t):
    """Take back that the edges beside triangle t were passed."""
    for i in range(0, 3, 2):
        if neighbours[t, i] < 0:
            sewn[-1 - neighbours[t, i]] = -1


@inner
def end_piece(edges, triangles, neighbours, sewn, outset, used, t, i):
    """Edge i of triangle t is where a piece ends: both ways it becomes an edge, passed on one side, unless another ends
    there, too. How many edges there are then; those from ``outset`` on are such.
    """
    a, b = triangles[t, i + 1 if i < 2 else 0], triangles[t, i - 1 if i > 0 else 2]
    for s in range(outset + 1, used, 2):
        if edges[s, 0] == a and edges[s, 1] == b and sewn[s] < 0:
            sewn[s], neighbours[t, i] = 3 * t + i, -1 - s
            return used
    edges[used, 0], edges[used, 1], edges[used + 1, 0], edges[used + 1, 1] = a, b, b, a
    sewn[used], sewn[used + 1], neighbours[t, i] = 3 * t + i, -1, -1 - used
    return used + 2


@inner
def sew_pieces(points, edges, triangles, neighbours, m, lists, sewn, fixed, outset, used, b):
    """``sew`` along parts of the loop of boundary node b.

    The new number of triangles, and that of the edges in use: see ``end_piece``.
    """
    following, arriving, at, far = lists[0], lists[1], b, 0.0
    while True:
        onward = edges[following[at], 1]
        step = square(points, at, onward)
        if far <= 0.0:
            r = nearest_rim(points, edges, arriving, lists[2], sewn, fixed, at)
            if r < 0:
                return m, used
            apart, reach = square(points, at, r), REACH * max(step, square(points, r, edges[arriving[r], 0]))
            far = math.sqrt(apart) - math.sqrt(reach)
            if apart <= reach and is_nearest(points, fixed, at, r):
                end, last, _, _ = sew(points, edges, triangles, neighbours, m, lists, sewn, at, r, EAGER[0], REACH)
                if end > m:
                    used = end_piece(edges, triangles, neighbours, sewn, outset, used, m, 1)
                    t = end - 1
                    used = end_piece(edges, triangles, neighbours, sewn, outset, used, t, open_edge(neighbours, t))
                    m, onward = end, last if last != at else onward
        far -= math.sqrt(step)  # so much nearer the rim can be at the next node
        at = np.int64(onward)
        if at == b or following[at] < 0 or sewn[following[at]] >= 0:
            return m, used


@inner
def twin_of(s, k):
    """The edge that goes the other way, of edges from k on that go both ways one behind the other."""
    return k + ((s - k) ^ 1)


@inner
def mark_left(edges, following, sewn, s, mark):
    """Note a mark for the edges not passed of the boundary loop of edge s."""
    first = s
    while s >= 0:
        if sewn[s] < 0:
            sewn[s] = mark
        s = np.int64(following[edges[s, 1]])
        if s == first:
            break


@inner
def sew_loops(points, edges, triangles, neighbours, lists, sewn, fixed, outer, used):
    """``sew_loop`` for every loop of the boundary, then ``sew_pieces`` for those that do not fit to the rim.

    The number of triangles, and of edges in use, ``used`` before. Edges of the boundary that are left are below -1 in
    ``sewn`` afterwards, those of the rim -1.
    """
    m, outset = 0, used
    for turn in range(2):
        for s in range(outer):
            if sewn[s] != -1 - turn:
                continue
            b = np.int64(edges[s, 0])
            if turn == 0:
                m = max(m, sew_loop(points, edges, triangles, neighbours, m, lists, sewn, fixed, b))
            else:
                m, used = sew_pieces(points, edges, triangles, neighbours, m, lists, sewn, fixed, outset, used, b)
            mark_left(edges, lists[0], sewn, s, -2 - turn)
    return m, used


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


@inner(allocates=True)
def edges_of(segments, hanging, room):
    """Segments (k, 2), edges hanging (h, 2), and room for so many more, as one."""
    k, h = segments.shape[0], hanging.shape[0]
    edges = np.empty((k + h + room, 2), np.int32)
    for s in range(k + h):
        for i in range(2):
            edges[s, i] = segments[s, i] if s < k else hanging[s - k, i]
    return edges


@kernel(allocates=True)
def between(points, segments, fixed, outer, hanging):
    """Triangulation of the strip on the left of segments (k, 2), or of a part of it.

    The first ``fixed`` points are ends of the first ``outer`` segments, the boundary; the others of the rim, of edges
    hanging (h, 2) in the strip, both ways one behind the other, or of none. Returns triangles and neighbours (m, 3),
    none where the walk fails; left (r,), segments, and edges hanging from k on, that enclose what is not triangulated,
    nodes that lie by themselves among it then; and hanging with the edges (e, 2) where triangles end.
    """
    n, k, used = points.shape[0], segments.shape[0], segments.shape[0] + hanging.shape[0]
    edges = edges_of(segments, hanging, 4 * outer)
    room = used + 2 * (n - fixed)
    triangles, neighbours = np.empty((room, 3), np.int32), np.empty((room, 3), np.int32)
    lists = np.empty(n, np.int32), np.empty(n, np.int32), np.empty(used, np.int32)
    sewn, vertex_triangle = np.empty(edges.shape[0], np.int32), np.empty(n, np.int32)
    none = triangles[:0], neighbours[:0], sewn[:0], hanging
    if not edges_by_ends(edges[:used], outer, fixed, *lists):
        return none
    for s in range(used):
        sewn[s] = -1
    m, used = sew_loops(points, edges, triangles, neighbours, lists, sewn, fixed, outer, used)
    left, fit = left_over(points, edges[:used], sewn, k)
    if m == 0 or not fit:
        return none
    if legalise_strip(points, triangles, neighbours, vertex_triangle, m, sewn[k:used]) != DONE:
        return none
    if left.shape[0] > 0:
        return triangles[:m], neighbours[:m], left, edges[k:used]
    # a triangle stands on each edge that was passed
    if m != used:
        return none
    for p in range(fixed, n):
        if lists[1][p] < 0:
            if not put_in(points, triangles, neighbours, vertex_triangle, fixed, p, m):
                return none
            m += 2
    return triangles[:m], neighbours[:m], left, hanging
