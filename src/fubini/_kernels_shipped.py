"""Compiled passes over the arrays of a finished mesh: figures of triangles, how they fit together, sides at segments.

They read what is shipped and nothing else. Nodes get local numbers in the order in which they are first met, so that a
face costs the same alone and among a thousand others.

Indices come as uint32: a signed index costs a test for being negative at every access.
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel

#: Entries of ``counts`` that ``measure`` writes.
NODES, FLAWED, INVERTED, FIRST_INVERTED, WORST_SOUND, FARTHEST, COUNTS = 0, 1, 2, 3, 4, 5, 6
#: Entries of ``figures`` that ``measure`` writes.
AREA, SKEW_SUM, WORST_SKEW, SOUND_SKEW, WORST_ASPECT, LEAST, GREATEST, HEIGHT, LONGEST, FIGURES = range(10)

#: The local number of a node that has none.
FREE = 2**32 - 1

DEGREES = 180.0 / math.pi
#: Below this ratio the series of ``skewness_of`` is exact to rounding.
NEARLY_EQUILATERAL = 0.03125
#: Triangles summed up by themselves before their sum is added to that of all.
SUMMED = 128


@inner
def skewness_of(r):
    """Skewness in degrees of a triangle with (Lmax^2 - Lmin^2) / (4 area) = r: 90 less the arc tangent of r."""
    if r > NEARLY_EQUILATERAL:
        return math.atan2(1.0, r) * DEGREES
    s = r * r
    return (0.5 * math.pi - r * (1.0 - s * (1.0 / 3.0 - s * (0.2 - s * (1.0 / 7.0 - s * (1.0 / 9.0)))))) * DEGREES


@inner
def normal_and_squares(points, a, b, c):
    """Twice the area vector of a triangle, and its squared sides."""
    ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    wx, wy, wz = points[c, 0] - points[b, 0], points[c, 1] - points[b, 1], points[c, 2] - points[b, 2]
    p, q, r = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx, p, q, r


@inner
def shape_of(p, q, r, double, enough):
    """Skewness (degrees), aspect ratio, cotangents of the least and the greatest angle from squared sides and 2 area.

    An aspect ratio below ``enough`` may come out too large, still below it.
    """
    low, high = min(p, q, r), max(p, q, r)
    middle = p + q + r - low - high
    if not double > 0.0:
        return 0.0, math.inf, math.inf, -math.inf if low + middle < high else math.inf
    scale = 0.5 / double
    # abc (a + b + c) / (16 area^2) is at most 3 high^2 / (16 area^2): most triangles need no roots of sides
    aspect = 3.0 * (high * scale) ** 2
    if not aspect < enough:
        aspect = math.sqrt(p * q * r) * (math.sqrt(p) + math.sqrt(q) + math.sqrt(r)) * scale * scale
    return skewness_of((high - low) * scale), aspect, (middle + high - low) * scale, (low + middle - high) * scale


@inner
def add(total, lost, value):
    """The sum and what rounding has lost of it, one value later (Kahan)."""
    value -= lost
    new = total + value
    return new, (new - total) - value


@kernel
def measure(points, triangles, plane, limits, number, flawed, flaws, figures, counts):
    """Figures of triangles (m, 3) of points (n, 3) in one pass; the number of flawed ones, -1 for a node out of range.

    plane : (2, 3), a point on it and its unit normal. limits : least skewness, greatest aspect ratio.
    number : (n,) all FREE; gets the local numbers of the nodes in use. flawed (room,), flaws (room, 2) : the first
    flawed triangles, their skewness and aspect ratio. figures, counts : the rest, as the names above say;
    angles in degrees, SOUND_SKEW and WORST_SOUND the least skewness of the triangles that are not flawed and its
    triangle (-1 for none).
    """
    ox, oy, oz, nx, ny, nz = plane[0, 0], plane[0, 1], plane[0, 2], plane[1, 0], plane[1, 1], plane[1, 2]
    nodes, found, inverted, first, soundest, far = 0, 0, 0, -1, -1, 0
    area, area_lost, skews, skews_lost, some_area, some_skews = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    worst, sound, worst_aspect, height, longest = math.inf, math.inf, 0.0, 0.0, 0.0
    sharp, blunt = -math.inf, math.inf  # cotangents of the least and the greatest angle
    for t in range(triangles.shape[0]):
        for i in range(3):
            v = triangles[t, i]
            if v >= number.shape[0]:
                return -1
            if number[v] == FREE:
                number[v] = nodes
                nodes += 1
                off = abs((points[v, 0] - ox) * nx + (points[v, 1] - oy) * ny + (points[v, 2] - oz) * nz)
                if not off <= height:
                    height, far = off, v
        x, y, z, p, q, r = normal_and_squares(points, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        longest = max(longest, p, q, r)
        double, signed = math.sqrt(x * x + y * y + z * z), x * nx + y * ny + z * nz
        if not signed > 0.0:
            inverted += 1
            if first < 0:
                first = t
        skew, aspect, least, greatest = shape_of(p, q, r, double, min(worst_aspect, limits[1]))
        sharp, blunt = max(sharp, least), min(blunt, greatest)
        some_area += signed
        some_skews += skew
        if t % SUMMED == SUMMED - 1 or t == triangles.shape[0] - 1:
            area, area_lost = add(area, area_lost, some_area)
            skews, skews_lost = add(skews, skews_lost, some_skews)
            some_area, some_skews = 0.0, 0.0
        worst, worst_aspect = min(worst, skew), max(worst_aspect, aspect)
        if skew <= limits[0] or aspect >= limits[1]:
            if found < flawed.shape[0]:
                flawed[found], flaws[found, 0], flaws[found, 1] = t, skew, aspect
            found += 1
        elif skew < sound:
            sound, soundest = skew, t
    figures[AREA], figures[SKEW_SUM] = 0.5 * area, skews
    figures[WORST_SKEW], figures[SOUND_SKEW], figures[WORST_ASPECT] = worst, sound, worst_aspect
    figures[LEAST], figures[GREATEST] = math.atan2(1.0, sharp) * DEGREES, math.atan2(1.0, blunt) * DEGREES
    figures[HEIGHT], figures[LONGEST] = height, math.sqrt(longest)
    counts[NODES], counts[FLAWED], counts[INVERTED] = nodes, found, inverted
    counts[FIRST_INVERTED], counts[WORST_SOUND], counts[FARTHEST] = first, soundest, far
    return found


@inner
def put(first, entries, a, b, kind):
    """Enter the directed edge from a to b at the lower of its nodes: there or back, of a triangle or a segment."""
    low, high = min(a, b), max(a, b)
    entries[first[low]] = 4 * high + kind + (a > b)
    first[low] += 1


@kernel
def fit_together(triangles, segments, number, nodes, first, entries, state):
    """Whether every directed edge of the triangles occurs once, and its reverse too but on the given segments.

    A segment stands for the triangle that is missing on its right; one there and one back cancel out. number : (n,)
    local numbers of all nodes in use, ``nodes`` of them; first and state (nodes,), all zero, and entries, one for
    each side and segment, are scratch space. Edges are gathered at the lower of their nodes: the cost is linear.
    """
    m, k = triangles.shape[0], segments.shape[0]
    for t in range(m):
        a, b, c = number[triangles[t, 0]], number[triangles[t, 1]], number[triangles[t, 2]]
        first[min(a, b)] += 1
        first[min(b, c)] += 1
        first[min(c, a)] += 1
    for s in range(k):
        first[min(number[segments[s, 0]], number[segments[s, 1]])] += 1
    total = 0
    for v in range(nodes):
        count = first[v]
        first[v] = total
        total += count
    for t in range(m):
        a, b, c = number[triangles[t, 0]], number[triangles[t, 1]], number[triangles[t, 2]]
        put(first, entries, a, b, 0)
        put(first, entries, b, c, 0)
        put(first, entries, c, a, 0)
    for s in range(k):
        put(first, entries, number[segments[s, 0]], number[segments[s, 1]], 2)
    start = 0
    for v in range(nodes):
        stop = np.int64(first[v])  # every cursor has reached the start of the next node
        # state of the edges from v to u: bit 0 there, bit 1 back, above them 4 (there - back) without the segments
        for e in range(start, stop):
            u, kind = entries[e] >> 2, entries[e] & 3
            if kind >= 2:
                state[u] += 8 * kind - 20
            elif state[u] & (1 + kind):
                return False
            else:
                state[u] += 5 - 7 * kind
        for e in range(start, stop):
            u = entries[e] >> 2
            if state[u] & ~3:
                return False
            state[u] = 0
        start = stop
    return True


@kernel
def number_more(nodes, indices, number):
    """Number the nodes of ``indices`` (k, d) that have none yet, from ``nodes`` on; how many have one then.

    -1 for a node out of range.
    """
    for i in range(indices.shape[0]):
        for j in range(indices.shape[1]):
            v = indices[i, j]
            if v >= number.shape[0]:
                return -1
            if number[v] == FREE:
                number[v] = nodes
                nodes += 1
    return nodes


@kernel
def forget(indices, number):
    """Take the numbers of the nodes of ``indices`` (k, d) back."""
    for i in range(indices.shape[0]):
        for j in range(indices.shape[1]):
            number[indices[i, j]] = FREE


@kernel
def meet(triangles, keys, first, high, found):
    """Sides of triangles (m, 3) that are segments: rows (segment, triangle, side) of ``found``; their number.

    The segments of lower node v have the numbers ``keys[first[v] : first[v + 1]]`` and the higher nodes ``high`` there,
    sorted. Rows come by triangle, and no more are written than ``found`` has. Side i runs from
    corner i to corner i + 1.
    """
    count, top = 0, first.shape[0] - 1
    for t in range(triangles.shape[0]):
        for i in range(3):
            a, b = triangles[t, i], triangles[t, i + 1 if i < 2 else 0]
            low, up = min(a, b), max(a, b)
            if low >= top:
                continue
            start, stop = np.int64(first[low]), np.int64(first[low + 1])
            while start < stop:  # the first entry that is not below
                middle = (start + stop) >> 1
                if high[middle] < up:
                    start = middle + 1
                else:
                    stop = middle
            if start < first[low + 1] and high[start] == up:
                if count < found.shape[0]:
                    found[count, 0], found[count, 1], found[count, 2] = keys[start], t, i
                count += 1
    return count


@inner
def root_of(parent, v):
    """The least node that v is known to be connected with, halving the way there."""
    while parent[v] != v:
        parent[v] = parent[parent[v]]
        v = np.int64(parent[v])
    return v


@kernel
def number_chains(ends, scratch, chain):
    """Number the connected chains of edges, by their least node: ``chain`` (k,) of each edge; how many there are.

    ends (2, k) : nodes at both ends, all from 0 to n - 1 in use. scratch : (2, n).
    """
    parent, number = scratch[0], scratch[1]
    for v in range(parent.shape[0]):
        parent[v] = v
    for e in range(ends.shape[1]):
        a, b = root_of(parent, np.int64(ends[0, e])), root_of(parent, np.int64(ends[1, e]))
        parent[max(a, b)] = min(a, b)
    count = 0
    for v in range(parent.shape[0]):
        if parent[v] == v:
            number[v] = count
            count += 1
        else:
            number[v] = number[parent[v]]
    for e in range(ends.shape[1]):
        chain[e] = number[ends[0, e]]
    return count


@kernel
def compare_with_curves(points, segments, on_curve, node, chord, length):
    """Write how far the ends of segments are off the curve, ``node`` (k, 2), and the curve off them, ``chord`` (k,).

    on_curve (k, 2 + s, 3) : points of the curve at the ends of each segment, then between them.
    """
    for k in range(segments.shape[0]):
        a, b = segments[k, 0], segments[k, 1]
        x, y, z = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        square = x * x + y * y + z * z
        length[k], chord[k] = math.sqrt(square), 0.0
        for i in range(on_curve.shape[1]):
            v = b if i == 1 else a
            p, q = on_curve[k, i, 0] - points[v, 0], on_curve[k, i, 1] - points[v, 1]
            r = on_curve[k, i, 2] - points[v, 2]
            share = 0.0
            if i > 1 and square > 0.0:
                share = min(1.0, max(0.0, (p * x + q * y + r * z) / square))
            p, q, r = p - share * x, q - share * y, r - share * z
            off = math.sqrt(p * p + q * q + r * r)
            if i < 2:
                node[k, i] = off
            else:
                chord[k] = max(chord[k], off)
