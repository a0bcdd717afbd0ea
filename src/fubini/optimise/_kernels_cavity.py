"""The primitive of the optimiser: replace the triangles of a small cavity by better ones.

    collect  a cavity's triangles in ``W.cavity``
    load     its polygon: nodes, what lies across each edge, coordinates
    edit     split one boundary edge on its curve, or drop a boundary node      (optional)
    fill     by the best triangulation of the polygon, or by a star from one new point
    commit   when the cost falls far enough

Flip, insertion, deletion, collapse, split and removal are this with different cavities and edits.
"""

from __future__ import annotations

import math

from fubini._jit import inner
from fubini.optimise._kernels_fill import choose_fill
from fubini.optimise._kernels_quality import is_flawed, triangle_cost
from fubini.optimise._kernels_state import (
    ATTEMPTS,
    FREED,
    LIMIT,
    NODES,
    QUEUED,
    REMOVED,
    SAG,
    SEGMENTS,
    STAMP,
    STRETCH,
    TRIANGLES,
)
from fubini.tracks._kernels import evaluate_one
from fubini.triangulation._kernels_topology import around


@inner
def local(S, t, v):
    """Local number of node v in triangle t."""
    if S.tri[t, 0] == v:
        return 0
    return 1 if S.tri[t, 1] == v else 2


@inner
def star(S, W, v):
    """Triangles around node v, counter-clockwise, into W.fan and the nodes around it into W.ring.

    Returns (k, closed): k triangles; the ring has k nodes, k + 1 where v lies on the boundary.
    k = -1 when there are too many. Only for nodes that the boundary passes at most once.
    """
    first = t = int(S.tri_of[v])
    steps = 0
    while True:
        steps += 1
        u = int(S.nbr[t, (local(S, t, v) + 2) % 3])
        if u < 0:
            break
        t = u
        if t == first:
            break
        if steps > 4 * LIMIT:
            return -1, True
    return around(S.tri, S.nbr, t, v, LIMIT - 4, W.fan, W.ring)


@inner
def loose_edges(S, W, m):
    """Edges of the cavity's border into W.ea (start), W.eb (end), W.ec (what lies across); their number."""
    S.counts[STAMP] += 1
    stamp = S.counts[STAMP]
    for q in range(m):
        S.mark[W.cavity[q]] = stamp
    n = 0
    for q in range(m):
        t = W.cavity[q]
        for i in range(3):
            u = S.nbr[t, i]
            if u >= 0 and S.mark[u] == stamp:
                continue
            if n >= LIMIT - 4:
                return -1
            W.ea[n] = S.tri[t, (i + 1) % 3]
            W.eb[n] = S.tri[t, (i + 2) % 3]
            W.ec[n] = u
            n += 1
    return n


@inner
def chain_edges(W, n):
    """Order the loose edges into the polygon W.poly, W.code; False when it is not one simple loop."""
    at = 0
    for z in range(n):
        W.poly[z] = W.ea[at]
        W.code[z] = W.ec[at]
        node = W.eb[at]
        following = -1
        for e in range(n):
            if W.ea[e] == node:
                if following >= 0:
                    return False
                following = e
        if following < 0 or (following == 0 and z != n - 1):
            return False
        at = following
    return at == 0


@inner
def inner_nodes(S, W, m, k):
    """Nodes inside the cavity into W.inner; their number, or -1 when one of them must stay."""
    if k == m + 2:
        return 0
    n = 0
    for q in range(m):
        for i in range(3):
            v = int(S.tri[W.cavity[q], i])
            known = False
            for z in range(k):
                known = known or W.poly[z] == v
            for z in range(n):
                known = known or W.inner[z] == v
            if known:
                continue
            if S.kind[v] != 0:
                return -1
            W.inner[n] = v
            n += 1
    return n


@inner
def place_polygon(S, W, k):
    """Coordinates of the polygon relative to its first node, and its unavoidable corners."""
    ox, oy = S.points[W.poly[0], 0], S.points[W.poly[0], 1]
    for z in range(k):
        v = W.poly[z]
        W.px[z] = S.points[v, 0] - ox
        W.py[z] = S.points[v, 1] - oy
        before = W.code[z - 1] if z > 0 else W.code[k - 1]
        W.ear[z] = S.sharp[v] if W.code[z] < 0 and before < 0 else 0


