"""Into the state of the moves and out of it: what is derived from the triangles, and the result as plain arrays."""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel
from fubini.optimise._kernels_even import even_out
from fubini.optimise._kernels_state import NODES, RANDOM, REMOVED, SEGMENTS, TRIANGLES
from fubini.optimise._kernels_words import state_of


@inner
def mean_lengths(S, first, n):
    """Mean length of the edges at each node from ``first`` on, into its size."""
    for v in range(first, n):
        S.stack[v], S.size[v] = 0, 0.0
    for t in range(S.counts[TRIANGLES]):
        for i in range(3):
            a, b = S.tri[t, i], S.tri[t, i + 1 if i < 2 else 0]
            if a >= first:
                x, y = S.points[a, 0] - S.points[b, 0], S.points[a, 1] - S.points[b, 1]
                S.size[a] += math.sqrt(x * x + y * y)
                S.stack[a] += 1
    for v in range(first, n):
        if S.stack[v] > 0:
            S.size[v] /= S.stack[v]


@inner
def derive(S, size, angle, most, acute, unavoidable):
    """Set kind and sizes, mark sharp corners and fill ``tri_of`` for the first NODES nodes of a state.

    size : wanted edge length at the first nodes; at the interior nodes behind them it becomes ``most`` or, where that
    is infinite, the mean length of the edges there. angle : interior angle in degrees at the first nodes, those of the
    boundary; corners below ``acute`` are marked 2, below ``unavoidable`` 1.
    """
    n, given = S.counts[NODES], size.shape[0]
    for v in range(n):
        S.sharp[v] = 0
        S.size[v] = min(most, size[v]) if v < given else most
    for v in range(angle.shape[0]):
        if angle[v] < unavoidable:
            S.sharp[v] = 1
        elif angle[v] < acute:
            S.sharp[v] = 2
    for v in range(angle.shape[0], n):
        S.kind[v] = 0
    for t in range(S.counts[TRIANGLES]):
        for i in range(3):
            S.tri_of[S.tri[t, i]] = t
    if most == math.inf:
        mean_lengths(S, given, n)


@inner
def fill(S, points, triangles, neighbours, kind, track, t, mode, seed):
    """Write a triangulation into a state with room for it; whatever was there before is forgotten.

    kind, angle : of the boundary nodes. track, t, mode : of the segments.
    """
    S.counts[:] = 0
    S.mark[:] = 0
    S.moved[:] = 0
    S.tried[:] = 0
    n, m, k = points.shape[0], triangles.shape[0], track.shape[0]
    S.counts[NODES], S.counts[TRIANGLES], S.counts[SEGMENTS], S.counts[RANDOM] = n, m, k, seed
    for v in range(n):
        S.points[v, 0], S.points[v, 1] = points[v, 0], points[v, 1]
    for v in range(kind.shape[0]):
        S.kind[v] = kind[v]
    for u in range(m):
        for i in range(3):
            S.tri[u, i], S.nbr[u, i] = triangles[u, i], neighbours[u, i]
    for s in range(k):
        S.track[s], S.mode[s] = track[s], mode[s]
        S.t[s, 0], S.t[s, 1] = t[s, 0], t[s, 1]


@inner(allocates=True)
def number_nodes(S):
    """New number of every node (-1 for those removed), boundary nodes first; how many there are of both."""
    n = S.counts[NODES]
    number = np.empty(n, np.int32)
    count = 0
    for v in range(n):
        number[v] = -1
        if S.kind[v] != 0 and S.kind[v] != REMOVED:
            number[v] = count
            count += 1
    boundary = count
    for v in range(n):
        if S.kind[v] == 0:
            number[v] = count
            count += 1
    return number, boundary, count


@inner(allocates=True)
def number_triangles(S, track, t, mode):
    """New number of every triangle and segment (-1 for those removed), how many there are, and the segments' arrays.

    The segments of the result (k, 2) hold the old numbers of their nodes.
    """
    m, k = S.counts[TRIANGLES], S.counts[SEGMENTS]
    number, rename, ends = np.empty(m, np.int32), np.empty(k, np.int32), np.empty((k, 2), np.int32)
    for s in range(k):
        rename[s] = -1
    count = 0
    for u in range(m):
        number[u] = -1
        if S.tri[u, 0] < 0:
            continue
        number[u] = count
        count += 1
        for i in range(3):
            s = -1 - S.nbr[u, i]
            if s >= 0:
                rename[s] = 0
                ends[s, 0], ends[s, 1] = S.tri[u, (i + 1) % 3], S.tri[u, (i + 2) % 3]
    alive = 0
    for s in range(k):
        if rename[s] == 0:
            rename[s] = alive
            ends[alive, 0], ends[alive, 1] = ends[s, 0], ends[s, 1]
            track[alive], mode[alive] = S.track[s], S.mode[s]
            t[alive, 0], t[alive, 1] = S.t[s, 0], S.t[s, 1]
            alive += 1
    return number, rename, ends[:alive], count


@kernel(allocates=True)
def read_out(S, angle, mode, limit, kept, outside):
    """The mesh of a state as arrays, numbered without gaps, boundary nodes first, and evened out.

    angle (n,), mode (k,) : those of the boundary nodes and segments that the state started with. limit, kept, outside :
    see ``even_out``. Returns points, triangles, neighbours; kind, size and angle of the boundary nodes; ends, track, t
    and mode of the segments; the numbers of the segments that start at a new node and may only be split; and what
    ``even_out`` does.
    """
    S = state_of(S)
    number, rim, nodes = number_nodes(S)
    k = S.counts[SEGMENTS]
    track, t, state = np.empty(k, np.int32), np.empty((k, 2)), np.empty(k, np.uint8)
    triangle, segment, ends, m = number_triangles(S, track, t, state)
    k = ends.shape[0]
    points, kind, size, opening = np.empty((nodes, 2)), np.empty(rim, np.uint8), np.empty(rim), np.empty(rim)
    for v in range(number.shape[0]):
        i = number[v]
        if i < 0:
            continue
        points[i, 0], points[i, 1] = S.points[v, 0], S.points[v, 1]
        if i < rim:
            kind[i], size[i], opening[i] = S.kind[v], S.size[v], angle[v] if v < angle.shape[0] else 180.0
    triangles, neighbours = np.empty((m, 3), np.int32), np.empty((m, 3), np.int32)
    for u in range(triangle.shape[0]):
        if triangle[u] >= 0:
            for i in range(3):
                w = S.nbr[u, i]
                triangles[triangle[u], i] = number[S.tri[u, i]]
                neighbours[triangle[u], i] = triangle[w] if w >= 0 else -1 - segment[-1 - w]
    fresh, found = np.empty(k, np.int32), 0
    for s in range(k):
        if state[s] == 1 and ends[s, 0] >= angle.shape[0]:
            fresh[found] = s
            found += 1
        ends[s, 0], ends[s, 1] = number[ends[s, 0]], number[ends[s, 1]]
    for s in range(mode.shape[0]):
        if segment[s] >= 0:
            state[segment[s]] = mode[s]
    moves, left, square = even_out(points, triangles, neighbours, rim, limit, kept, outside, k)
    return (
        points, triangles, neighbours, kind, size, opening, ends, track[:k], t[:k], state[:k], fresh[:found],
        moves, left, square,
    )  # fmt: skip
