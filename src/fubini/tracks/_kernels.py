"""Compiled evaluation of tracks; the layout is described at ``fubini.tracks.table.Tracks``."""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import kernel


@kernel
def rational_point(data, o, t):
    """Point at t of a chain of rational Bezier pieces whose data starts at ``o``."""
    pieces, degree = int(data[o]), int(data[o + 1])
    low, high = 0, pieces
    while high - low > 1:
        middle = (low + high) // 2
        if data[o + 2 + middle] <= t:
            low = middle
        else:
            high = middle
    t0, t1 = data[o + 2 + low], data[o + 3 + low]
    u = (t - t0) / (t1 - t0)
    v = 1.0 - u
    first = o + 3 + pieces + 3 * (degree + 1) * low
    # Bernstein sum by Horner's scheme in u / v or v / u, whichever is at most one
    x = y = w = 0.0
    binomial = 1.0
    if u <= 0.5:
        r = u / v
        power = v**degree
        for i in range(degree + 1):
            x += power * binomial * data[first + 3 * i]
            y += power * binomial * data[first + 3 * i + 1]
            w += power * binomial * data[first + 3 * i + 2]
            power *= r
            binomial *= (degree - i) / (i + 1.0)
    else:
        r = v / u
        power = u**degree
        for i in range(degree, -1, -1):
            x += power * binomial * data[first + 3 * i]
            y += power * binomial * data[first + 3 * i + 1]
            w += power * binomial * data[first + 3 * i + 2]
            power *= r
            binomial *= i / (degree - i + 1.0)
    return x / w, y / w


@kernel
def evaluate_one(kinds, offsets, data, track, t):
    """Point (x, y) of a track at t in [0, 1]; the stored ends at 0 and 1."""
    o = np.int64(offsets[track])
    if t <= 0.0:
        return data[o], data[o + 1]
    if t >= 1.0:
        return data[o + 2], data[o + 3]
    if kinds[track] == 0:
        s = 1.0 - t
        return s * data[o] + t * data[o + 2], s * data[o + 1] + t * data[o + 3]
    if kinds[track] == 1:
        u = data[o + 10] + t * (data[o + 11] - data[o + 10])
        c, s = math.cos(u), math.sin(u)
        return (
            data[o + 4] + c * data[o + 6] + s * data[o + 8],
            data[o + 5] + c * data[o + 7] + s * data[o + 9],
        )
    return rational_point(data, o + 4, t)


@kernel
def evaluate_many(kinds, offsets, data, track, t, out):
    """Write the points at t (n,) of tracks (n,) into out (n, 2)."""
    for i in range(t.shape[0]):
        out[i, 0], out[i, 1] = evaluate_one(kinds, offsets, data, np.int64(track[i]), t[i])
