"""Compiled parts of the boundary discretisation: the nodes of all edges, the boundary of one face, its gaps.

For the tables of sizes (``span`` or ``first``, ``t``, ``s``, ``h``) see ``_kernels_sizes``.
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel
from fubini.sampling._kernels_apart import all_apart
from fubini.sampling._kernels_legs import interpolate, with_leg_ends
from fubini.sampling._kernels_sizes import gathered, grade, lower_face, too_large
from fubini.tracks._kernels import evaluate_one

#: A segment over this times the size asked is long on purpose: the triangles at its ends may be larger than asked, too.
LONG_SEGMENT = 1.7


@inner(allocates=True)
def envelope(first, t, s, cap, h, g):
    """Tables with a sample wherever growth from a fine sample reaches the ceiling or another ramp.

    ``h`` holds the graded sizes at the samples, ``cap`` the sizes before grading. Between two samples
    the size is the least of the ceiling and of the two ramps of slope g. Returns the new first, t, s, h.
    """
    edges = first.shape[0] - 1
    new_first = np.empty(edges + 1, np.int64)
    out = np.empty((3, 3 * s.shape[0]))
    n = 0
    for e in range(edges):
        new_first[e] = n
        for i in range(first[e], first[e + 1]):
            if i > first[e]:
                length = s[i] - s[i - 1]
                low, high = cap[i - 1], cap[i]
                slope = (high - low) / length
                up = (low - h[i - 1]) / max(g - slope, 1e-300)  # ramp from the left meets the ceiling
                down = length - (high - h[i]) / max(g + slope, 1e-300)
                if up >= down:
                    up = 0.5 * (length + (h[i] - h[i - 1]) / g)  # the two ramps meet below it
                    down = up
                for k in range(2):
                    x = up if k == 0 else down
                    if (k == 1 and x <= up) or x <= 1e-6 * length or x >= (1.0 - 1e-6) * length:
                        continue
                    w = x / length
                    out[0, n] = (1.0 - w) * t[i - 1] + w * t[i]
                    out[1, n] = s[i - 1] + x
                    out[2, n] = min(low + slope * x, min(h[i - 1] + g * x, h[i] + g * (length - x)))
                    n += 1
            out[0, n], out[1, n], out[2, n] = t[i], s[i], h[i]
            n += 1
    new_first[edges] = n
    return new_first, out[0, :n], out[1, :n], out[2, :n]


@inner
def metric_length(length, h0, h1):
    """Integral of ds / h over a piece along which h runs linearly from h0 to h1."""
    d = h1 - h0
    if abs(d) < 1e-9 * h0:
        return length / h0
    return length * math.log(h1 / h0) / d


@inner
def metric_position(part, length, h0, h1):
    """Distance along a piece at which the integral of ds / h reaches ``part``."""
    d = h1 - h0
    if abs(d) < 1e-9 * h0:
        return min(length, part * h0)
    return min(length, h0 * length / d * (math.exp(part * d / length) - 1.0))


@inner
def edge_metric(first, s, h, e, low, high):
    """Metric length of edge e between arc lengths low and high."""
    total = 0.0
    a, b = first[e], first[e + 1] - 1
    left = low
    h_left = interpolate(low, s, h, a, b)
    for i in range(a + 1, b + 1):
        if s[i] <= low:
            continue
        right, h_right = s[i], h[i]
        if right > high:
            right, h_right = high, interpolate(high, s, h, a, b)
        total += metric_length(right - left, h_left, h_right)
        left, h_left = right, h_right
        if s[i] >= high:
            break
    return total


@inner
def count_nodes(first, s, h, radius, step, at_least, counts):
    """Number of segments of each edge into counts (e,), the protected ends included.

    Whole numbers are chosen by ratio, so that no segment is longer or shorter than asked by more than sqrt(2).
    ``radius`` (e, 2) is the length of the first and last segment, ``step`` (e, 2) that of the one beside; 0 for no
    such segment.
    """
    for e in range(first.shape[0] - 1):
        low = radius[e, 0] + step[e, 0]
        high = s[first[e + 1] - 1] - radius[e, 1] - step[e, 1]
        metric = edge_metric(first, s, h, e, low, high)
        n = math.floor(metric)
        if metric * metric > n * (n + 1.0):
            n += 1
        extra = 0
        for i in range(2):
            extra += (1 if radius[e, i] > 0.0 else 0) + (1 if step[e, i] > 0.0 else 0)
        counts[e] = max(1, at_least[e] - extra, n) + extra


@inner
def place_nodes(first, s, t, h, radius, step, counts, node_first, node_t):
    """Parameters of the nodes of each edge, both ends included, at equal metric lengths between protected ends.

    Edge e writes ``counts[e] + 1`` parameters into node_t from ``node_first[e]``; see ``count_nodes``.
    """
    for e in range(first.shape[0] - 1):
        a, b = first[e], first[e + 1] - 1
        o = node_first[e]
        low, high = 0.0, s[b]
        begin = 0
        stop = counts[e]
        for part in range(2):
            ahead, back = (radius[e, 0], radius[e, 1]) if part == 0 else (step[e, 0], step[e, 1])
            if ahead > 0.0:
                begin += 1
                low += ahead
                node_t[o + begin] = interpolate(low, s, t, a, b)
            if back > 0.0:
                stop -= 1
                high -= back
                node_t[o + stop] = interpolate(high, s, t, a, b)
        node_t[o] = 0.0
        node_t[o + counts[e]] = 1.0
        pieces = stop - begin
        part_length = edge_metric(first, s, h, e, low, high) / pieces
        passed = 0.0
        k = 1
        left, h_left = low, interpolate(low, s, h, a, b)
        for i in range(a + 1, b + 1):
            if s[i] <= low:
                continue
            right, h_right = s[i], h[i]
            if right > high:
                right, h_right = high, interpolate(high, s, h, a, b)
            m = metric_length(right - left, h_left, h_right)
            while k < pieces and k * part_length <= passed + m:
                at = left + metric_position(k * part_length - passed, right - left, h_left, h_right)
                node_t[o + begin + k] = interpolate(at, s, t, a, b)
                k += 1
            passed += m
            left, h_left = right, h_right
        while k < pieces:  # what rounding left over
            node_t[o + begin + k] = interpolate(high, s, t, a, b)
            k += 1


@kernel(allocates=True)
def lay_nodes(
    kinds, offsets, data, which, span, t, s, h, ends, radius, tilt, step, vertex_size, longest, at_least, g, most
):  # fmt: skip
    """Nodes of all edges, on tracks ``which`` (e,): counts (e,) of segments, node_first (e + 1,), parameters node_t.

    See ``grade``, ``envelope``, ``count_nodes`` and ``place_nodes``. The graded radius is made longer by ``tilt``
    (e, 2). No nodes are laid where they would be more than ``most``, or an edge cannot be counted (its count is below
    1): node_t is empty then.
    """
    first, t, s, cap = gathered(span, t, s, h)
    h, radius, vertex_size, vertex_leg = cap.copy(), radius.copy(), vertex_size.copy(), np.empty(longest.shape[0])
    for v in range(longest.shape[0]):
        vertex_leg[v] = np.inf
    grade(first, s, h, ends, radius, vertex_size, vertex_leg, g, longest)
    legs = 0
    for e in range(radius.shape[0]):
        for i in range(2):
            legs += 1 if radius[e, i] > 0.0 else 0
            radius[e, i] += tilt[e, i]
    if legs > 0:
        first, t, s, cap, h = with_leg_ends(kinds, offsets, data, which, first, t, s, cap, h, radius)
    first, t, s, h = envelope(first, t, s, cap, h, g)
    edges = first.shape[0] - 1
    counts, node_first = np.empty(edges, np.int64), np.empty(edges + 1, np.int64)
    count_nodes(first, s, h, radius, step, at_least, counts)
    total, least = 0, 1
    for e in range(edges):
        node_first[e] = total + e
        total += counts[e]
        least = min(least, counts[e])
    node_first[edges] = total + edges
    if total > most or least < 1:
        return counts, node_first, np.empty(0)
    node_t = np.empty(total + edges)
    place_nodes(first, s, t, h, radius, step, counts, node_first, node_t)
    return counts, node_first, node_t


@kernel
def find_moved(first, t, first_before, t_before, most, moved):
    """Mark edges (e,) whose nodes are more or fewer than before, or moved by over ``most`` times a segment beside."""
    for e in range(moved.shape[0]):
        a, b, ahead = first[e], first[e + 1] - 1, first_before[e] - first[e]
        moved[e] = first_before[e + 1] - 1 - ahead != b
        if not moved[e]:
            for i in range(a + 1, b):
                j = i + ahead
                least = min(t_before[j] - t_before[j - 1], t_before[j + 1] - t_before[j])
                if abs(t[i] - t_before[j]) > most * least:
                    moved[e] = 1


@inner(allocates=True)
def node_sizes(points, segments, angle, sharp, h, size):
    """Size of each boundary node: half the length of its two segments, at most h but where one of them is much longer.

    Beside a sharp corner the corner triangle is long and its base short: the neighbours of such a
    corner take the shorter of their two segments. Returns nothing; writes size (n,).
    """
    n = points.shape[0]
    shorter, longer, beside = np.empty(n), np.empty(n), np.empty(n, np.uint8)
    for v in range(n):
        shorter[v], longer[v], beside[v], size[v] = np.inf, 0.0, 0, 0.0
    for k in range(segments.shape[0]):
        a, b = segments[k, 0], segments[k, 1]
        length = math.hypot(points[a, 0] - points[b, 0], points[a, 1] - points[b, 1])
        for v in (a, b):
            size[v] += 0.5 * length
            shorter[v], longer[v] = min(shorter[v], length), max(longer[v], length)
        if angle[a] < sharp:
            beside[b] = 1
        if angle[b] < sharp:
            beside[a] = 1
    for v in range(n):
        size[v] = shorter[v] if beside[v] else size[v]
        if longer[v] <= LONG_SEGMENT * h:
            size[v] = min(h, size[v])


@kernel(allocates=True)
def gather_face(
    kinds, offsets, data, loop_first, edges, forward, angles, uses, node_first, node_t, sharp, h, look, g, factor,
    threshold,
):  # fmt: skip
    """Boundary arrays of one face from the nodes of its edges: points, kind, size, angle, segments, track, t, mode.

    Last comes whether ``look`` is set and ``all_apart`` says so.

    ``edges``, ``forward``, ``angles`` (c,) describe the curves in loop order; track j is curve j in the direction of
    its edge, ``uses`` (e,) tells how often an edge bounds a face. The node before curve j has the interior angle
    angles[j]. ``sharp`` and ``h`` as in ``node_sizes``.
    """
    n = 0
    for c in range(edges.shape[0]):
        n += node_first[edges[c] + 1] - node_first[edges[c]] - 1
    points, params, angle, size = np.empty((n, 2)), np.empty((n, 2)), np.empty(n), np.empty(n)
    kind, mode, track = np.empty(n, np.uint8), np.empty(n, np.uint8), np.empty(n, np.int32)
    segments = np.empty((n, 2), np.int32)
    n = 0
    for loop in range(loop_first.shape[0] - 1):
        start = n
        for c in range(loop_first[loop], loop_first[loop + 1]):
            e = edges[c]
            shared = uses[e] > 1
            o = node_first[e]
            k = node_first[e + 1] - o - 1
            for i in range(k):
                j, j1 = (o + i, o + i + 1) if forward[c] else (o + k - i, o + k - i - 1)
                points[n, 0], points[n, 1] = evaluate_one(kinds, offsets, data, c, node_t[j])
                kind[n] = 2 if i == 0 else (3 if shared else 1)
                angle[n] = angles[c] if i == 0 else 180.0
                segments[n, 0] = n
                segments[n, 1] = n + 1
                track[n] = c
                params[n, 0], params[n, 1] = node_t[j], node_t[j1]
                mode[n] = 1 if shared else 0
                n += 1
        segments[n - 1, 1] = start
    node_sizes(points, segments, angle, sharp, h, size)
    apart = look and all_apart(points, segments, size, angle, sharp, g, factor, threshold)
    return points, kind, size, angle, segments, track, params, mode, apart


@inner
def gap_sizes(points, triangles, neighbours, size, angle, sharp, g, factor, want, foot, foot_want):
    """Sizes wanted at the boundary nodes (n,) and at one place of each segment (k,).

    In a triangulation of the boundary nodes alone, a triangle with one edge on the boundary sees the
    gap between that segment and its apex. The apex is asked to be no larger than ``factor`` times the
    gap, and so is the foot of the apex on the segment: ``foot`` is its share of the segment and
    ``foot_want`` the size there, infinite where nothing is asked. Nodes at corners
    below ``sharp`` degrees are left alone. Growth is limited to g along all edges.
    """
    for v in range(want.shape[0]):
        want[v] = size[v]
    for k in range(foot.shape[0]):
        foot[k], foot_want[k] = 0.0, np.inf
    for t in range(triangles.shape[0]):
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            if neighbours[t, i] >= 0 or neighbours[t, j] < 0 or neighbours[t, k] < 0:
                continue
            v, a, b = triangles[t, i], triangles[t, j], triangles[t, k]
            ex, ey = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
            px, py = points[v, 0] - points[a, 0], points[v, 1] - points[a, 1]
            length = math.hypot(ex, ey)
            q = min(1.0, max(0.0, (px * ex + py * ey) / length**2))
            gap = factor * math.hypot(px - q * ex, py - q * ey)
            if angle[v] >= sharp:
                want[v] = min(want[v], gap)
            if angle[a] >= sharp:
                want[a] = min(want[a], gap + g * q * length)
            if angle[b] >= sharp:
                want[b] = min(want[b], gap + g * (1.0 - q) * length)
            segment = -1 - neighbours[t, i]
            foot[segment] = q
            foot_want[segment] = gap
    for _sweep in range(4):
        changed = False
        for t in range(triangles.shape[0]):
            for i in range(3):
                a, b = triangles[t, i], triangles[t, (i + 1) % 3]
                if want[a] > want[b]:
                    a, b = b, a
                if want[a] == want[b] or angle[a] < sharp or angle[b] < sharp:
                    continue
                reach = want[a] + g * math.hypot(points[a, 0] - points[b, 0], points[a, 1] - points[b, 1])
                if reach < want[b]:
                    want[b] = reach
                    changed = True
        if not changed:
            break


@inner
def corner_ratio(points, segments, want, v):
    """Wanted size over the base of the triangle in the sharp corner v; segments that leave and reach v."""
    leave = reach = -1
    for k in range(segments.shape[0]):
        if segments[k, 0] == v and leave < 0:
            leave = k
        if segments[k, 1] == v and reach < 0:
            reach = k
    p, q = segments[leave, 1], segments[reach, 0]
    base = math.hypot(points[p, 0] - points[q, 0], points[p, 1] - points[q, 1])
    ratio = min(want[p], want[q]) / base if base > 0.0 else 1.0
    return ratio, leave, reach


@inner
def is_narrow(points, segments, size, angle, sharp, want, foot, foot_want, threshold, leg_threshold):
    """Whether less is wanted than ``threshold`` times the present size anywhere.

    Of the triangle in a sharp corner, less than ``leg_threshold`` times its base.
    """
    for k in range(segments.shape[0]):
        if too_large(segments, size, want, foot, foot_want, threshold, k):
            return True
    for v in range(points.shape[0]):
        if angle[v] < sharp and corner_ratio(points, segments, want, v)[0] < leg_threshold:
            return True
    return False


@kernel(allocates=True)
def look_across(
    points, segments, track, params, size, angle, edges, triangles, neighbours, sharp, g, factor, least, threshold,
    leg_threshold, span, t, s, h, fill, changed,
):  # fmt: skip
    """Lower the tables of a face to what ``gap_sizes`` asks for, no less than ``least``, where it is too narrow.

    See ``is_narrow`` and ``lower_face``. Returns what is wanted at the nodes (n,), the feet on the segments (k,) as
    shares and what is wanted there, 1 where the face is too narrow or 0, and what ``lower_face`` does.
    """
    n, k = points.shape[0], segments.shape[0]
    want, foot, foot_want = np.empty(n), np.empty(k), np.empty(k)
    gap_sizes(points, triangles, neighbours, size, angle, sharp, g, factor, want, foot, foot_want)
    for v in range(n):
        want[v] = max(want[v], least)
    for i in range(k):
        foot_want[i] = max(foot_want[i], least)
    if not is_narrow(points, segments, size, angle, sharp, want, foot, foot_want, threshold, leg_threshold):
        return want, foot, foot_want, 0, fill, 0
    fill, missing = lower_face(
        edges, segments, track, params, size, want, foot, foot_want, threshold, span, t, s, h, fill, changed
    )  # fmt: skip
    return want, foot, foot_want, 1, fill, missing
