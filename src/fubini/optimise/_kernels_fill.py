"""Fills of a cavity: the best triangulation of its polygon, or a star from one well-placed new point."""

from __future__ import annotations

import math

from fubini._jit import inner
from fubini.optimise._kernels_quality import cost_of, filled_corner_cost, quality
from fubini.optimise._kernels_state import STRETCH

#: fills that ``choose_fill`` may take
PROGRAMME, POINT, EITHER = 1, 2, 3
#: a compass search looks around in eighths of a turn, and halves and turns its step by 0.37 where it finds nothing
EIGHTH, TURN_X, TURN_Y = math.sqrt(0.5), 0.5 * math.cos(0.37), 0.5 * math.sin(0.37)


@inner
def corner_cost(S, W, k, a, b, c):
    """Cost of the triangle of polygon corners a < b < c."""
    px, py = W.px, W.py
    if W.ear[b] > 0 and b - a == 1 and c - b == 1:
        return filled_corner_cost(W.ear[b], px[b], py[b], px[c], py[c], px[a], py[a], S.rule)
    if W.ear[a] > 0 and b - a == 1 and c - a == k - 1:
        return filled_corner_cost(W.ear[a], px[a], py[a], px[b], py[b], px[c], py[c], S.rule)
    if W.ear[c] > 0 and c - b == 1 and c - a == k - 1:
        return filled_corner_cost(W.ear[c], px[c], py[c], px[a], py[a], px[b], py[b], S.rule)
    return cost_of(quality(px[a], py[a], px[b], py[b], px[c], py[c], S.rule), S.rule)


@inner
def programme(S, W, k, bound):
    """Cost of the best triangulation of the polygon with no new point, by dynamic programming.

    ``W.cut`` holds the choices. Gives up early with a cost above ``bound``.
    """
    best, cut = W.best, W.cut
    for i in range(k - 1):
        best[i, i + 1] = 0.0
    for d in range(2, k):
        for i in range(k - d):
            j = i + d
            low, at = 1e300, i + 1
            for m in range(i + 1, j):
                c = best[i, m] + best[m, j]
                if c < low and c < bound:
                    c += corner_cost(S, W, k, i, m, j)
                    if c < low:
                        low, at = c, m
            best[i, j] = low
            cut[i, j] = at
    return best[0, k - 1]


@inner
def read_programme(W, k):
    """Write the triangles of the last programme into W.fill; their number."""
    n, top = 0, 1
    W.ea[0], W.eb[0] = 0, k - 1
    while top > 0:
        top -= 1
        i, j = W.ea[top], W.eb[top]
        if j - i < 2:
            continue
        m = W.cut[i, j]
        W.fill[n, 0], W.fill[n, 1], W.fill[n, 2] = i, m, j
        n += 1
        W.ea[top], W.eb[top] = i, m
        W.ea[top + 1], W.eb[top + 1] = m, j
        top += 2
    return n


@inner
def lowest(rx, ry, k, closed, x, y, rule, floor):
    """Smallest f of the triangles from (x, y) to the ring's edges; stops early at or below ``floor``."""
    low = 2.0
    for i in range(k if closed else k - 1):
        j = i + 1 if i + 1 < k else 0
        f = quality(rx[i], ry[i], rx[j], ry[j], x, y, rule)
        if f < low:
            low = f
            if low <= floor:
                break
    return low


@inner
def star_cost(rx, ry, k, x, y, rule, bound):
    """Cost of the closed star from (x, y); stops early at or above ``bound``."""
    total = 0.0
    for i in range(k):
        j = i + 1 if i + 1 < k else 0
        total += cost_of(quality(rx[i], ry[i], rx[j], ry[j], x, y, rule), rule)
        if total >= bound:
            break
    return total


@inner
def climb(rx, ry, k, x, y, step, goal, rule):
    """Raise the lowest f of the closed star from (x, y) by compass search; (x, y, lowest f)."""
    low = lowest(rx, ry, k, True, x, y, rule, -9.0)
    least = step * 0.01
    dx, dy = step, 0.0
    while step > least and low < goal:
        moved = False
        for _ in range(8):
            u, v = x + dx, y + dy
            f = lowest(rx, ry, k, True, u, v, rule, low)
            if f > low + 1e-9:
                x, y, low = u, v, f
                moved = True
                break
            dx, dy = EIGHTH * (dx - dy), EIGHTH * (dx + dy)
        if not moved:
            step *= 0.5
            dx, dy = TURN_X * dx - TURN_Y * dy, TURN_Y * dx + TURN_X * dy
    return x, y, low


@inner
def best_point(rx, ry, k, goal, rule):
    """Point of large lowest f for a star over the whole ring: (x, y, lowest f).

    Starts from the better of the nodes' mean and the mean of the apices of the equilateral triangles on the edges.
    """
    cx = cy = ax = ay = length = 0.0
    for i in range(k):
        j = i + 1 if i + 1 < k else 0
        ex, ey = rx[j] - rx[i], ry[j] - ry[i]
        cx += rx[i]
        cy += ry[i]
        ax += 0.5 * (rx[i] + rx[j]) - 0.8660254 * ey
        ay += 0.5 * (ry[i] + ry[j]) + 0.8660254 * ex
        length += math.sqrt(ex * ex + ey * ey)
    cx, cy, ax, ay = cx / k, cy / k, ax / k, ay / k
    fc = lowest(rx, ry, k, True, cx, cy, rule, -9.0)
    fa = lowest(rx, ry, k, True, ax, ay, rule, -9.0)
    if fa > fc:
        cx, cy = ax, ay
    return climb(rx, ry, k, cx, cy, 0.25 * length / k, goal, rule)


@inner
def longest_diagonal(S, W, k, n):
    """Longest new edge over the size wanted at its ends, of the n triangles W.fill."""
    worst = 0.0
    for a in range(n):
        for i in range(3):
            p, q = W.fill[a, i], W.fill[a, (i + 1) % 3]
            if p >= k or q >= k or q == (p + 1) % k or W.poly[p] < 0 or W.poly[q] < 0:
                continue
            wanted = 0.5 * (S.size[W.poly[p]] + S.size[W.poly[q]])
            length = math.hypot(W.px[p] - W.px[q], W.py[p] - W.py[q])
            worst = max(worst, length / (wanted + 1e-300))
    return worst


@inner
def choose_fill(S, W, k, mode, bound):
    """Cheapest fill below cost ``bound`` into W.fill: (cost, triangles, x, y); triangles 0 when there is none.

    A star has its point at local corner k. Its cost is that of the place where the node comes to lie: what rounding
    alone seems to lower would be lowered for ever.
    """
    cost, n, x, y = 1e300, 0, 0.0, 0.0
    if mode & PROGRAMME:
        c = programme(S, W, k, bound)
        if c < bound:
            cost = c
            n = read_programme(W, k)
            if longest_diagonal(S, W, k, n) > S.rule[STRETCH]:
                n, cost = 0, 1e300
    if mode & POINT:
        u, v, low = best_point(W.px, W.py, k, 0.6, S.rule)
        ox, oy = S.points[W.poly[0], 0], S.points[W.poly[0], 1]
        u, v = (ox + u) - ox, (oy + v) - oy
        c = star_cost(W.px, W.py, k, u, v, S.rule, min(bound, cost))
        for z in range(k):
            c += 2.0 if W.ear[z] == 1 else 0.0
        if c < bound and c < cost:
            cost, n, x, y = c, k, u, v
            for z in range(k):
                W.fill[z, 0], W.fill[z, 1], W.fill[z, 2] = z, (z + 1) % k, k
    return cost, n, x, y
