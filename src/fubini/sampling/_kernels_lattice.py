"""A lattice laid and divided, in one kernel: each call from Python costs time."""

from __future__ import annotations

import numpy as np

from fubini._jit import inner, kernel
from fubini.sampling._kernels_alignment import lay
from fubini.sampling._kernels_core import divide

#: A byte eight times over.
EIGHTFOLD = np.uint64(0x0101010101010101)


@inner
def changes(cells, eight, ends):
    """Number of cells that are not like the next one; their numbers into ends (r,), as far as there is room.

    ``eight`` : the same bytes in words, as many as are whole.
    """
    count, last, room = 0, cells[0], ends.shape[0]
    for w in range(eight.shape[0] + 1):
        if w < eight.shape[0] and eight[w] == EIGHTFOLD * np.uint64(last):
            continue
        for i in range(8 * w, 8 * w + 8 if w < eight.shape[0] else cells.shape[0]):
            if cells[i] != last:
                if count < room:
                    ends[count] = i - 1
                count += 1
                last = cells[i]
    return count


@inner(allocates=True)
def strip_between(points, segments, outside, first, nodes, edges):
    """Points and segments of what lies between a boundary and a patch: those of the boundary, then ``divide``'s.

    first : number of the first node ``outside``.
    """
    n, k = points.shape[0], segments.shape[0]
    places, ends = np.empty((n + nodes.shape[0], 2)), np.empty((k + edges.shape[0], 2), np.int32)
    for v in range(n):
        places[v, 0], places[v, 1] = points[v, 0], points[v, 1]
    for z in range(nodes.shape[0]):
        places[n + z, 0], places[n + z, 1] = outside[nodes[z] - first, 0], outside[nodes[z] - first, 1]
    for s in range(k):
        ends[s, 0], ends[s, 1] = segments[s, 0], segments[s, 1]
    for e in range(edges.shape[0]):
        ends[k + e, 0], ends[k + e, 1] = edges[e, 0], edges[e, 1]
    return places, ends


@kernel(allocates=True)
def lay_divided(points, segments, sizes, track, kinds, how, lattice, size, clearance, gradient, least):
    """The lattice that ``lay`` is told, divided with a core of at least so many triangles.

    Returns the table of its nodes (rows, columns); what ``divide`` does; and points and segments of what lies between
    the boundary and the patch.
    """
    role = lay(points, segments, sizes, track, kinds, how, lattice, size, clearance, gradient)
    cells = role.reshape(role.size)
    eight = cells[: 8 * (cells.shape[0] // 8)].view(np.uint64)
    ends = np.empty(changes(cells, eight, np.empty(0, np.int64)), np.int64)
    changes(cells, eight, ends)
    place, n, k = np.empty(5), points.shape[0], segments.shape[0]
    place[0], place[1], place[2] = lattice[5], lattice[6], lattice[4]
    place[3], place[4] = lattice[2], lattice[3]
    core, inner_nodes, outside, on_rim, rim, triangles, neighbours, half_edges, nodes, edges, hanging = divide(
        cells, role.shape[1], ends, least, n, k, place
    )
    places, strip = strip_between(points, segments, outside, n + on_rim.shape[0], nodes, edges)
    return (
        role, core, inner_nodes, outside, on_rim, rim, triangles, neighbours, half_edges, nodes, hanging,
        places, strip,
    )  # fmt: skip
