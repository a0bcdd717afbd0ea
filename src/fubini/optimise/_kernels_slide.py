"""Nodes of the boundary that move along their curve: where they may go, and how far.

A node slides where it lies inside one curve of this face alone, between two segments that may change, and not as the
leg of a sharp corner, whose two legs are equal for a reason.
"""

from __future__ import annotations

from fubini._jit import inner
from fubini.tracks._kernels import evaluate_one

#: a node stays this share of the way to its neighbours from them, in the parameter
MARGIN = 0.1
#: no segment becomes longer than this times the size wanted at the node that slides, unless it was
LONGEST = 1.35


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
def newton_along(S, W, k, r, s, slopes):
    """Newton's step for the node of the loaded fan along its curve: (change of the parameter, fall to expect twice).

    slopes : the fall (x, y) of a cost with its place and its second derivatives (xx, xy, yy), none negative along
    the curve. The curve is taken for the line between the neighbours.
    """
    gx, gy, hxx, hxy, hyy = slopes
    ex, ey = W.rx[0] - W.rx[k], W.ry[0] - W.ry[k]
    g, h = gx * ex + gy * ey, hxx * ex * ex + 2.0 * hxy * ex * ey + hyy * ey * ey
    if h <= 0.0:
        return 0.0, 0.0
    return g / h * (S.t[r, 1] - S.t[s, 0]), g * g / h


@inner
def place_along(S, W, v, k, r, s, step):
    """Whether node v may slide by ``step`` in the parameter, and where that takes it: (may, parameter, x, y)."""
    low, high = S.t[s, 0], S.t[r, 1]
    t = S.t[s, 1] + step
    if min(t - low, high - t) < MARGIN * (high - low):
        return False, t, 0.0, 0.0
    x, y = evaluate_one(S.track_kinds, S.track_offsets, S.track_data, int(S.track[s]), t)
    dx, dy = x - S.points[v, 0], y - S.points[v, 1]
    most = LONGEST * S.size[v]
    most = max(most * most, max(W.rx[0] ** 2 + W.ry[0] ** 2, W.rx[k] ** 2 + W.ry[k] ** 2))
    longer = max((W.rx[0] - dx) ** 2 + (W.ry[0] - dy) ** 2, (W.rx[k] - dx) ** 2 + (W.ry[k] - dy) ** 2)
    return longer <= most, t, x, y


@inner
def put_along(S, v, r, s, t, x, y):
    """Move node v to (x, y), the point of parameter t of the track of its segments s and r."""
    S.points[v, 0], S.points[v, 1] = x, y
    S.t[s, 1] = S.t[r, 0] = t
