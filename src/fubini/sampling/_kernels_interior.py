"""Compiled part of the interior sampling: a hexagonal lattice between the limits of horizontal slices."""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel

ROW = 0.8660254037844386  # sqrt(3) / 2


@kernel(allocates=True)
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


@kernel(allocates=True)
def lattice(points, segments, size, h, x0, y0, columns, rows, clearance, g):
    """Lattice nodes inside the boundary and clear of it, (n, 2), row by row, and where they are (rows, columns).

    Row j of the lattice lies at y0 + j h sqrt(3)/2 and starts at x0, odd rows half a step further.
    A node stays when its row's limits enclose it and it is at least ``clearance`` h from every
    segment, further where the segment is finer: there the size grows from the segment with
    gradient g until it reaches h.
    """
    step = h * ROW
    inside = np.empty((rows, columns), np.uint8)
    for j in range(rows):
        for i in range(columns):
            inside[j, i] = 0
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
        square = ex * ex + ey * ey
        reach = clearance * h
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
            for i in range(i0, i1):
                if inside[j, i] == 0:
                    continue
                px, py = start + i * h - ax, y - ay
                q = min(1.0, max(0.0, (px * ex + py * ey) / square))
                if (px - q * ex) ** 2 + (py - q * ey) ** 2 < reach * reach:
                    inside[j, i] = 0
    n = 0
    for j in range(rows):
        for i in range(columns):
            n += inside[j, i]
    out = np.empty((n, 2))
    n = 0
    for j in range(rows):
        start = x0 + (0.5 * h if j & 1 else 0.0)
        for i in range(columns):
            if inside[j, i]:
                out[n, 0] = start + i * h
                out[n, 1] = y0 + j * step
                n += 1
    return out, inside


@kernel
def erode(inside, out):
    """Write into out (rows, columns) which nodes have all six neighbours, the rim of the table excepted."""
    rows, columns = inside.shape
    for j in range(rows):
        odd = j & 1
        for i in range(columns):
            out[j, i] = 0
            if inside[j, i] and 0 < j < rows - 1 and 0 < i < columns - 1:
                a, b = i - 1 + odd, i + odd
                row = inside[j, i - 1] & inside[j, i + 1]
                out[j, i] = row & inside[j - 1, a] & inside[j - 1, b] & inside[j + 1, a] & inside[j + 1, b]


@inner
def number_rim(neighbours, t, rim):
    """Give the edges of triangle t without a neighbour the next numbers; the next one after them."""
    for e in range(3):
        if neighbours[t, e] < 0:
            neighbours[t, e] = -1 - rim
            rim += 1
    return rim


@kernel
def core_triangles(deep, number, table, triangles, neighbours):
    """Triangles between deep nodes (rows, columns), and their neighbours; the number of triangles and of rim edges.

    ``number`` (rows, columns) names the nodes. ``table`` (2, rows, columns) is scratch space for the numbers of
    the triangles that point up and down: up[j, i] stands on nodes i, i + 1 of row j, down[j, i] hangs from nodes i,
    i + 1 of row j + 1. An edge of the rim, with no triangle across, has the neighbour -1 - k, k counting these edges.
    ``triangles`` and ``neighbours`` have room for every triangle.
    """
    rows, columns = deep.shape
    up, down = table[0], table[1]
    m = 0
    for j in range(rows):
        odd = j & 1
        for i in range(columns):
            up[j, i], down[j, i] = -1, -1
            if j == rows - 1 or i >= columns - 2:
                continue
            if deep[j, i] & deep[j, i + 1] & deep[j + 1, i + odd]:
                up[j, i] = m
                triangles[m, 0], triangles[m, 1] = number[j, i], number[j, i + 1]
                triangles[m, 2] = number[j + 1, i + odd]
                m += 1
            if deep[j, i + 1 - odd] & deep[j + 1, i + 1] & deep[j + 1, i]:
                down[j, i] = m
                triangles[m, 0], triangles[m, 1] = number[j, i + 1 - odd], number[j + 1, i + 1]
                triangles[m, 2] = number[j + 1, i]
                m += 1
    rim = 0
    for j in range(1, rows - 1):
        odd = j & 1
        for i in range(1, columns - 1):
            t, u = up[j, i], down[j, i]
            if t >= 0:
                neighbours[t, 0], neighbours[t, 1] = down[j, i + odd], down[j, i - 1 + odd]
                neighbours[t, 2] = down[j - 1, i]
                rim = number_rim(neighbours, t, rim)
            if u >= 0:
                neighbours[u, 0], neighbours[u, 1] = up[j + 1, i], up[j, i - odd]
                neighbours[u, 2] = up[j, i + 1 - odd]
                rim = number_rim(neighbours, u, rim)
    return m, rim
