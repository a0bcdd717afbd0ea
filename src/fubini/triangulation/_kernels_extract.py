"""The region that segments enclose, cut out of a triangulation of the plane."""

from __future__ import annotations

import numpy as np

from fubini._jit import inner

#: Ways in which segments fail to enclose a region, as bits.
LEAKED, CONTRADICTED = 1, 2


@inner(allocates=True)
def flood(triangles, neighbours, half_edge, count, n):
    """Number the triangles on the left of the segments; returns number (count,), how many, and LEAKED or 0.

    Stops at cut edges and at triangles that have a far corner (ranks from n on). Numbers follow the slots; others
    have -1. A segment with a far triangle on its left leaks.
    """
    leaked = 0
    number = np.empty(count, np.int32)
    for t in range(count):
        far = triangles[t, 0] >= n or triangles[t, 1] >= n or triangles[t, 2] >= n
        number[t] = -2 if far else -1
    stack = np.empty(count, np.int32)
    for s in range(half_edge.shape[0]):
        if half_edge[s] < 0:
            continue
        t = half_edge[s] // 3
        if number[t] == -2:
            leaked = LEAKED
        if number[t] != -1:
            continue
        stack[0], number[t] = t, 0
        waiting = 1
        while waiting > 0:
            waiting -= 1
            t = np.int64(stack[waiting])
            for i in range(3):
                u = neighbours[t, i]
                if u >= 0 and number[u] == -1:
                    stack[waiting], number[u] = u, 0
                    waiting += 1
    kept = 0
    for t in range(count):
        if number[t] == 0:
            number[t] = kept
            kept += 1
        else:
            number[t] = -1
    return number, kept, leaked


@inner(allocates=True)
def compact(triangles, neighbours, number, kept, order, k):
    """The kept triangles with points by index: triangles (m, 3), neighbours (m, 3), status bits.

    An edge without a segment towards a triangle that is not kept gets ``-1 - k`` (LEAKED); one on the right
    of a segment whose left lies outside gets that segment's code (CONTRADICTED).
    """
    out, across = np.empty((kept, 3), np.int32), np.empty((kept, 3), np.int32)
    leaked, contradicted = 0, 0
    for t in range(number.shape[0]):
        m = number[t]
        if m < 0:
            continue
        for i in range(3):
            out[m, i] = order[triangles[t, i]]
            u = neighbours[t, i]
            if u >= 0:
                u = number[u]
                if u < 0:
                    u = -1 - k
                    leaked = LEAKED
            elif u < -k:
                u += k
                contradicted = CONTRADICTED
            across[m, i] = u
    return out, across, leaked | contradicted


@inner(allocates=True)
def drop_unused(triangles, n, fixed):
    """Renumber vertices of triangles in place without the unused ones from ``fixed`` on; returns those."""
    number = np.empty(n, np.int32)
    for v in range(n):
        number[v] = 0
    for t in range(triangles.shape[0]):
        for i in range(3):
            number[triangles[t, i]] = 1
    used = fixed
    for v in range(fixed, n):
        used += number[v]
    dropped = np.empty(n - used, np.int32)
    if used == n:
        return dropped
    count = 0
    for v in range(n):
        if v >= fixed and number[v] == 0:
            dropped[count] = v
            count += 1
        number[v] = v - count
    for t in range(triangles.shape[0]):
        for i in range(3):
            triangles[t, i] = number[triangles[t, i]]
    return dropped


@inner(allocates=True)
def extract(triangles, neighbours, half_edge, order, fixed):
    """The region on the left of the segments, by index, of a triangulation whose segments were cut.

    fixed : the first so many points stay even where no triangle uses them. Returns triangles (m, 3),
    neighbours (m, 3), dropped (d,) indices of points left out, and status bits (LEAKED, CONTRADICTED).
    """
    n = order.shape[0]
    number, kept, leaked = flood(triangles, neighbours, half_edge, triangles.shape[0], n)
    out, across, status = compact(triangles, neighbours, number, kept, order, half_edge.shape[0])
    return out, across, drop_unused(out, n, fixed), leaked | status
