"""Smoothing: interior nodes move to where the triangles around them are nearest to equilateral.

The shape of a triangle is ``r = (a^2 + b^2 + c^2) / (4 sqrt(3) A)``, 1 for the equilateral one and infinite at no
area. With ``d = r - 1`` its cost is ``sqrt(d + NEAR) + FAR d^4``: the root grows like the loss of skewness, so
that the mean rises; the fourth power keeps the worst from paying for it.
"""

from __future__ import annotations

import math

from fubini._jit import inner, kernel
from fubini.triangulation._kernels_topology import count_stars, fill_vertex_triangle, legalise

ROOT3 = math.sqrt(3.0)
NEAR, FAR = 0.01, 50.0
#: stars of a cost below this times their number of triangles are left alone
GOOD = 1e-7
#: attempts to shorten a step that does not pay, and by what
SHORTER, STEPS = 0.4, 4
#: sweeps over all nodes before edges are flipped
SWEEPS = 2


@inner
def gather(tri, fixed, first, star):
    """Edges opposite to every node from ``fixed`` on: node v has star[first[v - fixed] : first[v - fixed + 1]].

    first (n - fixed + 1,) int32, star (3 m, 2) int32; both are written.
    """
    count_stars(tri, fixed, first)
    for t in range(tri.shape[0]):
        for i in range(3):
            v = tri[t, i] - fixed
            if v >= 0:
                q = first[v]
                star[q, 0], star[q, 1] = tri[t, (i + 1) % 3], tri[t, (i + 2) % 3]
                first[v] += 1
    for v in range(first.shape[0] - 1, 0, -1):
        first[v] = first[v - 1]
    first[0] = 0


@inner
def star_cost(points, star, low, high, x, y):
    """Cost of the triangles between (x, y) and the edges star[low:high]; infinite where one is upside down."""
    total = 0.0
    for q in range(low, high):
        b, c = star[q, 0], star[q, 1]
        bx, by, cx, cy = points[b, 0] - x, points[b, 1] - y, points[c, 0] - x, points[c, 1] - y
        area = 2.0 * ROOT3 * (bx * cy - by * cx)
        if area <= 0.0:
            return math.inf
        d = (bx * bx + by * by + cx * cx + cy * cy + (bx - cx) ** 2 + (by - cy) ** 2) / area - 1.0
        total += math.sqrt(max(d, 0.0) + NEAR) - math.sqrt(NEAR) + FAR * d * d * d * d
    return total


@inner
def newton_step(points, star, low, high, x, y):
    """Cost at (x, y) and the step towards its least value, after Newton with what is not convex left out."""
    total = gx = gy = hxx = hxy = hyy = 0.0
    for q in range(low, high):
        b, c = star[q, 0], star[q, 1]
        bx, by, cx, cy = points[b, 0] - x, points[b, 1] - y, points[c, 0] - x, points[c, 1] - y
        area = 2.0 * ROOT3 * (bx * cy - by * cx)
        if area <= 0.0:
            return math.inf, 0.0, 0.0
        r = (bx * bx + by * by + cx * cx + cy * cy + (bx - cx) ** 2 + (by - cy) ** 2) / area
        ax, ay = 2.0 * ROOT3 * (by - cy), 2.0 * ROOT3 * (cx - bx)  # derivatives of the area, of r, and again
        rx, ry = (-2.0 * (bx + cx) - r * ax) / area, (-2.0 * (by + cy) - r * ay) / area
        rxx, ryy, rxy = (4.0 - 2.0 * rx * ax) / area, (4.0 - 2.0 * ry * ay) / area, -(rx * ay + ry * ax) / area
        d = max(r - 1.0, 0.0)
        root = math.sqrt(d + NEAR)
        w = 0.5 / root + 4.0 * FAR * d * d * d
        w2 = max(0.0, 12.0 * FAR * d * d - 0.25 / (root * root * root))
        total += root - math.sqrt(NEAR) + FAR * d * d * d * d
        gx += w * rx
        gy += w * ry
        hxx += w * rxx + w2 * rx * rx
        hxy += w * rxy + w2 * rx * ry
        hyy += w * ryy + w2 * ry * ry
    det = hxx * hyy - hxy * hxy
    if det <= 0.0:
        return total, 0.0, 0.0
    return total, (gy * hxy - gx * hyy) / det, (gx * hxy - gy * hxx) / det


@inner
def smooth_sweep(points, fixed, first, star):
    """Move every interior node once, where that lowers the cost around it; the number moved."""
    moved = 0
    for v in range(fixed, points.shape[0]):
        low, high = first[v - fixed], first[v - fixed + 1]
        x, y = points[v, 0], points[v, 1]
        cost, dx, dy = newton_step(points, star, low, high, x, y)
        if cost < GOOD * (high - low) or cost == math.inf:
            continue
        for _ in range(STEPS):
            if star_cost(points, star, low, high, x + dx, y + dy) < cost:
                points[v, 0], points[v, 1] = x + dx, y + dy
                moved += 1
                break
            dx, dy = SHORTER * dx, SHORTER * dy
    return moved


@kernel
def smooth(points, tri, nbr, fixed, rounds, first, star, tri_of, stack):
    """Move the nodes from ``fixed`` on and flip edges to be Delaunay again, ``rounds`` times; moves and flips made.

    points (n, 2), tri and nbr (m, 3) are changed in place. Scratch: first (n - fixed + 1,), star (3 m, 2), tri_of (n,),
    stack (more than m,), all int32.
    """
    total = flips = 0
    for turn in range(rounds):
        if turn == 0 or flips > 0:
            gather(tri, fixed, first, star)
        moved = 0
        for _ in range(SWEEPS):
            moved += smooth_sweep(points, fixed, first, star)
        if moved == 0:
            break
        fill_vertex_triangle(tri, tri.shape[0], tri_of)
        for t in range(tri.shape[0]):
            stack[t] = t
        _, flips = legalise(points, tri, nbr, tri_of, stack, tri.shape[0])
        total += moved + flips
    return total
