"""Exact signs of the orientation and in-circle determinants.

Each predicate is a plain evaluation with an error bound (Shewchuk, "Adaptive precision floating-point
arithmetic and fast robust geometric predicates", 1997, figures 21 and 23: ``CCW_ERROR`` and ``ICC_ERROR``).
Where the bound cannot decide, in_circle tries two cheap tests made for lattices, whose points are cocircular all
the time; what is left goes to expansions, sums of doubles that hold a number exactly.

Exact as long as no product of four coordinates overflows and no product of four of their last bits
underflows: coordinates between about 1e-60 and 1e60 in magnitude, and zero.
"""

from __future__ import annotations

import numpy as np

from fubini._jit import kernel

EPSILON = 2.0**-53
CCW_ERROR = (3.0 + 16.0 * EPSILON) * EPSILON
ICC_ERROR = (10.0 + 96.0 * EPSILON) * EPSILON
#: Double-double in-circle of exact differences: about 40 roundings of 2**-104 each, generously 2**-96.
ICC_ERROR_DOUBLE = 2.0**-96
SPLITTER = 2.0**27 + 1.0


@kernel
def two_sum(a, b):
    """(s, e) with s = fl(a + b) and s + e = a + b exactly (Knuth)."""
    s = a + b
    bb = s - a
    return s, (a - (s - bb)) + (b - bb)


@kernel
def two_product(a, b):
    """(p, e) with p = fl(a b) and p + e = a b exactly (Dekker, Veltkamp)."""
    p = a * b
    c = SPLITTER * a
    a_high = c - (c - a)
    a_low = a - a_high
    c = SPLITTER * b
    b_high = c - (c - b)
    b_low = b - b_high
    return p, a_low * b_low - (((p - a_high * b_high) - a_low * b_high) - a_high * b_low)


@kernel
def add_product(total, n, e, m, f, k):
    """Add the product of the expansions e (m terms) and f (k terms) to ``total`` (n terms), in place.

    Terms are kept in increasing magnitude, non-overlapping, without zeros. Returns the new n, at most
    n + 2 m k. The sign of an expansion is the sign of its last term.
    """
    for i in range(m):
        for j in range(k):
            high, low = two_product(e[i], f[j])
            for part in (low, high):
                q = part
                kept = 0
                for term in range(n):
                    q, error = two_sum(q, total[term])
                    if error != 0.0:
                        total[kept] = error
                        kept += 1
                if q != 0.0:
                    total[kept] = q
                    kept += 1
                n = kept
    return n


@kernel
def exact_determinant(columns, circle):
    """Sign carrier of the orientation or in-circle determinant, exact.

    columns : (4, 2), points a, b, c, d. Orientation of (a, b, c) where ``circle`` is 0, else in_circle(a, b, c, d).
    """
    corners = 3 if circle else 2
    # difference[2 i + axis]: the point i minus the last one, as two terms; then its negative for i = 0..2
    difference = np.empty((12, 2))
    for i in range(corners):
        for axis in range(2):
            high, low = two_sum(columns[i, axis], -columns[corners, axis])
            difference[2 * i + axis, 0], difference[2 * i + axis, 1] = low, high
            difference[6 + 2 * i + axis, 0], difference[6 + 2 * i + axis, 1] = -low, -high
    minor = np.empty(20)
    if not circle:
        n = add_product(minor, 0, difference[0], 2, difference[3], 2)
        n = add_product(minor, n, difference[7], 2, difference[2], 2)
        return minor[n - 1] if n > 0 else 0.0
    lift = np.empty(20)
    total = np.empty(1600)
    n = 0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        size = add_product(minor, 0, difference[2 * j], 2, difference[2 * k + 1], 2)
        size = add_product(minor, size, difference[7 + 2 * j], 2, difference[2 * k], 2)
        length = add_product(lift, 0, difference[2 * i], 2, difference[2 * i], 2)
        length = add_product(lift, length, difference[2 * i + 1], 2, difference[2 * i + 1], 2)
        n = add_product(total, n, lift, length, minor, size)
    return total[n - 1] if n > 0 else 0.0


@kernel
def orient(ax, ay, bx, by, cx, cy):
    """Positive where a, b, c turn left, negative where they turn right, zero where they are collinear."""
    left = (ax - cx) * (by - cy)
    right = (ay - cy) * (bx - cx)
    det = left - right
    if abs(det) > CCW_ERROR * (abs(left) + abs(right)):
        return det
    if left == 0.0 and right == 0.0 and (ax == cx or by == cy) and (ay == cy or bx == cx):
        return 0.0
    columns = np.empty((4, 2))
    columns[0, 0], columns[0, 1] = ax, ay
    columns[1, 0], columns[1, 1] = bx, by
    columns[2, 0], columns[2, 1] = cx, cy
    return exact_determinant(columns, 0)


