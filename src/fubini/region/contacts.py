"""Where two parts of a boundary cross or touch.

Pairs of monotone parts are halved until a strip around each (the chord, widened by the height of
the arc over it) shows that they stay apart, or that they meet. Strips thin out with the square of
their length, so that even a cusp keeps only a few pairs alive at every step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.curves import BSpline
from fubini.region.parts import Parts, close_pairs

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

#: Halvings of a part before the search gives up on a pair (below rounding, of either curve).
_DEPTH = 60

#: More pieces than this alive for one pair of parts: they run along each other.
_CROWD = 600

#: Points at which such a pair is measured.
_PROBES = 65

#: Shares of a piece at which it is looked at; ends matter most to how far it swings away from its chord there.
_PLACES = np.array([0.0, 1.0 / 64.0, 0.25, 0.5, 0.75, 63.0 / 64.0, 1.0])

#: Those of them that are even.
_FIVE = [0, 2, 3, 4, 6]

#: Rays between those looked at swing by no more than this times as much: 1 of arcs, 1.1 of cubics.
_BEYOND = 1.25

#: Pieces of splines with more knots inside may wind between the places that are looked at.
_KNOTS = 4

#: Contacts nearer than this along the loop (times the diagonal) are one joint with its tiny edges.
_NEIGHBOURS = 1e-6

#: Joints taper off into a cusp: up to this long (times the diagonal) ...
_CUSP_LENGTH = 2e-3

#: ... and this thin (times the diagonal), ends that cross within the accuracy of CAD are no fault.
_CUSP_WIDTH = 1e-7


@dataclass(frozen=True)
class Contact:
    """Parts ``a`` and ``b`` meet at ``place`` (2,), at parameters ``ta`` and ``tb`` of their curves.

    ``steep``: at an angle, so that they cross unless one of them ends there.
    """

    a: int
    b: int
    ta: float
    tb: float
    place: Float
    steep: bool


@dataclass(frozen=True)
class _Pairs:
    """Pieces [a0, a1] of part ``a`` and [b0, b1] of part ``b``, one pair a row."""

    a: Int
    a0: Float
    a1: Float
    b: Int
    b0: Float
    b1: Float

    def select(self, keep: Bool | Int) -> _Pairs:
        return _Pairs(*(getattr(self, f)[keep] for f in ("a", "a0", "a1", "b", "b0", "b1")))

    def halved(self, cut_a: Bool, cut_b: Bool) -> _Pairs:
        """All combinations of the halves, of those pieces that are to be cut."""
        am = np.where(cut_a, 0.5 * (self.a0 + self.a1), self.a1)
        bm = np.where(cut_b, 0.5 * (self.b0 + self.b1), self.b1)
        quarters = [
            _Pairs(self.a, a0, a1, self.b, b0, b1).select((a0 < a1) & (b0 < b1))
            for a0, a1 in ((self.a0, am), (am, self.a1))
            for b0, b1 in ((self.b0, bm), (bm, self.b1))
        ]
        return _Pairs(*(np.concatenate([getattr(q, f) for q in quarters]) for f in ("a", "a0", "a1", "b", "b0", "b1")))

    def __len__(self) -> int:
        return len(self.a)


@dataclass(frozen=True)
class _Strip:
    """Five points (n, 5, 2) of each piece, its chord (n, 2) and its height (n,) over the chord.

    ``swing`` (n,) bounds the angle in radians between the chord and any ray from an end of the piece to its points.
    Height and swing tell nothing of pieces with ``knots`` (n,): so many inside that they may wind between those points.
    """

    points: Float
    chord: Float
    height: Float
    swing: Float
    knots: Bool

    @property
    def length(self) -> Float:
        return np.hypot(self.chord[:, 0], self.chord[:, 1])


def find_contacts(parts: Parts, tolerance: float, diagonal: float) -> list[Contact]:
    """At most one contact for every pair of parts that meet other than at their joint."""
    found: list[Contact] = []
    for a, b in close_pairs(parts, tolerance):
        near = _neighbours(parts, a, b, _NEIGHBOURS * diagonal)
        pairs = _Pairs(a, parts.t0[a], parts.t1[a], b, parts.t0[b], parts.t1[b])
        for group, slack in ((~near, tolerance), (near, 0.0)):
            found += _search(parts, pairs.select(group), slack, tolerance, diagonal)
    found.sort(key=lambda c: (c.a, c.b))
    return found


def _search(parts: Parts, pairs: _Pairs, slack: float, tolerance: float, diagonal: float) -> list[Contact]:
    found: list[Contact] = []
    for _ in range(_DEPTH):
        if not len(pairs):
            break
        a, b = _strip(parts, pairs.a, pairs.a0, pairs.a1), _strip(parts, pairs.b, pairs.b0, pairs.b1)
        done = _apart(a, b, slack) | _only_joint(parts, pairs, a, b, _NEIGHBOURS * diagonal)
        pairs, a, b = pairs.select(~done), _pick(a, ~done), _pick(b, ~done)
        meets, steep = _meets(a, b, slack, tolerance)
        new = [c for c in _contacts(parts, pairs, a, b, meets, steep) if not _is_joint(parts, c, tolerance, diagonal)]
        pairs = pairs.select(~meets).halved((a.length >= 0.5 * b.length)[~meets], (b.length >= 0.5 * a.length)[~meets])
        pairs, crowded = _thin_out(parts, pairs, tolerance)
        new += [c for c in crowded if not _is_joint(parts, c, tolerance, diagonal)]
        pairs = _without(parts, pairs, new)
        found += new
    return found


def _strip(parts: Parts, part: Int, t0: Float, t1: Float) -> _Strip:
    t = t0[:, None] + (t1 - t0)[:, None] * _PLACES
    t[:, -1] = t1
    points, knots = np.empty((len(part), len(_PLACES), 2)), np.zeros(len(part), dtype=bool)
    numbers = parts.curve[part]
    for c in np.unique(numbers):
        mine, curve = np.flatnonzero(numbers == c), parts.curves[c]
        points[mine] = np.asarray(curve.point(t[mine].ravel()), float).reshape(len(mine), -1, 2)
        if isinstance(curve, BSpline):
            breaks = curve.chain.breaks
            inside = np.searchsorted(breaks, t1[mine]) - np.searchsorted(breaks, t0[mine], "right")
            knots[mine] = inside > _KNOTS
    chord = points[:, -1] - points[:, 0]
    length = np.maximum(np.hypot(chord[:, 0], chord[:, 1]), np.finfo(float).tiny)
    inner = points[:, 1:-1] - points[:, :1]
    ahead = np.einsum("nkd,nd->nk", inner, chord) / length[:, None]
    off = np.abs(inner[..., 0] * chord[:, None, 1] - inner[..., 1] * chord[:, None, 0]) / length[:, None]
    height = off[:, 1:-1].max(axis=1)
    swing = _BEYOND * np.maximum(np.arctan2(off, ahead), np.arctan2(off, length[:, None] - ahead)).max(axis=1)
    height[parts.straight[part]] = swing[parts.straight[part]] = 0.0
    return _Strip(points[:, _FIVE], chord, height, swing, knots)


def _pick(strip: _Strip, keep: Bool) -> _Strip:
    return _Strip(*(getattr(strip, f)[keep] for f in ("points", "chord", "height", "swing", "knots")))


def _apart(a: _Strip, b: _Strip, slack: float) -> Bool:
    """Whether some line keeps the strips more than ``slack`` apart (separating axes).

    Pieces with many knots inside are monotone all the same: only their boxes count.
    """
    apart = np.zeros(len(a.height), dtype=bool)
    pad = 0.5 * (a.height + b.height) + slack
    for chord in (a.chord, b.chord):
        length = np.maximum(np.hypot(chord[:, 0], chord[:, 1]), np.finfo(float).tiny)[:, None]
        for unit in (chord / length, np.stack([-chord[:, 1], chord[:, 0]], axis=1) / length):
            u = np.einsum("nkd,nd->nk", a.points, unit)
            v = np.einsum("nkd,nd->nk", b.points, unit)
            apart |= (u.min(axis=1) - v.max(axis=1) > pad) | (v.min(axis=1) - u.max(axis=1) > pad)
    apart &= ~(a.knots | b.knots)
    for first, second in ((a, b), (b, a)):
        apart |= (first.points.min(axis=1) - second.points.max(axis=1) > pad[:, None]).any(axis=1)
    return apart


def _only_joint(parts: Parts, pairs: _Pairs, a: _Strip, b: _Strip, short: float) -> Bool:
    """Whether the pieces meet at the joint of their parts and nowhere else that counts.

    They lie in different sectors around it, or within ``short`` of it.
    """
    done = np.zeros(len(pairs), dtype=bool)
    starts_a, ends_a = pairs.a0 == parts.t0[pairs.a], pairs.a1 == parts.t1[pairs.a]
    starts_b, ends_b = pairs.b0 == parts.t0[pairs.b], pairs.b1 == parts.t1[pairs.b]
    ahead = (parts.following[pairs.a] == pairs.b) & ends_a & starts_b
    behind = (parts.following[pairs.b] == pairs.a) & ends_b & starts_a
    for joint, sign in ((ahead & ~behind, 1.0), (behind & ~ahead, -1.0)):
        u, v = -sign * a.chord, sign * b.chord
        between = np.abs(np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], (u * v).sum(axis=1)))
        done |= joint & ~a.knots & ~b.knots & (between > a.swing + b.swing + 1e-12)
    for first, p, second, q in (
        (a, parts.p1[pairs.a], b, parts.p0[pairs.b]),
        (b, parts.p1[pairs.b], a, parts.p0[pairs.a]),
    ):
        close = np.hypot(*(p - q).T) <= short
        done |= close & (_radius(first, p) <= short) & (_radius(second, q) <= short)
    return done & (parts.loop[pairs.a] == parts.loop[pairs.b])


def _radius(strip: _Strip, center: Float) -> Float:
    """Largest distance (n,) of the sampled points from a point (n, 2) for each piece."""
    off = strip.points - center[:, None]
    return np.hypot(off[..., 0], off[..., 1]).max(axis=1)


def _meets(a: _Strip, b: _Strip, slack: float, tolerance: float) -> tuple[Bool, Bool]:
    """Which pairs meet for certain (sampled points within ``tolerance``, or a crossing); which at an angle.

    Neighbours (``slack`` is zero) come close without fault; for them only what cannot be told apart
    at the scale of the tolerance counts.
    """
    p, d, q, e = a.points[:, 0], a.chord, b.points[:, 0], b.chord
    cross = d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0]
    between = np.abs(np.arctan2(cross, (d * e).sum(axis=1)))
    steep = np.minimum(between, np.pi - between) > 4.0 * (a.swing + b.swing) + 1e-9
    with np.errstate(divide="ignore", invalid="ignore"):
        w = q - p
        s = (w[:, 0] * e[:, 1] - w[:, 1] * e[:, 0]) / cross
        t = (w[:, 0] * d[:, 1] - w[:, 1] * d[:, 0]) / cross
        # the arcs stray from their chords: ask for the crossing well inside both
        margin_a = 2.0 * (a.height + b.height) / (a.length * np.sin(between)) + 1e-12
        margin_b = 2.0 * (a.height + b.height) / (b.length * np.sin(between)) + 1e-12
        crossing = steep & (s > margin_a) & (s < 1 - margin_a) & (t > margin_b) & (t < 1 - margin_b)
        crossing &= ~(a.knots | b.knots)
    near = _point_distance(a, b) <= tolerance
    if slack == 0.0:
        near &= np.maximum(a.length, b.length) <= tolerance
    return crossing | near, steep


def _point_distance(a: _Strip, b: _Strip) -> Float:
    """Smallest distance (n,) of the sampled points of each to the sampled chords of the other."""
    best = np.full(len(a.height), np.inf)
    for first, second in ((a, b), (b, a)):
        for k in range(4):
            p, d = second.points[:, None, k], second.points[:, None, k + 1] - second.points[:, None, k]
            w = first.points - p
            square = np.maximum((d * d).sum(axis=2), np.finfo(float).tiny)
            t = np.clip((w * d).sum(axis=2) / square, 0.0, 1.0)
            off = w - t[..., None] * d
            # the arc itself strays from its chord by less than this
            stray = (0.25 * second.height)[:, None]
            best = np.minimum(best, (np.hypot(off[..., 0], off[..., 1]) + stray).min(axis=1))
    return best


def _contacts(parts: Parts, pairs: _Pairs, a: _Strip, b: _Strip, meets: Bool, steep: Bool) -> list[Contact]:
    """The first meeting row of every pair of parts, as contacts."""
    rows = np.flatnonzero(meets)
    key = pairs.a[rows] * np.int64(len(parts)) + pairs.b[rows]
    order = np.lexsort((~steep[rows], key))
    _, first = np.unique(key[order], return_index=True)
    return [_contact(pairs, a, b, int(i), bool(steep[i])) for i in rows[order[first]]]


def _contact(pairs: _Pairs, a: _Strip, b: _Strip, i: int, steep: bool) -> Contact:
    """The contact of row i: where the chords cross, or the nearest sampled points."""
    d, e, w = a.chord[i], b.chord[i], b.points[i, 0] - a.points[i, 0]
    if steep:
        cross = d[0] * e[1] - d[1] * e[0]
        s, t = (w[0] * e[1] - w[1] * e[0]) / cross, (w[0] * d[1] - w[1] * d[0]) / cross
        s, t = float(np.clip(s, 0.0, 1.0)), float(np.clip(t, 0.0, 1.0))
        place = a.points[i, 0] + s * d
    else:
        gaps = np.hypot(*(a.points[i][:, None] - b.points[i][None]).reshape(-1, 2).T)
        j, k = divmod(int(np.argmin(gaps)), 5)
        s, t, place = 0.25 * j, 0.25 * k, a.points[i, j]
    ta = float(pairs.a0[i] + s * (pairs.a1[i] - pairs.a0[i]))
    tb = float(pairs.b0[i] + t * (pairs.b1[i] - pairs.b0[i]))
    return Contact(int(pairs.a[i]), int(pairs.b[i]), ta, tb, place, steep)


def _without(parts: Parts, pairs: _Pairs, found: list[Contact]) -> _Pairs:
    """The pairs whose parts are not yet known to meet."""
    known = np.array([c.a * len(parts) + c.b for c in found], dtype=np.int64)
    return pairs.select(~np.isin(pairs.a * np.int64(len(parts)) + pairs.b, known))


def _thin_out(parts: Parts, pairs: _Pairs, tolerance: float) -> tuple[_Pairs, list[Contact]]:
    """Settle the pairs of parts that run along each other by the distance of points to the curve."""
    key = pairs.a * np.int64(len(parts)) + pairs.b
    values, first, count = np.unique(key, return_index=True, return_counts=True)
    found, settled = [], []
    for k in np.flatnonzero(count > _CROWD):
        a, b = int(pairs.a[first[k]]), int(pairs.b[first[k]])
        t = np.unique(np.concatenate([pairs.a0[key == values[k]], pairs.a1[key == values[k]]]))
        t = t[np.linspace(0, len(t) - 1, _PROBES).astype(np.int64)]
        points = np.asarray(parts.curves[parts.curve[a]].point(t), float)
        tb, distance = parts.curves[parts.curve[b]].closest(points)
        inside = (tb >= parts.t0[b]) & (tb <= parts.t1[b])
        distance = np.where(inside, distance, np.inf)
        i = int(np.argmin(distance))
        if distance[i] <= tolerance:
            found.append(Contact(a, b, float(t[i]), float(tb[i]), points[i], False))
        if distance[i] <= tolerance or count[k] > 64 * _CROWD:
            settled.append(values[k])
    return pairs.select(~np.isin(key, np.array(settled, dtype=np.int64))), found


def _neighbours(parts: Parts, a: Int, b: Int, reach: float) -> Bool:
    """Which parts (a, b) follow each other on one loop, tiny edges between them aside."""
    length = parts.total[a]
    end_a, end_b = _end(parts, a), _end(parts, b)
    ahead = np.mod(parts.start[b] - end_a, length)
    behind = np.mod(parts.start[a] - end_b, length)
    gap = np.minimum(np.minimum(ahead, length - ahead), np.minimum(behind, length - behind))
    return (parts.loop[a] == parts.loop[b]) & (gap <= reach)


def _end(parts: Parts, part: Int) -> Float:
    """Distance along the loop at which the parts end."""
    following = parts.following[part]
    end = parts.start[following]
    return np.where(end == 0.0, parts.total[part], end)


def _is_joint(parts: Parts, contact: Contact, tolerance: float, diagonal: float) -> bool:
    """Whether the parts meet only because a joint lies close by along the loop.

    Ends that run into a cusp may cross within the accuracy of CAD data: such a lens of no width
    and little length is the joint, too.
    """
    a, b = contact.a, contact.b
    if parts.loop[a] != parts.loop[b]:
        return False
    way = _way(parts, contact)
    if parts.curve[a] == parts.curve[b]:  # a curve that crosses itself makes a loop, however small
        return way <= (tolerance if contact.steep else _NEIGHBOURS * diagonal)
    if way <= _NEIGHBOURS * diagonal:
        return True
    if way > _CUSP_LENGTH * diagonal:
        return False
    return _width(parts, contact) <= _CUSP_WIDTH * diagonal


def _way(parts: Parts, contact: Contact) -> float:
    """Length of the boundary between the two places of a contact on one loop, the shorter way round.

    Only what lies between them is measured, so that a short way is right to its last digits.
    """
    a, b = contact.a, contact.b
    curve_a, curve_b = parts.curves[parts.curve[a]], parts.curves[parts.curve[b]]
    ends = _end(parts, np.array([a, b]))
    total = float(parts.total[a])
    ahead = curve_a.length(contact.ta, float(parts.t1[a])) + curve_b.length(float(parts.t0[b]), contact.tb)
    behind = curve_a.length(float(parts.t0[a]), contact.ta) + curve_b.length(contact.tb, float(parts.t1[b]))
    between = np.mod(np.array([parts.start[b] - ends[0], parts.start[a] - ends[1]]), total)
    between[between > (1.0 - 1e-12) * total] = 0.0  # one ends where the other starts, but for rounding
    return float(min(ahead + between[0], behind + between[1]))


def _width(parts: Parts, contact: Contact) -> float:
    """Largest distance from the second curve of the stretch of the first between contact and joint."""
    curve = parts.curves[parts.curve[contact.a]]
    other = parts.curves[parts.curve[contact.b]]
    to_start, to_end = (float(np.hypot(*(end - contact.place))) for end in (curve.start, curve.end))
    t = np.linspace(contact.ta, 1.0 if to_end < to_start else 0.0, 9)
    return float(other.closest(np.asarray(curve.point(t), float))[1].max())
