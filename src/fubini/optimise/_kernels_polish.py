"""Polishing: the worst triangles are raised once the bound is met, by moves of their nodes alone.

The cotangent of a triangle's skewness is the largest of its three ``|Li^2 - Lj^2| / 4 A``. The cost of a triangle
is the sum of the eighth powers of all three, over the cotangent of the skewness that is wanted: smooth, where the
largest is not, and nearly as good a measure. A node moves by Newton's method where that lessens the sum over the
triangles around it and leaves none of them worse than the worst was, or than is wanted. The corners of triangles that
then still fall short wait for their turn: what is too much at one node so spreads to those around it until none is
left, or nothing gives way.
"""

from __future__ import annotations

import math

from fubini._jit import inner
from fubini.optimise._kernels_fill import lowest
from fubini.optimise._kernels_slide import load, load_fan, may_slide, newton_along, place_along, put_along
from fubini.optimise._kernels_state import AR, LOW, RELOCATION, SLIDE, SOFT

#: a move is made when the cost falls by more than this share
FALL = 0.02
#: attempts to shorten a step that does not pay, and by what
SHORTER, STEPS = 0.4, 2
#: squares of cotangents, over the one wanted, that are left out of derivatives
SMALL = 0.2
#: share of the trace that is added to second derivatives, which one triangle alone leaves without an inverse
STEADY = 0.05
#: entry of ``State.moved`` of a node that waits for its turn
WAITS = -1


@inner
def cost_at(rx, ry, k, x, y, scale, squares):
    """Sum of the costs of the k triangles between (x, y) and the edges of its ring, and the largest square.

    ``scale`` : 1 over the cotangent wanted. Infinite where a triangle is upside down. The largest square of each goes
    into ``squares``.
    """
    total = worst = 0.0
    cx, cy = rx[0] - x, ry[0] - y
    cc = cx * cx + cy * cy
    for q in range(k):
        bx, by, bb = cx, cy, cc
        cx, cy = rx[q + 1] - x, ry[q + 1] - y
        cc = cx * cx + cy * cy
        area4 = 2.0 * (bx * cy - by * cx)
        if area4 <= 0.0:
            return math.inf, math.inf
        ex, ey = cx - bx, cy - by
        ee = ex * ex + ey * ey
        i = scale / area4
        u, v, w = (bb - cc) * i, (bb - ee) * i, (cc - ee) * i
        u, v, w = u * u, v * v, w * w
        squares[q] = max(u, max(v, w))
        worst = max(worst, squares[q])
        u, v, w = u * u, v * v, w * w
        total += u * u + v * v + w * w
    return total, worst


@inner
def slopes(rx, ry, k, scale):
    """Cost at the origin, the largest square, minus the derivatives, second ones after Gauss and Newton.

    (cost, worst, gx, gy, hxx, hxy, hyy). What is small is left out of all but the largest square.
    """
    total = worst = gx = gy = hxx = hxy = hyy = 0.0
    cx, cy = rx[0], ry[0]
    cc = cx * cx + cy * cy
    for q in range(k):
        bx, by, bb = cx, cy, cc
        cx, cy = rx[q + 1], ry[q + 1]
        cc = cx * cx + cy * cy
        area4 = 2.0 * (bx * cy - by * cx)
        if area4 <= 0.0:
            return math.inf, math.inf, 0.0, 0.0, 0.0, 0.0, 0.0
        ex, ey = cx - bx, cy - by
        ee = ex * ex + ey * ey
        i = scale / area4
        for j in range(3):
            u = (bb - cc) * i if j == 0 else ((bb - ee) * i if j == 1 else (cc - ee) * i)
            square = u * u
            worst = max(worst, square)
            if square < SMALL:
                continue
            # the derivative of u by the place of the node
            fx, fy = (ex, ey) if j == 0 else ((-bx, -by) if j == 1 else (-cx, -cy))
            dx, dy = 2.0 * (i * fx - u * (by - cy) / area4), 2.0 * (i * fy - u * (cx - bx) / area4)
            sixth = square * square * square
            total += sixth * square
            gx -= 8.0 * sixth * u * dx
            gy -= 8.0 * sixth * u * dy
            hxx += 56.0 * sixth * dx * dx
            hxy += 56.0 * sixth * dx * dy
            hyy += 56.0 * sixth * dy * dy
    return total, worst, gx, gy, hxx, hxy, hyy


