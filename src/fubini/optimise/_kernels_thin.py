"""Interior nodes taken out of a triangulation that has more triangles than are wanted, those with least room first."""

from __future__ import annotations

import numpy as np

from fubini._jit import inner
from fubini._kernels_predicates import orient
from fubini.optimise._kernels_cavity import local
from fubini.optimise._kernels_state import NODES, TRIANGLES
from fubini.triangulation._kernels_topology import INTERIOR, around, flip, legalise, replace_neighbour

#: nodes that are taken out at most, and of how many triangles each
TAKEN, AROUND = 200, 24


@inner
def add_area(S, room, t, times):
    """Add so many times the area of triangle t, doubled, to the room of its corners."""
    a, b, c = S.tri[t, 0], S.tri[t, 1], S.tri[t, 2]
    x, y = S.points[a, 0], S.points[a, 1]
    area2 = (S.points[b, 0] - x) * (S.points[c, 1] - y) - (S.points[b, 1] - y) * (S.points[c, 0] - x)
    room[a] += times * area2
    room[b] += times * area2
    room[c] += times * area2


@inner
def least_room(S, room):
    """The interior node with least room; -1 for none."""
    best = -1
    for v in range(S.counts[NODES]):
        if S.kind[v] == INTERIOR and (best < 0 or room[v] < room[best]):
            best = v
    return best


@inner
def turn(S, p, q, r):
    """Whether the nodes p, q, r turn left."""
    return orient(S.points[p, 0], S.points[p, 1], S.points[q, 0], S.points[q, 1], S.points[r, 0], S.points[r, 1]) > 0.0


@inner
def lessen(S, W, v):
    """Flip an edge of interior node v away: the triangle that v loses; -1 where it has three alone, -2 where none can.

    From the triangle v, a, b and the next one, v, b, d, edge v - b goes where a, b, d and a, d, v are triangles too.
    Without a flip its triangles are in W.fan, the corners after it in W.ring.
    """
    k, _ = around(S.tri, S.nbr, np.int64(S.tri_of[v]), v, AROUND, W.fan, W.ring)
    if k == 3:
        return np.int64(-1)
    for q in range(k):
        t, a, b, d = W.fan[q], W.ring[q], W.ring[(q + 1) % k], W.ring[(q + 2) % k]
        if turn(S, a, b, d) and turn(S, a, d, v):
            flip(S.tri, S.nbr, S.tri_of, t, local(S, t, a))
            return t
    return np.int64(-2)


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
def join_three(S, W, v):
    """Make one of the three triangles W.fan around node v: the first of them, with the corners W.ring."""
    t, after, before = W.fan[0], W.fan[1], W.fan[2]
    a, b, d = W.ring[0], W.ring[1], W.ring[2]
    i = local(S, t, v)
    # opposite to a comes the edge b, d; opposite to b the edge d, a
    b_d, d_a = np.int64(S.nbr[after, local(S, after, v)]), np.int64(S.nbr[before, local(S, before, v)])
    S.tri[t, i] = d
    S.nbr[t, i + 1 if i < 2 else 0], S.nbr[t, i - 1 if i > 0 else 2] = b_d, d_a
    replace_neighbour(S.nbr, b_d, after, t)
    replace_neighbour(S.nbr, d_a, before, t)
    S.tri_of[a] = S.tri_of[b] = S.tri_of[d] = t


@inner
def take_out(S, W, v):
    """Take interior node v out: number of triangles in its place, which are in W.cavity; 0 where that is not possible.

    Nothing is left empty: the last node and the last triangles get the numbers that become free.
    """
    count = 1
    for _ in range(AROUND):
        t = lessen(S, W, v)
        if t < 0:
            break
        W.cavity[count] = t
        count += 1
    if t != -1:
        return 0
    join_three(S, W, v)
    W.cavity[0] = W.fan[0]
    for free in (max(W.fan[1], W.fan[2]), min(W.fan[1], W.fan[2])):
        S.counts[TRIANGLES] -= 1
        last = S.counts[TRIANGLES]
        if free != last:
            move_triangle(S, last, free)
            for q in range(count):
                if W.cavity[q] == last:
                    W.cavity[q] = free
    S.counts[NODES] -= 1
    if v != S.counts[NODES]:
        move_node(S, S.counts[NODES], v)
    return count


@inner
def thin(S, W, most):
    """Take out nodes until there are no more than ``most`` triangles, as far as that goes; how many.

    Edges are Delaunay before, and made so after each: only where a node was are there other triangles then, so that
    the room of nodes, the area of their triangles, changes there alone. Scratch: ``S.key``.
    """
    room, taken = S.key, 0
    for v in range(S.counts[NODES]):
        room[v] = 0.0
    for t in range(S.counts[TRIANGLES]):
        add_area(S, room, t, 1.0)
    while S.counts[TRIANGLES] > most and taken < TAKEN:
        v = least_room(S, room)
        if v < 0:
            break
        k, _ = around(S.tri, S.nbr, np.int64(S.tri_of[v]), v, AROUND, W.fan, W.ring)
        for q in range(k):
            add_area(S, room, W.fan[q], -1.0)
        count = take_out(S, W, v)
        if count == 0:
            break
        room[v] = room[S.counts[NODES]]  # of the node that has its number now
        for q in range(count):
            S.stack[q] = W.cavity[q]
        legalise(S.points, S.tri, S.nbr, S.tri_of, S.stack, count)
        for q in range(count):
            add_area(S, room, W.cavity[q], 1.0)
        taken += 1
    return taken
