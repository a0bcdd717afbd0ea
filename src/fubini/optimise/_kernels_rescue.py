"""Delaunay refinement around what local moves left flawed (Ruppert 1995; off-centres: Ungor 2009).

A flawed triangle gets a new node at its off-centre, the place nearest to its shortest edge that makes a
good triangle on it. A node that would fall beyond a boundary segment, or into its diametral circle, splits that
segment on its curve instead. At corners below about 50 degrees the two segments get equal lengths first, so
that one isosceles triangle fills the corner.
"""

from __future__ import annotations

import math

from fubini._jit import inner, kernel
from fubini.optimise._kernels_cavity import local, replace
from fubini.optimise._kernels_fill import PROGRAMME
from fubini.optimise._kernels_loop import keep, room
from fubini.optimise._kernels_quality import is_flawed
from fubini.optimise._kernels_refine import circle, conflicts, insert_point
from fubini.optimise._kernels_state import DONE, FULL, LIMIT, QUEUED, REFINEMENT, STUCK
from fubini.optimise._kernels_words import state_of, work_of
from fubini.triangulation._kernels_topology import locate

#: apex angle of the triangle on the shortest edge that a new node aims at
APEX = math.tan(math.radians(0.5 * 36.0))
#: legs of a sharp corner differ by no more than this
LEGS = 1.08
ANY = -1e9


@inner
def corner_fan(S, W, t, c):
    """Triangles around boundary node c from t to the segments on both sides into W.cavity: (m, right, left).

    right, left : the triangles' local edges at the ends, coded 3 t + i. m = 0 when there are too many.
    """
    for _ in range(LIMIT):
        i = local(S, t, c)
        u = S.nbr[t, (i + 2) % 3]
        if u < 0:
            break
        t = u
    right = 3 * t + (local(S, t, c) + 2) % 3
    m = 0
    while m < LIMIT - 6:
        W.cavity[m] = t
        m += 1
        i = local(S, t, c)
        u = S.nbr[t, (i + 1) % 3]
        if u < 0:
            return m, right, 3 * t + (i + 1) % 3
        t = u
    return 0, right, right


