"""Quality and cost of triangles, as the moves measure them.

The quality is ``f = tan(skewness - 45 deg) = (4 A - D) / (4 A + D)`` with ``D = Lmax^2 - Lmin^2``: no
square root, 1 for the equilateral triangle, 0 at 45 degrees, -1 at no area, less for inverted ones.
"""

from __future__ import annotations

import math

from fubini._jit import inner
from fubini.optimise._kernels_state import AR, SOFT, WAIVED, WEIGHT

INVERTED = 1000.0


@inner
def aspect_quality(l0, l1, l2, a4, rule):
    """Aspect ratio on the scale of f: the soft bound where it meets its bound, 1 at the equilateral."""
    a, b, c = math.sqrt(l0), math.sqrt(l1), math.sqrt(l2)
    ratio = a * b * c * (a + b + c) / (a4 * a4)
    scaled = (rule[AR] - ratio) / (rule[AR] - 1.0)
    return max(-1.0, rule[SOFT] + (1.0 - rule[SOFT]) * scaled)


@inner
def quality(ax, ay, bx, by, cx, cy, rule):
    """f of the triangle a, b, c: at least ``rule[SOFT]`` when valid with a margin."""
    ux, uy, vx, vy = bx - ax, by - ay, cx - ax, cy - ay
    wx, wy = cx - bx, cy - by
    l0, l1, l2 = wx * wx + wy * wy, vx * vx + vy * vy, ux * ux + uy * uy
    top = max(l0, max(l1, l2))
    a4 = 2.0 * (ux * vy - uy * vx)
    if a4 <= 1e-12 * top:
        return -1.0 + min(0.0, a4 / (top + 1e-300)) - 1e-9
    d = top - min(l0, min(l1, l2))
    f = (a4 - d) / (a4 + d)
    if rule[AR] > 0.0:
        f = min(f, aspect_quality(l0, l1, l2, a4, rule))
    return f


@inner
def cost_of(f, rule):
    """Cost of a triangle of quality f: 0 best; at least 1 when flawed; 1000 and more when inverted.

    Valid triangles weigh little, so that mending one flawed triangle is worth spoiling its
    neighbours within the bound; among valid ones the eighth power lets the worst count most.
    """
    r = (1.0 - f) * rule[WEIGHT]
    if f >= rule[SOFT]:
        r *= r
        r *= r
        return 0.02 * r * r
    return 4.0 * r - 3.0 if f >= -1.0 else INVERTED - f


@inner
def ear_cost(ax, ay, bx, by, cx, cy):
    """Cost of the one triangle that covers an unavoidable corner a: how far from isosceles it is."""
    ux, uy, vx, vy = bx - ax, by - ay, cx - ax, cy - ay
    if ux * vy - uy * vx <= 0.0:
        return INVERTED
    p, q = ux * ux + uy * uy, vx * vx + vy * vy
    return 0.3 * (1.0 - min(p, q) / max(p, q))


@inner
def covers_corner(S, t):
    """Local corner at which triangle t alone fills a sharp corner of the region, or -1."""
    for i in range(3):
        if S.sharp[S.tri[t, i]] > 0 and S.nbr[t, (i + 1) % 3] < 0 and S.nbr[t, (i + 2) % 3] < 0:
            return i
    return -1


@inner
def filled_corner_cost(mark, ax, ay, bx, by, cx, cy, rule):
    """Cost of the triangle that alone fills the sharp corner a, marked 1 where unavoidable.

    Where the corner is only just avoidable no triangle has the margin of the soft bound: it is waived here.
    """
    if mark == 1:
        return ear_cost(ax, ay, bx, by, cx, cy)
    return cost_of(quality(ax, ay, bx, by, cx, cy, rule) + rule[WAIVED], rule)


@inner
def triangle_quality(S, t):
    """f of triangle t."""
    a, b, c = S.tri[t, 0], S.tri[t, 1], S.tri[t, 2]
    p = S.points
    return quality(p[a, 0], p[a, 1], p[b, 0], p[b, 1], p[c, 0], p[c, 1], S.rule)


@inner
def triangle_cost(S, t):
    """Cost of triangle t, the exemption of unavoidable corners included."""
    i = covers_corner(S, t)
    if i < 0:
        return cost_of(triangle_quality(S, t), S.rule)
    a, b, c = S.tri[t, i], S.tri[t, (i + 1) % 3], S.tri[t, (i + 2) % 3]
    p = S.points
    return filled_corner_cost(S.sharp[a], p[a, 0], p[a, 1], p[b, 0], p[b, 1], p[c, 0], p[c, 1], S.rule)


@inner
def is_flawed(S, t):
    """Whether triangle t is to be mended: below the soft bound and not the one of an unavoidable corner."""
    f = triangle_quality(S, t)
    if f >= S.rule[SOFT]:
        return False
    i = covers_corner(S, t)
    if i < 0:
        return True
    return S.sharp[S.tri[t, i]] != 1 and f + S.rule[WAIVED] < S.rule[SOFT]
