"""Evening out: interior nodes move where triangles with a common edge differ too much in size.

The size of a triangle is the mean length of its edges. A node may make the worst triangle beside it worse, down to a
skewness that is still good; in later rounds, for pairs that are left, somewhat less good.
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel
from fubini.triangulation._kernels_topology import count_stars

#: share of the limit from which on pairs count, so that they keep a distance from it
FROM = 0.97
#: compass steps begin at this share of the size and end at its last
FIRST_STEP, LAST_STEP = 0.2, 0.02
#: its directions
COMPASS = np.array([(math.cos(0.25 * math.pi * d), math.sin(0.25 * math.pi * d)) for d in range(8)])


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
def unevenness(points, tri, nbr, star, low, high, v, x, y, limit, size, most):
    """Sum of the squared excesses over ``limit`` of all pairs with a triangle at v, v at (x, y), at most ``most``.

    The sizes (m,) of the triangles at v are set to those for this place.
    """
    for q in range(low, high):
        size[star[q]], _ = triangle_size(points, tri, star[q], v, x, y)
    total = 0.0
    for q in range(low, high):
        t = star[q]
        for i in range(3):
            u = nbr[t, i]
            if u >= 0:
                least = min(size[t], size[u])
                excess = max(size[t], size[u]) - limit * least
                if excess > 0.0:
                    total += (excess / least) ** 2
                    if total >= most:
                        return most
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
def even_node(points, tri, nbr, star, low, high, v, limit, good, size):
    """Move node v by compass search to where the pairs around it are least uneven; whether it moved.

    No shape beside it becomes worse than it is and than ``good``. ``size`` (m,) stays true.
    """
    x, y = points[v, 0], points[v, 1]
    old = unevenness(points, tri, nbr, star, low, high, v, x, y, limit, size, math.inf)
    if old == 0.0:
        return False
    best, step = old, FIRST_STEP * size[star[low]]
    last = LAST_STEP * size[star[low]]
    while step > last and best > 0.0:
        moved = False
        for d in range(8):
            p, q = x + step * COMPASS[d, 0], y + step * COMPASS[d, 1]
            cost = unevenness(points, tri, nbr, star, low, high, v, p, q, limit, size, best)
            if cost < best and not spoils(points, tri, star, low, high, v, p, q, good):
                x, y, best, moved = p, q, cost, True
                break
        if not moved:
            step *= 0.5
    if best > 0.999 * old:
        x, y = points[v, 0], points[v, 1]
    unevenness(points, tri, nbr, star, low, high, v, x, y, limit, size, math.inf)
    if best > 0.999 * old:
        return False
    points[v, 0], points[v, 1] = x, y
    return True


@inner
def unchanged(nbr, star, low, high, stamp, since):
    """Whether the triangles star[low:high] and those beside them have the sizes that they had at move ``since``."""
    for q in range(low, high):
        t = star[q]
        if stamp[t] > since:
            return False
        for i in range(3):
            if nbr[t, i] >= 0 and stamp[nbr[t, i]] > since:
                return False
    return True


@inner
def count_uneven(nbr, limit, size):
    """Number of pairs of neighbours whose sizes differ by more than ``limit``."""
    found = 0
    for t in range(nbr.shape[0]):
        for i in range(3):
            u = nbr[t, i]
            if u > t and max(size[t], size[u]) > limit * min(size[t], size[u]):
                found += 1
    return found


@inner
def longest_edge(points, tri):
    """Square of the length of the longest edge."""
    longest = 0.0
    for t in range(tri.shape[0]):
        a, b, c = tri[t, 0], tri[t, 1], tri[t, 2]
        ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
        wx, wy = ux - vx, uy - vy
        longest = max(longest, max(ux * ux + uy * uy, max(vx * vx + vy * vy, wx * wx + wy * wy)))
    return longest


@kernel
def even_out(points, tri, nbr, fixed, limit, kept, first, star, before, size, stamp, failed):
    """Move the nodes from ``fixed`` on of pairs that differ by more than ``limit``.

    Returns the number of moves, and as it is then: the pairs left above the limit, the square of the longest edge.
    points (n, 2) is changed in place. kept (r,) : shapes, (Lmax^2 - Lmin^2) / 4 A, to which no objection is made in
    each of r rounds. Scratch: first (n - fixed + 1,), star (3 m,); sizes before (m,) at the start of a round and
    size (m,) now; stamp (m,) int32, zero: the move that last changed a triangle; failed (n - fixed,) int32: the moves
    made when a node last stayed where it was.
    """
    total = 0
    for turn in range(kept.shape[0]):
        moved, good = 0, kept[turn]
        for t in range(tri.shape[0]):
            before[t], _ = triangle_size(points, tri, t, -1, 0.0, 0.0)
            size[t] = before[t]
        for t in range(tri.shape[0]):
            for i in range(3):
                u = nbr[t, i]
                if u <= t or max(before[t], before[u]) <= limit * min(before[t], before[u]):
                    continue
                if turn == 0 and moved == 0:
                    gather_triangles(tri, fixed, first, star)
                if moved == 0:
                    for v in range(failed.shape[0]):
                        failed[v] = -1
                moved += 1
                for k in range(6):
                    v = tri[t, k] if k < 3 else tri[u, k - 3]
                    if v < fixed:
                        continue
                    low, high = first[v - fixed], first[v - fixed + 1]
                    if failed[v - fixed] >= 0 and unchanged(nbr, star, low, high, stamp, failed[v - fixed]):
                        continue
                    if even_node(points, tri, nbr, star, low, high, v, FROM * limit, good, size):
                        total += 1
                        for q in range(low, high):
                            stamp[star[q]] = total
                    else:
                        failed[v - fixed] = total
        if moved == 0:
            break
    return total, count_uneven(nbr, limit, size), longest_edge(points, tri)
