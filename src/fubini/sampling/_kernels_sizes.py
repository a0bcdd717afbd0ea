"""Compiled tables of the size along edges: graded, lowered. They are sampled from the curves by ``_kernels_samples``.

Samples of all edges lie in one pool: rows ``span[e, 0] .. span[e, 1] - 1`` are those of edge e and hold the parameter
``t``, the arc length ``s`` and the wanted size ``h``; between samples ``h`` is linear in ``s``. A table that changes is
written anew behind all others. Where tables lie one behind the other, ``first[e] .. first[e + 1]`` delimits them.
"""

from __future__ import annotations

import numpy as np

from fubini._jit import inner, kernel

#: A size is lowered where less than this share of the present one is asked for.
LOWER = 0.999
#: Tables of more rows than this do without those that tell nothing: each round would add all its nodes.
MANY_ROWS = 4096


@inner(allocates=True)
def gathered(span, t, s, h):
    """The tables one behind the other: ``first`` (e + 1,), t, s, h."""
    edges, n = span.shape[0], 0
    first = np.empty(edges + 1, np.int64)
    for e in range(edges):
        first[e] = n
        n += span[e, 1] - span[e, 0]
    first[edges] = n
    out_t, out_s, out_h = np.empty(n), np.empty(n), np.empty(n)
    for e in range(edges):
        ahead = first[e] - span[e, 0]
        for i in range(span[e, 0], span[e, 1]):
            out_t[ahead + i], out_s[ahead + i], out_h[ahead + i] = t[i], s[i], h[i]
    return first, out_t, out_s, out_h


@inner
def relax_edge(s, h, a, b, g):
    """Limit the growth of h along s to g from sample a to b, in place."""
    for i in range(a + 1, b + 1):
        h[i] = min(h[i], h[i - 1] + g * (s[i] - s[i - 1]))
    for i in range(b - 1, a - 1, -1):
        h[i] = min(h[i], h[i + 1] + g * (s[i + 1] - s[i]))


@inner
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
            relax_edge(s, h, a, b, g)
            for i in range(2):
                v = ends[e, i]
                at = a if i == 0 else b
                if radius[e, i] == 0.0 and h[at] < vertex_size[v]:
                    vertex_size[v] = h[at]
                    changed = True
        if not changed:
            return sweep
    return 100


@kernel(allocates=True)
def shorten_legs(span, t, s, h, ends, radius, vertex_size, vertex_leg, g, longest):
    """Shorten the protected lengths ``radius`` (e, 2) to fit the graded sizes, in place: see ``grade``."""
    first, _, along, sizes = gathered(span, t, s, h)
    grade(first, along, sizes, ends, radius, vertex_size, vertex_leg, g, longest)


@inner
def between(x, x0, x1, y0, y1):
    """Value at x of the line from (x0, y0) to (x1, y1)."""
    if x == x1:
        return y1
    return (y1 - y0) / (x1 - x0) * (x - x0) + y0


@inner
def asked(want, size, v):
    """Size wanted at node v; infinite where that is no less than what it has: it asks for nothing."""
    return want[v] if want[v] < LOWER * size[v] else np.inf


@inner
def gather_nodes(segments, params, low, high, size, want, foot, foot_want, node, value):
    """Places on one edge, ascending, and the sizes asked there, from its segments low .. high - 1; their number.

    Every segment gives its ends and, between them, its foot. Of sizes in one place the least counts.
    """
    forward = params[low, 0] < params[low, 1]
    n = 0
    for q in range(high - low):
        k = low + q if forward else high - 1 - q
        near, far = (0, 1) if forward else (1, 0)
        f = min(params[k, far], max(params[k, near], params[k, 0] + foot[k] * (params[k, 1] - params[k, 0])))
        for place in range(3):
            if place == 1:
                at = f
                present = foot[k] * size[segments[k, 1]] + (1.0 - foot[k]) * size[segments[k, 0]]
                least = foot_want[k] if foot_want[k] < LOWER * present else np.inf
            else:
                side = near if place == 0 else far
                at, least = params[k, side], asked(want, size, segments[k, side])
            if n > 0 and node[n - 1] == at:
                value[n - 1] = min(value[n - 1], least)
            else:
                node[n], value[n] = at, least
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


