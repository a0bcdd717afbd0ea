r"""Flips and splits that bring every node nearer to the number of triangles that suits the angle around it.

Where k triangles share an angle none of them can be better than the isosceles one of that angle over k; what it loses
in skewness is about its distance from 60 degrees. A node on a straight edge wants three triangles: two make right
angles, of skewness 63.4 degrees at most, wherever the nodes around move. What is made less is the sum of the
squares of these distances. Flips and splits may make the triangles worse for now: nodes are smoothed afterwards,
and an edge that is not Delaunay then is flipped back.

A split gives node v and a node y one triangle more, where no flip does without taking one from nodes that need it:

          y                     y
        / | \                 / _ \         an interior node c between v and y becomes two, p on the left of the way
       /  |  \               / / \ \        from v to y and c on its right, which share the triangles of c;
      /   c   \      ->     / p---c \       (v, c, p) and (y, p, c) are new
       \  |  /               \ \ / /
        \ | /                 \   /
          v                     v
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner
from fubini.optimise._kernels_cavity import new_node
from fubini.optimise._kernels_state import NODES, TRIANGLES
from fubini.triangulation._kernels_topology import around, flip, replace_neighbour

ROOT3 = math.sqrt(3.0)
THIRD, TURN = math.pi / 3.0, 2.0 * math.pi
#: ``d`` (see ``_kernels_smooth``) above which edges of a triangle are looked at, and which no flip may exceed, no split
WORSE, OFF, CROWDED = 0.02, 1.5, 0.4
#: fall of the sum of squares, in squared radians, from which on an edge is flipped or a node split
GAIN = 150.0 * math.radians(1.0) ** 2
#: share of the angle at a node, for each of its triangles, above which the node is to get one more
WIDE = math.radians(78.0)
#: squares of these distances, by the number of triangles, where they share a whole turn; one triangle does not
AROUND = np.array([math.inf] + [(TURN / k - THIRD) ** 2 for k in range(1, 100)])
#: what is noted of a node: its angle, and by how much its square falls with a triangle more and with one less
ANGLE, MORE, LESS = range(3)
NOTES = 3
#: least length of what an angle is told by
TINY = 1e-300
#: share of the way from v to y by which the halves of a node are put apart at first, and rounds of moving to the middle
APART, TRIES = 0.15, 3


@inner
def shape(points, a, b, c):
    """``d`` of the triangle a, b, c; infinite where it is upside down."""
    x, y = points[a, 0], points[a, 1]
    ux, uy, vx, vy = points[b, 0] - x, points[b, 1] - y, points[c, 0] - x, points[c, 1] - y
    area = ROOT3 * (ux * vy - uy * vx)
    if area <= 0.0:
        return math.inf
    return (ux * ux + uy * uy + vx * vx + vy * vy - (ux * vx + uy * vy)) / area - 1.0


@inner
def angle_between(ux, uy, wx, wy):
    """Angle from u counter-clockwise to w, above 0, up to a whole turn, to about 1e-5.

    By the polynomial 4.4.49 of Abramowitz and Stegun for the arc tangent of up to 1: no library's function, which
    would take several times as long.
    """
    x, y = ux * wx + uy * wy, ux * wy - uy * wx
    p, q = abs(x), abs(y)
    z = min(p, q) / max(max(p, q), TINY)
    s = z * z
    z *= 0.9998660 + s * (-0.3302995 + s * (0.1801410 + s * (-0.0851330 + s * 0.0208351)))
    z = 0.5 * math.pi - z if q > p else z
    z = math.pi - z if x < 0.0 else z
    return TURN - z if y < 0.0 or z <= 0.0 else z


@inner
def note(gains, v, k):
    """By how much the square at node v with k triangles falls with one more, and with one less, into its gains."""
    z = NOTES * v
    if k < AROUND.shape[0] - 1 and gains[z + ANGLE] == TURN:
        now, more, less = AROUND[k], AROUND[k + 1], AROUND[k - 1]
    else:
        now, more = (gains[z + ANGLE] / k - THIRD) ** 2, (gains[z + ANGLE] / (k + 1) - THIRD) ** 2
        less = (gains[z + ANGLE] / (k - 1) - THIRD) ** 2 if k > 1 else math.inf
    gains[z + MORE], gains[z + LESS] = now - more, now - less


@inner
def note_all(points, n, degree, rim, gains):
    """``note`` for all n nodes; on the boundary the angle is the one between the nodes next to them there."""
    for v in range(n):
        angle = TURN
        if v < rim.shape[0]:
            x, y, a, b = points[v, 0], points[v, 1], rim[v, 0], rim[v, 2]
            angle = angle_between(points[a, 0] - x, points[a, 1] - y, points[b, 0] - x, points[b, 1] - y)
        gains[NOTES * v + ANGLE] = angle
        if degree[v] > 0:
            note(gains, v, int(degree[v]))


@inner
def count_triangles(tri, m, n, degree):
    """Number of triangles at every node."""
    for v in range(n):
        degree[v] = 0
    for t in range(m):
        for i in range(3):
            degree[tri[t, i]] += 1


@inner
def flip_to_even(S, m, degree, gains, awake):
    """Flip the edges of not so good triangles where that suits the four nodes better, and wake them; flips made."""
    points, tri, nbr, at = S.points, S.tri, S.nbr, S.tri_of
    flips = 0
    for t in range(m):
        for i in range(3):
            u = int(nbr[t, i])
            if u < 0:
                continue
            j = (nbr[u, 1] == t) + 2 * (nbr[u, 2] == t)
            p, a, b, d = tri[t, i], tri[t, i + 1 if i < 2 else 0], tri[t, i - 1 if i > 0 else 2], tri[u, j]
            fall = gains[NOTES * p + MORE] + gains[NOTES * d + MORE] + gains[NOTES * a + LESS] + gains[NOTES * b + LESS]
            if fall <= GAIN or max(shape(points, p, a, d), shape(points, p, d, b)) >= OFF:
                continue
            if max(shape(points, p, a, b), shape(points, d, b, a)) < WORSE:
                continue
            flip(tri, nbr, at, t, i)
            flips += 1
            for v, change in ((p, 1), (d, 1), (a, -1), (b, -1)):
                degree[v] += change
                note(gains, int(v), int(degree[v]))
                awake[v] = 1
            break
    return flips


@inner
def after(S, t, v):
    """Local number of the corner after v in triangle t."""
    return 1 + (S.tri[t, 1] == v) - (S.tri[t, 2] == v)


@inner
def load_star(S, W, t, c, v):
    """Triangles around interior node c, beginning with (c, v, .), into W.fan, what lies opposite to their left sides
    into W.ring; their number, or -1 where there are too many. t : any triangle of c.
    """
    k = 0
    while S.tri[t, after(S, t, c)] != v and k < W.fan.shape[0]:
        t = int(S.nbr[t, after(S, t, c)])
        k += 1
    return around(S.tri, S.nbr, t, c, W.fan.shape[0], W.fan, W.ring)[0]


@inner
def best_split(S, W, gains, fixed, v):
    """The split that gives node v a triangle and lessens the sum most: (node, place of y in its ring); -1 for none."""
    best, node, place = GAIN, -1, -1
    wide = gains[NOTES * v + MORE]
    first = t = int(S.tri_of[v])
    for way in range(2):  # on a boundary the turn ends at a segment: then the other way
        while t >= 0:
            i = after(S, t, v)
            c = int(S.tri[t, i])
            k = load_star(S, W, t, c, v) if c >= fixed else 0
            for j in range(2, k - 1):
                fall = wide + gains[NOTES * W.ring[j] + MORE] + AROUND[k] - (AROUND[j + 2] + AROUND[k - j + 2])
                if fall > best:
                    best, node, place = fall, c, j
            t = int(S.nbr[t, i] if way == 0 else S.nbr[t, i + 1 if i < 2 else 0])
            if t == first:
                return node, place
        t = first
    return node, place


@inner
def place_halves(S, W, k, j, c, p):
    """Put the halves of node c, whose star of k triangles is loaded and cut at place j, in the middle of their rings.

    The worst ``d`` of the triangles around them; where it is too much, c is to go back.
    """
    points, v, y = S.points, W.ring[0], W.ring[j]
    dx, dy = APART * (points[y, 0] - points[v, 0]), APART * (points[y, 1] - points[v, 1])
    points[p, 0], points[p, 1] = points[c, 0] - dy, points[c, 1] + dx
    points[c, 0], points[c, 1] = points[c, 0] + dy, points[c, 1] - dx
    for _ in range(TRIES):
        sx, sy, tx, ty = points[c, 0], points[c, 1], points[p, 0], points[p, 1]
        for q in range(k):
            a = W.ring[q]
            if q >= j or q == 0:
                sx, sy = sx + points[a, 0], sy + points[a, 1]
            if q <= j:
                tx, ty = tx + points[a, 0], ty + points[a, 1]
        points[p, 0], points[p, 1] = sx / (k - j + 2), sy / (k - j + 2)
        points[c, 0], points[c, 1] = tx / (j + 2), ty / (j + 2)
    worst = max(shape(points, v, c, p), shape(points, y, p, c))
    for q in range(k):
        worst = max(worst, shape(points, c if q < j else p, W.ring[q], W.ring[q + 1 if q + 1 < k else 0]))
    return worst


@inner
def split(S, W, k, j, c, p):
    """Cut the loaded star of node c at place j of its ring and hand the triangles on the left to node p."""
    tri, nbr, at = S.tri, S.nbr, S.tri_of
    t1 = S.counts[TRIANGLES]
    t2 = t1 + 1
    S.counts[TRIANGLES] += 2
    v, y, last = W.ring[0], W.ring[j], W.fan[k - 1]
    for q in range(j, k):
        t = W.fan[q]
        tri[t, 0 if tri[t, 0] == c else (1 if tri[t, 1] == c else 2)] = p
    tri[t1, 0], tri[t1, 1], tri[t1, 2] = v, c, p
    tri[t2, 0], tri[t2, 1], tri[t2, 2] = y, p, c
    nbr[t1, 0], nbr[t1, 1], nbr[t1, 2] = t2, last, W.fan[0]
    nbr[t2, 0], nbr[t2, 1], nbr[t2, 2] = t1, W.fan[j - 1], W.fan[j]
    replace_neighbour(nbr, W.fan[0], last, t1)
    replace_neighbour(nbr, last, W.fan[0], t1)
    replace_neighbour(nbr, W.fan[j - 1], W.fan[j], t2)
    replace_neighbour(nbr, W.fan[j], W.fan[j - 1], t2)
    at[v], at[y], at[c], at[p] = t1, t2, t2, t2


@inner
def split_to_even(S, W, n, degree, gains, fixed, awake):
    """Split a neighbour of every node with too few triangles where that suits all better, and wake what is there.

    The number of splits. New nodes are interior.
    """
    number = 0
    for v in range(n):
        if degree[v] < 2 or gains[NOTES * v + ANGLE] <= WIDE * degree[v]:
            continue
        p = S.counts[NODES]
        if p >= degree.shape[0] or S.counts[TRIANGLES] + 2 > S.tri.shape[0]:
            break
        c, j = best_split(S, W, gains, fixed, v)
        if c < 0:
            continue
        k = load_star(S, W, int(S.tri_of[c]), c, v)
        x, y = S.points[c, 0], S.points[c, 1]
        if place_halves(S, W, k, j, c, p) > CROWDED:
            S.points[c, 0], S.points[c, 1] = x, y
            continue
        new_node(S, S.points[p, 0], S.points[p, 1], 0, S.size[c])
        split(S, W, k, j, c, p)
        degree[v] += 1
        degree[W.ring[j]] += 1
        degree[c], degree[p] = j + 2, k - j + 2
        gains[NOTES * p + ANGLE] = TURN
        for q in (v, int(W.ring[j]), c, p):
            note(gains, q, int(degree[q]))
        awake[c] = awake[p] = 1
        for q in range(k):
            awake[W.ring[q]] = 1
        number += 1
    return number


@inner
def even_degrees(S, W, degree, rim, awake, gains):
    """Flips, then splits, each of which lessens the sum of squares; their number.

    rim (b, 4) : ``rim_of``. Scratch: degree (N,) and gains (3 N,) for as many nodes as there is room for.
    """
    n, m = S.counts[NODES], S.counts[TRIANGLES]
    count_triangles(S.tri, m, n, degree)
    note_all(S.points, n, degree, rim, gains)
    flips = flip_to_even(S, m, degree, gains, awake)
    return flips + split_to_even(S, W, n, degree, gains, rim.shape[0], awake)
