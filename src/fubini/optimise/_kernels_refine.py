"""Frontal insertion of interior points until every triangle meets the size wanted there.

Rebay, "Efficient unstructured mesh generation by means of Delaunay triangulation and Bowyer-Watson algorithm",
1993: a point goes where it makes an almost equilateral triangle on an edge of the front, the edges between
triangles that are small enough, or the boundary, and triangles that are not.
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner
from fubini.optimise._kernels_cavity import local, new_node
from fubini.optimise._kernels_state import DONE, FULL, INSERTED, NODES, QUEUED, ROOM, STAMP, TRIANGLES
from fubini.triangulation._kernels_topology import legalise, locate, split_triangle

ROOT3 = math.sqrt(3.0)
#: a point keeps this share of the wanted size from other nodes, and from segments
NODE_DISTANCE, SEGMENT_DISTANCE = 0.65, 0.5
#: triangles looked at around a new point
NEAR = 48
#: where about as many triangles are wanted as of one size, up to this ratio, the largest triangles go first: the limit
#: comes down in so many steps of that height, until there are as many triangles as are wanted, and this share more
EVEN, STEPS, STEP, FILLED = 1.03, 2, 0.075, 1.06
#: with more triangles than these those at the boundary, which are too many, count little
SMALL = 1000.0
#: one size is wanted where none is below this share of it (an edge rounded to whole segments has none shorter than
#: 1 / sqrt(2)), and where all that are wanted make no more triangles than that one, times this
ONE_SIZE, HARDLY_MORE = 0.7, 1.2
#: triangles over those that area and one size ask for that a face may have, a little below 1.1 since its area is that
#: of the polygon of its nodes; faces where fewer than the second number are asked for consist of their boundary
MOST, LEAST = 1.095, 100.0
#: more triangles than there are
MANY = 2**31 - 1


@inner
def circle(S, t):
    """Centre and squared radius of the circle of triangle t; radius infinite at no area."""
    a, b, c = S.tri[t, 0], S.tri[t, 1], S.tri[t, 2]
    ax, ay = S.points[a, 0], S.points[a, 1]
    bx, by = S.points[b, 0] - ax, S.points[b, 1] - ay
    cx, cy = S.points[c, 0] - ax, S.points[c, 1] - ay
    d = 2.0 * (bx * cy - by * cx)
    if d <= 0.0:
        return ax, ay, math.inf
    bb, cc, inverse = bx * bx + by * by, cx * cx + cy * cy, 1.0 / d
    ux, uy = (cy * bb - by * cc) * inverse, (bx * cc - cx * bb) * inverse
    return ax + ux, ay + uy, ux * ux + uy * uy


@inner
def oversize(S, t, limit):
    """Whether triangle t is larger than ``limit`` times the equilateral triangle of the size wanted there.

    The radius of its circle is the product of its sides over four times its area.
    """
    a, b, c = S.tri[t, 0], S.tri[t, 1], S.tri[t, 2]
    ax, ay = S.points[a, 0], S.points[a, 1]
    bx, by, cx, cy = S.points[b, 0] - ax, S.points[b, 1] - ay, S.points[c, 0] - ax, S.points[c, 1] - ay
    ex, ey = cx - bx, cy - by
    area4 = 2.0 * (bx * cy - by * cx)
    sides = (bx * bx + by * by) * (cx * cx + cy * cy) * (ex * ex + ey * ey)
    wanted = limit * (S.size[a] + S.size[b] + S.size[c]) * area4
    return area4 <= 0.0 or 27.0 * sides > wanted * wanted


@inner
def holds(S, t, x, y):
    """Whether the circle of triangle t holds (x, y); within rounding."""
    a, b, c = S.tri[t, 0], S.tri[t, 1], S.tri[t, 2]
    ax, ay = S.points[a, 0] - x, S.points[a, 1] - y
    bx, by = S.points[b, 0] - x, S.points[b, 1] - y
    cx, cy = S.points[c, 0] - x, S.points[c, 1] - y
    inside = (ax * ax + ay * ay) * (bx * cy - by * cx) + (bx * bx + by * by) * (cx * ay - cy * ax)
    return inside + (cx * cx + cy * cy) * (ax * by - ay * bx) >= 0.0


@inner
def front_edges(S, W, t, limit, everywhere):
    """Edges of t on the front, shortest first, into W.ea; their number."""
    n = 0
    for i in range(3):
        u = S.nbr[t, i]
        if u < 0 or everywhere or not oversize(S, u, limit):
            a, b = S.tri[t, (i + 1) % 3], S.tri[t, (i + 2) % 3]
            x, y = S.points[a, 0] - S.points[b, 0], S.points[a, 1] - S.points[b, 1]
            W.rx[n] = x * x + y * y
            W.ea[n] = i
            n += 1
    for i in range(1, n):
        for j in range(i, 0, -1):
            if W.rx[j] < W.rx[j - 1]:
                W.rx[j], W.rx[j - 1] = W.rx[j - 1], W.rx[j]
                W.ea[j], W.ea[j - 1] = W.ea[j - 1], W.ea[j]
    return n


@inner
def front_point(S, t, i, h, gradient):
    """The third corner of the wanted triangle on edge i of t, no further than the circle's centre allows."""
    a, b = S.tri[t, (i + 1) % 3], S.tri[t, (i + 2) % 3]
    ax, ay, bx, by = S.points[a, 0], S.points[a, 1], S.points[b, 0], S.points[b, 1]
    length = math.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    half = 0.5 * length
    mx, my = 0.5 * (ax + bx), 0.5 * (ay + by)
    nx, ny = (ay - by) / length, (bx - ax) / length
    cx, cy, square = circle(S, t)
    wanted = min(h, 0.5 * (S.size[a] + S.size[b]) + 0.25 * gradient * length)
    radius = max(wanted / ROOT3, half * 1.0001)
    if square < math.inf:
        q = (cx - mx) * nx + (cy - my) * ny
        if q > 1e-9 * length:
            radius = max(half, min(radius, (half * half + q * q) / (2.0 * q)))
    d = radius + math.sqrt(max(0.0, radius * radius - half * half))
    return mx + d * nx, my + d * ny


