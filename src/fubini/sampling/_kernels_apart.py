"""Whether the nodes of a boundary lie so far apart that no gap between its parts can be too narrow."""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel

#: Segments longer than this times the sizes at their ends could cross and no node lie near.
LENGTHY = 1.6
#: Primes that spread cells of a grid over a table.
HASH = (73856093, 19349663)


@inner
def neighbours_along(points, segments, size, before, after, reach, length):
    """Nodes before and after each node (n,), largest size of the three, longer segment of the two; whether that is all.

    It is not where a node is passed twice, or where segments are so long for their sizes, or turn so far, that they
    could cross with no node near the other.
    """
    n = points.shape[0]
    for v in range(n):
        before[v] = after[v] = -1
        length[v] = 0.0
    for k in range(segments.shape[0]):
        a, b = segments[k, 0], segments[k, 1]
        if after[a] >= 0 or before[b] >= 0:
            return False
        after[a], before[b] = b, a
        x, y = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        d = math.sqrt(x * x + y * y)
        if d > LENGTHY * max(size[a], size[b]):
            return False
        length[a], length[b] = max(length[a], d), max(length[b], d)
    turned = np.int64(-1)
    for v in range(n):
        a, b = before[v], after[v]
        if a < 0 or b < 0:
            return False
        reach[v] = max(size[v], max(size[a], size[b]))
        ux, uy = points[v, 0] - points[a, 0], points[v, 1] - points[a, 1]
        wx, wy = points[b, 0] - points[v, 0], points[b, 1] - points[v, 1]
        dot, most = ux * wx + uy * wy, math.sqrt((ux * ux + uy * uy) * (wx * wx + wy * wy))
        if dot < -0.3 * most:
            return False
        if dot < 0.5 * most:
            if turned == a or turned == b:
                return False
            turned = v
    return True


@kernel(allocates=True)
def all_apart(points, segments, size, angle, sharp, g, factor, threshold):
    """Whether nodes that do not follow each other lie so far apart that ``look_across`` would see no gap too narrow.

    A node v is at least ``sqrt(d^2 - l^2 / 4)`` from a segment of length l whose ends are at least d from it. Where
    that is no less than the sizes at all three over ``factor``, nothing is asked by a gap; and sizes do not grow faster
    than g beyond ``threshold``. No two segments cross then. False where a closer look is due, as beside sharp corners.
    """
    n = points.shape[0]
    before, after = np.empty(n, np.int32), np.empty(n, np.int32)
    reach, length = np.empty(n), np.empty(n)
    least, most, longest = math.inf, 0.0, 0.0
    for v in range(n):
        if angle[v] < sharp:
            return False
        least, most = min(least, size[v]), max(most, size[v])
    if not neighbours_along(points, segments, size, before, after, reach, length):
        return False
    for v in range(n):
        longest = max(longest, length[v])
    radius = math.sqrt((most / factor) ** 2 + 0.25 * longest**2)
    if least + g * radius < threshold * most:
        return False
    mask = 1
    while mask < 2 * n:
        mask *= 2
    first, following = np.empty(mask, np.int32), np.empty(n, np.int32)
    mask -= 1
    for cell in range(mask + 1):
        first[cell] = -1
    x0, y0 = points[0, 0], points[0, 1]
    for v in range(n):
        x0, y0 = min(x0, points[v, 0]), min(y0, points[v, 1])
    for v in range(n):
        i, j = np.int64((points[v, 0] - x0) / radius) + 1, np.int64((points[v, 1] - y0) / radius) + 1
        for row in range(i - 1, i + 2):
            for column in range(j - 1, j + 2):
                w = first[(row * HASH[0] ^ column * HASH[1]) & mask]
                while w >= 0:
                    x, y = points[v, 0] - points[w, 0], points[v, 1] - points[w, 1]
                    square = x * x + y * y
                    if square < radius * radius:
                        beside = before[v] == w or after[v] == w
                        d, l = max(reach[v], reach[w]) / factor, max(length[v], length[w])
                        if not beside and square < d * d + 0.25 * l * l:
                            return False
                        if min(size[v], size[w]) + g * math.sqrt(square) < threshold * max(size[v], size[w]):
                            return False
                    w = following[w]
        cell = (i * HASH[0] ^ j * HASH[1]) & mask
        following[v] = first[cell]
        first[cell] = v
    return True
