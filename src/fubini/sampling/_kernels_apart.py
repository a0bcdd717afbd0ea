"""Whether the nodes of a boundary lie so far apart that no gap between its parts can be too narrow."""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel

#: Pairs of nodes looked at for each node before it is left to a triangulation: a boundary of very different sizes.
PAIRS = 64
#: Primes that spread cells of a grid over a table.
HASH = (73856093, 19349663)


@inner
def neighbours_along(points, segments, size, before, after, reach, length, shortest):
    """Nodes before and after each node (n,), largest size of the three, longer segment of the two; whether that is all.

    It is not where a node is passed twice, or a segment is no shorter than ``shortest`` times the sizes at its ends.
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
        if d >= shortest * (size[a] + size[b]):
            return False
        length[a], length[b] = max(length[a], d), max(length[b], d)
    for v in range(n):
        if before[v] < 0 or after[v] < 0:
            return False
        reach[v] = max(size[v], max(size[before[v]], size[after[v]]))
    return True


@inner
def is_clear(points, size, v, a, b, least):
    """Whether node v is at least ``least`` times its size, and that at its foot, from the segment from a to b."""
    ex, ey = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    px, py = points[v, 0] - points[a, 0], points[v, 1] - points[a, 1]
    square = ex * ex + ey * ey
    q = min(1.0, max(0.0, (px * ex + py * ey) / square)) if square > 0.0 else 0.0
    x, y = px - q * ex, py - q * ey
    wanted = least * max(size[v], q * size[b] + (1.0 - q) * size[a])
    return x * x + y * y >= wanted * wanted


@inner
def are_clear(points, size, before, after, v, w, least):
    """Whether node v is clear of the segments at w, and w of those at v; v and w are not neighbours."""
    return (
        is_clear(points, size, v, before[w], w, least)
        and is_clear(points, size, v, w, after[w], least)
        and is_clear(points, size, w, before[v], v, least)
        and is_clear(points, size, w, v, after[v], least)
    )


@kernel(allocates=True)
def all_apart(points, segments, size, angle, sharp, g, factor, threshold):
    """Whether nodes lie so far from segments at which they do not end that ``look_across`` would see no gap too narrow.

    What a gap asks for is then no less than ``threshold`` times the size at the node beside it, nor on the segment; no
    size grows from such a one to less than ``threshold`` times any other; and since a segment is shorter than its two
    ends are, together, from any other, no two cross. A node is at least ``sqrt(d^2 - l^2 / 4)`` from a segment of
    length l whose ends are at least d from it: nearer ones alone are measured. False where a closer look is due, as
    beside sharp corners.
    """
    n, clear = points.shape[0], threshold / factor
    before, after = np.empty(n, np.int32), np.empty(n, np.int32)
    reach, length = np.empty(n), np.empty(n)
    least, most, longest = math.inf, 0.0, 0.0
    for v in range(n):
        if angle[v] < sharp:
            return False
        least, most = min(least, size[v]), max(most, size[v])
    if not neighbours_along(points, segments, size, before, after, reach, length, clear):
        return False
    for v in range(n):
        longest = max(longest, length[v])
        w = after[v]
        if not (is_clear(points, size, v, w, after[w], clear) and is_clear(points, size, w, before[v], v, clear)):
            return False
    radius = max(math.sqrt((most / factor) ** 2 + 0.25 * longest**2), threshold * (most - least) / g)
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
    left = PAIRS * n
    for v in range(n):
        i, j = np.int64((points[v, 0] - x0) / radius) + 1, np.int64((points[v, 1] - y0) / radius) + 1
        for row in range(i - 1, i + 2):
            for column in range(j - 1, j + 2):
                w = first[(row * HASH[0] ^ column * HASH[1]) & mask]
                while w >= 0:
                    x, y = points[v, 0] - points[w, 0], points[v, 1] - points[w, 1]
                    square = x * x + y * y
                    if square < radius * radius:
                        smaller, larger = min(size[v], size[w]), max(size[v], size[w])
                        if threshold * smaller + g * math.sqrt(square) < threshold * larger:
                            return False
                        d, l = max(reach[v], reach[w]) / factor, max(length[v], length[w])
                        near = square < d * d + 0.25 * l * l and before[v] != w and after[v] != w
                        if near and not are_clear(points, size, before, after, v, w, clear):
                            return False
                    w = following[w]
                    left -= 1
        if left < 0:
            return False
        cell = (i * HASH[0] ^ j * HASH[1]) & mask
        following[v] = first[cell]
        first[cell] = v
    return True
