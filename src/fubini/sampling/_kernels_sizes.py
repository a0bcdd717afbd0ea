"""Compiled tables of the size along edges: sampled from the curves, graded, lowered.

Edges are stored flat: samples ``first[e] .. first[e + 1]`` of edge e hold the parameter ``t``, the
arc length ``s`` and the wanted size ``h`` there; between samples ``h`` is linear in ``s``.
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel
from fubini.tracks._kernels import evaluate_one


@inner
def turning_sizes(x, y, s, turn, a, n, angle, out):
    """Size at the samples a .. a + n - 1 of a polyline x, y with arc lengths s: it turns by ``turn`` radians there.

    The narrowest window about the sample over which the tangent turns by ``turn`` is the size; an
    isolated kink that turns by less does not call for small elements, however small its radius.
    Writes into out; ``angle`` is scratch space.
    """
    previous = math.atan2(y[a + 1] - y[a], x[a + 1] - x[a])
    total = 0.0
    angle[a] = 0.0
    for i in range(a + 1, a + n):
        d = math.atan2(y[i] - y[i - 1], x[i] - x[i - 1])
        step = d - previous
        if step > math.pi:
            step -= 2.0 * math.pi
        elif step < -math.pi:
            step += 2.0 * math.pi
        previous = d
        total += abs(step)
        angle[i] = total
    low = a
    for i in range(a, a + n):
        out[i] = np.inf
    for high in range(a + 1, a + n):
        while angle[high] - angle[low] >= turn:
            window = s[high] - s[low]
            for i in range(low, high + 1):
                if window < out[i]:
                    out[i] = window
            low += 1


@kernel(allocates=True)
def sample_tracks(kinds, offsets, data, which, count, turn, most, pieces):
    """Tables (first, t, s, h) of the tracks ``which`` (e,), each sampled at ``count`` (e,) even parameters.

    Samples that do not get ahead are left out. ``h`` is the size bound by the turning of the curve, by ``most`` (e,)
    and by the length over ``pieces`` (e,).
    """
    edges, room = which.shape[0], 0
    for e in range(edges):
        room += count[e]
    first = np.empty(edges + 1, np.int64)
    t, s, h = np.empty(room), np.empty(room), np.empty(room)
    x, y, angle = np.empty(room), np.empty(room), np.empty(room)
    n = 0
    for e in range(edges):
        first[e] = n
        step, length = 1.0 / (count[e] - 1), 0.0
        last_x = last_y = 0.0
        for i in range(count[e]):
            at = 1.0 if i == count[e] - 1 else i * step
            px, py = evaluate_one(kinds, offsets, data, which[e], at)
            ahead = math.hypot(px - last_x, py - last_y) if i > 0 else 0.0
            last_x, last_y = px, py
            longer = length + ahead
            if i == 0 or longer > length:
                t[n], s[n], x[n], y[n], h[n] = at, longer, px, py, np.inf
                n += 1
            length = longer
        if kinds[which[e]] != 0:
            turning_sizes(x, y, s, turn, first[e], n - first[e], angle, h)
        bound = min(most[e], length / pieces[e])
        for i in range(first[e], n):
            h[i] = min(h[i], bound)
    first[edges] = n
    return first, t[:n], s[:n], h[:n]


@kernel
def relax_edge(s, h, g):
    """Limit the growth of h (n,) along s (n,) to g, in place."""
    n = s.shape[0]
    for i in range(1, n):
        h[i] = min(h[i], h[i - 1] + g * (s[i] - s[i - 1]))
    for i in range(n - 2, -1, -1):
        h[i] = min(h[i], h[i + 1] + g * (s[i + 1] - s[i]))


@kernel
def grade(first, s, h, ends, radius, vertex_size, vertex_leg, g, longest):
    """Limit the growth of sizes along all edges and through the vertices that they share.

    ends (e, 2): vertices; radius (e, 2): protected length at each end, 0 for none. All protected ends at a
    vertex get one length ``vertex_leg`` (v,), at most ``longest`` (v,) times the size of the vertex, which is at
    most that length. The sizes along a protected edge do not act on its vertex: just after a long leg into a
    cusp they are tiny. Seen round other edges they ask for g times the leg and more, so that with ``longest``
    1/g a leg never shortens itself.
    ``h``, ``radius``, ``vertex_size`` (v,) and ``vertex_leg`` change in place. Returns the number of sweeps.
    """
    edges = first.shape[0] - 1
    for sweep in range(100):
        changed = False
        for e in range(edges):
            a, b = first[e], first[e + 1] - 1
            for i in range(2):
                v = ends[e, i]
                at = a if i == 0 else b
                if radius[e, i] > 0.0:
                    leg = min(radius[e, i], vertex_leg[v], longest[v] * vertex_size[v])
                    if leg < radius[e, i] or leg < vertex_leg[v] or leg < vertex_size[v]:
                        radius[e, i] = leg
                        vertex_leg[v] = leg
                        vertex_size[v] = min(vertex_size[v], leg)
                        changed = True
                elif h[at] > vertex_size[v]:
                    h[at] = vertex_size[v]
            relax_edge(s[a : b + 1], h[a : b + 1], g)
            for i in range(2):
                v = ends[e, i]
                at = a if i == 0 else b
                if radius[e, i] == 0.0 and h[at] < vertex_size[v]:
                    vertex_size[v] = h[at]
                    changed = True
        if not changed:
            return sweep
    return 100


@inner
def between(x, x0, x1, y0, y1):
    """Value at x of the line from (x0, y0) to (x1, y1)."""
    if x == x1:
        return y1
    return (y1 - y0) / (x1 - x0) * (x - x0) + y0


@inner
def gather_nodes(params, low, high, start_want, end_want, foot, foot_want, node, value):
    """Places on one edge, ascending, and the sizes asked there, from its segments low .. high - 1; their number.

    Every segment gives its ends and, between them, its foot. Of sizes in one place the least counts.
    """
    forward = params[low, 0] < params[low, 1]
    n = 0
    for q in range(high - low):
        k = low + q if forward else high - 1 - q
        a, b = (params[k, 0], params[k, 1]) if forward else (params[k, 1], params[k, 0])
        wa, wb = (start_want[k], end_want[k]) if forward else (end_want[k], start_want[k])
        f = min(b, max(a, params[k, 0] + foot[k] * (params[k, 1] - params[k, 0])))
        for place in range(3):
            at, want = (a, wa) if place == 0 else ((f, foot_want[k]) if place == 1 else (b, wb))
            if n > 0 and node[n - 1] == at:
                value[n - 1] = min(value[n - 1], want)
            else:
                node[n], value[n] = at, want
                n += 1
    return n


@inner
def fill_free(t, s, h, a, b, node, value, n):
    """Sizes of the present table (samples a .. b) in the places where none is asked (infinite)."""
    i = a
    for q in range(n):
        while i < b - 1 and t[i + 1] <= node[q]:
            i += 1
        if value[q] == np.inf:
            at = between(node[q], t[i], t[i + 1], s[i], s[i + 1])
            j = i
            while j < b - 1 and s[j + 1] <= at:
                j += 1
            value[q] = between(at, s[j], s[j + 1], h[j], h[j + 1])


@kernel(allocates=True)
def lower_tables(first, t, s, h, seg_first, params, start_want, end_want, foot, foot_want):
    """Lower the tables of edges to the sizes asked at the nodes and feet of their segments.

    Table and segments of edge e are ``first[e] ..`` and ``seg_first[e] ..``; an infinite size asks for nothing: it
    keeps what is asked elsewhere from spreading. Returns new first, t, s, h, and changed (e,), 0 where no size fell.
    """
    edges = first.shape[0] - 1
    room = t.shape[0] + 3 * foot.shape[0]
    new_first, changed = np.empty(edges + 1, np.int64), np.empty(edges, np.uint8)
    out_t, out_s, out_h = np.empty(room), np.empty(room), np.empty(room)
    node, value = np.empty(3 * foot.shape[0] + 1), np.empty(3 * foot.shape[0] + 1)
    m = 0
    for e in range(edges):
        new_first[e], changed[e] = m, 0
        a, b = first[e], first[e + 1] - 1
        n = gather_nodes(params, seg_first[e], seg_first[e + 1], start_want, end_want, foot, foot_want, node, value)
        fill_free(t, s, h, a, b, node, value, n)
        i, q, before = a, 0, -1.0
        while i <= b or q < n:
            at = min(t[i] if i <= b else 2.0, node[q] if q < n else 2.0)
            left = min(max(a, i if i <= b and t[i] == at else i - 1), b - 1)
            along = between(at, t[left], t[left + 1], s[left], s[left + 1])
            size = between(along, s[left], s[left + 1], h[left], h[left + 1])
            near = min(max(0, q if q < n and node[q] == at else q - 1), n - 2)
            asked = between(at, node[near], node[near + 1], value[near], value[near + 1])
            if m == new_first[e] or along - before > 1e-14 * s[b]:
                out_t[m], out_s[m], out_h[m] = at, along, min(size, asked)
                if out_h[m] < 0.999 * size:
                    changed[e] = 1
                m += 1
            before = along
            i += 1 if i <= b and t[i] == at else 0
            q += 1 if q < n and node[q] == at else 0
    new_first[edges] = m
    return new_first, out_t[:m], out_s[:m], out_h[:m], changed
