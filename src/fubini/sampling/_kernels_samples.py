"""Compiled tables of the size along edges, as their curves ask for it: see ``_kernels_sizes`` for what becomes of them.

Curves are sampled at even parameters, and between these where they turn or where the parameter is uneven.
"""

from __future__ import annotations

import math

import numpy as np

from fubini._jit import inner, kernel
from fubini.tracks._kernels import evaluate_one

#: Curves are sampled more densely where segments are to turn by less than this (radians), up to so many samples.
FINE_TURN, MOST_SAMPLES = 0.75, 16385
#: Half-diameters that differ by less than this, relative to their squares, make a circle.
ROUND = 1e-9
#: Samples are close enough where chords turn by less than this share of the turning of a segment, ...
CLOSE = 0.4
#: ... and where the parameter in the middle is not this many times as far from one end of a chord as from the other,
#: nor the speed at an end so many times that along the chord, or less. Both are looked for where a chord is so many
#: times as long as one beside it, longer than this share of the curve, or its speed so many times that of one beside
#: it. The speed at an end is that over this share of the parameter.
UNEVEN, LONGER, LONG, FASTER, BESIDE = 4.0, 8.0, 0.0625, 2.5, 1.0 / 64.0
#: Chords this many times as long as what counts as one point may be halved.
DIVISIBLE = 3.0
#: Samples that a curve may get beyond the even ones, and rounds of halving: below rounding.
MOST_EXTRA, MOST_ROUNDS = 4096, 48
#: The direction at an end is looked for at a share of the chord there, at that share of it, ..., so many times.
PROBE, PROBES = 0.0625, 6


@inner
def turning_sizes(x, y, s, turn, blur, angle, out):
    """Size at the samples of a polyline x, y with arc lengths s (n,): it turns by ``turn`` radians there.

    The narrowest window about the sample over which the tangent turns by ``turn`` is the size; an
    isolated kink that turns by less does not call for small elements, however small its radius. Windows
    no longer than ``blur`` are not looked at: what turns there is rounding, or a loop that counts as a point.
    Writes into out (n,); ``angle`` is scratch space.
    """
    n = s.shape[0]
    previous = math.atan2(y[1] - y[0], x[1] - x[0])
    total = 0.0
    angle[0] = 0.0
    for i in range(1, n):
        d = math.atan2(y[i] - y[i - 1], x[i] - x[i - 1]) if s[i] - s[i - 1] > 1.5 * blur else previous
        step = d - previous
        if step > math.pi:
            step -= 2.0 * math.pi
        elif step < -math.pi:
            step += 2.0 * math.pi
        previous = d
        total += abs(step)
        angle[i] = total
    low = 0
    for i in range(n):
        out[i] = np.inf
    for high in range(1, n):
        while angle[high] - angle[low] >= turn:
            window = s[high] - s[low]
            if window > blur:
                for i in range(low, high + 1):
                    if window < out[i]:
                        out[i] = window
            low += 1


@inner
def circle_radius(data, o):
    """Radius of the conic whose data starts at ``o`` if it is a circle, or an arc of one; else 0."""
    ax, ay, bx, by = data[o + 6], data[o + 7], data[o + 8], data[o + 9]
    square = ax * ax + ay * ay
    if abs(square - bx * bx - by * by) > ROUND * square or abs(ax * bx + ay * by) > ROUND * square:
        return 0.0
    return math.sqrt(square) if data[o + 10] != data[o + 11] else 0.0


