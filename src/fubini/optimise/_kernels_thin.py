"""Interior nodes taken out of a triangulation that has more triangles than are wanted, those with least room first."""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner
from fubini._kernels_predicates import orient
from fubini.optimise._kernels_cavity import local
from fubini.optimise._kernels_state import NODES, TRIANGLES
from fubini.triangulation._kernels_topology import flip, legalise, replace_neighbour

#: nodes that are taken out at most, and of how many triangles each
TAKEN, AROUND = 200, 24


@inner
def least_room(S):
    """The interior node whose triangles have least area together; -1 for none. Scratch: ``S.key``."""
    area, n = S.key, S.counts[NODES]
    for v in range(n):
        area[v] = 0.0
    for t in range(S.counts[TRIANGLES]):
        a, b, c = S.tri[t, 0], S.tri[t, 1], S.tri[t, 2]
        x, y = S.points[a, 0], S.points[a, 1]
        twice = (S.points[b, 0] - x) * (S.points[c, 1] - y) - (S.points[b, 1] - y) * (S.points[c, 0] - x)
        area[a] += twice
        area[b] += twice
        area[c] += twice
    best, least = -1, math.inf
    for v in range(n):
        if S.kind[v] == 0 and area[v] < least:
            best, least = v, area[v]
    return best


@inner
def turn(S, p, q, r):
    """Whether the nodes p, q, r turn left."""
    return orient(S.points[p, 0], S.points[p, 1], S.points[q, 0], S.points[q, 1], S.points[r, 0], S.points[r, 1]) > 0.0


@inner
def lessen(S, v):
    """Flip an edge of interior node v away: the triangle that v loses; -1 where it has three alone, -2 where none can.

    From the triangle v, a, b and the next one, v, b, d, edge v - b goes where a, b, d and a, d, v are triangles too.
    """
    first = t = np.int64(S.tri_of[v])
    found, way, k = np.int64(-1), 0, 0
    while k < AROUND:
        i = local(S, t, v)
        i1 = i + 1 if i < 2 else 0
        a, b, u = S.tri[t, i1], S.tri[t, i - 1 if i > 0 else 2], np.int64(S.nbr[t, i1])
        d = S.tri[u, (local(S, u, v) + 2) % 3]
        if found < 0 and turn(S, a, b, d) and turn(S, a, d, v):
            found, way = t, i1
        k += 1
        t = u
        if t == first:
            break
    if t != first or (k > 3 and found < 0):
        return np.int64(-2)
    if k == 3:
        return np.int64(-1)
    u = flip(S.tri, S.nbr, S.tri_of, found, way)
    return u if S.tri[u, 0] != v and S.tri[u, 1] != v and S.tri[u, 2] != v else found


@inner
def move_triangle(S, t, to):
    """Give triangle t the number ``to``, which no other has."""
    for i in range(3):
        S.tri[to, i], S.nbr[to, i] = S.tri[t, i], S.nbr[t, i]
        replace_neighbour(S.nbr, np.int64(S.nbr[t, i]), t, to)
    for i in range(3):
        S.tri_of[S.tri[to, i]] = to


@inner
def move_node(S, v, to):
    """Give interior node v the number ``to``, which no other has."""
    S.points[to, 0], S.points[to, 1] = S.points[v, 0], S.points[v, 1]
    S.kind[to], S.size[to], S.sharp[to], S.tri_of[to] = S.kind[v], S.size[v], S.sharp[v], S.tri_of[v]
    first = t = np.int64(S.tri_of[v])
    while True:
        i = local(S, t, v)
        S.tri[t, i] = to
        t = np.int64(S.nbr[t, i + 1 if i < 2 else 0])
        if t == first:
            return


@inner
def take_out(S, v):
    """Take interior node v out and make edges Delaunay again; whether that was possible.

    Nothing is left empty: the last node and the last triangles get the numbers that become free.
    """
    count = 1
    for _ in range(AROUND):
        t = lessen(S, v)
        if t < 0:
            break
        S.stack[count] = t
        count += 1
    if t != -1:
        return False
    t = np.int64(S.tri_of[v])
    i = local(S, t, v)
    i1, i2 = i + 1 if i < 2 else 0, i - 1 if i > 0 else 2
    after, before = np.int64(S.nbr[t, i1]), np.int64(S.nbr[t, i2])
    j, k = local(S, after, v), local(S, before, v)
    # t becomes the ring a, b, d of v; what lies across b, d and d, a comes from the other two
    b_d, d_a = np.int64(S.nbr[after, j]), np.int64(S.nbr[before, k])
    a, b, d = S.tri[t, i1], S.tri[t, i2], S.tri[after, (j + 2) % 3]
    S.tri[t, i] = d
    S.nbr[t, i1], S.nbr[t, i2] = b_d, d_a
    # opposite to a lies the edge b, d; opposite to b the edge d, a
    replace_neighbour(S.nbr, b_d, after, t)
    replace_neighbour(S.nbr, d_a, before, t)
    S.tri_of[a] = S.tri_of[b] = S.tri_of[d] = t
    S.stack[0] = t
    for free in (max(after, before), min(after, before)):
        S.counts[TRIANGLES] -= 1
        last = S.counts[TRIANGLES]
        if free != last:
            move_triangle(S, last, free)
            for q in range(count):
                if S.stack[q] == last:
                    S.stack[q] = free
    S.counts[NODES] -= 1
    if v != S.counts[NODES]:
        move_node(S, S.counts[NODES], v)
    legalise(S.points, S.tri, S.nbr, S.tri_of, S.stack, count)
    return True


@inner
def thin(S, most):
    """Take out nodes until there are no more than ``most`` triangles, as far as that goes; how many."""
    taken = 0
    while S.counts[TRIANGLES] > most and taken < TAKEN:
        v = least_room(S)
        if v < 0 or not take_out(S, v):
            break
        taken += 1
    return taken