@inner
def lower_edge(t, s, h, a, b, node, value, n, fill):
    """Write the table of samples a .. b, lowered to the sizes ``value`` at places ``node`` (n,), to rows from ``fill``.

    In a long table, places between samples get no row where they and their neighbours keep their sizes. Returns the row
    behind it, and whether a size fell.
    """
    fell, thin = False, b - a + n > MANY_ROWS
    m, i, q, before = fill, a, 0, -1.0
    spare = untouched = False  # whether the last row tells nothing if the next keeps its size; whether it keeps its own
    while i <= b or q < n:
        at = min(t[i] if i <= b else 2.0, node[q] if q < n else 2.0)
        left = min(max(a, i if i <= b and t[i] == at else i - 1), b - 1)
        along = between(at, t[left], t[left + 1], s[left], s[left + 1])
        size = between(along, s[left], s[left + 1], h[left], h[left + 1])
        near = min(max(0, q if q < n and node[q] == at else q - 1), n - 2)
        wanted = between(at, node[near], node[near + 1], value[near], value[near + 1])
        if m == fill or along - before > 1e-14 * s[b]:
            kept, own = wanted > (1.0 - 1e-9) * size, i <= b and t[i] == at
            if thin and spare and kept:
                m -= 1
            t[m], s[m], h[m] = at, along, min(size, wanted)
            fell |= h[m] < LOWER * size
            spare, untouched = kept and untouched and not own, kept
            m += 1
        before = along
        i += 1 if i <= b and t[i] == at else 0
        q += 1 if q < n and node[q] == at else 0
    return m, fell


@inner
def too_large(segments, size, want, foot, foot_want, threshold, k):
    """Whether at segment k less is wanted than ``threshold`` times what there is."""
    a, b = segments[k, 0], segments[k, 1]
    present = foot[k] * size[b] + (1.0 - foot[k]) * size[a]
    return want[a] < threshold * size[a] or want[b] < threshold * size[b] or foot_want[k] < threshold * present


@inner(allocates=True)
def lower_face(
    edges, segments, track, params, size, want, foot, foot_want, threshold, span, t, s, h, fill, changed
):  # fmt: skip
    """Lower the tables of the curves of a face that have a segment too large, to all that is wanted on them.

    ``want`` (n,) at the nodes, ``foot_want`` (k,) at the share ``foot`` (k,) of each segment; where nothing is asked
    the present size keeps what is asked elsewhere from spreading. ``changed`` (e,) becomes 1 where a size fell. Returns
    the number of rows of the pool in use, and how many are missing for the rest.
    """
    count = track.shape[0]
    node, value = np.empty(3 * count + 1), np.empty(3 * count + 1)
    low = 0
    while low < count:
        high, some = low, False
        while high < count and track[high] == track[low]:
            some = some or too_large(segments, size, want, foot, foot_want, threshold, high)
            high += 1
        if some:
            e = edges[track[low]]
            a, b = span[e, 0], span[e, 1] - 1
            missing = fill + (b - a) + 1 + 3 * (high - low) - t.shape[0]
            if missing > 0:
                return fill, missing
            n = gather_nodes(segments, params, low, high, size, want, foot, foot_want, node, value)
            fill_free(t, s, h, a, b, node, value, n)
            end, fell = lower_edge(t, s, h, a, b, node, value, n, fill)
            if fell:
                span[e, 0], span[e, 1], changed[e] = fill, end, 1
                fill = end
        low = high
    return fill, 0


@kernel(allocates=True)
def lower_tables(
    edges, segments, track, params, size, want, foot, foot_want, threshold, span, t, s, h, fill, changed
):  # fmt: skip
    """``lower_face`` for Python."""
    return lower_face(
        edges, segments, track, params, size, want, foot, foot_want, threshold, span, t, s, h, fill, changed
    )  # fmt: skip