@inner
def conflicts(S, W, t, x, y):
    """Triangles around t whose circle holds (x, y), t first, into W.cavity; their number (at most NEAR)."""
    S.counts[STAMP] += 1
    stamp = S.counts[STAMP]
    W.cavity[0] = t
    S.mark[t] = stamp
    n, at = 1, 0
    while at < n and n < NEAR:
        for i in range(3):
            u = S.nbr[W.cavity[at], i]
            if u < 0 or S.mark[u] == stamp or n >= NEAR:
                continue
            S.mark[u] = stamp
            if holds(S, u, x, y):
                W.cavity[n] = u
                n += 1
        at += 1
    return n


@inner
def height(S, t, i, x, y):
    """Distance of (x, y) from the line of edge i of t over the length of the edge, and the length."""
    a, b = S.tri[t, (i + 1) % 3], S.tri[t, (i + 2) % 3]
    ex, ey = S.points[b, 0] - S.points[a, 0], S.points[b, 1] - S.points[a, 1]
    length = math.sqrt(ex * ex + ey * ey)
    return (ex * (y - S.points[a, 1]) - ey * (x - S.points[a, 0])) / length, length


@inner
def less(small, size, gradient, square):
    """Whether ``small`` and ``gradient`` times a distance, of which the square is given, are less than ``size``."""
    more = size - small
    return more > 0.0 and gradient * gradient * square < more * more


@inner
def admit(S, W, n, x, y, h, gradient, share):
    """Size wanted at (x, y) among the n triangles W.cavity; -1 where a node or a segment is too near."""
    size = h
    nearest = math.inf
    for q in range(n):
        for i in range(3):
            v = S.tri[W.cavity[q], i]
            dx, dy = S.points[v, 0] - x, S.points[v, 1] - y
            square = dx * dx + dy * dy
            nearest = min(nearest, square)
            if less(S.size[v], size, gradient, square):
                size = S.size[v] + gradient * math.sqrt(square)
    least = share * NODE_DISTANCE * size
    if nearest < least * least:
        return -1.0
    for q in range(n):
        t = W.cavity[q]
        for i in range(3):
            if S.nbr[t, i] < 0:
                d, length = height(S, t, i, x, y)
                if d < share * SEGMENT_DISTANCE * min(size, length):
                    return -1.0
    return size


@inner
def insert_point(S, t, x, y, size):
    """Put a node into triangle t, keep the triangulation Delaunay; the node."""
    v = new_node(S, x, y, 0, size)
    t1 = S.counts[TRIANGLES]
    S.counts[TRIANGLES] += 2
    split_triangle(S.tri, S.nbr, S.tri_of, t, v, t1, t1 + 1)
    S.stack[0], S.stack[1], S.stack[2] = t, t1, t1 + 1
    legalise(S.points, S.tri, S.nbr, S.tri_of, S.stack, 3)
    return v


@inner
def push(S, t, limit):
    """Append triangle t to the first-in first-out list S.todo when it is oversize."""
    if oversize(S, t, limit):
        S.todo[S.counts[QUEUED] % S.todo.shape[0]] = t
        S.counts[QUEUED] += 1


@inner
def push_star(S, v, limit):
    """Append what is oversize around the new interior node v, the triangles beyond its star included."""
    first = t = S.tri_of[v]
    while True:
        i = local(S, t, v)
        push(S, t, limit)
        if S.nbr[t, i] >= 0:
            push(S, S.nbr[t, i], limit)
        t = S.nbr[t, (i + 1) % 3]
        if t == first or t < 0:
            return


@inner
def try_triangle(S, W, t, h, gradient, limit, everywhere):
    """Insert a point on a front edge of triangle t; the node, or -1."""
    n = front_edges(S, W, t, limit, everywhere)
    for e in range(n):
        x, y = front_point(S, t, W.ea[e], h, gradient)
        at, report = locate(S.points, S.tri, S.nbr, t, x, y, 200)
        if report != 0:
            continue
        k = conflicts(S, W, at, x, y)
        size = admit(S, W, k, x, y, h, gradient, 0.9 if everywhere else 1.0)
        if size > 0.0:
            return insert_point(S, at, x, y, size)
    return -1