@inner
def pays(S, W, k, x, y, cost, worst, scale):
    """Whether the loaded node is better off at (x, y), and no triangle falls short of the bounds for it.

    Into W.px go the squares of the triangles there.
    """
    new, now = cost_at(W.rx, W.ry, k, x, y, scale, W.px)
    if new > (1.0 - FALL) * cost or now > max(1.0, worst):
        return False
    if S.rule[AR] <= 0.0:
        return True
    low = lowest(W.rx, W.ry, k + 1, False, 0.0, 0.0, S.rule, -9.0)
    return lowest(W.rx, W.ry, k + 1, False, x, y, S.rule, -9.0) >= min(low, S.rule[SOFT])


@inner
def improve_inside(S, W, v, scale):
    """Move interior node v where that pays: (whether it moved, triangles around it)."""
    k = load(S.points, S.tri, S.nbr, int(S.tri_of[v]), v, W.ring, W.rx, W.ry)
    if k < 3:
        return False, 0
    cost, worst, gx, gy, hxx, hxy, hyy = slopes(W.rx, W.ry, k, scale)
    if not 1.0 < worst < math.inf:
        return False, k
    more = STEADY * (hxx + hyy)
    hxx, hyy = hxx + more, hyy + more
    share = 1.0 / (hxx * hyy - hxy * hxy)
    dx, dy = share * (gx * hyy - gy * hxy), share * (gy * hxx - gx * hxy)
    for _ in range(STEPS):
        if pays(S, W, k, dx, dy, cost, worst, scale):
            S.points[v, 0] += dx
            S.points[v, 1] += dy
            S.counts[RELOCATION] += 1
            return True, k
        dx, dy = SHORTER * dx, SHORTER * dy
    return False, k


@inner
def improve_along(S, W, v, scale):
    """Slide boundary node v where that pays: (whether it moved, nodes of its ring). Not the legs of cusps."""
    k, r, s = load_fan(S, W, v)
    if k == 0 or not may_slide(S, r, s) or S.sharp[W.ring[0]] == 1 or S.sharp[W.ring[k]] == 1:
        return False, k
    cost, worst, gx, gy, hxx, hxy, hyy = slopes(W.rx, W.ry, k, scale)
    if not 1.0 < worst < math.inf:
        return False, k
    more = STEADY * (hxx + hyy)
    ends = W.rx[0], W.ry[0], W.rx[k], W.ry[k]
    step, _ = newton_along(S, ends, r, s, (gx, gy, hxx + more, hxy, hyy + more))
    for _ in range(STEPS):
        may, t, x, y = place_along(S, v, ends, r, s, step)
        if may and pays(S, W, k, x - S.points[v, 0], y - S.points[v, 1], cost, worst, scale):
            put_along(S, v, r, s, t, x, y)
            S.counts[SLIDE] += 1
            return True, k
        step *= SHORTER
    return False, k


@inner
def wait(S, v, tail):
    """Put node v at the end of the queue, where it is not there yet and may move; the new end."""
    if S.kind[v] > 1 or S.moved[v] == WAITS:
        return tail
    S.moved[v] = WAITS
    S.queue[tail % S.queue.shape[0]] = v
    return tail + 1


@inner
def wait_again(S, W, v, k, tail):
    """Put the corners of those of the k triangles around node v, just moved, that fall short at the end of the queue.

    The new end. The ring and the squares are loaded.
    """
    last = k if S.kind[v] == 0 else k + 1  # around an interior node the last triangle ends at the first node
    for q in range(k):
        if W.px[q] > 1.0:
            tail = wait(S, v, tail)
            tail = wait(S, W.ring[q], tail)
            tail = wait(S, W.ring[q + 1 if q + 1 < last else 0], tail)
    return tail


@inner
def polish(S, W, goal, budget):
    """Raise the triangles S.low towards a skewness with tangent ``goal``; ``budget`` visits of nodes at most."""
    head = tail = visits = 0
    for q in range(S.counts[LOW]):
        t = S.low[q]
        for i in range(3):
            tail = wait(S, S.tri[t, i], tail)
    while head < tail and visits < budget:
        v = S.queue[head % S.queue.shape[0]]
        head, visits = head + 1, visits + 1
        S.moved[v] = 0
        done, k = improve_inside(S, W, v, goal) if S.kind[v] == 0 else improve_along(S, W, v, goal)
        if done:
            tail = wait_again(S, W, v, k, tail)
