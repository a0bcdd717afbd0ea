"""Compiled part of the assembly: nodes that faces share, segments in order, faces written into space."""

from __future__ import annotations

import numpy as np

from fubini._jit import inner, kernel
from fubini.tracks._kernels import evaluate_one
from fubini.triangulation._kernels_topology import FROZEN, LOCKED

#: Columns of ``starts`` in ``assemble``.
NODES, SEGMENTS, TRACKS, POINTS, CORNERS, INNER, TRIANGLES = range(7)
#: The place of a node that no segment starts at.
NOWHERE = 2**62


@inner
def lift(axes, x, y, points, i):
    """Write the point (x, y) of a plane into row i of points (n, 3); axes (3, 3) : its origin and its two axes."""
    for k in range(3):
        points[i, k] = axes[0, k] + x * axes[1, k] + y * axes[2, k]


@inner
def enter(
    kinds, offsets, data, segments, track, t, ahead, edges, ends, axes, at, place, param, lifted, seg_edge, seg_t,
    seg_nodes,
):  # fmt: skip
    """Enter the nodes and segments of one face, the nodes from row ``at`` on, into the arrays of all faces.

    A node lies at the start of a segment: ``place`` is the running number of its edge, ``param`` where on it, or -1 - v
    and 0 at vertex v; ``lifted`` (n, 3) is the point in space. Segments run along their edges: seg_edge (k,),
    seg_t (k, 2) and seg_nodes (k, 2). edges (c,) : edges of the tracks, those of the face from number ``ahead`` on;
    ends (e, 2) : vertices of the edges.
    """
    for k in range(segments.shape[0]):
        a, b = at + segments[k, 0], at + segments[k, 1]
        e, start, stop = edges[ahead + track[k]], t[k, 0], t[k, 1]
        if start == 0.0 or start == 1.0:
            place[a], param[a] = -1 - ends[e, 0 if start == 0.0 else 1], 0.0
        else:
            place[a], param[a] = e, start
        x, y = evaluate_one(kinds, offsets, data, ahead + track[k], start)
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


@inner
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


@inner
def place_lone(place, param, lifted, vertices, places):
    """Enter the nodes that no segment starts at: at these vertices (p,), in their order, and places (p, 3)."""
    z = 0
    for a in range(place.shape[0]):
        if place[a] == NOWHERE and z < vertices.shape[0]:
            place[a], param[a] = -1 - vertices[z], 0.0
            for k in range(3):
                lifted[a, k] = places[z, k]
            z += 1


@inner
def to_edges(edge, t, spans):
    """Turn parameters t (k, 2) on pieces ``edge`` (k,) into those on their CAD edges, in place; see ``Pieces``."""
    for s in range(t.shape[0] if spans.shape[0] > 0 else 0):
        e = edge[s]
        for i in range(2):
            if t[s, i] == 0.0:
                t[s, i] = spans[e, 0]
            elif t[s, i] == 1.0:
                t[s, i] = spans[e, 3]
            else:
                t[s, i] = spans[e, 1] + t[s, i] * (spans[e, 2] - spans[e, 1])


@inner
def lowest_place(ends, vertices):
    """The least place that a node can have: -1 - v of the last vertex."""
    last = -1
    for e in range(ends.shape[0]):
        last = max(last, max(ends[e, 0], ends[e, 1]))
    for z in range(vertices.shape[0]):
        last = max(last, vertices[z])
    return -1 - last


@kernel(allocates=True)
def assemble(
    kinds, offsets, data, segments, track, t, edges, ends, spans, edge_ids, axes, starts, vertices, places, flat,
    corners, apart, points, triangles,
):  # fmt: skip
    """All faces as one mesh, but for the cores: shared nodes first, then those inside the faces.

    The arrays of the faces lie one behind the other: tracks and their edges (c,), boundary segments (k, 2), their track
    and t, ``flat`` and ``corners`` of ``write_strip``; ``starts`` (f + 1, 7) says where those of each face begin, its
    boundary nodes, and what is inside it in points (n, 3) and triangles (m, 3), which are filled in place; n may be too
    many by nodes that faces share. axes (f, 3, 3). spans : of pieces (``Pieces``), or no rows. vertices (p,), places
    (p, 3) : of nodes that no segment starts at. Other arguments, and what is returned, as in ``join``, but in place of
    ``first`` how many shared nodes there are; last, all rows in space.
    """
    faces = starts.shape[0] - 1
    n, k = starts[faces, NODES], starts[faces, SEGMENTS]
    place, param, lifted = np.empty(n, np.int64), np.empty(n), np.empty((n, 3))
    edge, params, nodes = np.empty(k, np.int64), np.empty((k, 2)), np.empty((k, 2), np.int64)
    for a in range(n):
        place[a] = NOWHERE
    for f in range(faces):
        a, b = starts[f, SEGMENTS], starts[f + 1, SEGMENTS]
        enter(
            kinds, offsets, data, segments[a:b], track[a:b], t[a:b], starts[f, TRACKS], edges, ends, axes[f],
            starts[f, NODES], place, param, lifted, edge[a:b], params[a:b], nodes[a:b],
        )  # fmt: skip
    place_lone(place, param, lifted, vertices, places)
    to_edges(edge, params, spans)
    lowest = lowest_place(ends, vertices)
    first, index, ways, edge_of, along, far = join(place, param, lifted, lowest, apart, edge, params, nodes, edge_ids)
    total = first.shape[0]
    for i in range(total):
        for d in range(3):
            points[i, d] = lifted[first[i], d]
    for f in range(faces):
        a, b = starts[f], starts[f + 1]
        write_strip(
            axes[f], flat[a[POINTS] : b[POINTS]], corners[a[CORNERS] : b[CORNERS]], index[a[NODES] : b[NODES]],
            total + a[INNER], points[total + a[INNER] :], triangles[a[TRIANGLES] :],
        )  # fmt: skip
    return total, index, ways, edge_of, along, far, lifted


