"""Local operations on a triangulation held in arrays.

Arrays (capacity cap; all changed in place)
-------------------------------------------
triangles : (cap, 3) int32, corners counter-clockwise.
neighbours : (cap, 3) int32, ``neighbours[t, i]`` lies across local edge i, from corner i+1 to corner i+2,
    opposite to corner i; a code ``-1 - s`` marks boundary segment s.
vertex_triangle : (n,) int32, one triangle at each vertex.
points : (n, 2) float64.

A *half-edge* is the integer 3 t + i: edge i seen from triangle t, with t on its left.
Index arguments are int64: cast what is read from an array (``np.int64(triangles[t, 0])``), so that each
kernel is compiled once.
"""

from __future__ import annotations

import numpy as np

from fubini._jit import inner, kernel
from fubini._kernels_predicates import in_circle, orient

#: What ``locate`` and ``legalise`` report besides their result.
DONE, OUT_OF_BUDGET = 0, 1

#: What a node may do (``Boundary.kind``): an interior node moves freely; a node on a curve slides
#: along its track, may be removed, and segments beside it may be split; a corner stays; a frozen
#: node stays and is never removed.
INTERIOR, ON_CURVE, CORNER, FROZEN = 0, 1, 2, 3

#: What may happen to a boundary segment (``Boundary.mode``): split and merged freely; only split
#: (it is shared with another face); nothing (it is an interface or was fixed by the user).
FREE, SPLIT_ONLY, LOCKED = 0, 1, 2


@inner
def replace_neighbour(neighbours, t, old, new):
    """In triangle t, let the edge towards ``old`` lead to ``new``; nothing where t is a segment code."""
    if t >= 0:
        for i in range(3):
            if neighbours[t, i] == old:
                neighbours[t, i] = new
                return


@kernel(inlined=True)
def flip(triangles, neighbours, vertex_triangle, t, i):
    r"""Replace edge i of t, which must have a triangle u across it, by the other diagonal; returns u.

                 b                            b
               / | \                        / n \
        n_bp  /  |  \  n_db          n_bp  /  u  \  n_db
             /   |   \                    /       \
            p  t | u  d        ->        p ------- d
             \   |   /                    \       /
        n_pa  \  |  /  n_ad          n_pa  \  t  /  n_ad
               \ | /                        \ n /
                 a                            a

    p is corner i of t, and afterwards t = (p, a, d) and u = (p, d, b): both keep p at corner 0, and the two
    edges that a flip may have made illegal are local edge 0 of t and of u.
    """
    u = np.int64(neighbours[t, i])
    i1 = i + 1 if i < 2 else 0
    i2 = i - 1 if i > 0 else 2
    j = 0 if neighbours[u, 0] == t else (1 if neighbours[u, 1] == t else 2)
    j1 = j + 1 if j < 2 else 0
    j2 = j - 1 if j > 0 else 2
    p, a, b, d = triangles[t, i], triangles[t, i1], triangles[t, i2], triangles[u, j]
    n_bp, n_pa = neighbours[t, i1], neighbours[t, i2]
    n_ad, n_db = neighbours[u, j1], neighbours[u, j2]
    triangles[t, 0], triangles[t, 1], triangles[t, 2] = p, a, d
    neighbours[t, 0], neighbours[t, 1], neighbours[t, 2] = n_ad, u, n_pa
    triangles[u, 0], triangles[u, 1], triangles[u, 2] = p, d, b
    neighbours[u, 0], neighbours[u, 1], neighbours[u, 2] = n_db, n_bp, t
    replace_neighbour(neighbours, np.int64(n_ad), u, t)
    replace_neighbour(neighbours, np.int64(n_bp), t, u)
    vertex_triangle[a] = t
    vertex_triangle[b] = u
    return u


@kernel
def split_triangle(triangles, neighbours, vertex_triangle, t, p, t1, t2):
    r"""Put vertex p into triangle t = (a, b, c): afterwards t = (p, a, b), t1 = (p, b, c), t2 = (p, c, a).

                 c
               / | \
         n_ca / t2|  \ n_bc        t1 and t2 are free slots of the arrays; p is corner 0 of all three.
             /  _p_ t1\            p may lie on an edge of t: the triangle of no area that then arises
            / _-  t  -_\           is flipped away by the in-circle test of its edge 0.
           a ----------- b
                 n_ab
    """
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    n_bc, n_ca, n_ab = neighbours[t, 0], neighbours[t, 1], neighbours[t, 2]
    triangles[t, 0], triangles[t, 1], triangles[t, 2] = p, a, b
    neighbours[t, 0], neighbours[t, 1], neighbours[t, 2] = n_ab, t1, t2
    triangles[t1, 0], triangles[t1, 1], triangles[t1, 2] = p, b, c
    neighbours[t1, 0], neighbours[t1, 1], neighbours[t1, 2] = n_bc, t2, t
    triangles[t2, 0], triangles[t2, 1], triangles[t2, 2] = p, c, a
    neighbours[t2, 0], neighbours[t2, 1], neighbours[t2, 2] = n_ca, t, t1
    replace_neighbour(neighbours, np.int64(n_bc), t, t1)
    replace_neighbour(neighbours, np.int64(n_ca), t, t2)
    vertex_triangle[p] = t
    vertex_triangle[c] = t1


