"""Smoothing: nodes move to where the triangles around them are nearest to equilateral.

Interior nodes move freely, nodes of the boundary along their curve (``_kernels_slide``).

The shape of a triangle is ``r = (a^2 + b^2 + c^2) / (4 sqrt(3) A)``, 1 for the equilateral one and infinite at no
area. With ``d = r - 1`` its cost is ``sqrt(d + NEAR) + FAR d^4``: the root grows like the loss of skewness, so
that the mean rises; the fourth power keeps the worst from paying for it. Where p is a corner and e the apex of the
equilateral triangle on the edge across, ``d = |p - e|^2 / (2 sqrt(3) A)``.

Most nodes lie on a lattice and are at rest. A node is looked at where a triangle beside it is not good to begin with,
and again when it or a neighbour gained by a move, or an edge beside it was flipped.
"""

from __future__ import annotations

import math

from fubini._jit import inner
from fubini.optimise._kernels_degrees import even_degrees
from fubini.optimise._kernels_slide import load_fan, may_slide, newton_along, place_along, put_along
from fubini.optimise._kernels_state import NODES, TRIANGLES
from fubini.triangulation._kernels_topology import edge_is_illegal, flip

ROOT3 = math.sqrt(3.0)
HEIGHT = 0.5 * ROOT3
NEAR, FAR = 0.01, 150.0
LEAST = math.sqrt(NEAR)
#: ``d`` above which a triangle has its nodes looked at, and above which its cost is convex in ``d``
FROM, CONVEX = 3e-4, 0.0765
#: falls of the cost: less is no reason to move, more has the nodes around looked at again
FALL, GAIN = 1e-3, 1e-2
#: attempts to shorten a step that does not pay, and by what
SHORTER, STEPS = 0.4, 4
#: sweeps over all nodes before edges are flipped: the first time, when many are flipped, and later
FIRST_SWEEPS, SWEEPS = 1, 2
#: an angle is acute where the product of its sides is more than this share of their squares
ACUTE = 1e-12


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
            awake[a] = awake[b] = awake[c] = 1
            found = True
    return found


@inner
def load(points, tri, nbr, t, v, ring, rx, ry):
    """Nodes around interior node v, counter-clockwise from triangle t, and where they lie from v; their number k.

    rx[k], ry[k] repeat the first. 0 where there are too many.
    """
    x, y = points[v, 0], points[v, 1]
    first, k = t, 0
    while k < ring.shape[0] - 1:
        # the corner after v, without a branch
        i1 = 1 + (tri[t, 1] == v) - (tri[t, 2] == v)
        a = tri[t, i1]
        ring[k] = a
        rx[k], ry[k] = points[a, 0] - x, points[a, 1] - y
        k += 1
        t = nbr[t, i1]
        if t == first:
            rx[k], ry[k] = rx[0], ry[0]
            return k
        if t < 0:
            return 0
    return 0


@inner
def star_cost(rx, ry, k, x, y):
    """Cost of the k triangles between (x, y) and the edges of its ring; infinite where one is upside down."""
    total = 0.0
    cx, cy = rx[0] - x, ry[0] - y
    for q in range(k):
        bx, by = cx, cy
        cx, cy = rx[q + 1] - x, ry[q + 1] - y
        area = ROOT3 * (bx * cy - by * cx)
        if area <= 0.0:
            return math.inf
        ux, uy = 0.5 * (bx + cx) - HEIGHT * (cy - by), 0.5 * (by + cy) + HEIGHT * (cx - bx)
        d = (ux * ux + uy * uy) / area
        square = d * d
        total += math.sqrt(d + NEAR) + FAR * square * square
    return total - k * LEAST


@inner
def slopes(rx, ry, k, x, y):
    """Cost at (x, y), minus its derivatives and what serves as its second: (cost, gx, gy, hxx, hxy, hyy).

    The second are positive: what is not convex is left out, and what depends on the areas.
    """
    total = gx = gy = h = hxx = hxy = hyy = 0.0
    cx, cy = rx[0] - x, ry[0] - y
    for q in range(k):
        bx, by = cx, cy
        cx, cy = rx[q + 1] - x, ry[q + 1] - y
        nx, ny = by - cy, cx - bx
        area = ROOT3 * (bx * cy - by * cx)
        if area <= 0.0:
            return math.inf, 0.0, 0.0, 1.0, 0.0, 1.0
        ux, uy = 0.5 * (bx + cx) + HEIGHT * nx, 0.5 * (by + cy) + HEIGHT * ny
        # one division for 1 / area and 1 / (d + NEAR)
        off = ux * ux + uy * uy
        near = off + NEAR * area
        share = 1.0 / (area * near)
        inverse = near * share
        d = off * inverse
        flat = area * math.sqrt(share)  # 1 / sqrt(d + NEAR)
        cube = d * d * d
        w = inverse * (flat + 8.0 * FAR * cube)  # twice the derivative of the cost by d, over the area
        total += near * inverse * flat + FAR * d * cube
        d *= HEIGHT
        sx, sy = ux + d * nx, uy + d * ny  # minus half the derivatives of d, times the area
        gx += w * sx
        gy += w * sy
        h += w
        if d > HEIGHT * CONVEX:
            bend = 4.0 * inverse * inverse * (9.0 * FAR * d * d - 0.25 * flat * flat * flat)
            hxx += bend * sx * sx
            hxy += bend * sx * sy
            hyy += bend * sy * sy
    return total - k * LEAST, gx, gy, hxx + h, hxy, hyy + h