@kernel(allocates=True)
def with_rim(points, kind, size, angle, segments, track, t, mode, on_rim, rim, wanted):
    """Arrays of a boundary with the rim of a core behind it: frozen nodes, and locked segments of no track.

    wanted : size of these nodes. on_rim (r, 2) : nodes there. rim (e, 2) : its edges, the core on the left of each:
    the segments run the other way. Returns points, kind, size, angle; segments, track, t and mode.
    """
    n, k, r, e = points.shape[0], segments.shape[0], on_rim.shape[0], rim.shape[0]
    places, kinds, sizes, angles = np.empty((n + r, 2)), np.empty(n + r, np.uint8), np.empty(n + r), np.empty(n + r)
    for v in range(n):
        places[v, 0], places[v, 1] = points[v, 0], points[v, 1]
        kinds[v], sizes[v], angles[v] = kind[v], size[v], angle[v]
    for v in range(r):
        places[n + v, 0], places[n + v, 1] = on_rim[v, 0], on_rim[v, 1]
        kinds[n + v], sizes[n + v], angles[n + v] = FROZEN, wanted, 180.0
    ends, tracks = np.empty((k + e, 2), np.int32), np.empty(k + e, np.int32)
    params, modes = np.empty((k + e, 2)), np.empty(k + e, np.uint8)
    for s in range(k):
        ends[s, 0], ends[s, 1], tracks[s] = segments[s, 0], segments[s, 1], track[s]
        params[s, 0], params[s, 1], modes[s] = t[s, 0], t[s, 1], mode[s]
    for s in range(e):
        ends[k + s, 0], ends[k + s, 1], tracks[k + s] = n + rim[s, 1], n + rim[s, 0], -1
        params[k + s, 0], params[k + s, 1], modes[k + s] = 0.0, 0.0, LOCKED
    return places, kinds, sizes, angles, ends, tracks, params, modes


@inner
def number_rim_last(segments, track, number):
    """Numbers (n,) of the nodes of a boundary, those on segments of no track behind the others; how many others."""
    for v in range(number.shape[0]):
        number[v] = 0
    for s in range(segments.shape[0]):
        if track[s] < 0:
            number[segments[s, 0]] = number[segments[s, 1]] = 1
    own = 0
    for v in range(number.shape[0]):
        own += 1 - number[v]
    first, last = 0, own
    for v in range(number.shape[0]):
        if number[v]:
            number[v] = last
            last += 1
        else:
            number[v] = first
            first += 1
    return own


@kernel(allocates=True)
def without_rim(points, triangles, kind, size, angle, segments, track, t, mode):
    """A strip renumbered: the nodes of the face's own boundary, those on the rim of the core, the others.

    points (n, 2), triangles (m, 3). kind, size, angle : of the nodes of both boundaries; segments (k, 2), track, t and
    mode (k,) : track is -1 on the rim. Returns points and triangles, and the arrays of the face's own boundary alone.
    """
    fixed, k = kind.shape[0], 0
    number = np.empty(fixed, np.int32)
    own = number_rim_last(segments, track, number)
    places, corners = np.empty_like(points), np.empty_like(triangles)
    kinds, sizes, angles = np.empty(own, np.uint8), np.empty(own), np.empty(own)
    for v in range(points.shape[0]):
        w = number[v] if v < fixed else v
        places[w, 0], places[w, 1] = points[v, 0], points[v, 1]
        if w < own:
            kinds[w], sizes[w], angles[w] = kind[v], size[v], angle[v]
    for u in range(triangles.shape[0]):
        for i in range(3):
            v = triangles[u, i]
            corners[u, i] = number[v] if v < fixed else v
    for s in range(track.shape[0]):
        k += track[s] >= 0
    ends, tracks = np.empty((k, 2), np.int32), np.empty(k, np.int32)
    params, modes = np.empty((k, 2)), np.empty(k, np.uint8)
    k = 0
    for s in range(track.shape[0]):
        if track[s] >= 0:
            ends[k, 0], ends[k, 1], tracks[k] = number[segments[s, 0]], number[segments[s, 1]], track[s]
            params[k, 0], params[k, 1], modes[k] = t[s, 0], t[s, 1], mode[s]
            k += 1
    return places, corners, kinds, sizes, angles, ends, tracks, params, modes
