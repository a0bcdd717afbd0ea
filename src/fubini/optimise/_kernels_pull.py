"""What triangles want of their corners in smoothing: how their cost falls as a corner moves.

The shape of a triangle is ``r = (a^2 + b^2 + c^2) / (4 sqrt(3) A)``, 1 for the equilateral one and infinite at no
area. With ``d = r - 1`` its cost is ``f(d) = sqrt(d + NEAR) + FAR d^4``: the root grows like the loss of skewness, so
that the mean rises; the fourth power keeps the worst from paying for it.

With the sides p, q, r opposite to the corners, a half turn apart, the fall of the cost with the place of the corner
opposite to p is ``f' / (sqrt(3) A) (r - q + sqrt(3) (1 + d) turned(p))``, A twice the area, and its second derivative
about ``2 f' / (sqrt(3) A)`` in all directions, and along the first one ``f''`` times its square over ``f'^2``, which is
left out where it is negative.

Triangles are taken LANES at a time: their sides are written one beside the other, so that the compiler works several
out with each instruction.
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner
from fubini.optimise._kernels_state import LANE_NUMBERS, LANES

ROOT3 = math.sqrt(3.0)
NEAR, FAR = 0.01, 150.0
#: weight of what bends in one direction alone
BEND = 1.5
#: the sums of a node: the fall by x and by y, second derivatives that are the same in all directions, and xx, xy, yy
GX, GY, HH, HXX, HXY, HYY = range(6)
ROW = 6
#: where what belongs to a triangle begins: two sides, what is wanted at two corners, second derivatives, area
PX, PY, RX, RY, FX, FY, SX, SY, ALL, ALONG, AREA = range(0, LANE_NUMBERS, LANES)


@inner
def load_sides(points, tri, active, first, n, lanes):
    """Two sides of the n active triangles from ``first`` on; what is behind them repeats the first."""
    for j in range(n):
        t = active[first + j]
        a, b, c = tri[t, 0], tri[t, 1], tri[t, 2]
        x, y = points[b, 0], points[b, 1]
        lanes[PX + j], lanes[PY + j] = points[c, 0] - x, points[c, 1] - y
        lanes[RX + j], lanes[RY + j] = x - points[a, 0], y - points[a, 1]
    for j in range(n, LANES):
        lanes[PX + j], lanes[PY + j], lanes[RX + j], lanes[RY + j] = lanes[PX], lanes[PY], lanes[RX], lanes[RY]


@inner
def work_out(lanes):
    """What the loaded triangles want, see above; nothing that counts where an area is not positive."""
    for j in range(LANES):
        px, py, rx, ry = lanes[PX + j], lanes[PY + j], lanes[RX + j], lanes[RY + j]
        qx, qy = -(px + rx), -(py + ry)
        area = ROOT3 * (rx * py - ry * px)
        off = 0.5 * (px * px + py * py + qx * qx + qy * qy + rx * rx + ry * ry) - area
        # one division for 1 / area and 1 / (d + NEAR)
        near = off + NEAR * area
        share = 1.0 / (area * near)
        flat = area * math.sqrt(share)  # 1 / sqrt(d + NEAR)
        inverse = near * share
        d = off * inverse
        square = FAR * d * d
        first = 0.5 * flat + 4.0 * square * d
        second = 12.0 * square - 0.25 * flat * flat * flat
        w = first * inverse
        u = ROOT3 * w + ROOT3 * d * w
        lanes[FX + j], lanes[FY + j] = w * (rx - qx) - u * py, w * (ry - qy) + u * px
        lanes[SX + j], lanes[SY + j] = w * (px - rx) - u * qy, w * (py - ry) + u * qx
        lanes[ALL + j], lanes[ALONG + j], lanes[AREA + j] = w + w, BEND * second / (first * first), area


@inner
def bend(sums, z, w, x, y):
    """Add w times the square of (x, y) to second derivatives."""
    sums[z + HXX] += w * x * x
    sums[z + HXY] += w * x * y
    sums[z + HYY] += w * y * y


@inner
def pull(points, tri, active, k, sums, lanes):
    """Add to the sums of nodes what the first k active triangles want of them; whether none is upside down.

    Nodes of one that is are to stay: the second derivative is minus infinity. Scratch: lanes (LANE_NUMBERS,).
    """
    valid = True
    for first in range(0, k, LANES):
        n = min(LANES, k - first)
        load_sides(points, tri, active, first, n, lanes)
        work_out(lanes)
        for j in range(n):
            t = active[first + j]
            a, b, c = ROW * np.int64(tri[t, 0]), ROW * np.int64(tri[t, 1]), ROW * np.int64(tri[t, 2])
            if lanes[AREA + j] <= 0.0:
                valid = False
                sums[a + HH] = sums[b + HH] = sums[c + HH] = -math.inf
                continue
            fx, fy, sx, sy = lanes[FX + j], lanes[FY + j], lanes[SX + j], lanes[SY + j]
            h, w = lanes[ALL + j], lanes[ALONG + j]
            sums[a + GX] += fx
            sums[a + GY] += fy
            sums[a + HH] += h
            sums[b + GX] += sx
            sums[b + GY] += sy
            sums[b + HH] += h
            sums[c + GX] -= fx + sx
            sums[c + GY] -= fy + sy
            sums[c + HH] += h
            if w > 0.0:
                bend(sums, a, w, fx, fy)
                bend(sums, b, w, sx, sy)
                bend(sums, c, w, fx + sx, fy + sy)
    return valid
