"""Flips that bring every node nearer to the number of triangles that suits the angle around it.

Where k triangles share an angle none of them can be better than the isosceles one of that angle over k; what it loses
in skewness is about its distance from 60 degrees. A node on a straight edge wants three triangles: two make right
angles, of skewness 63.4 degrees at most, wherever the nodes around move. Such a flip may make the triangles worse
for now: nodes are smoothed afterwards, and an edge that is not Delaunay then is flipped back.
"""

from __future__ import annotations

import math

from fubini._jit import inner
from fubini.triangulation._kernels_topology import flip

ROOT3 = math.sqrt(3.0)
THIRD = math.pi / 3.0
#: ``d`` (see ``_kernels_smooth``) above which edges of a triangle are looked at, and which no flip may exceed
WORSE, OFF = 0.02, 0.5
#: fall of the sum over the four nodes, in radians, from which on an edge is flipped
GAIN = math.radians(10.0)


@inner
def shape(points, a, b, c):
    """``d`` of the triangle a, b, c; infinite where it is upside down."""
    x, y = points[a, 0], points[a, 1]
    ux, uy, vx, vy = points[b, 0] - x, points[b, 1] - y, points[c, 0] - x, points[c, 1] - y
    area = ROOT3 * (ux * vy - uy * vx)
    if area <= 0.0:
        return math.inf
    return (ux * ux + uy * uy + vx * vx + vy * vy - (ux * vx + uy * vy)) / area - 1.0


@inner
def boundary_angles(points, tri, nbr, sides):
    """Angle of the region at every boundary node v into sides[v, 0], from the segments that leave and reach it."""
    for t in range(tri.shape[0]):
        for i in range(3):
            if nbr[t, i] < 0:
                a, b = tri[t, i + 1 if i < 2 else 0], tri[t, i - 1 if i > 0 else 2]
                x, y = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
                sides[a, 0], sides[a, 1], sides[b, 2], sides[b, 3] = x, y, -x, -y
    for v in range(sides.shape[0]):
        ux, uy, wx, wy = sides[v, 0], sides[v, 1], sides[v, 2], sides[v, 3]
        angle = math.atan2(ux * wy - uy * wx, ux * wx + uy * wy)
        sides[v, 0] = angle if angle > 0.0 else angle + 2.0 * math.pi


@inner
def fall_at(sides, degree, v, change):
    """How much nearer to 60 degrees the angles at node v come with ``change`` triangles more."""
    k = degree[v]
    if k + change < 1:
        return -math.inf
    turn = sides[v, 0] if v < sides.shape[0] else 2.0 * math.pi
    return abs(turn / k - THIRD) - abs(turn / (k + change) - THIRD)


@inner
def count_triangles(tri, degree):
    """Number of triangles at every node."""
    for v in range(degree.shape[0]):
        degree[v] = 0
    for t in range(tri.shape[0]):
        for i in range(3):
            degree[tri[t, i]] += 1


@inner
def even_degrees(points, tri, nbr, at, degree, sides, awake):
    """Flip the edges of not so good triangles where that suits the four nodes better, and wake them; flips made."""
    flips = 0
    count_triangles(tri, degree)
    boundary_angles(points, tri, nbr, sides)
    for t in range(tri.shape[0]):
        if shape(points, tri[t, 0], tri[t, 1], tri[t, 2]) < WORSE:
            continue
        for i in range(3):
            u = int(nbr[t, i])
            if u < 0:
                continue
            j = 0 if nbr[u, 0] == t else (1 if nbr[u, 1] == t else 2)
            p, a, b, d = tri[t, i], tri[t, i + 1 if i < 2 else 0], tri[t, i - 1 if i > 0 else 2], tri[u, j]
            fall = fall_at(sides, degree, p, 1) + fall_at(sides, degree, d, 1)
            fall += fall_at(sides, degree, a, -1) + fall_at(sides, degree, b, -1)
            if fall > GAIN and max(shape(points, p, a, d), shape(points, p, d, b)) < OFF:
                flip(tri, nbr, at, t, i)
                flips += 1
                degree[p] += 1
                degree[d] += 1
                degree[a] -= 1
                degree[b] -= 1
                awake[p] = awake[a] = awake[b] = awake[d] = 1
                break
    return flips
