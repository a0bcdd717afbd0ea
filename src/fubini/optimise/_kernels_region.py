"""The valid region of a node in closed form (Perumal 2019, section 3.3, found there by sampling).

A triangle on the edge A -> B with third vertex P has skewness above s exactly when

    | |P-A|^2 - |P-B|^2 | < 4 A / tan s     between two lines
    | |P-A|^2 - |AB|^2 |  < 4 A / tan s     inside one circle, outside another
    | |P-B|^2 - |AB|^2 |  < 4 A / tan s     inside one circle, outside another

Each bound is a generalised circle ``q |P|^2 + g . P + d <= 0`` with q = 0, 1 or -1. The region of a node is the
intersection over the edges of its ring. When it is not empty, it has a vertex, where two of the
circles meet: the triangles' own regions are closed off by arcs that end on one another.
"""

from __future__ import annotations

import math

from fubini._jit import inner


@inner
def edge_constraints(ax, ay, bx, by, tau, c, n):
    """Write the six constraints of edge a -> b for tan(skewness) > tau into rows n .. n + 5 of c."""
    ex, ey = bx - ax, by - ay
    length = ex * ex + ey * ey
    # 4 A / tau is the linear function lx x + ly y + l
    lx, ly, l = -2.0 * ey / tau, 2.0 * ex / tau, 2.0 * (ey * ax - ex * ay) / tau
    aa, bb = ax * ax + ay * ay, bx * bx + by * by
    for side in range(2):
        w = 1.0 - 2.0 * side
        c[n, 0], c[n, 1], c[n, 2], c[n, 3] = 0.0, 2.0 * w * (bx - ax), 2.0 * w * (by - ay), w * (aa - bb)
        c[n + 1, 0], c[n + 1, 1], c[n + 1, 2], c[n + 1, 3] = w, -2.0 * w * ax, -2.0 * w * ay, w * (aa - length)
        c[n + 2, 0], c[n + 2, 1], c[n + 2, 2], c[n + 2, 3] = w, -2.0 * w * bx, -2.0 * w * by, w * (bb - length)
        for i in range(3):
            c[n + i, 1] -= lx
            c[n + i, 2] -= ly
            c[n + i, 3] -= l
        n += 3


@inner
def meet(c, i, j):
    """Points where circles i and j of c meet: (number, x, y, x, y); 0 when they do not."""
    q, gx, gy, d = c[i, 0], c[i, 1], c[i, 2], c[i, 3]
    lx, ly, l = c[j, 1], c[j, 2], c[j, 3]
    if c[j, 0] != 0.0:
        if q == 0.0:
            q, lx, ly, l = c[j, 0], gx, gy, d
            gx, gy, d = c[j, 1], c[j, 2], c[j, 3]
        else:
            w = c[j, 0] * q  # both +1 or -1: the difference is the radical line
            lx, ly, l = lx - w * gx, ly - w * gy, l - w * d
    norm = lx * lx + ly * ly
    if norm == 0.0:
        return 0, 0.0, 0.0, 0.0, 0.0
    x, y = -l * lx / norm, -l * ly / norm
    norm = math.sqrt(norm)
    ux, uy = -ly / norm, lx / norm
    b = gx * ux + gy * uy
    e = q * (x * x + y * y) + gx * x + gy * y + d
    if q == 0.0:
        if b == 0.0:
            return 0, 0.0, 0.0, 0.0, 0.0
        s = -e / b
        return 1, x + s * ux, y + s * uy, 0.0, 0.0
    root = b * b - 4.0 * q * e
    if root < 0.0:
        return 0, 0.0, 0.0, 0.0, 0.0
    root = math.sqrt(root)
    s, r = (-b + root) / (2.0 * q), (-b - root) / (2.0 * q)
    return 2, x + s * ux, y + s * uy, x + r * ux, y + r * uy


@inner
def satisfies(c, n, x, y, slack, i, j):
    """Whether (x, y) meets all n constraints but i and j, on which it lies, within ``slack``."""
    square = x * x + y * y
    for z in range(n):
        if z != i and z != j and c[z, 0] * square + c[z, 1] * x + c[z, 2] * y + c[z, 3] > slack:
            return False
    return True


@inner
def region_point(rx, ry, k, tau, c):
    """A point of the common valid region of the closed ring (k nodes): (found, x, y).

    The mean of the first few vertices of the region when it lies inside, else the first of them. Exact: not found
    means that the region is empty. ``c`` (6 k, 4) is scratch space.
    """
    scale = 0.0
    for i in range(k):
        j = i + 1 if i + 1 < k else 0
        edge_constraints(rx[i], ry[i], rx[j], ry[j], tau, c, 6 * i)
        scale = max(scale, rx[i] * rx[i] + ry[i] * ry[i])
    n, slack, found = 6 * k, 1e-10 * scale, 0
    fx = fy = mx = my = 0.0
    for i in range(n):
        for j in range(i):
            number, x0, y0, x1, y1 = meet(c, i, j)
            for side in range(number):
                x, y = (x0, y0) if side == 0 else (x1, y1)
                if satisfies(c, n, x, y, slack, i, j):
                    if found == 0:
                        fx, fy = x, y
                    found += 1
                    mx += x
                    my += y
        if found >= 4:
            break
    if found == 0:
        return False, 0.0, 0.0
    mx, my = mx / found, my / found
    if satisfies(c, n, mx, my, slack, -1, -1):
        return True, mx, my
    return True, fx, fy