@inner
def sample_count(kinds, offsets, data, track, finer):
    """Samples to take of a track: two of a line, more of a curve with many pieces."""
    if kinds[track] == 0:
        return np.int64(2)
    if kinds[track] == 1:
        return min(MOST_SAMPLES, 128 * finer + 1)
    pieces = np.int64(data[offsets[track] + 4])
    each = max(1, min(max(16, -(-64 // pieces)), 4096 // pieces) * finer)
    return pieces * max(1, min(each, (MOST_SAMPLES - 1) // pieces)) + 1


@inner
def walk(kinds, offsets, data, track, count, blur, t, s, x, y):
    """Samples of a track at even parameters of each of its pieces; their number.

    Where a curve stays in one place, within ``blur`` from sample to sample, only the ends of the stretch are kept, so
    far apart in ``s`` as that. Other samples that do not get ahead are left out.
    """
    o = np.int64(offsets[track])
    pieces = np.int64(data[o + 4]) if kinds[track] == 2 else 1
    each, n = (count - 1) // pieces, 0
    length = last_x = last_y = 0.0
    waiting = -1.0
    for i in range(count):
        at = i / (count - 1)
        if kinds[track] == 2 and i < count - 1:
            k = i // each
            low = data[o + 6 + k]
            at = low + (data[o + 7 + k] - low) * ((i - k * each) / each)
        px, py = evaluate_one(kinds, offsets, data, track, at)
        ahead = math.hypot(px - last_x, py - last_y) if i > 0 else 0.0
        if i > 0 and i < count - 1 and ahead <= blur:
            waiting = at
            continue
        if waiting >= 0.0 and length + blur > length:
            length += blur
            t[n], s[n], x[n], y[n] = waiting, length, last_x, last_y
            n += 1
        waiting = -1.0
        if i == 0 or length + ahead > length:
            length += ahead
            t[n], s[n], x[n], y[n] = at, length, px, py
            n += 1
        last_x, last_y = px, py
    return n


@inner(allocates=True)
def extended(old, n, room):
    """An array with so much room that starts with the first n entries of ``old``."""
    out = np.empty(room)
    for i in range(n):
        out[i] = old[i]
    return out


@inner
def turns_at_end(kinds, offsets, data, track, at, far, x, y, far_x, far_y, turn, blur):
    """Whether the curve leaves its end (x, y) at ``at`` at an angle above ``turn`` to the chord to ``far``."""
    cx, cy, share = far_x - x, far_y - y, 1.0
    for _ in range(PROBES):
        share *= PROBE
        px, py = evaluate_one(kinds, offsets, data, track, at + share * (far - at))
        px, py = px - x, py - y
        if math.hypot(px, py) <= DIVISIBLE * blur:
            break
        if abs(math.atan2(cx * py - cy * px, cx * px + cy * py)) > turn:
            return True
    return False


@inner
def is_uneven(kinds, offsets, data, track, t, x, y, i):
    """Whether half the way from sample i to the next in the parameter is far from half the chord, or speed changes.

    Where a curve all but stops at a sample, lengths go with the square of the parameter: on however short a chord, what
    lies beside that end is far less than a table of straight lines tells.
    """
    step = t[i + 1] - t[i]
    px, py = evaluate_one(kinds, offsets, data, track, t[i] + 0.5 * step)
    a, b = math.hypot(px - x[i], py - y[i]), math.hypot(px - x[i + 1], py - y[i + 1])
    if a > UNEVEN * b or b > UNEVEN * a:
        return True
    for k in range(2):
        at = t[i + k] + BESIDE * (1.0 - 2.0 * k) * step
        px, py = evaluate_one(kinds, offsets, data, track, at)
        way = math.hypot(px - x[i + k], py - y[i + k])
        if way > UNEVEN * BESIDE * (a + b) or UNEVEN * way < BESIDE * (a + b):
            return True
    return False


@inner
def mark_coarse(kinds, offsets, data, track, turn, blur, t, s, x, y, n, coarse):
    """Mark the chords that are to be halved: beside a bend above ``turn``, and where the parameter is uneven.

    Chords below ``DIVISIBLE`` times ``blur`` stay. Returns the number of them.
    """
    most, long, count = math.cos(turn), LONG * s[n - 1], 0
    ends = 0, n - 2
    for i in range(n - 1):
        coarse[i] = 0
    b = math.hypot(x[1] - x[0], y[1] - y[0])
    for i in range(1, n - 1):
        ux, uy, vx, vy, a = x[i] - x[i - 1], y[i] - y[i - 1], x[i + 1] - x[i], y[i + 1] - y[i], b
        b = math.hypot(vx, vy)
        bent = ux * vx + uy * vy < most * a * b
        p, q = a * (t[i + 1] - t[i]), b * (t[i] - t[i - 1])  # as the speeds along the two chords
        jump = p > FASTER * q or q > FASTER * p
        if bent or ((jump or a > min(LONGER * b, long)) and is_uneven(kinds, offsets, data, track, t, x, y, i - 1)):
            coarse[i - 1] = 1
        if bent or ((jump or b > min(LONGER * a, long)) and is_uneven(kinds, offsets, data, track, t, x, y, i)):
            coarse[i] = 1
    for k in range(2):
        i, at, far = ends[k], k * (n - 1), 1 + k * (n - 3)
        if coarse[i] == 0 and turns_at_end(
            kinds, offsets, data, track, t[at], t[far], x[at], y[at], x[far], y[far], turn, blur
        ):  # fmt: skip
            coarse[i] = 1
    for i in range(n - 1):
        if coarse[i] == 1 and math.hypot(x[i + 1] - x[i], y[i + 1] - y[i]) <= DIVISIBLE * blur:
            coarse[i] = 0
        count += coarse[i]
    return count


@inner
def halve_coarse(kinds, offsets, data, track, turn, blur, n, t, s, x, y, coarse):
    """Put more samples of a track among the n there are, until all are close enough or there is no room; their number.

    Even parameters miss the ends of slender ellipses, near-cusps, and what heavy weights draw together.
    """
    for _ in range(MOST_ROUNDS):
        count = mark_coarse(kinds, offsets, data, track, turn, blur, t, s, x, y, n, coarse)
        if count == 0 or n + count > t.shape[0]:
            return n
        for i in range(n - 1, 0, -1):
            s[i] -= s[i - 1]
        to = n + count - 1
        for i in range(n - 1, 0, -1):
            t[to], s[to], x[to], y[to] = t[i], s[i], x[i], y[i]
            to -= 1
            if coarse[i - 1] == 1:
                at = 0.5 * (t[i - 1] + t[i])
                px, py = evaluate_one(kinds, offsets, data, track, at)
                s[to + 1] = math.hypot(px - x[i], py - y[i])
                t[to], s[to], x[to], y[to] = at, math.hypot(px - x[i - 1], py - y[i - 1]), px, py
                to -= 1
        last = 0
        for i in range(1, n + count):  # samples that do not get ahead are left out, but for the end
            if s[i] > 0.0 and s[last] + s[i] > s[last]:
                last += 1
                t[last], s[last], x[last], y[last] = t[i], s[last - 1] + s[i], x[i], y[i]
        t[last] = t[n + count - 1]
        n = last + 1
    return n


@kernel(allocates=True)
def sample_tracks(kinds, offsets, data, which, turn, blur, most, pieces, dense, spare):
    """Tables (span, t, s, h) of the tracks ``which`` (e,), with ``spare`` rows behind them.

    ``h`` is the size bound by the turning of the curve (over more than ``blur``), by ``most`` (e,) and by the length
    over ``pieces`` (e,).
    Circles, whose tables are straight lines, get two samples unless ``dense``.
    """
    edges, room, longest = which.shape[0], 0, 2
    finer = max(1, np.int64(math.ceil(FINE_TURN / turn)))
    count = np.empty(edges, np.int64)
    for e in range(edges):
        count[e] = sample_count(kinds, offsets, data, which[e], finer)
        if kinds[which[e]] == 1 and not dense and circle_radius(data, offsets[which[e]]) > 0.0:
            count[e] = 2
        room += count[e]
        longest = max(longest, count[e])
    span = np.empty((edges, 2), np.int64)
    room += spare
    t, s, h = np.empty(room), np.empty(room), np.empty(room)
    longest += MOST_EXTRA if longest > 2 else 0
    along, far, x, y = np.empty(longest), np.empty(longest), np.empty(longest), np.empty(longest)
    angle, size, coarse = np.empty(longest), np.empty(longest), np.empty(longest, np.uint8)
    n = 0
    for e in range(edges):
        a, o, m = n, np.int64(offsets[which[e]]), 0
        if kinds[which[e]] == 1 and count[e] == 2:
            radius, sweep = circle_radius(data, o), abs(data[o + 11] - data[o + 10])
            bound = radius * turn if sweep >= turn else np.inf
            for i in range(2):
                t[n], s[n], h[n] = i, i * radius * sweep, bound
                n += 1
        else:
            m = walk(kinds, offsets, data, which[e], count[e], blur, along, far, x, y)
            if kinds[which[e]] != 0:
                if kinds[which[e]] != 1 or circle_radius(data, o) == 0.0:  # circles turn evenly, whatever ends they get
                    m = halve_coarse(
                        kinds, offsets, data, which[e], CLOSE * turn, blur, m, along, far, x, y, coarse
                    )  # fmt: skip
                turning_sizes(x, y, far[:m], turn, blur, angle, size)
            room += max(0, m - count[e])
            if room > t.shape[0]:
                t, s, h = extended(t, n, 2 * room), extended(s, n, 2 * room), extended(h, n, 2 * room)
            for i in range(m):
                t[n + i], s[n + i] = along[i], far[i]
                h[n + i] = size[i] if kinds[which[e]] != 0 else np.inf
            n += m
        bound = min(most[e], s[n - 1] / pieces[e])
        for i in range(a, n):
            h[i] = min(h[i], bound)
        span[e, 0], span[e, 1] = a, n
    return span, t, s, h
