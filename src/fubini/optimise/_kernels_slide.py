"""Nodes of the boundary that move along their curve: where they may go, and how far.

A node slides where it lies inside one curve of this face alone, between two segments that may change, and not as the
leg of a sharp corner, whose two legs are equal for a reason.
"""

from __future__ import annotations

import numpy as np

from fubini._jit import inner
from fubini.optimise._kernels_state import TRIANGLES
from fubini.tracks._kernels import evaluate_one

#: a node stays this share of the way to its neighbours from them, in the parameter
MARGIN = 0.1
#: no segment becomes longer than this times the size wanted at the node that slides, unless it was
LONGEST = 1.35


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
def load_fan(S, W, v):
    """Nodes around boundary node v, from the next to the last on the boundary, into W.ring, with W.rx, W.ry from v.

    (k, r, s): k triangles between k + 1 nodes; segment r leaves v, segment s ends there. k = 0: too many.
    ``S.tri_of[v]`` becomes the first triangle.
    """
    t = int(S.tri_of[v])
    u, k = 0, 0
    while u >= 0 and k < W.ring.shape[0]:
        i = 1 + (S.tri[t, 1] == v) - (S.tri[t, 2] == v)
        u = int(S.nbr[t, i + 1 if i < 2 else 0])
        t, k = u if u >= 0 else t, k + 1
    if u >= 0:
        return 0, 0, 0
    S.tri_of[v] = t
    r, k = -1 - u, 0
    x, y = S.points[v, 0], S.points[v, 1]
    while k < W.ring.shape[0] - 1:
        i = 1 + (S.tri[t, 1] == v) - (S.tri[t, 2] == v)
        a, b = S.tri[t, i], S.tri[t, i + 1 if i < 2 else 0]
        W.ring[k], W.ring[k + 1] = a, b
        W.rx[k], W.ry[k] = S.points[a, 0] - x, S.points[a, 1] - y
        k += 1
        u = int(S.nbr[t, i])
        if u < 0:
            W.rx[k], W.ry[k] = S.points[b, 0] - x, S.points[b, 1] - y
            return k, r, -1 - u
        t = u
    return 0, 0, 0


@inner
def may_slide(S, r, s):
    """Whether the node between segments s and r may move along their common track."""
    free = S.mode[s] == 0 and S.mode[r] == 0
    return free and S.track[s] >= 0 and S.track[s] == S.track[r] and S.t[s, 1] == S.t[r, 0]


@inner
def rim_of(S, rim):
    """Neighbours on the boundary of every node v of it, and the segments there: rim[v] = next, to it, last, from it.

    The segments are -1 where the node may not slide, as the legs of a sharp corner; a node on no segment is its own
    neighbour.
    """
    for v in range(rim.shape[0]):
        rim[v, 0] = rim[v, 2] = v
        rim[v, 1] = rim[v, 3] = -1
    for t in range(S.counts[TRIANGLES]):
        for i in range(3):
            u = S.nbr[t, i]
            if u < 0:
                a, b = S.tri[t, i + 1 if i < 2 else 0], S.tri[t, i - 1 if i > 0 else 2]
                rim[a, 0], rim[a, 1], rim[b, 2], rim[b, 3] = b, -1 - u, a, -1 - u
    for v in range(rim.shape[0]):
        r, s = np.int64(rim[v, 1]), np.int64(rim[v, 3])
        if min(r, s) < 0 or S.kind[v] != 1 or not may_slide(S, r, s) or S.sharp[rim[v, 0]] + S.sharp[rim[v, 2]] > 0:
            rim[v, 1] = rim[v, 3] = -1


@inner
def newton_along(S, ends, r, s, slopes):
    """Newton's step for a node between segments s and r of a curve: (change of the parameter, fall to expect twice).

    ends : the next and the last node from it, x and y of both. slopes : the fall (x, y) of a cost with its place and
    its second derivatives (xx, xy, yy), none negative along the curve, which is taken for the line between the ends.
    """
    gx, gy, hxx, hxy, hyy = slopes
    ex, ey = ends[0] - ends[2], ends[1] - ends[3]
    g, h = gx * ex + gy * ey, hxx * ex * ex + 2.0 * hxy * ex * ey + hyy * ey * ey
    if h <= 0.0:
        return 0.0, 0.0
    return g / h * (S.t[r, 1] - S.t[s, 0]), g * g / h


@inner
def place_along(S, v, ends, r, s, step):
    """Whether node v may slide by ``step`` in the parameter, and where that takes it: (may, parameter, x, y)."""
    low, high = S.t[s, 0], S.t[r, 1]
    t = S.t[s, 1] + step
    if min(t - low, high - t) < MARGIN * (high - low):
        return False, t, 0.0, 0.0
    x, y = evaluate_one(S.track_kinds, S.track_offsets, S.track_data, int(S.track[s]), t)
    dx, dy = x - S.points[v, 0], y - S.points[v, 1]
    most = LONGEST * S.size[v]
    most = max(most * most, max(ends[0] ** 2 + ends[1] ** 2, ends[2] ** 2 + ends[3] ** 2))
    longer = max((ends[0] - dx) ** 2 + (ends[1] - dy) ** 2, (ends[2] - dx) ** 2 + (ends[3] - dy) ** 2)
    return longer <= most, t, x, y


@inner
def put_along(S, v, r, s, t, x, y):
    """Move node v to (x, y), the point of parameter t of the track of its segments s and r."""
    S.points[v, 0], S.points[v, 1] = x, y
    S.t[s, 1] = S.t[r, 0] = t
