"""Smoothing: nodes move to where the triangles around them are nearest to equilateral.

Interior nodes move freely, nodes of the boundary along their curve (``_kernels_slide``).

All nodes move at once: one pass over triangles adds to the sums of their corners what the cost falls by (see
``_kernels_pull``), a second over nodes takes Newton's step for each by itself, with the others where they were, a
little longer, and some of the step before (Polyak 1964). That takes more sweeps than to move node by node, but in each
a triangle is looked at once, not from every corner, and nobody asks which triangles lie around a node. A triangle that
is upside down after a sweep has its corners put back.

Most nodes lie on a lattice and are at rest. In the first round those of triangles that are not good to begin with are
awake, in the next ones those that gained by their last move, and where an edge was flipped: they move, and the ones
beside them.
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner
from fubini.optimise._kernels_degrees import even_degrees
from fubini.optimise._kernels_pull import GX, GY, HH, HXX, HXY, HYY, ROOT3, ROW, pull
from fubini.optimise._kernels_slide import newton_along, place_along, put_along, rim_of
from fubini.optimise._kernels_state import NODES, TRIANGLES
from fubini.triangulation._kernels_topology import edge_is_illegal, flip

#: ``d`` above which a triangle has its nodes moved
FROM = 3e-4
#: twice the fall of the cost that is no reason to slide, nor for another sweep; more than which keeps a node awake
FALL, GAIN = 1e-3, 5e-3
#: what is noted of nodes, as bits
AWAKE, MOVES = 1, 2
#: length of a step over Newton's, share of the step before that is added
OVER, AGAIN = 1.5, 0.1
#: sweeps before edges are flipped: the first time, when many are flipped, and later
SWEEPS = 1, 3
#: an angle is acute where the product of its sides is more than this share of their squares
ACUTE = 1e-12
#: what is noted of a node before it moves: where it was, on the boundary also its parameter
WAS = 3


@inner
def survey(points, tri, m, at, awake):
    """One triangle of every node into ``at``; mark the nodes of triangles that are not good; whether there are any."""
    found = False
    for t in range(m):
        a, b, c = tri[t, 0], tri[t, 1], tri[t, 2]
        at[a] = at[b] = at[c] = t
        x, y = points[a, 0], points[a, 1]
        ux, uy, vx, vy = points[b, 0] - x, points[b, 1] - y, points[c, 0] - x, points[c, 1] - y
        sides = ux * ux + uy * uy + vx * vx + vy * vy - (ux * vx + uy * vy)
        if sides > (1.0 + FROM) * ROOT3 * (ux * vy - uy * vx):
            awake[a] = awake[b] = awake[c] = AWAKE
            found = True
    return found


@inner
def forget(sums, z):
    """Set the sums of a node to nothing."""
    for i in range(ROW):
        sums[z + i] = 0.0


@inner
def forget_all(sums, n):
    """Set the sums of the first n nodes to nothing."""
    for v in range(n):
        forget(sums, ROW * v)


@inner
def gather(S, awake, active, sums, was):
    """Nodes that are awake, and those beside them, are to move; list the triangles there, and begin anew with the sums.

    Their number. No node has moved before.
    """
    points, tri, m, n, k = S.points, S.tri, S.counts[TRIANGLES], S.counts[NODES], 0
    for v in range(n):
        awake[v] &= AWAKE
        was[WAS * v], was[WAS * v + 1] = points[v, 0], points[v, 1]
    for t in range(m):
        a, b, c = tri[t, 0], tri[t, 1], tri[t, 2]
        if (awake[a] | awake[b] | awake[c]) & AWAKE:
            awake[a] |= MOVES
            awake[b] |= MOVES
            awake[c] |= MOVES
    for t in range(m):
        active[k] = t
        k += (awake[tri[t, 0]] | awake[tri[t, 1]] | awake[tri[t, 2]]) >> 1
    forget_all(sums, n)
    return k


@inner
def step_inside(points, awake, fixed, n, sums, was):
    """Move the interior nodes that are to move; the largest fall of the cost around one to expect, twice.

    Those where it is no more than ``GAIN`` are not awake afterwards.
    """
    most = 0.0
    for v in range(fixed, n):
        z, p = ROW * v, WAS * v
        h = sums[z + HH]
        if awake[v] & MOVES and h > 0.0:
            gx, gy, hxx, hxy, hyy = sums[z + GX], sums[z + GY], sums[z + HXX] + h, sums[z + HXY], sums[z + HYY] + h
            share = 1.0 / (hxx * hyy - hxy * hxy)
            dx, dy = share * (gx * hyy - gy * hxy), share * (gy * hxx - gx * hxy)
            slope = gx * dx + gy * dy
            if 0.0 <= slope < math.inf:  # not where a triangle has next to no area: second derivatives may cancel there
                most = max(most, slope)
                awake[v] = MOVES + (slope > GAIN)
                x, y, wx, wy = points[v, 0], points[v, 1], was[p], was[p + 1]
                points[v, 0], points[v, 1] = x + OVER * dx + AGAIN * (x - wx), y + OVER * dy + AGAIN * (y - wy)
                was[p], was[p + 1] = x, y
        forget(sums, z)
    return most


@inner
def step_along(S, awake, rim, sums, was):
    """Slide the nodes of the boundary that are to move, and may; as ``step_inside``."""
    most = 0.0
    for v in range(rim.shape[0]):
        z, p = ROW * v, WAS * v
        h, r, s = sums[z + HH], np.int64(rim[v, 1]), np.int64(rim[v, 3])
        awake[v] &= MOVES
        if awake[v] and h > 0.0 and r >= 0:
            x, y = S.points[v, 0], S.points[v, 1]
            was[p], was[p + 1], was[p + 2] = x, y, S.t[r, 0]
            a, b = rim[v, 0], rim[v, 2]
            ends = S.points[a, 0] - x, S.points[a, 1] - y, S.points[b, 0] - x, S.points[b, 1] - y
            slopes = sums[z + GX], sums[z + GY], sums[z + HXX] + h, sums[z + HXY], sums[z + HYY] + h
            step, slope = newton_along(S, ends, r, s, slopes)
            if FALL < slope < math.inf:
                most = max(most, slope)
                may, t, x, y = place_along(S, v, ends, r, s, OVER * step)
                if may:
                    put_along(S, v, r, s, t, x, y)
                    awake[v] += slope > GAIN
        forget(sums, z)
    return most


@inner
def put_back(S, active, k, rim, was):
    """Put the corners of active triangles that are upside down back to where they were; how many had moved."""
    points, tri, moved = S.points, S.tri, 0
    for q in range(k):
        t = active[q]
        a, b, c = tri[t, 0], tri[t, 1], tri[t, 2]
        x, y = points[a, 0], points[a, 1]
        area2 = (points[b, 0] - x) * (points[c, 1] - y) - (points[b, 1] - y) * (points[c, 0] - x)
        if 0.0 < area2 < math.inf:
            continue
        for i in range(3):
            v = tri[t, i]
            p = WAS * v
            if points[v, 0] == was[p] and points[v, 1] == was[p + 1]:
                continue
            moved += 1
            points[v, 0], points[v, 1] = was[p], was[p + 1]
            if v < rim.shape[0]:
                S.t[rim[v, 3], 1] = S.t[rim[v, 1], 0] = was[p + 2]
    return moved


@inner
def repair(S, active, k, rim, was):
    """``put_back`` until nothing is left to do: each node goes back once at most."""
    while put_back(S, active, k, rim, was) > 0:
        pass


@inner
def sweep(S, fixed, slides, awake, active, k, rim, sums, was, lanes):
    """Move the nodes that are to move, on the boundary where ``slides``; the largest fall to expect, twice.

    What the sweep before turned over is put back first.
    """
    if not pull(S.points, S.tri, active, k, sums, lanes):
        repair(S, active, k, rim, was)
        forget_all(sums, S.counts[NODES])
        pull(S.points, S.tri, active, k, sums, lanes)
    most = step_inside(S.points, awake, fixed, S.counts[NODES], sums, was)
    if slides:
        return max(most, step_along(S, awake, rim, sums, was))
    forget_all(sums, fixed)
    return most


@inner
def flip_from(points, tri, nbr, at, awake, stack, s):
    """Flip the edges of triangle s that are not Delaunay and what follows from it; wake the nodes there; flips made."""
    flips, count = 0, 1
    stack[0] = s
    while count > 0:
        count -= 1
        t = int(stack[count])
        for i in range(3):
            if count + 2 < stack.shape[0] and edge_is_illegal(points, tri, nbr, t, i):
                u = flip(tri, nbr, at, t, i)
                stack[count], stack[count + 1] = u, t
                count += 2
                flips += 1
                awake[tri[t, 0]] = awake[tri[t, 1]] = awake[tri[t, 2]] = awake[tri[u, 2]] = AWAKE
                break
    return flips


@inner
def flip_all(points, tri, nbr, m, at, awake, stack):
    """Make all edges Delaunay; flips made.

    An edge is Delaunay where the two angles across it are acute: only those across from other angles are tested.
    """
    flips = 0
    for t in range(m):
        a, b, c = tri[t, 0], tri[t, 1], tri[t, 2]
        x, y = points[a, 0], points[a, 1]
        ux, uy, vx, vy = points[b, 0] - x, points[b, 1] - y, points[c, 0] - x, points[c, 1] - y
        uu, vv, uv = ux * ux + uy * uy, vx * vx + vy * vy, ux * vx + uy * vy
        if min(uv, min(uu - uv, vv - uv)) <= ACUTE * (uu + vv):
            flips += flip_from(points, tri, nbr, at, awake, stack, t)
    return flips


@inner
def smooth(S, W, fixed, rounds):
    """Move nodes and flip edges to be Delaunay again, ``rounds`` times; sweeps, flips and splits made.

    The first ``fixed`` nodes lie on the boundary and move from the second round on. Between the first two rounds flips
    and splits even out the number of triangles at nodes (``even_degrees``). Nothing may have been removed. Scratch, of
    what the moves fill anew: ``S.low`` for nodes that move, ``S.queue`` for their degrees, ``S.todo`` for the rim,
    ``S.stack`` for the triangles that are active, ``S.key``.
    """
    points, tri, nbr, at, n = S.points, S.tri, S.nbr, S.tri_of, S.points.shape[0]
    awake, rim, sums, was = S.low[:n], S.todo[: 4 * fixed].reshape((fixed, 4)), S.key[: ROW * n], S.key[ROW * n :]
    for v in range(n):
        awake[v] = 0
    if not survey(points, tri, S.counts[TRIANGLES], at, awake):
        return 0
    rim_of(S, rim)
    total = 0
    for turn in range(rounds):
        k, done = gather(S, awake, S.stack, sums, was), 0
        for _ in range(SWEEPS[min(turn, 1)]):
            most = sweep(S, fixed, turn > 0, awake, S.stack, k, rim, sums, was, W.lanes)
            done += most > 0.0
            if most < FALL:
                break
        if done == 0:
            break
        repair(S, S.stack, k, rim, was)
        total += done + flip_all(points, tri, nbr, S.counts[TRIANGLES], at, awake, S.stack)
        if turn == 0 and rounds > 1:
            total += even_degrees(S, W, S.queue[:n], rim, awake, was)
    return total
