"""Compiled part of the alignment: where a lattice meets the boundary best."""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner
from fubini.sampling._kernels_interior import ROW, mark_inside, turned_box

#: segments of this share of the size and more take part, straight edges of as many at least are candidates
FULL, LEAST = 0.75, 2
#: a lattice follows the spacing of an edge that differs from the size by at most this share
STRETCH = 0.03
#: squared misfit (in spacings) beyond which a node is simply missing
WORST = 0.1
#: straight edges whose lattices are compared
CANDIDATES = 6
#: how a lattice is placed
SHIFT, NODE, BEST = 0, 1, 2


@inner
def enter(found, x, y, dx, dy, weight):
    """Put a candidate among the heaviest in the rows of found (k, 6), heaviest first; ties keep their order."""
    k = found.shape[0]
    if weight <= found[k - 1, 5]:
        return
    r = k - 1
    while r > 0 and weight > found[r - 1, 5]:
        for i in range(6):
            found[r, i] = found[r - 1, i]
        r -= 1
    length = math.sqrt(dx * dx + dy * dy)
    found[r, 0], found[r, 1], found[r, 2], found[r, 3] = x, y, dx / length, dy / length
    found[r, 4], found[r, 5] = length, weight


@inner
def straight_edges(points, segments, track, kinds, size, found):
    """The straight edges with most segments of about full size: start, direction and length of their middle one."""
    k = 0
    while k < segments.shape[0]:
        end, full = k, 0
        while end < segments.shape[0] and track[end] == track[k]:
            a, b = segments[end, 0], segments[end, 1]
            full += math.hypot(points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]) >= FULL * size
            end += 1
        if track[k] >= 0 and kinds[track[k]] == 0 and full >= LEAST:
            a, b = segments[(k + end) // 2, 0], segments[(k + end) // 2, 1]
            dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
            enter(found, points[a, 0], points[a, 1], dx, dy, float(full))
        k = end


@inner
def third_corners(points, segments, size, corners):
    """Third corners of equilateral triangles on segments of about full size, into corners (k, 2); their number."""
    number = 0
    for k in range(segments.shape[0]):
        a, b = segments[k, 0], segments[k, 1]
        ex, ey = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        if math.sqrt(ex * ex + ey * ey) < FULL * size:
            continue
        corners[number, 0] = points[a, 0] + 0.5 * ex - ROW * ey
        corners[number, 1] = points[a, 1] + 0.5 * ey + ROW * ex
        number += 1
    return number


@inner
def misfit(corners, number, x, y, dx, dy, spacing):
    """Mean squared distance, in spacings, of the first ``number`` of the corners from nodes of a lattice."""
    total, across, along = 0.0, 1.0 / spacing, 1.0 / (spacing * ROW)
    for k in range(number):
        px, py = corners[k, 0] - x, corners[k, 1] - y
        u, v = (px * dx + py * dy) * across, (py * dx - px * dy) * along
        row = math.floor(v + 0.5)
        u -= 0.5 * (row & 1)
        u -= math.floor(u + 0.5)
        v = ROW * (v - row)
        total += min(u * u + v * v, WORST)
    return total / max(number, 1)


@inner
def place(points, segments, track, kinds, size, found, corners, best):
    """Write the lattice that meets the boundary best into best (5,): a node, the direction of rows, the spacing.

    Candidates are the lattices with a row on one of the longest straight edges, and on its nodes; and the one with rows
    along x from the lowest corner of the bounding box, less ``size``, which comes first. Scratch: found (c, 6), corners
    (k, 2) for k segments.
    """
    best[0], best[1], best[2], best[3], best[4] = math.inf, math.inf, 1.0, 0.0, size
    for i in range(points.shape[0]):
        best[0], best[1] = min(best[0], points[i, 0]), min(best[1], points[i, 1])
    best[0] -= size
    best[1] -= size
    for i in range(found.shape[0]):
        found[i, 5] = 0.0
    straight_edges(points, segments, track, kinds, size, found)
    number = third_corners(points, segments, size, corners)
    least = misfit(corners, number, best[0], best[1], best[2], best[3], best[4])
    for i in range(found.shape[0]):
        if found[i, 5] == 0.0:
            break
        spacing = min((1.0 + STRETCH) * size, max((1.0 - STRETCH) * size, found[i, 4]))
        off = misfit(corners, number, found[i, 0], found[i, 1], found[i, 2], found[i, 3], spacing)
        if off < least:
            least = off
            for j in range(4):
                best[j] = found[i, j]
            best[4] = spacing


@inner
def first_node(node, low, size):
    """Where the first row of a lattice starts, in axes along its rows, so that it begins outside the box from ``low``
    on and that ``node`` is one of its nodes."""
    x, y = (node[0] - low[0]) / size, (node[1] - low[1]) / size
    row = math.ceil((1.0 + y) / ROW - 1e-9)
    column = math.ceil(1.0 + x - 0.5 * (row % 2) - 1e-9) + 0.5 * (row % 2)
    return low[0] - size * (1.0 + (column - 1.0 - x)), low[1] - size * (1.0 + (row * ROW - 1.0 - y))


@inner(allocates=True)
def lay(points, segments, sizes, track, kinds, how, lattice, size, clearance, gradient):
    """The table (rows, columns) of the lattice nodes inside a boundary and clear of it: see ``mark_inside``.

    lattice (7,) : a node, unit direction of the rows and spacing; gets, at the end, where the first row starts in axes
    along the rows. how : SHIFT for the lowest corner of the box in these axes in place of the node, moved back by
    fractions of the spacing; NODE; BEST for the lattice of about ``size`` that meets the boundary best (``place``).
    """
    if how == BEST:
        corners = np.empty((segments.shape[0], 2))
        place(points, segments, track, kinds, size, np.empty((CANDIDATES, 6)), corners, lattice)
    c, s, h = lattice[2], lattice[3], lattice[4]
    turned = np.empty_like(points)
    low_x, low_y, high_x, high_y = turned_box(points, c, -s, turned)
    if how == SHIFT:
        x0, y0 = low_x - h * (1.0 + lattice[0]), low_y - h * (1.0 + lattice[1])
    else:
        node = c * lattice[0] + s * lattice[1], c * lattice[1] - s * lattice[0]
        x0, y0 = first_node(node, (low_x, low_y), h)
    lattice[5], lattice[6] = x0, y0
    columns, rows = math.ceil((high_x - x0) / h) + 2, math.ceil((high_y - y0) / (h * ROW)) + 2
    role = np.zeros((rows, columns), np.uint8)
    mark_inside(turned, segments, sizes, h, x0, y0, clearance, gradient, role)
    return role