@inner
def grade(S, gradient):
    """Lower the sizes of interior nodes to what their neighbours allow, by sweeps until nothing changes.

    A sweep looks at the triangles of nodes that it or the one before has lowered. Scratch: ``S.low``, the last of
    these sweeps for each node.
    """
    lowered = S.low
    for v in range(S.counts[NODES]):
        lowered[v] = 0
    for turn in range(1, 65):
        changed = False
        for t in range(S.counts[TRIANGLES]):
            if max(lowered[S.tri[t, 0]], max(lowered[S.tri[t, 1]], lowered[S.tri[t, 2]])) < turn - 1:
                continue
            for i in range(3):
                a, b = S.tri[t, i], S.tri[t, i + 1 if i < 2 else 0]
                if S.size[a] > S.size[b]:
                    a, b = b, a
                if S.kind[b] != 0 or S.size[b] == S.size[a]:
                    continue
                x, y = S.points[a, 0] - S.points[b, 0], S.points[a, 1] - S.points[b, 1]
                if not less(S.size[a], S.size[b], gradient, x * x + y * y):
                    continue
                most = S.size[a] + gradient * math.sqrt(x * x + y * y)
                if S.size[b] > most:  # not where it is rounding that tells them apart
                    S.size[b], lowered[b] = most, turn
                    changed = True
        if not changed:
            break


@inner
def room(S, h):
    """How many equilateral triangles of the sizes wanted at the nodes there is room for, and how many of size h.

    Notes the latter in S.counts where no size is much smaller.
    """
    total = area2 = 0.0
    least = h
    for t in range(S.counts[TRIANGLES]):
        a, b, c = S.tri[t, 0], S.tri[t, 1], S.tri[t, 2]
        ax, ay = S.points[a, 0], S.points[a, 1]
        bx, by, cx, cy = S.points[b, 0] - ax, S.points[b, 1] - ay, S.points[c, 0] - ax, S.points[c, 1] - ay
        size, twice = S.size[a] + S.size[b] + S.size[c], bx * cy - by * cx
        least = min(least, min(S.size[a], min(S.size[b], S.size[c])))
        total += 9.0 * twice / (size * size)
        area2 += twice
    total, uniform = 2.0 / ROOT3 * total, 2.0 / ROOT3 * area2 / (h * h)
    S.counts[ROOM] = int(uniform) if least >= ONE_SIZE * h and total <= HARDLY_MORE * uniform else 0
    return total, uniform


@inner
def most_of(room, core, beside):
    """Triangles that a face may have besides a core of ``core``, MANY where not known.

    room, beside : how many of one size there is room for, and in place of the core; 0 and below 0 where not known.
    """
    return int(MOST * (room + beside) - core) if room > 0 and beside >= 0.0 and room + beside >= LEAST else MANY


@inner
def fill_in(S, W, h, gradient, limit, everywhere, most):
    """Insert points until no triangle is oversize, or there are ``most``.

    ``everywhere`` takes every edge for the front. Returns how many triangles got no point; -1 where arrays are full.
    """
    S.counts[QUEUED] = 0
    head = failed = 0
    for t in range(S.counts[TRIANGLES]):
        push(S, t, limit)
    while head < S.counts[QUEUED] and S.counts[TRIANGLES] < most:
        t = S.todo[head % S.todo.shape[0]]
        head += 1
        if not oversize(S, t, limit):
            continue
        if S.counts[NODES] + 4 > S.points.shape[0] or S.counts[TRIANGLES] + 8 > S.tri.shape[0]:
            return -1
        if S.counts[QUEUED] - head > S.todo.shape[0] - 64:
            return -1
        v = try_triangle(S, W, t, h, gradient, limit, everywhere)
        if v >= 0:
            S.counts[INSERTED] += 1
            push_star(S, v, limit)
        else:
            failed += 1
    return failed


@inner
def advance(S, W, h, gradient, limit):
    """Insert points from the boundary inwards until no triangle is oversize. DONE or FULL.

    ``S.size`` holds the sizes wanted at the nodes; interior ones are lowered to the gradient first. Where these
    sizes differ little and triangles are few, points stop once there are as many triangles as these sizes ask for. A
    last pass takes every edge for the front, where the others found no room.
    """
    grade(S, gradient)
    wanted, uniform = room(S, h)
    steps, most = 0, MANY
    if wanted < min(SMALL, EVEN * uniform):
        steps, most = STEPS, np.int64(FILLED * wanted)
    failed, loose, everywhere, end = 0, limit + steps * STEP, False, MANY
    while True:
        found = fill_in(S, W, h, gradient, loose, everywhere, end)
        if found < 0:
            return FULL
        failed = max(failed, found)
        if steps > 0 and S.counts[TRIANGLES] < most:
            steps -= 1
            loose, end = limit + steps * STEP, most
        elif failed > 0 and not everywhere:
            steps, loose, everywhere, end = 0, 1.25 * limit, True, MANY
        else:
            return DONE