@kernel(inlined=True)
def edge_is_illegal(points, triangles, neighbours, t, i):
    """Whether the vertex across edge i of t lies strictly inside the circle of t; never across a segment."""
    u = neighbours[t, i]
    if u < 0:
        return False
    p, a, b = triangles[t, i], triangles[t, (i + 1) % 3], triangles[t, (i + 2) % 3]
    j = 0 if neighbours[u, 0] == t else (1 if neighbours[u, 1] == t else 2)
    d = triangles[u, j]
    return (
        in_circle(
            points[p, 0], points[p, 1], points[a, 0], points[a, 1],
            points[b, 0], points[b, 1], points[d, 0], points[d, 1],
        )
        > 0.0
    )  # fmt: skip


@kernel
def legalise(points, triangles, neighbours, vertex_triangle, stack, count):
    """Flip until all edges that can be reached from the triangles on the stack are locally Delaunay.

    stack : (room,) int32, the first ``count`` entries are triangles to check (all three edges); overwritten.
    A tie (four cocircular points) is never flipped; segments are never flipped. All triangles must have
    positive area or be on the stack beside a triangle that repairs them. At most room - count flips are made.
    Returns (DONE or OUT_OF_BUDGET, flips made).
    """
    flips = 0
    room = stack.shape[0] - count
    while count > 0:
        count -= 1
        t = np.int64(stack[count])
        for i in range(3):
            if edge_is_illegal(points, triangles, neighbours, t, i):
                if flips == room:
                    return OUT_OF_BUDGET, flips
                u = flip(triangles, neighbours, vertex_triangle, t, i)
                stack[count], stack[count + 1] = u, t
                count += 2
                flips += 1
                break
    return DONE, flips


@inner
def legalise_star(points, triangles, neighbours, vertex_triangle, t):
    """Flip the rim of the star of vertex p until it is Delaunay; corner 0 of t and of the rest is p."""
    first = triangles[t, 1]
    for _ in range(4 * triangles.shape[0]):
        if edge_is_illegal(points, triangles, neighbours, t, 0):
            flip(triangles, neighbours, vertex_triangle, t, 0)
        elif triangles[t, 2] == first:
            return
        else:
            t = np.int64(neighbours[t, 1])


@kernel
def locate(points, triangles, neighbours, t, x, y, budget):
    """Walk from triangle t towards (x, y); returns (triangle, report).

    report is DONE where the point lies in the triangle or on its rim, a segment code ``-1 - s`` where the
    way on is blocked by segment s only (the point may still lie inside a region that is not convex), and
    OUT_OF_BUDGET after ``budget`` steps. Terminates by itself in a Delaunay triangulation of a convex region.
    """
    came = np.int64(-1)
    for _ in range(budget):
        onward = np.int64(-1)
        blocked = np.int64(DONE)
        for i in range(3):
            u = np.int64(neighbours[t, i])
            if u == came and u >= 0:
                continue
            a = triangles[t, i + 1 if i < 2 else 0]
            b = triangles[t, i - 1 if i > 0 else 2]
            if orient(points[a, 0], points[a, 1], points[b, 0], points[b, 1], x, y) < 0.0:
                if u >= 0:
                    onward = u
                    break
                blocked = u
        if onward < 0:
            return t, blocked
        came = t
        t = onward
    return t, np.int64(OUT_OF_BUDGET)


@inner
def around(triangles, neighbours, t, v, most, fan, ring):
    """Triangles around vertex v counter-clockwise from t, into fan, and the corner after v in each of them, into ring.

    Returns (k, closed): k triangles; where a segment ends the turn it is not closed, and ring has one corner more.
    k = -1 where there are more than ``most``.
    """
    first, k = t, 0
    while k < most:
        i = 1 + (triangles[t, 1] == v) - (triangles[t, 2] == v)
        u = np.int64(neighbours[t, i])
        fan[k], ring[k] = t, triangles[t, i]
        k += 1
        if u < 0:
            ring[k] = triangles[t, i + 1 if i < 2 else 0]
            return k, False
        if u == first:
            return k, True
        t = u
    return -1, True


@kernel
def find_edge(triangles, neighbours, vertex_triangle, a, b):
    """Half-edge 3 t + i of the directed edge a -> b (t on its left), or -1 where there is none.

    Turns about a, first counter-clockwise, then clockwise from the start where a segment stops the turn; an
    edge with a segment on its left has no triangle there and is not found from its other side.
    """
    start = np.int64(vertex_triangle[a])
    for way in range(2):
        t = start
        while t >= 0:
            i = 0 if triangles[t, 0] == a else (1 if triangles[t, 1] == a else 2)
            i1 = i + 1 if i < 2 else 0
            i2 = i - 1 if i > 0 else 2
            if triangles[t, i1] == b:
                return 3 * t + i2
            t = np.int64(neighbours[t, i1 if way == 0 else i2])
            if t == start:
                return np.int64(-1)
    return np.int64(-1)


@kernel
def fill_vertex_triangle(triangles, count, vertex_triangle):
    """Set one triangle for each vertex: the last of the first ``count`` triangles that has it, or -1."""
    for v in range(vertex_triangle.shape[0]):
        vertex_triangle[v] = -1
    for t in range(count):
        for i in range(3):
            vertex_triangle[triangles[t, i]] = t