@kernel
def double_cross(a, b, c, d):
    """a b + c d of doubles as a double-double."""
    p, e = two_product(a, b)
    q, f = two_product(c, d)
    s, g = two_sum(p, q)
    return two_sum(s, g + (e + f))


@kernel
def mirrored(au, av, bu, bv, cu, cv, du, dv):
    """Whether one line of constant u mirrors a to b and c to d: then the four are cocircular."""
    return av == bv and cv == dv and two_sum(au, bu) == two_sum(cu, du)


@kernel
def double_in_circle(ax, ay, bx, by, cx, cy):
    """In-circle determinant of differences to the fourth point, in double-double.

    Returns the determinant, or zero where its error bound cannot decide the sign.
    """
    high, low, size = 0.0, 0.0, 0.0
    for _ in range(3):
        lift, lift_low = double_cross(ax, ax, ay, ay)
        minor, minor_low = double_cross(bx, cy, -by, cx)
        p, e = two_product(lift, minor)
        high, error = two_sum(high, p)
        low += error + (e + (lift * minor_low + lift_low * minor))
        size += lift * (abs(bx * cy) + abs(by * cx))
        ax, ay, bx, by, cx, cy = bx, by, cx, cy, ax, ay
    det = high + low
    return det if abs(det) > ICC_ERROR_DOUBLE * size else 0.0


@kernel
def close_in_circle(ax, ay, bx, by, cx, cy, dx, dy):
    """in_circle where plain arithmetic cannot decide: symmetry, then double-double, then expansions."""
    if (
        mirrored(ax, ay, bx, by, cx, cy, dx, dy)
        or mirrored(ay, ax, by, bx, cy, cx, dy, dx)
        or mirrored(ax, ay, cx, cy, bx, by, dx, dy)
        or mirrored(ay, ax, cy, cx, by, bx, dy, dx)
    ):
        return 0.0
    aex, tail = two_sum(ax, -dx)
    aey, tail_next = two_sum(ay, -dy)
    tails = abs(tail) + abs(tail_next)
    bex, tail = two_sum(bx, -dx)
    bey, tail_next = two_sum(by, -dy)
    tails += abs(tail) + abs(tail_next)
    cex, tail = two_sum(cx, -dx)
    cey, tail_next = two_sum(cy, -dy)
    tails += abs(tail) + abs(tail_next)
    if tails == 0.0:
        det = double_in_circle(aex, aey, bex, bey, cex, cey)
        if det != 0.0:
            return det
    columns = np.empty((4, 2))
    columns[0, 0], columns[0, 1] = ax, ay
    columns[1, 0], columns[1, 1] = bx, by
    columns[2, 0], columns[2, 1] = cx, cy
    columns[3, 0], columns[3, 1] = dx, dy
    return exact_determinant(columns, 1)


@kernel
def in_circle(ax, ay, bx, by, cx, cy, dx, dy):
    """Positive where d lies inside the circle through the counter-clockwise a, b, c; zero on it."""
    aex, aey = ax - dx, ay - dy
    bex, bey = bx - dx, by - dy
    cex, cey = cx - dx, cy - dy
    bc, cb = bex * cey, cex * bey
    ca, ac = cex * aey, aex * cey
    ab, ba = aex * bey, bex * aey
    a_lift = aex * aex + aey * aey
    b_lift = bex * bex + bey * bey
    c_lift = cex * cex + cey * cey
    det = a_lift * (bc - cb) + b_lift * (ca - ac) + c_lift * (ab - ba)
    size = (abs(bc) + abs(cb)) * a_lift + (abs(ca) + abs(ac)) * b_lift + (abs(ab) + abs(ba)) * c_lift
    if abs(det) > ICC_ERROR * size:
        return det
    return close_in_circle(ax, ay, bx, by, cx, cy, dx, dy)


@kernel
def orient_many(a, b, c, out):
    """Write the orientation signs of the rows of a, b, c (n, 2) into out (n,) int8."""
    for i in range(out.shape[0]):
        out[i] = np.sign(orient(a[i, 0], a[i, 1], b[i, 0], b[i, 1], c[i, 0], c[i, 1]))


@kernel
def in_circle_many(a, b, c, d, out):
    """Write the in-circle signs of the rows of a, b, c, d (n, 2) into out (n,) int8."""
    for i in range(out.shape[0]):
        out[i] = np.sign(
            in_circle(a[i, 0], a[i, 1], b[i, 0], b[i, 1], c[i, 0], c[i, 1], d[i, 0], d[i, 1])
        )
