"""Compiled part of the assembly: nodes that faces share, segments in order, faces written into space."""

from __future__ import annotations

import numpy as np

from fubini._jit import inner, kernel
from fubini.tracks._kernels import evaluate_one


@inner
def lift(axes, x, y, points, i):
    """Write the point (x, y) of a plane into row i of points (n, 3); axes (3, 3) : its origin and its two axes."""
    for k in range(3):
        points[i, k] = axes[0, k] + x * axes[1, k] + y * axes[2, k]


@kernel
def enter(
    kinds, offsets, data, segments, track, t, edges, ends, axes, at, place, param, lifted, seg_edge, seg_t, seg_nodes
):  # fmt: skip
    """Enter the nodes and segments of one face, the nodes from row ``at`` on, into the arrays of all faces.

    A node lies at the start of a segment: ``place`` is the running number of its edge, ``param`` where on it, or -1 - v
    and 0 at vertex v; ``lifted`` (n, 3) is the point in space. Segments run along their edges: seg_edge (k,),
    seg_t (k, 2) and seg_nodes (k, 2). edges (c,) : edges of the tracks; ends (e, 2) : vertices of the edges.
    """
    for k in range(segments.shape[0]):
        a, b = at + segments[k, 0], at + segments[k, 1]
        e, start, stop = edges[track[k]], t[k, 0], t[k, 1]
        if start == 0.0 or start == 1.0:
            place[a], param[a] = -1 - ends[e, 0 if start == 0.0 else 1], 0.0
        else:
            place[a], param[a] = e, start
        x, y = evaluate_one(kinds, offsets, data, np.int64(track[k]), start)
        lift(axes, x, y, lifted, a)
        seg_edge[k] = e
        if start > stop:
            start, stop, a, b = stop, start, b, a
        seg_t[k, 0], seg_t[k, 1], seg_nodes[k, 0], seg_nodes[k, 1] = start, stop, a, b