@inner
def edge_length(S, e):
    """Length of half-edge e = 3 t + i."""
    a, b = S.tri[e // 3, (e % 3 + 1) % 3], S.tri[e // 3, (e % 3 + 2) % 3]
    return math.hypot(S.points[a, 0] - S.points[b, 0], S.points[a, 1] - S.points[b, 1])


@inner
def even_legs(S, W, t, c):
    """Split the longer segment at corner c where the shorter ends; whether it was split."""
    m, right, left = corner_fan(S, W, t, c)
    if m == 0:
        return False
    p, q = edge_length(S, right), edge_length(S, left)
    if max(p, q) < LEGS * min(p, q):
        return False
    e = right if p > q else left
    share = q / p if p > q else 1.0 - p / q
    t, i = e // 3, e % 3
    return split_at(S, W, m, t, i, share)


@inner
def split_at(S, W, m, t, i, share):
    """Split the segment at edge i of t at a share of its length, refill the cavity of m triangles; whether done."""
    s = -1 - S.nbr[t, i]
    if S.mode[s] > 1:
        return False
    done, starred = replace(S, W, m, PROGRAMME, ANY, S.tri[t, (i + 1) % 3], s, share, -1)
    return done


@inner
def split_edge_of(S, W, t, i):
    """Split the segment at edge i of triangle t in the middle, in a shell around a sharp end; whether done."""
    a, b = S.tri[t, (i + 1) % 3], S.tri[t, (i + 2) % 3]
    share = 0.5
    if (S.sharp[a] > 0) != (S.sharp[b] > 0):
        length = edge_length(S, 3 * t + i)
        shell = 2.0 ** math.floor(math.log2(length) - 0.4)
        share = shell / length if S.sharp[a] > 0 else 1.0 - shell / length
    W.cavity[0] = t
    if split_at(S, W, 1, t, i, share):
        return True
    m = 1
    W.cavity[0] = t
    for j in range(3):
        if S.nbr[t, j] >= 0:
            W.cavity[m] = S.nbr[t, j]
            m += 1
    return split_at(S, W, m, t, i, share)


@inner
def off_centre(S, t):
    """Where a node makes a good triangle on the shortest edge of t, no further than the circle's centre."""
    best, at = 1e300, 0
    for i in range(3):
        length = edge_length(S, 3 * t + i)
        if length < best:
            best, at = length, i
    a, b = S.tri[t, (at + 1) % 3], S.tri[t, (at + 2) % 3]
    ax, ay, bx, by = S.points[a, 0], S.points[a, 1], S.points[b, 0], S.points[b, 1]
    mx, my = 0.5 * (ax + bx), 0.5 * (ay + by)
    nx, ny = (ay - by) / best, (bx - ax) / best
    cx, cy, square = circle(S, t)
    d = 0.5 * best / APEX
    if square < math.inf:
        d = min(d, (cx - mx) * nx + (cy - my) * ny)
    return mx + d * nx, my + d * ny


@inner
def encroached(S, W, k, x, y):
    """Half-edge of a segment of the k triangles W.cavity whose diametral circle holds (x, y), or -1."""
    for q in range(k):
        t = W.cavity[q]
        for i in range(3):
            if S.nbr[t, i] >= 0:
                continue
            a, b = S.tri[t, (i + 1) % 3], S.tri[t, (i + 2) % 3]
            dot = (S.points[a, 0] - x) * (S.points[b, 0] - x) + (S.points[a, 1] - y) * (S.points[b, 1] - y)
            if dot < 0.0:
                return 3 * t + i
    return -1


@inner
def blocking_edge(S, t, s):
    """Half-edge of triangle t that is segment s."""
    for i in range(3):
        if S.nbr[t, i] == -1 - s:
            return 3 * t + i
    return -1


@inner
def rescue_triangle(S, W, t):
    """One step of refinement at flawed triangle t; whether anything was done. New triangles are queued."""
    for i in range(3):
        c = S.tri[t, i]
        if S.sharp[c] > 0 and even_legs(S, W, t, c):
            return True
    x, y = off_centre(S, t)
    at, report = locate(S.points, S.tri, S.nbr, t, x, y, 100)
    if report > 0:
        return False
    e = -1
    if report < 0:
        e = blocking_edge(S, at, -1 - report)
    else:
        k = conflicts(S, W, at, x, y)
        e = encroached(S, W, k, x, y)
    if e >= 0:
        return split_edge_of(S, W, e // 3, e % 3)
    a, b, c = S.tri[at, 0], S.tri[at, 1], S.tri[at, 2]
    v = insert_point(S, at, x, y, (S.size[a] + S.size[b] + S.size[c]) / 3.0)
    queue_star(S, v)
    return True


@inner
def queue_star(S, v):
    """Queue the flawed triangles around interior node v."""
    first = t = S.tri_of[v]
    while True:
        if is_flawed(S, t):
            keep(S, t)
        t = S.nbr[t, (local(S, t, v) + 1) % 3]
        if t == first or t < 0:
            return


@kernel
def rescue(S, W, limit):
    """Refine at the queued flawed triangles, first in first out, at most ``limit`` steps. Returns a status."""
    S, W = state_of(S), work_of(W)
    head = steps = 0
    while head < S.counts[QUEUED] and steps < limit:
        t = S.queue[head]
        head += 1
        if S.tri[t, 0] < 0 or not is_flawed(S, t):
            continue
        if not room(S) or S.counts[QUEUED] > S.queue.shape[0] - 100:
            return FULL
        if rescue_triangle(S, W, t):
            S.counts[REFINEMENT] += 1
            steps += 1
            if S.tri[t, 0] >= 0 and is_flawed(S, t):
                keep(S, t)
    return DONE if steps > 0 else STUCK
