"""Evening out: interior nodes move where triangles with a common edge differ too much in size.

The size of a triangle is the mean length of its edges. A node may make the worst triangle beside it worse, down to a
skewness that is still good; in later rounds, for pairs that are left, somewhat less good.
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner
from fubini.triangulation._kernels_topology import around

#: share of the limit from which on pairs count, so that they keep a distance from it
FROM = 0.97
#: compass steps begin at this share of the size and end at its last
FIRST_STEP, LAST_STEP = 0.2, 0.02
#: its directions
COMPASS = np.array([(math.cos(0.25 * math.pi * d), math.sin(0.25 * math.pi * d)) for d in range(8)])
#: triangles at a node that moves, at most
MOST = 40
#: what is noted of each: its first corner after the node, the square and the length of the edge between the two others,
#: the size beyond that edge (0 for none), its own size
X, Y, SQUARE, LENGTH, BEYOND, OWN = range(6)


@inner
def squares(points, a, b, c):
    """Squared lengths of the edges of the triangle a, b, c, and twice its area."""
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    wx, wy = ux - vx, uy - vy
    return ux * ux + uy * uy, vx * vx + vy * vy, wx * wx + wy * wy, ux * vy - uy * vx


@inner
def mean_length(uu, vv, ww):
    """Size of a triangle: the mean length of its edges, by their squares."""
    return (math.sqrt(uu) + math.sqrt(vv) + math.sqrt(ww)) / 3.0


@inner
def survey(points, tri, size):
    """Sizes of all triangles into size (m,); the square of the longest edge."""
    longest = 0.0
    for t in range(tri.shape[0]):
        uu, vv, ww, _ = squares(points, tri[t, 0], tri[t, 1], tri[t, 2])
        size[t] = mean_length(uu, vv, ww)
        longest = max(longest, max(uu, max(vv, ww)))
    return longest


@inner
def load_star(points, tri, nbr, size, t, v, fan, ring, star):
    """The triangles around interior node v, counter-clockwise from t, into fan, and what is noted of them into star.

    Their number k, -1 where there are too many; ring and star[k] repeat the first corner.
    """
    k, _ = around(tri, nbr, t, v, MOST, fan, ring)
    if k < 0:
        return k
    ring[k] = ring[0]
    for q in range(k):
        t, x, y = fan[q], points[ring[q], 0], points[ring[q], 1]
        ex, ey = points[ring[q + 1], 0] - x, points[ring[q + 1], 1] - y
        square = ex * ex + ey * ey
        u = nbr[t, (tri[t, 1] == v) + 2 * (tri[t, 2] == v)]
        star[q, X], star[q, Y], star[q, SQUARE], star[q, LENGTH] = x, y, square, math.sqrt(square)
        star[q, BEYOND] = size[u if u >= 0 else tri.shape[0] - 1 - u]
    star[k, X], star[k, Y] = star[0, X], star[0, Y]
    return k


@inner
def over(one, other, limit):
    """Square of the share by which the larger of two sizes exceeds ``limit`` times the other."""
    least = min(one, other)
    excess = max(one, other) - limit * least
    if excess <= 0.0:
        return 0.0
    return (excess / least) ** 2


@inner
def unevenness(star, k, x, y, limit, most):
    """Sum of the squared excesses over ``limit`` of all pairs with one of k triangles, their node at (x, y); at most
    ``most``. Pairs of two of them count twice.
    """
    total = before = 0.0
    ux, uy = star[0, X] - x, star[0, Y] - y
    low = math.sqrt(ux * ux + uy * uy)
    for q in range(k):
        ux, uy = star[q + 1, X] - x, star[q + 1, Y] - y
        high = math.sqrt(ux * ux + uy * uy)
        size = (low + high + star[q, LENGTH]) / 3.0
        if star[q, BEYOND] > 0.0:
            total += over(size, star[q, BEYOND], limit)
        if q > 0:
            total += 2.0 * over(size, before, limit)
        if total >= most:
            return most
        star[q, OWN] = before = size
        low = high
    return min(most, total + 2.0 * over(before, star[0, OWN], limit))


@inner
def shape(star, q, x, y):
    """Shape of triangle q with its node at (x, y), infinite where it is upside down."""
    ux, uy, wx, wy = star[q, X] - x, star[q, Y] - y, star[q + 1, X] - x, star[q + 1, Y] - y
    area4 = 2.0 * (ux * wy - uy * wx)
    if area4 <= 0.0:
        return math.inf
    uu, ww, ee = ux * ux + uy * uy, wx * wx + wy * wy, star[q, SQUARE]
    return (max(uu, max(ww, ee)) - min(uu, min(ww, ee))) / area4


@inner
def spoils(star, k, x0, y0, x, y, good):
    """Whether their node at (x, y) makes the shape of one of k triangles worse than at (x0, y0) and than ``good``."""
    for q in range(k):
        now = shape(star, q, x, y)
        if now > good and now > shape(star, q, x0, y0):
            return True
    return False


@inner
def even_node(points, star, k, v, limit, good):
    """Move node v by compass search to where the pairs around it are least uneven; whether it moved.

    No shape beside it becomes worse than it is and than ``good``. The sizes of its k triangles are in star then.
    """
    x0, y0 = points[v, 0], points[v, 1]
    x, y = x0, y0
    old = unevenness(star, k, x, y, limit, math.inf)
    if old == 0.0:
        return False
    best, step, last, way = old, FIRST_STEP * star[0, OWN], LAST_STEP * star[0, OWN], 0
    while step > last and best > 0.0:
        moved = False
        for d in range(way, way + 8):
            p, q = x + step * COMPASS[d & 7, 0], y + step * COMPASS[d & 7, 1]
            cost = unevenness(star, k, p, q, limit, best)
            if cost < best and not spoils(star, k, x0, y0, p, q, good):
                x, y, best, moved, way = p, q, cost, True, d & 7
                break
        if not moved:
            step *= 0.5
    if best > 0.999 * old:
        return False
    points[v, 0], points[v, 1] = x, y
    unevenness(star, k, x, y, limit, math.inf)
    return True


@inner
def unchanged(nbr, fan, k, stamp, since):
    """Whether k triangles and those beside them have the sizes that they had at move ``since``."""
    for q in range(k):
        t = fan[q]
        if stamp[t] > since:
            return False
        for i in range(3):
            if nbr[t, i] >= 0 and stamp[nbr[t, i]] > since:
                return False
    return True


@inner
def even_pair(points, tri, nbr, fixed, limit, good, pair, fan, ring, star, size, stamp, failed, total):
    """``even_node`` at the six corners of a pair of triangles; the new number of moves, so far ``total``."""
    for k in range(6):
        t = pair[0] if k < 3 else pair[1]
        v = np.int64(tri[t, k if k < 3 else k - 3])
        if v < fixed:
            continue
        number = load_star(points, tri, nbr, size, t, v, fan, ring, star)
        since = failed[v - fixed]
        if number < 0 or (since >= 0 and unchanged(nbr, fan, number, stamp, since)):
            continue
        if even_node(points, star, number, v, FROM * limit, good):
            total += 1
            for q in range(number):
                size[fan[q]], stamp[fan[q]] = star[q, OWN], total
        else:
            failed[v - fixed] = total
    return total


@inner
def differ(nbr, size, t, i, limit):
    """Whether triangle t differs by more than ``limit`` from what lies beyond its edge i; pairs inside once."""
    u = np.int64(nbr[t, i])
    if 0 <= u <= t:
        return False
    beyond = size[u if u >= 0 else nbr.shape[0] - 1 - u]
    return beyond > 0.0 and max(size[t], beyond) > limit * min(size[t], beyond)


@inner
def count_uneven(nbr, limit, size):
    """Number of pairs that differ by more than ``limit``."""
    found = 0
    for t in range(nbr.shape[0]):
        for i in range(3):
            found += differ(nbr, size, t, i, limit)
    return found


@inner(allocates=True)
def even_out(points, tri, nbr, fixed, limit, kept, outside, segments):
    """Move the nodes from ``fixed`` on of pairs that differ by more than ``limit``.

    Returns the number of moves, and as it is then: the pairs left above the limit, the square of the longest edge.
    points (n, 2) is changed in place. kept (r,) : shapes, (Lmax^2 - Lmin^2) / 4 A, to which no objection is made in
    each of r rounds; without rounds nothing is looked at. outside : sizes beyond each of so many ``segments``, 0 for
    none; empty where nothing lies beyond any.
    """
    if kept.shape[0] == 0:
        return 0, 0, 0.0
    fan, ring, star = np.empty(MOST, np.int64), np.empty(MOST + 1, np.int64), np.empty((MOST + 1, 6))
    size, stamp = np.empty(tri.shape[0] + segments), np.zeros(tri.shape[0], np.int32)  # move that last changed one
    for s in range(segments):
        size[tri.shape[0] + s] = outside[s] if outside.shape[0] > 0 else 0.0
    failed = np.empty(points.shape[0] - fixed, np.int32)  # moves made when a node last stayed where it was
    total, longest = 0, survey(points, tri, size)
    for turn in range(kept.shape[0]):
        uneven = 0
        for t in range(tri.shape[0]):
            for i in range(3):
                if not differ(nbr, size, t, i, limit):
                    continue
                if uneven == 0:
                    for v in range(failed.shape[0]):
                        failed[v] = -1
                uneven += 1
                pair = t, max(t, np.int64(nbr[t, i]))  # the triangle alone, where the other is of another face
                total = even_pair(
                    points, tri, nbr, fixed, limit, kept[turn], pair, fan, ring, star, size, stamp, failed, total
                )
        if uneven == 0:
            return total, 0, longest if total == 0 else survey(points, tri, size)
    return total, count_uneven(nbr, limit, size), survey(points, tri, size)
