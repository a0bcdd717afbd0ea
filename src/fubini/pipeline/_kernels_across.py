"""Compiled part of ``across``: sizes of the triangles on both sides of every shared segment."""

from __future__ import annotations

import math

from fubini._jit import inner, kernel
from fubini.optimise._kernels_even import mean_length, squares


@inner
def size_and_shape(points, a, b, c):
    """Mean length of the edges of a triangle, and its shape, (Lmax^2 - Lmin^2) / 4 A; infinite where it has no area."""
    uu, vv, ww, twice = squares(points, a, b, c)
    shape = (max(uu, max(vv, ww)) - min(uu, min(vv, ww))) / (2.0 * twice) if twice > 0.0 else math.inf
    return mean_length(uu, vv, ww), shape


@inner
def place_of(node_t, low, high, t):
    """The entry of node_t[low:high], ascending, that is t; -1 where none is."""
    while low < high:
        m = (low + high) // 2
        if node_t[m] < t:
            low = m + 1
        else:
            high = m
    return low if low < node_t.shape[0] and node_t[low] == t else -1


@kernel
def beside(starts, points, triangles, neighbours, track, t, edges, uses, first, node_t, flawed, size, place, found):
    """Sizes of the triangles beside the segments of all faces, where they lie on shared edges.

    starts (f + 1, 4) : where the nodes, triangles, segments and curves of each face begin in the arrays of all.
    edges, uses : the edge of each curve, how many curves lie on each edge; first, node_t : parameters of the nodes on
    the edges. Triangles of the shape ``flawed`` and more do not count.

    size (k,) : gets the mean edge length of the triangle beside, 0 for none. place (k,) : gets where the segment starts
    in ``node_t``, -1 for none. found (len(node_t), 3) : gets the number, the least and the greatest of these sizes.
    """
    for q in range(found.shape[0]):
        found[q, 0], found[q, 1], found[q, 2] = 0.0, math.inf, 0.0
    for s in range(size.shape[0]):
        size[s], place[s] = 0.0, -1
    for f in range(starts.shape[0] - 1):
        node = starts[f, 0]
        for u in range(starts[f, 1], starts[f + 1, 1]):
            for i in range(3):
                s = starts[f, 2] - 1 - neighbours[u, i]
                if neighbours[u, i] >= 0 or track[s] < 0:
                    continue
                e = edges[starts[f, 3] + track[s]]
                if uses[e] < 2:
                    continue
                a, b, c = node + triangles[u, 0], node + triangles[u, 1], node + triangles[u, 2]
                mean, shape = size_and_shape(points, a, b, c)
                at = place_of(node_t, first[e], first[e + 1], min(t[s, 0], t[s, 1]))
                if shape >= flawed or at < 0:
                    continue
                size[s], place[s] = mean, at
                found[at, 0] += 1.0
                found[at, 1], found[at, 2] = min(found[at, 1], mean), max(found[at, 2], mean)
