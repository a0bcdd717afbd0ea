"""Compiled part of the alignment: where a lattice meets the boundary best."""

from __future__ import annotations

import math

from fubini._jit import inner, kernel

ROW = 0.8660254037844386  # sqrt(3) / 2
#: segments of this share of the size and more take part, straight edges of as many at least are candidates
FULL, LEAST = 0.75, 2
#: a lattice follows the spacing of an edge that differs from the size by at most this share
STRETCH = 0.03
#: squared misfit (in spacings) beyond which a node is simply missing
WORST = 0.1


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
def misfit(points, segments, size, x, y, dx, dy, spacing):
    """Mean squared distance, in spacings, of the third corners wanted at the boundary from the lattice."""
    total, number = 0.0, 0
    for k in range(segments.shape[0]):
        a, b = segments[k, 0], segments[k, 1]
        ex, ey = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        if math.sqrt(ex * ex + ey * ey) < FULL * size:
            continue
        px, py = points[a, 0] + 0.5 * ex - ROW * ey - x, points[a, 1] + 0.5 * ey + ROW * ex - y
        u, v = (px * dx + py * dy) / spacing, (py * dx - px * dy) / (spacing * ROW)
        row = math.floor(v + 0.5)
        if row % 2 != 0:
            u -= 0.5
        u -= math.floor(u + 0.5)
        v = ROW * (v - row)
        total += min(u * u + v * v, WORST)
        number += 1
    return total / max(number, 1)


@kernel
def place(points, segments, track, kinds, size, found, best):
    """Write the lattice that meets the boundary best into best (5,): a node, the direction of rows, the spacing.

    Candidates are the lattices with a row on one of the longest straight edges, and on its nodes; and the one with rows
    along x from the lowest corner of the bounding box, less ``size``, which comes first. found (k, 6) is scratch space.
    """
    best[0], best[1], best[2], best[3], best[4] = math.inf, math.inf, 1.0, 0.0, size
    for i in range(points.shape[0]):
        best[0], best[1] = min(best[0], points[i, 0]), min(best[1], points[i, 1])
    best[0] -= size
    best[1] -= size
    for i in range(found.shape[0]):
        found[i, 5] = 0.0
    straight_edges(points, segments, track, kinds, size, found)
    least = misfit(points, segments, size, best[0], best[1], best[2], best[3], best[4])
    for i in range(found.shape[0]):
        if found[i, 5] == 0.0:
            break
        spacing = min((1.0 + STRETCH) * size, max((1.0 - STRETCH) * size, found[i, 4]))
        off = misfit(points, segments, size, found[i, 0], found[i, 1], found[i, 2], found[i, 3], spacing)
        if off < least:
            least = off
            for j in range(4):
                best[j] = found[i, j]
            best[4] = spacing
