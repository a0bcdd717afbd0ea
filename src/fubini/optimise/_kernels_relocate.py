"""Relocation of interior nodes into their valid region, and sliding of boundary nodes along their curve."""

from __future__ import annotations

import math

from fubini._jit import inner
from fubini.optimise._kernels_cavity import enqueue, local, star
from fubini.optimise._kernels_fill import EIGHTH, TURN_X, TURN_Y, best_point, climb, lowest, star_cost
from fubini.optimise._kernels_quality import cost_of, filled_corner_cost, quality
from fubini.optimise._kernels_region import region_point
from fubini.optimise._kernels_state import ATTEMPTS, RELOCATION, SLIDE, SOFT
from fubini.tracks._kernels import evaluate_one

#: value of f at which a climb ends
GOAL = 0.3


@inner
def load_ring(S, W, v, k, closed):
    """Ring coordinates relative to node v into W.rx, W.ry; the mean distance."""
    n = k if closed else k + 1
    mean = 0.0
    for i in range(n):
        W.rx[i] = S.points[W.ring[i], 0] - S.points[v, 0]
        W.ry[i] = S.points[W.ring[i], 1] - S.points[v, 1]
        mean += math.sqrt(W.rx[i] * W.rx[i] + W.ry[i] * W.ry[i]) / n
    return mean


@inner
def cheapest(W, k, x, y, step, rule):
    """Lower the cost of the closed star from (x, y) by compass search; (x, y, cost)."""
    cost = star_cost(W.rx, W.ry, k, x, y, rule, math.inf)
    least = step * 0.01
    dx, dy = step * math.cos(0.2), step * math.sin(0.2)
    while step > least:
        moved = False
        for _ in range(8):
            u, v = x + dx, y + dy
            c = star_cost(W.rx, W.ry, k, u, v, rule, cost)
            if c < cost - 1e-6:
                x, y, cost = u, v, c
                moved = True
                break
            dx, dy = EIGHTH * (dx - dy), EIGHTH * (dx + dy)
        if not moved:
            step *= 0.5
            dx, dy = TURN_X * dx - TURN_Y * dy, TURN_Y * dx + TURN_X * dy
    return x, y, cost


@inner
def valid_place(W, k, mean, rule):
    """A place of large lowest f for the node of the loaded closed ring: (x, y, lowest f).

    Uphill from where it is, then from the ring's middle, then from a point of the valid region in closed
    form (method.md, section 5), whose emptiness settles the matter.
    """
    x, y, low = climb(W.rx, W.ry, k, 0.0, 0.0, 0.3 * mean, GOAL, rule)
    if low < rule[SOFT]:
        u, w, f = best_point(W.rx, W.ry, k, GOAL, rule)
        if f > low:
            x, y, low = u, w, f
    if low < rule[SOFT] and k <= 9:
        tau = (1.0 + rule[SOFT]) / (1.0 - rule[SOFT])
        found, u, w = region_point(W.rx, W.ry, k, tau, W.circles)
        if found:
            x, y, low = climb(W.rx, W.ry, k, u, w, 0.1 * mean, GOAL, rule)
    return x, y, low


@inner
def relocate(S, W, v, fall, soft):
    """Move interior node v where the cost of its star falls by more than ``fall``; whether it moved.

    Where the valid region is empty, to the place of least cost. ``soft``: instead raise its lowest f,
    with no rise of cost.
    """
    k, closed = star(S, W, v)
    if k < 3 or not closed:
        return False
    mean = load_ring(S, W, v, k, closed)
    rule = S.rule
    old = star_cost(W.rx, W.ry, k, 0.0, 0.0, rule, math.inf)
    if soft:
        low = lowest(W.rx, W.ry, k, True, 0.0, 0.0, rule, -9.0)
        x, y, f = climb(W.rx, W.ry, k, 0.0, 0.0, 0.25 * mean, 0.97, rule)
        if f <= low + 1e-4:
            return False
        cost, fall = star_cost(W.rx, W.ry, k, x, y, rule, old), -1e-9
    else:
        x, y, low = valid_place(W, k, mean, rule)
        if low >= rule[SOFT]:
            cost = star_cost(W.rx, W.ry, k, x, y, rule, old - fall)
        else:
            x, y, cost = cheapest(W, k, x, y, 0.2 * mean, rule)
    if cost >= old - fall:
        return False
    before_x, before_y = S.points[v, 0], S.points[v, 1]
    S.points[v, 0] += x
    S.points[v, 1] += y
    # the cost jumps where f passes the bound: what rounding alone seems to lower would be lowered for ever
    load_ring(S, W, v, k, closed)
    if star_cost(W.rx, W.ry, k, 0.0, 0.0, rule, math.inf) >= old - fall:
        S.points[v, 0], S.points[v, 1] = before_x, before_y
        return False
    if not soft:
        S.counts[RELOCATION] += 1
    return True