@inner
def sort_part(order, spare, key, a, b):
    """Sort order[a:b] by key, stably: rising and falling runs are merged one after the other.

    Nodes along an edge make one run for each face, and one for each node that was inserted later.
    """
    done = a
    while done < b:
        end = done + 1
        if end < b and key[order[end]] < key[order[done]]:
            while end < b and key[order[end]] < key[order[end - 1]]:
                end += 1
            for i in range((end - done) // 2):
                order[done + i], order[end - 1 - i] = order[end - 1 - i], order[done + i]
        else:
            while end < b and key[order[end]] >= key[order[end - 1]]:
                end += 1
        if done > a and key[order[done]] < key[order[done - 1]]:
            for i in range(a, done):
                spare[i] = order[i]
            i, j = a, done
            for k in range(a, end):
                if i < done and (j == end or key[spare[i]] <= key[order[j]]):
                    order[k] = spare[i]
                    i += 1
                else:
                    order[k] = order[j]
                    j += 1
        done = end


@inner(allocates=True)
def ordered(group, lowest, count, key):
    """Rows sorted by group (n,), one of ``count`` numbers from ``lowest`` on, then by key (n,), then by row."""
    n = group.shape[0]
    start, order, spare = np.zeros(count + 1, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        start[group[i] - lowest] += 1
    total = 0
    for g in range(count + 1):
        start[g], total = total, total + start[g]
    for i in range(n):
        g = group[i] - lowest
        order[start[g]] = i
        start[g] += 1
    first = 0
    for g in range(count):
        sort_part(order, spare, key, first, start[g])
        first = start[g]
    return order


@inner
def follows(t, nodes, a, b):
    """Whether segment b, which starts at the same parameter as a, comes before it: by t, then by nodes."""
    if t[a, 1] != t[b, 1]:
        return t[b, 1] < t[a, 1]
    if nodes[a, 0] != nodes[b, 0]:
        return nodes[b, 0] < nodes[a, 0]
    return nodes[b, 1] < nodes[a, 1]


@kernel(allocates=True)
def join(place, param, lifted, lowest, apart, edge, t, nodes, edge_ids):
    """Nodes that are the same once, sorted by place and parameter; and segments, sorted by edge, parameters and nodes.

    place, param, lifted, edge, t, nodes : as ``enter`` fills them; places from ``lowest`` on, nodes renamed in place.
    edge_ids (e,) : CAD indices. Returns first (m,), a row of each node; index (n,), the node of every row; segments
    (s, 2), their CAD edges (s,) and parameters (s, 2); and whether rows of one node lie farther than ``apart`` from
    each other.
    """
    n, k, edges = place.shape[0], edge.shape[0], edge_ids.shape[0]
    order = ordered(place, lowest, edges - lowest, param)
    first, index = np.empty(n, np.int64), np.empty(n, np.int64)
    count, far = 0, False
    for i in range(n):
        row = order[i]
        if i == 0 or place[row] != place[order[i - 1]] or param[row] != param[order[i - 1]]:
            first[count] = row
            count += 1
        index[row] = count - 1
        off = 0.0
        for d in range(3):
            off += (lifted[row, d] - lifted[first[count - 1], d]) ** 2
        far = far or off > apart * apart
    key = np.empty(k)
    for s in range(k):
        nodes[s, 0], nodes[s, 1], key[s] = index[nodes[s, 0]], index[nodes[s, 1]], t[s, 0]
    order = ordered(edge, 0, edges, key)
    segments, edge_of, params = np.empty((k, 2), np.int32), np.empty(k, np.int32), np.empty((k, 2))
    for i in range(1, k):  # ties, of two faces or more
        j, row = i, order[i]
        while j > 0 and edge[order[j - 1]] == edge[row] and key[order[j - 1]] == key[row]:
            if not follows(t, nodes, order[j - 1], row):
                break
            order[j] = order[j - 1]
            j -= 1
        order[j] = row
    m = 0
    for i in range(k):
        s = order[i]
        if (
            m > 0
            and edge_of[m - 1] == edge_ids[edge[s]]
            and params[m - 1, 0] == t[s, 0]
            and params[m - 1, 1] == t[s, 1]
            and segments[m - 1, 0] == nodes[s, 0]
            and segments[m - 1, 1] == nodes[s, 1]
        ):
            continue
        segments[m, 0], segments[m, 1], edge_of[m] = nodes[s, 0], nodes[s, 1], edge_ids[edge[s]]
        params[m, 0], params[m, 1] = t[s, 0], t[s, 1]
        m += 1
    return first[:count], index, segments[:m], edge_of[:m], params[:m], far


@kernel
def write_strip(axes, flat, corners, numbers, first, points, triangles):
    """Write the nodes inside a triangulation into space, points (n - b, 3), and its triangles (m, 3).

    axes (3, 3) : where the plane lies. flat (n, 2), corners (m, 3) : the triangulation. numbers (b,) : what its first
    nodes are called; the others are called ``first`` and so on.
    """
    b = numbers.shape[0]
    for v in range(b, flat.shape[0]):
        lift(axes, flat[v, 0], flat[v, 1], points, v - b)
    for t in range(corners.shape[0]):
        for i in range(3):
            v = corners[t, i]
            triangles[t, i] = numbers[v] if v < b else first + v - b


@kernel(allocates=True)
def rim_last(points, triangles, segments, track, real, kept):
    """Renumber a strip in place: the nodes of the face's own boundary, those on the rim of the core, the others.

    points (n, 2), triangles (m, 3). segments (k, 2), track (k,) : -1 on the rim. Writes the old numbers of the first
    nodes into real, their segments into kept (k, 2), and returns how many there are of both.
    """
    fixed = real.shape[0]
    number, on_rim = np.zeros(fixed, np.int32), np.empty((fixed, 2))
    for s in range(segments.shape[0]):
        if track[s] < 0:
            number[segments[s, 0]], number[segments[s, 1]] = 1, 1
    own, rim = 0, 0
    for v in range(fixed):
        if number[v]:
            on_rim[rim, 0], on_rim[rim, 1] = points[v, 0], points[v, 1]
            rim += 1
        else:
            points[own, 0], points[own, 1] = points[v, 0], points[v, 1]
            real[own] = v
            own += 1
    first, last = 0, own
    for v in range(fixed):
        if number[v]:
            points[last, 0], points[last, 1] = on_rim[last - own, 0], on_rim[last - own, 1]
            number[v] = last
            last += 1
        else:
            number[v] = first
            first += 1
    for t in range(triangles.shape[0]):
        for i in range(3):
            if triangles[t, i] < fixed:
                triangles[t, i] = number[triangles[t, i]]
    k = 0
    for s in range(segments.shape[0]):
        if track[s] >= 0:
            kept[k, 0], kept[k, 1] = number[segments[s, 0]], number[segments[s, 1]]
            k += 1
    return own, k
