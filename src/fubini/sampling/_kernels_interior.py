"""Compiled part of the interior sampling: a hexagonal lattice between the limits of horizontal slices."""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel

ROW = 0.8660254037844386  # sqrt(3) / 2
#: least square of the length of a segment that is divided by
TINY = 1e-300


@inner
def turned_box(points, c, s, turned):
    """Write points (n, 2) turned by the angle of cosine c and sine s; returns the least and the greatest x and y."""
    low_x, low_y, high_x, high_y = math.inf, math.inf, -math.inf, -math.inf
    for i in range(points.shape[0]):
        x, y = c * points[i, 0] - s * points[i, 1], s * points[i, 0] + c * points[i, 1]
        turned[i, 0], turned[i, 1] = x, y
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
    return low_x, low_y, high_x, high_y


@inner(allocates=True)
def crossings(points, segments, y0, step, rows):
    """Limits of all rows y0 + j step: row j crosses the boundary at xs[first[j] : first[j + 1]], sorted."""
    first, fill = np.empty(rows + 1, np.int64), np.empty(rows, np.int64)
    for j in range(rows + 1):
        first[j] = 0
    for k in range(segments.shape[0]):
        a, b = points[segments[k, 0], 1], points[segments[k, 1], 1]
        j0 = max(0, math.ceil((min(a, b) - y0) / step))
        j1 = min(rows, math.ceil((max(a, b) - y0) / step))
        for j in range(j0, j1):
            first[j + 1] += 1
    for j in range(rows):
        fill[j] = first[j]
        first[j + 1] += first[j]
    xs = np.empty(first[rows])
    for k in range(segments.shape[0]):
        ax, ay = points[segments[k, 0], 0], points[segments[k, 0], 1]
        bx, by = points[segments[k, 1], 0], points[segments[k, 1], 1]
        j0 = max(0, math.ceil((min(ay, by) - y0) / step))
        j1 = min(rows, math.ceil((max(ay, by) - y0) / step))
        for j in range(j0, j1):
            x = ax + (y0 + j * step - ay) / (by - ay) * (bx - ax)
            q = fill[j]
            while q > first[j] and xs[q - 1] > x:
                xs[q] = xs[q - 1]
                q -= 1
            xs[q] = x
            fill[j] += 1
    return first, xs


@inner(allocates=True)
def mark_inside(points, segments, size, h, x0, y0, clearance, g, inside):
    """Mark in the table (rows, columns), all 0, which lattice nodes are inside the boundary and clear of it.

    Row j of the lattice lies at y0 + j h sqrt(3)/2 and starts at x0, odd rows half a step further.
    A node stays when its row's limits enclose it and it is at least ``clearance`` h from every
    segment, further where the segment is finer: there the size grows from the segment with
    gradient g until it reaches h.
    """
    rows, columns = inside.shape
    step = h * ROW
    first, xs = crossings(points, segments, y0, step, rows)
    for j in range(rows):
        start = x0 + (0.5 * h if j & 1 else 0.0)
        for q in range(first[j], first[j + 1] - 1, 2):
            i0 = max(0, math.ceil((xs[q] - start) / h))
            i1 = min(columns, math.ceil((xs[q + 1] - start) / h))
            for i in range(i0, i1):
                inside[j, i] = 1
    for k in range(segments.shape[0]):
        a, b = segments[k, 0], segments[k, 1]
        ax, ay = points[a, 0], points[a, 1]
        ex, ey = points[b, 0] - ax, points[b, 1] - ay
        inverse, reach = 1.0 / max(ex * ex + ey * ey, TINY), clearance * h
        small = min(size[a], size[b])
        if small < 0.8 * h:
            reach = max(reach, (0.9 * h - small) / g)
        j0 = max(0, math.floor((min(ay, ay + ey) - reach - y0) / step))
        j1 = min(rows, math.ceil((max(ay, ay + ey) + reach - y0) / step) + 1)
        for j in range(j0, j1):
            y = y0 + j * step
            start = x0 + (0.5 * h if j & 1 else 0.0)
            i0 = max(0, math.floor((min(ax, ax + ex) - reach - start) / h))
            i1 = min(columns, math.ceil((max(ax, ax + ex) + reach - start) / h) + 1)
            for i in range(i0, i1):  # with no branches: which nodes are near nobody can foresee
                px, py = start + i * h - ax, y - ay
                q = min(1.0, max(0.0, (px * ex + py * ey) * inverse))
                px, py = px - q * ex, py - q * ey
                inside[j, i] &= px * px + py * py >= reach * reach


@kernel
def write_core(role, place, axes, numbers, rim, inner, points, triangles):
    """Write the nodes inside the core (n, 3) and its triangles (m, 3), row by row.

    role (rows, columns) : 2 at nodes of the rim, 3 at nodes of the core alone, less elsewhere, 0 around the table.
    place : x0, y0 and step of the lattice. axes (3, 3) : where the plane lies in space, its origin and its two axes.
    numbers (2, columns) : scratch space. rim, inner : numbers of the first node of the rim and of the core alone.
    """
    rows, columns = role.shape
    x0, y0, h = place[0], place[1], place[2]
    step = h * ROW
    written, m = 0, 0
    for i in range(columns):
        numbers[0, i] = -1
    for j in range(1, rows):
        start, y = x0 + (0.5 * h if j & 1 else 0.0), y0 + j * step
        above, below = j & 1, 1 - (j & 1)
        for i in range(columns):
            numbers[above, i] = -1
            if role[j, i] == 2:
                numbers[above, i] = rim
                rim += 1
            elif role[j, i] == 3:
                x = start + i * h
                for k in range(3):
                    points[written, k] = axes[0, k] + x * axes[1, k] + y * axes[2, k]
                numbers[above, i] = inner + written
                written += 1
        # row j - 1 is odd where ``below`` is 1
        for i in range(columns - 2):
            a, b, c = numbers[below, i], numbers[below, i + 1], numbers[above, i + below]
            if min(a, b, c) >= 0:
                triangles[m, 0], triangles[m, 1], triangles[m, 2] = a, b, c
                m += 1
            a, b, c = numbers[below, i + above], numbers[above, i + 1], numbers[above, i]
            if min(a, b, c) >= 0:
                triangles[m, 0], triangles[m, 1], triangles[m, 2] = a, b, c
                m += 1
