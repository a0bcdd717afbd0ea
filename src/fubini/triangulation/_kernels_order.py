"""Order of insertion: rounds of random points, each along a Hilbert curve (Amenta, Choi, Rote: BRIO, 2003).

Neighbours in the order are neighbours in the plane, so the walk to a new point is short and memory stays near;
the rounds, each a quarter of the next, keep the flips few where points lie along curves or in columns, which
a Hilbert curve alone does not.
"""

from __future__ import annotations

import numpy as np

from fubini._jit import inner

#: Levels of the curve: cells of 2**-14 of the bounding square; points in one cell keep their order.
LEVELS = 14
#: Rounds; a point is in the first with probability 4**(1 - ROUNDS).
ROUNDS = 10
#: A key has 28 bits of the curve and 4 of the round; they are sorted in three passes of 11, those of few points in
#: four of 8: counting takes as long as sorting then.
DIGIT, SMALL_DIGIT, FEW = 11, 8, 2048
INDEX_BITS = 31
#: Factors and shifts that mix bits; the two lowest bits.
FIRST, SECOND = np.uint64(0x1E3779B97F4A7C15), np.uint64(0x3F58476D1CE4E5B9)
HALF, SHORT, TWO, LOWEST, NONE = np.uint64(30), np.uint64(27), np.uint64(2), np.uint64(3), np.uint64(0)


@inner
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


@inner
def insertion_round(index):
    """Round of a point, 0 to ROUNDS - 1, from the bits of its index, well mixed (as in Steele's SplitMix64).

    In integers without a sign: where products of others leave their range, compilers may do as they like.
    """
    bits = np.uint64(index) * FIRST
    bits = (bits ^ (bits >> HALF)) * SECOND
    bits ^= bits >> SHORT
    turn = ROUNDS - 1
    while turn > 0 and bits & LOWEST == NONE:
        bits >>= TWO
        turn -= 1
    return turn


@inner(allocates=True)
def insertion_order(points, low_x, low_y, extent):
    """(n,) int64, indices of points (n, 2) in the order of insertion; low and extent bound them by a square."""
    n = points.shape[0]
    scale = (2**LEVELS - 1) / extent
    packed = np.empty(n, np.int64)
    other = np.empty(n, np.int64)
    for i in range(n):
        x, y = np.int64((points[i, 0] - low_x) * scale), np.int64((points[i, 1] - low_y) * scale)
        packed[i] = (insertion_round(i) << 2 * LEVELS | hilbert_key(x, y)) << INDEX_BITS | i
    bits = SMALL_DIGIT if n < FEW else DIGIT
    start = np.empty(1 << bits, np.int64)
    mask = (1 << bits) - 1
    for shift in range(INDEX_BITS, 63, bits):
        for digit in range(start.shape[0]):
            start[digit] = 0
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