@inner
def segment_middle(S, s, a, b, share):
    """Parameter and point on segment s (nodes a, b) that splits its chord lengths as share : 1 - share."""
    t0, t1 = S.t[s, 0], S.t[s, 1]
    ax, ay, bx, by = S.points[a, 0], S.points[a, 1], S.points[b, 0], S.points[b, 1]
    track = int(S.track[s])
    if track < 0:
        return t0 + share * (t1 - t0), ax + share * (bx - ax), ay + share * (by - ay)
    low, high = 0.0, 1.0
    middle = share
    x = y = 0.0
    for _ in range(12):
        x, y = evaluate_one(S.track_kinds, S.track_offsets, S.track_data, track, t0 + middle * (t1 - t0))
        p, q = math.hypot(x - ax, y - ay), math.hypot(x - bx, y - by)
        g = p / (p + q)
        if abs(g - share) < 1e-3:
            break
        if g < share:
            low = middle
        else:
            high = middle
        middle = 0.5 * (low + high)
    t = t0 + middle * (t1 - t0)
    x, y = evaluate_one(S.track_kinds, S.track_offsets, S.track_data, track, t)
    return t, x, y


@inner
def split_edge(S, W, k, a, s, share):
    """Edit the polygon: a new corner on segment s, whose edge starts at node a. (k, corner, t) or corner -1."""
    at = -1
    for z in range(k):
        if W.code[z] == -1 - s and W.poly[z] == a:
            at = z
    if at < 0 or S.mode[s] > 1:
        return k, -1, 0.0
    t, x, y = segment_middle(S, s, a, W.poly[(at + 1) % k], share)
    for z in range(k, at + 1, -1):
        W.poly[z], W.code[z] = W.poly[z - 1], W.code[z - 1]
        W.px[z], W.py[z], W.ear[z] = W.px[z - 1], W.py[z - 1], W.ear[z - 1]
    c = at + 1
    W.poly[c], W.code[c], W.ear[c] = -1, -1 - s, 0
    W.px[c] = x - S.points[W.poly[0], 0]
    W.py[c] = y - S.points[W.poly[0], 1]
    return k + 1, c, t


@inner
def may_merge(S, a, v, b, s, r):
    """Whether node v between segments s = (a, v) and r = (v, b) may go."""
    if S.kind[v] != 1 or S.mode[s] != 0 or S.mode[r] != 0 or S.track[s] < 0 or S.track[s] != S.track[r]:
        return False
    if S.t[s, 1] != S.t[r, 0] or a == b:
        return False
    p = S.points
    ex, ey = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1]
    length = math.sqrt(ex * ex + ey * ey)
    sag = abs(ex * (p[v, 1] - p[a, 1]) - ey * (p[v, 0] - p[a, 0])) / (length + 1e-300)
    if length > S.rule[STRETCH] * S.size[v] or S.size[v] <= 0.0:
        return False
    return sag <= max(1e-9 * length, S.rule[SAG] * length)


@inner
def drop_corner(S, W, k, v):
    """Edit the polygon: boundary node v goes. (k, s, r) with its segments before and after, or s = -1."""
    at = -1
    for z in range(k):
        if W.poly[z] == v:
            at = z
    if at < 0 or k < 4:
        return k, -1, -1
    before = at - 1 if at > 0 else k - 1
    if W.code[at] >= 0 or W.code[before] >= 0:
        return k, -1, -1
    s, r = -1 - W.code[before], -1 - W.code[at]
    if not may_merge(S, W.poly[before], v, W.poly[(at + 1) % k], s, r):
        return k, -1, -1
    for z in range(at, k - 1):
        W.poly[z], W.code[z] = W.poly[z + 1], W.code[z + 1]
    k -= 1
    place_polygon(S, W, k)
    return k, s, r


@inner
def new_node(S, x, y, kind, size):
    """Append a node; its number."""
    v = S.counts[NODES]
    S.counts[NODES] += 1
    S.points[v, 0], S.points[v, 1] = x, y
    S.kind[v], S.size[v], S.sharp[v] = kind, size, 0
    return v


@inner
def split_segment(S, s, v, t):
    """Cut segment s at node v of parameter t; the number of the second half."""
    r = S.counts[SEGMENTS]
    S.counts[SEGMENTS] += 1
    S.track[r], S.mode[r] = S.track[s], S.mode[s]
    S.t[r, 0], S.t[r, 1] = t, S.t[s, 1]
    S.t[s, 1] = t
    S.kind[v] = 1 if S.mode[s] == 0 and S.track[s] >= 0 else 3
    return r


@inner
def take_triangle(S, W, m, a):
    """Number for the a-th new triangle: of the cavity, of those removed, or a new one."""
    if a < m:
        return W.cavity[a]
    if S.counts[FREED] > 0:
        S.counts[FREED] -= 1
        return int(S.free[S.counts[FREED]])
    t = S.counts[TRIANGLES]
    S.counts[TRIANGLES] += 1
    return t


