"""Order of points along a Hilbert curve: neighbours in the order are neighbours in the plane."""

from __future__ import annotations

import numpy as np

from fubini._jit import kernel

#: Levels of the curve: cells of 2**-16 of the bounding square; points in one cell keep their order.
LEVELS = 16
#: The 32 bits of a key are sorted in three passes of 11.
DIGIT = 11
INDEX_BITS = 31


@kernel
def hilbert_key(x, y):
    """Position along the Hilbert curve of cell (x, y), both in [0, 2**LEVELS)."""
    key = 0
    for level in range(LEVELS - 1, -1, -1):
        right, up = (x >> level) & 1, (y >> level) & 1
        key = key << 2 | (3 * right) ^ up
        # turn the quadrant into the curve's standard position: swap axes below, and mirror at the lower right
        flip = -(right & (1 - up))
        x, y = x ^ flip, y ^ flip
        swap = (x ^ y) & -(1 - up)
        x, y = x ^ swap, y ^ swap
    return key


@kernel
def hilbert_order(points, low_x, low_y, extent):
    """(n,) int64, indices of points (n, 2) along the Hilbert curve of a square; ties by index."""
    n = points.shape[0]
    scale = (2**LEVELS - 1) / extent
    packed = np.empty(n, np.int64)
    other = np.empty(n, np.int64)
    for i in range(n):
        x, y = np.int64((points[i, 0] - low_x) * scale), np.int64((points[i, 1] - low_y) * scale)
        packed[i] = hilbert_key(x, y) << INDEX_BITS | i
    start = np.empty(2**DIGIT, np.int64)
    mask = 2**DIGIT - 1
    for shift in range(INDEX_BITS, 63, DIGIT):
        start[:] = 0
        for i in range(n):
            start[packed[i] >> shift & mask] += 1
        total = 0
        for digit in range(start.shape[0]):
            start[digit], total = total, total + start[digit]
        for i in range(n):
            digit = packed[i] >> shift & mask
            other[start[digit]] = packed[i]
            start[digit] += 1
        packed, other = other, packed
    for i in range(n):
        packed[i] &= 2**INDEX_BITS - 1
    return packed
