"""Compiled tables of the size along edges, made exact where legs of sharp corners end: see ``_kernels_sizes``."""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel
from fubini.sampling._kernels_samples import circle_radius
from fubini.tracks._kernels import evaluate_one


@inner
def interpolate(x, xs, ys, a, b):
    """Value at x of the polyline (xs, ys) over samples a .. b, ends clamped."""
    if x <= xs[a]:
        return ys[a]
    if x >= xs[b]:
        return ys[b]
    while b - a > 1:
        m = (a + b) // 2
        if xs[m] <= x:
            a = m
        else:
            b = m
    w = (x - xs[a]) / (xs[b] - xs[a])
    return (1.0 - w) * ys[a] + w * ys[b]


@kernel
def chord_parameter(kinds, offsets, data, track, side, chord, guess):
    """Parameter at which a track is as far as ``chord`` from its start (``side`` 0) or end (1); before, it is nearer.

    Looked for about ``guess``, which is returned where there is none.
    """
    end = np.float64(side)
    x, y = evaluate_one(kinds, offsets, data, track, end)
    near, far, found = end, guess, False
    for _ in range(60):
        px, py = evaluate_one(kinds, offsets, data, track, far)
        if math.hypot(px - x, py - y) >= chord:
            found = True
            break
        if far <= 0.0 or far >= 1.0:
            break
        near, far = far, min(1.0, max(0.0, end + 1.5 * (far - end)))
    if not found:
        return guess
    for _ in range(60):
        at = 0.5 * (near + far)
        px, py = evaluate_one(kinds, offsets, data, track, at)
        if math.hypot(px - x, py - y) < chord:
            near = at
        else:
            far = at
    return far


@inner
def along(kinds, offsets, data, track, t0, t1):
    """Length of a track from t0 to t1, which are close to each other unless it is a circle."""
    if kinds[track] == 1:
        radius, o = circle_radius(data, offsets[track]), np.int64(offsets[track])
        if radius > 0.0:
            return radius * abs(data[o + 11] - data[o + 10]) * (t1 - t0)
    x0, y0 = evaluate_one(kinds, offsets, data, track, t0)
    x1, y1 = evaluate_one(kinds, offsets, data, track, t1)
    return math.hypot(x1 - x0, y1 - y0)


@inner(allocates=True)
def with_leg_ends(kinds, offsets, data, which, first, t, s, cap, h, radius):
    """Tables (first, t, s, cap, h) with a sample at the end of every leg that lies on a curve, and none inside of legs.

    There the chord is as long as the leg, and lengths between samples are measured anew: what linear interpolation in
    the parameter makes of them may be off by more than the base of the triangle in a slender corner.
    """
    edges = first.shape[0] - 1
    new_first, out, n = np.empty(edges + 1, np.int64), np.empty((4, s.shape[0] + 2 * edges)), 0
    for e in range(edges):
        a, b, track = first[e], first[e + 1] - 1, np.int64(which[e])
        new_first[e] = n
        low, high, legs = 0.0, 1.0, 0
        for side in range(2):
            leg = radius[e, side] if kinds[track] != 0 else 0.0
            if 0.0 < leg < 0.5 * s[b]:
                guess = interpolate(leg if side == 0 else s[b] - leg, s, t, a, b)
                at = chord_parameter(kinds, offsets, data, track, side, leg, guess)
                low, high = (at, high) if side == 0 else (low, at)
                legs += 1
        if legs == 0 or low >= high:
            for i in range(a, b + 1):
                out[0, n], out[1, n], out[2, n], out[3, n] = t[i], s[i], cap[i], h[i]
                n += 1
            continue
        out[0, n], out[1, n], out[2, n], out[3, n] = t[a], 0.0, cap[a], h[a]
        n += 1
        if low > 0.0:
            out[0, n], out[1, n] = low, radius[e, 0]
            out[2, n], out[3, n] = interpolate(low, t, cap, a, b), interpolate(low, t, h, a, b)
            n += 1
        for i in range(a + 1, b + 1):
            inside = low < t[i] < high and i < b
            if inside or (i == b and high == 1.0):
                reached = out[1, n - 1] + along(kinds, offsets, data, track, out[0, n - 1], t[i])
                if reached > out[1, n - 1]:
                    out[0, n], out[1, n], out[2, n], out[3, n] = t[i], reached, cap[i], h[i]
                    n += 1
        if high < 1.0:
            reached = out[1, n - 1] + along(kinds, offsets, data, track, out[0, n - 1], high)
            n -= 1 if reached == out[1, n - 1] else 0  # a sample at the same place gives way
            out[0, n], out[1, n] = high, reached
            out[2, n], out[3, n] = interpolate(high, t, cap, a, b), interpolate(high, t, h, a, b)
            out[0, n + 1], out[1, n + 1], out[2, n + 1], out[3, n + 1] = 1.0, out[1, n] + radius[e, 1], cap[b], h[b]
            n += 2
    new_first[edges] = n
    return new_first, out[0, :n], out[1, :n], out[2, :n], out[3, :n]