@inner
def link(S, W, k, n):
    """Neighbours of the n new triangles W.fan with local corners W.fill over a polygon of k corners."""
    for a in range(n):
        t = W.fan[a]
        for i in range(3):
            p, q = W.fill[a, (i + 1) % 3], W.fill[a, (i + 2) % 3]
            if p < k and q == (p + 1) % k:
                u = W.code[p]
                S.nbr[t, i] = u
                if u >= 0:
                    for j in range(3):
                        if S.tri[u, (j + 1) % 3] == W.poly[q] and S.tri[u, (j + 2) % 3] == W.poly[p]:
                            S.nbr[u, j] = t
                continue
            for b in range(n):
                for j in range(3):
                    if W.fill[b, (j + 1) % 3] == q and W.fill[b, (j + 2) % 3] == p:
                        S.nbr[t, i] = W.fan[b]


@inner
def commit(S, W, m, k, n, inner):
    """Put the n triangles W.fill over polygon W.poly (k corners, then new points) for the m of the cavity."""
    for z in range(inner):
        S.kind[W.inner[z]] = REMOVED
    for a in range(n):
        W.fan[a] = take_triangle(S, W, m, a)
    for a in range(n, m):
        t = W.cavity[a]
        S.tri[t, 0] = -1
        S.free[S.counts[FREED]] = t
        S.counts[FREED] += 1
    for a in range(n):
        for i in range(3):
            v = W.poly[W.fill[a, i]]
            S.tri[W.fan[a], i] = v
            S.tri_of[v] = W.fan[a]
            S.moved[v] = S.counts[ATTEMPTS]
    link(S, W, k, n)
    for a in range(n):
        enqueue(S, W.fan[a])


@inner
def enqueue(S, t):
    """Note triangle t for another look when it is flawed."""
    if S.counts[QUEUED] < S.queue.shape[0] and is_flawed(S, t):
        S.queue[S.counts[QUEUED]] = t
        S.counts[QUEUED] += 1


@inner
def replace(S, W, m, mode, fall, split_at, segment, share, dropped):
    """Refill the cavity W.cavity[:m] when its cost falls by more than ``fall``; (done, star used).

    split_at, segment, share : split this segment, whose edge starts at node split_at, or -1.
    dropped : boundary node that goes, or -1.
    """
    k = loose_edges(S, W, m)
    if k < 3 or not chain_edges(W, k):
        return False, False
    inner = inner_nodes(S, W, m, k)
    if inner < 0:
        return False, False
    place_polygon(S, W, k)
    old = 0.0
    size = 0.0
    for q in range(m):
        old += triangle_cost(S, W.cavity[q])
    for z in range(k):
        size += S.size[W.poly[z]] / k
    corner, s, r, t = -1, -1, -1, 0.0
    ox, oy = S.points[W.poly[0], 0], S.points[W.poly[0], 1]
    if segment >= 0:
        k, corner, t = split_edge(S, W, k, split_at, segment, share)
        if corner < 0:
            return False, False
    if dropped >= 0:
        k, s, r = drop_corner(S, W, k, dropped)
        if s < 0:
            return False, False
        ox, oy = S.points[W.poly[0], 0], S.points[W.poly[0], 1]
    cost, n, x, y = choose_fill(S, W, k, mode, old - fall)
    if n == 0:
        return False, False
    apply_edits(S, W, k, corner, segment, t, ox, oy, size, s, r, dropped)
    if n == k:
        W.poly[k] = new_node(S, ox + x, oy + y, 0, size)
    commit(S, W, m, k, n, inner)
    return True, n == k


@inner
def apply_edits(S, W, k, corner, segment, t, ox, oy, size, s, r, dropped):
    """Make the split (corner >= 0) and the merge (dropped >= 0) real.

    The size at a new node is at most the longer part of its segment, so that no merge takes it back.
    """
    if corner >= 0:
        track = int(S.track[segment])
        x, y = ox + W.px[corner], oy + W.py[corner]
        if track >= 0:
            x, y = evaluate_one(S.track_kinds, S.track_offsets, S.track_data, track, t)
        reach = 0.0
        for e in (corner - 1, (corner + 1) % k):
            reach = max(reach, math.hypot(W.px[corner] - W.px[e], W.py[corner] - W.py[e]))
        W.poly[corner] = new_node(S, x, y, 1, min(size, reach))
        W.code[corner] = -1 - split_segment(S, segment, W.poly[corner], t)
    if dropped >= 0:
        S.t[s, 1] = S.t[r, 1]
        S.mode[r] = REMOVED
        S.kind[dropped] = REMOVED
