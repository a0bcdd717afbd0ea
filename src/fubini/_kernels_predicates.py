"""Exact signs of the orientation and in-circle determinants.

Each predicate is a plain evaluation with an error bound (Shewchuk, "Adaptive precision floating-point
arithmetic and fast robust geometric predicates", 1997, figures 21 and 23: ``CCW_ERROR`` and ``ICC_ERROR``).
Where the bound cannot decide, in_circle tries two cheap tests made for lattices, whose points are cocircular
all the time; what is left goes to expansions, sums of doubles that hold a number exactly.

Exact as long as no product of four coordinates overflows and no product of four of their last bits
underflows: coordinates between about 1e-60 and 1e60 in magnitude, and zero.
"""

from __future__ import annotations

import numpy as np

from fubini._jit import inner, kernel

EPSILON = 2.0**-53
CCW_ERROR = (3.0 + 16.0 * EPSILON) * EPSILON
ICC_ERROR = (10.0 + 96.0 * EPSILON) * EPSILON
#: Double-double in-circle: about 60 roundings of 2**-104 each, generously 2**-96.
ICC_ERROR_DOUBLE = 2.0**-96
SPLITTER = 2.0**27 + 1.0

#: The exact determinants as a list of steps "out += e f" on rows of expansions, so that the code is compiled
#: once. Rows 0-5: differences ax, ay, bx, by, cx, cy to the last point; 6-11: their negatives; 12-14: lifts
#: of a, b, c; 15: minor of a and b; 16: of b and c; 17: of c and a; 18: the in-circle determinant.
STEPS = np.array(
    [(15, 0, 3), (15, 7, 2), (16, 2, 5), (16, 9, 4), (17, 4, 1), (17, 11, 0)]
    + [(12 + i // 2, i, i) for i in range(6)]
    + [(18, 12, 16), (18, 13, 17), (18, 14, 15)],
    np.int64,
)
ORIENTATION_STEPS, IN_CIRCLE_STEPS = 2, 15


@inner
def two_sum(a, b):
    """(s, e) with s = fl(a + b) and s + e = a + b exactly (Knuth)."""
    s = a + b
    bb = s - a
    return s, (a - (s - bb)) + (b - bb)


@inner
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


@inner
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


@inner(allocates=True)
def exact_determinant(ax, ay, bx, by, cx, cy, dx, dy, steps):
    """Sign carrier of the in-circle determinant of a, b, c, d (all steps) or of the orientation of a, b, d.

    Carries out the first so many STEPS; for the orientation ORIENTATION_STEPS.
    """
    size = np.empty(19, np.int64)
    term = np.empty((19, 1600))
    for row in range(19):
        size[row] = 0
    ends = (ax, ay, bx, by, cx, cy)
    for row in range(6):
        high, low = two_sum(ends[row], -dy if row % 2 else -dx)
        term[row, 0], term[row, 1], size[row] = low, high, 2
        term[6 + row, 0], term[6 + row, 1], size[6 + row] = -low, -high, 2
    out = np.int64(0)
    for step in range(steps):
        out = np.int64(STEPS[step, 0])
        e, f = np.int64(STEPS[step, 1]), np.int64(STEPS[step, 2])
        size[out] = add_product(term[out], size[out], term[e], size[e], term[f], size[f])
    return term[out, size[out] - 1] if size[out] > 0 else 0.0


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
    return exact_determinant(ax, ay, bx, by, cx, cy, cx, cy, ORIENTATION_STEPS)


@inner
def double_cross(a, al, b, bl, c, cl, d, dl):
    """a b + c d as a double-double, each factor a double and the small rest (.l) that rounding took from it."""
    p, e = two_product(a, b)
    q, f = two_product(c, d)
    s, g = two_sum(p, q)
    return two_sum(s, g + ((e + (a * bl + al * b)) + (f + (c * dl + cl * d))))


@inner
def mirrored(au, av, bu, bv, cu, cv, du, dv):
    """Whether one line of constant u mirrors a to b and c to d: then the four are cocircular."""
    return av == bv and cv == dv and two_sum(au, bu) == two_sum(cu, du)


@inner
def double_in_circle(ax, ay, bx, by, cx, cy, dx, dy):
    """In-circle determinant in double-double, or zero where its error bound cannot decide the sign."""
    ax, axl = two_sum(ax, -dx)
    ay, ayl = two_sum(ay, -dy)
    bx, bxl = two_sum(bx, -dx)
    by, byl = two_sum(by, -dy)
    cx, cxl = two_sum(cx, -dx)
    cy, cyl = two_sum(cy, -dy)
    high, low, size = 0.0, 0.0, 0.0
    for _ in range(3):
        lift, lift_low = double_cross(ax, axl, ax, axl, ay, ayl, ay, ayl)
        minor, minor_low = double_cross(bx, bxl, cy, cyl, -by, -byl, cx, cxl)
        p, e = two_product(lift, minor)
        high, error = two_sum(high, p)
        low += error + (e + (lift * minor_low + lift_low * minor))
        size += lift * (abs(bx * cy) + abs(by * cx))
        ax, axl, bx, bxl, cx, cxl = bx, bxl, cx, cxl, ax, axl
        ay, ayl, by, byl, cy, cyl = by, byl, cy, cyl, ay, ayl
    det = high + low
    return det if abs(det) > ICC_ERROR_DOUBLE * size else 0.0


@inner
def close_in_circle(ax, ay, bx, by, cx, cy, dx, dy):
    """in_circle where plain arithmetic cannot decide: symmetry, then double-double, then expansions."""
    if (
        mirrored(ax, ay, bx, by, cx, cy, dx, dy)
        or mirrored(ay, ax, by, bx, cy, cx, dy, dx)
        or mirrored(ax, ay, cx, cy, bx, by, dx, dy)
        or mirrored(ay, ax, cy, cx, by, bx, dy, dx)
    ):
        return 0.0
    det = double_in_circle(ax, ay, bx, by, cx, cy, dx, dy)
    if det != 0.0:
        return det
    return exact_determinant(ax, ay, bx, by, cx, cy, dx, dy, IN_CIRCLE_STEPS)


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
        out[i] = np.sign(in_circle(a[i, 0], a[i, 1], b[i, 0], b[i, 1], c[i, 0], c[i, 1], d[i, 0], d[i, 1]))