@inner
def downhill(rx, ry, k, x, y):
    """Cost at (x, y) and Newton's step to its least value: (cost, dx, dy, slope), slope the fall to expect twice."""
    cost, gx, gy, hxx, hxy, hyy = slopes(rx, ry, k, x, y)
    share = 1.0 / (hxx * hyy - hxy * hxy)
    dx, dy = share * (gx * hyy - gy * hxy), share * (gy * hxx - gx * hxy)
    return cost, dx, dy, gx * dx + gy * dy


@inner
def move(points, v, rx, ry, k):
    """Move node v where that lowers the cost around it; by how much it fell.

    A step that is to gain less than ``GAIN`` is taken without a look at the cost there: it is too short to turn a
    triangle upside down, as second derivatives grow with the inverse of the areas.
    """
    cost, dx, dy, slope = downhill(rx, ry, k, 0.0, 0.0)
    if slope < 2.0 * FALL:
        return 0.0
    if slope < 2.0 * GAIN:
        points[v, 0] += dx
        points[v, 1] += dy
        return 0.5 * slope
    for _ in range(STEPS):
        fall = cost - star_cost(rx, ry, k, dx, dy)
        if fall > FALL:
            points[v, 0] += dx
            points[v, 1] += dy
            return fall
        dx, dy = SHORTER * dx, SHORTER * dy
    return 0.0


@inner
def smooth_sweep(points, tri, nbr, n, fixed, at, awake, ring, rx, ry):
    """Look at every interior node that is awake; the number moved."""
    moved = 0
    for v in range(fixed, n):
        if awake[v] == 0:
            continue
        awake[v] = 0
        k = load(points, tri, nbr, int(at[v]), v, ring, rx, ry)
        fall = move(points, v, rx, ry, k) if k > 0 else 0.0
        if fall > 0.0:
            moved += 1
            if fall > GAIN:
                awake[v] = 1
                for q in range(k):
                    awake[ring[q]] = 1
    return moved


@inner
def slide(S, W, v):
    """Move boundary node v along its curve where that lowers the cost around it: (fall, k), k as of ``load_fan``.

    Not the legs of a sharp corner.
    """
    k, r, s = load_fan(S, W, v)
    if k == 0 or not may_slide(S, r, s) or S.sharp[W.ring[0]] + S.sharp[W.ring[k]] > 0:
        return 0.0, k
    cost, gx, gy, hxx, hxy, hyy = slopes(W.rx, W.ry, k, 0.0, 0.0)
    step, slope = newton_along(S, W, k, r, s, (gx, gy, hxx, hxy, hyy))
    if slope < 2.0 * FALL:
        return 0.0, k
    for _ in range(STEPS):
        may, t, x, y = place_along(S, W, v, k, r, s, step)
        fall = cost - star_cost(W.rx, W.ry, k, x - S.points[v, 0], y - S.points[v, 1]) if may else 0.0
        if fall > FALL:
            put_along(S, v, r, s, t, x, y)
            return fall, k
        step *= SHORTER
    return 0.0, k


@inner
def slide_sweep(S, W, fixed, awake):
    """Look at every node of the boundary that is awake and may slide; the number moved."""
    moved = 0
    for v in range(fixed):
        if awake[v] == 0 or S.kind[v] != 1:
            continue
        awake[v] = 0
        fall, k = slide(S, W, v)
        if fall > 0.0:
            moved += 1
            if fall > GAIN:
                awake[v] = 1
                for q in range(k + 1):
                    awake[W.ring[q]] = 1
    return moved


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
                awake[tri[t, 0]] = awake[tri[t, 1]] = awake[tri[t, 2]] = awake[tri[u, 2]] = 1
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
    """Move nodes and flip edges to be Delaunay again, ``rounds`` times; moves, flips and splits made.

    The first ``fixed`` nodes lie on the boundary and move from the second round on. Between the first two rounds flips
    and splits even out the number of triangles at nodes (``even_degrees``). Nothing may have been removed. Scratch, of
    what the moves fill anew: ``S.low`` for nodes that are awake, ``S.queue`` for their degrees, ``S.key``.
    """
    points, tri, nbr, at, n = S.points, S.tri, S.nbr, S.tri_of, S.points.shape[0]
    total, awake = 0, S.low[:n]
    for v in range(n):
        awake[v] = 0
    if not survey(points, tri, S.counts[TRIANGLES], at, awake):
        return 0
    for turn in range(rounds):
        done = 0
        for _ in range(FIRST_SWEEPS if turn == 0 else SWEEPS):
            done += smooth_sweep(points, tri, nbr, S.counts[NODES], fixed, at, awake, W.ring, W.rx, W.ry)
            if turn > 0:
                done += slide_sweep(S, W, fixed, awake)
        if done == 0:
            break
        total += done + flip_all(points, tri, nbr, S.counts[TRIANGLES], at, awake, S.stack)
        if turn == 0 and rounds > 1:
            sides = S.key[: 4 * fixed].reshape((fixed, 4))
            for v in range(fixed):
                for i in range(4):
                    sides[v, i] = 0.0
            total += even_degrees(S, W, S.queue[:n], sides, awake)
    return total