@inner
def fan_cost(W, k, x, y, first, last, rule):
    """Cost of the open fan from (x, y).

    first, last : marks of the sharp corners that its end triangles fill alone, or 0.
    """
    total = 0.0
    rx, ry = W.rx, W.ry
    for i in range(k):
        if i == 0 and first > 0:
            total += filled_corner_cost(first, rx[0], ry[0], rx[1], ry[1], x, y, rule)
        elif i == k - 1 and last > 0:
            total += filled_corner_cost(last, rx[k], ry[k], x, y, rx[k - 1], ry[k - 1], rule)
        else:
            total += cost_of(quality(rx[i], ry[i], rx[i + 1], ry[i + 1], x, y, rule), rule)
    return total


@inner
def slide(S, W, v, fall):
    """Slide node v along its curve where the cost of its fan falls by more than ``fall``; whether it moved."""
    k, closed = star(S, W, v)
    if k < 1 or closed:
        return False
    head, tail = W.fan[0], W.fan[k - 1]
    i, j = local(S, head, v), local(S, tail, v)
    r, s = int(-1 - S.nbr[head, (i + 2) % 3]), int(-1 - S.nbr[tail, (j + 1) % 3])
    if S.track[s] < 0 or S.track[s] != S.track[r] or S.mode[s] != 0 or S.mode[r] != 0 or S.t[s, 1] != S.t[r, 0]:
        return False
    load_ring(S, W, v, k, closed)
    first = S.sharp[W.ring[0]] if S.nbr[head, i] < 0 else 0
    last = S.sharp[W.ring[k]] if S.nbr[tail, j] < 0 else 0
    track = int(S.track[s])
    ta, t, tb = S.t[s, 0], S.t[s, 1], S.t[r, 1]
    ox, oy = S.points[v, 0], S.points[v, 1]
    old = fan_cost(W, k, 0.0, 0.0, first, last, S.rule)
    cost, step, at = old, 0.25 * (tb - ta), t
    low, high = min(ta, tb) + 0.05 * abs(tb - ta), max(ta, tb) - 0.05 * abs(tb - ta)
    least = abs(step) * 0.005
    while abs(step) > least:
        moved = False
        for d in range(2):
            u = at + step * (1.0 - 2.0 * d)
            if moved or u <= low or u >= high:
                continue
            x, y = evaluate_one(S.track_kinds, S.track_offsets, S.track_data, track, u)
            c = fan_cost(W, k, x - ox, y - oy, first, last, S.rule)
            if c < cost - 1e-7:
                cost, at, moved = c, u, True
        if not moved:
            step *= 0.5
    if cost >= old - fall:
        return False
    x, y = evaluate_one(S.track_kinds, S.track_offsets, S.track_data, track, at)
    S.points[v, 0], S.points[v, 1] = x, y
    S.t[s, 1], S.t[r, 0] = at, at
    S.counts[SLIDE] += 1
    return True


@inner
def look_again(S, W, v):
    """Queue what is flawed around node v, which has moved, and note that the triangles there have changed."""
    k, closed = star(S, W, v)
    S.moved[v] = S.counts[ATTEMPTS]
    for q in range(k):
        enqueue(S, W.fan[q])
        S.moved[W.ring[q]] = S.counts[ATTEMPTS]
    if k > 0 and not closed:
        S.moved[W.ring[k]] = S.counts[ATTEMPTS]
