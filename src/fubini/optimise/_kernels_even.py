"""Evening out: interior nodes move where triangles with a common edge differ too much in size.

The size of a triangle is the mean length of its edges. A node may make the worst triangle beside it worse, down to a
skewness that is still good; in later rounds, for pairs that are left, somewhat less good.
"""

from __future__ import annotations

import math

from fubini._jit import inner, kernel
from fubini.triangulation._kernels_topology import count_stars

#: share of the limit from which on pairs count, so that they keep a distance from it
FROM = 0.97
#: compass steps begin at this share of the size and end at its last
FIRST_STEP, LAST_STEP = 0.2, 0.02


@inner
def triangle_size(points, tri, t, v, x, y):
    """Mean edge length of triangle t with node v at (x, y), and its shape (infinite where it is inverted)."""
    a, b, c = tri[t, 0], tri[t, 1], tri[t, 2]
    ax, ay, bx, by, cx, cy = points[a, 0], points[a, 1], points[b, 0], points[b, 1], points[c, 0], points[c, 1]
    if a == v:
        ax, ay = x, y
    if b == v:
        bx, by = x, y
    if c == v:
        cx, cy = x, y
    ux, uy, wx, wy = bx - ax, by - ay, cx - ax, cy - ay
    area4 = 2.0 * (ux * wy - uy * wx)
    l0, l1, l2 = ux * ux + uy * uy, wx * wx + wy * wy, (ux - wx) ** 2 + (uy - wy) ** 2
    size = (math.sqrt(l0) + math.sqrt(l1) + math.sqrt(l2)) / 3.0
    if area4 <= 0.0:
        return size, math.inf
    return size, (max(l0, max(l1, l2)) - min(l0, min(l1, l2))) / area4


@inner
def unevenness(points, tri, nbr, star, low, high, v, x, y, limit):
    """Sum of the squared excesses over ``limit`` of all pairs with a triangle at v, v at (x, y)."""
    total = 0.0
    for q in range(low, high):
        t = star[q]
        size, _ = triangle_size(points, tri, t, v, x, y)
        for i in range(3):
            u = nbr[t, i]
            if u >= 0:
                other, _ = triangle_size(points, tri, u, v, x, y)
                excess = max(size, other) - limit * min(size, other)
                if excess > 0.0:
                    total += (excess / min(size, other)) ** 2
    return total


@inner
def spoils(points, tri, star, low, high, v, x, y, good):
    """Whether v at (x, y) makes the shape of a triangle worse than it is and than ``good``."""
    for q in range(low, high):
        _, shape = triangle_size(points, tri, star[q], v, x, y)
        if shape > good:
            _, now = triangle_size(points, tri, star[q], -1, 0.0, 0.0)
            if shape > now:
                return True
    return False


@inner
def gather_triangles(tri, fixed, first, star):
    """Triangles at every node from ``fixed`` on: star[first[v - fixed] : first[v - fixed + 1]]."""
    count_stars(tri, fixed, first)
    for t in range(tri.shape[0]):
        for i in range(3):
            v = tri[t, i] - fixed
            if v >= 0:
                star[first[v]] = t
                first[v] += 1
    for v in range(first.shape[0] - 1, 0, -1):
        first[v] = first[v - 1]
    first[0] = 0


@inner
def even_node(points, tri, nbr, star, low, high, v, limit, good):
    """Move node v by compass search to where the pairs around it are least uneven; whether it moved.

    No shape beside it becomes worse than it is and than ``good``.
    """
    x, y = points[v, 0], points[v, 1]
    old = unevenness(points, tri, nbr, star, low, high, v, x, y, limit)
    if old == 0.0:
        return False
    size, _ = triangle_size(points, tri, star[low], v, x, y)
    best, step = old, FIRST_STEP * size
    while step > LAST_STEP * size and best > 0.0:
        moved = False
        for d in range(8):
            p, q = x + step * math.cos(0.25 * math.pi * d), y + step * math.sin(0.25 * math.pi * d)
            cost = unevenness(points, tri, nbr, star, low, high, v, p, q, limit)
            if cost < best and not spoils(points, tri, star, low, high, v, p, q, good):
                x, y, best, moved = p, q, cost, True
                break
        if not moved:
            step *= 0.5
    if best > 0.999 * old:
        return False
    points[v, 0], points[v, 1] = x, y
    return True


@kernel
def even_out(points, tri, nbr, fixed, limit, kept, first, star, size):
    """Move the nodes from ``fixed`` on of pairs that differ by more than ``limit``; the number of moves.

    points (n, 2) is changed in place. kept (r,) : shapes, (Lmax^2 - Lmin^2) / 4 A, to which no objection is made in
    each of r rounds. Scratch: first (n - fixed + 1,), star (3 m,), size (m,).
    """
    total = 0
    for turn in range(kept.shape[0]):
        moved, good = 0, kept[turn]
        for t in range(tri.shape[0]):
            size[t], _ = triangle_size(points, tri, t, -1, 0.0, 0.0)
        for t in range(tri.shape[0]):
            for i in range(3):
                u = nbr[t, i]
                if u <= t or max(size[t], size[u]) <= limit * min(size[t], size[u]):
                    continue
                if turn == 0 and moved == 0:
                    gather_triangles(tri, fixed, first, star)
                moved += 1
                for k in range(6):
                    v = tri[t, k] if k < 3 else tri[u, k - 3]
                    if v >= fixed:
                        low, high = first[v - fixed], first[v - fixed + 1]
                        if even_node(points, tri, nbr, star, low, high, v, FROM * limit, good):
                            total += 1
        if moved == 0:
            break
    return total
