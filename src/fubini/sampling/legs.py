"""Legs of sharp corners: both edges of such a corner start with a segment of one length.

So the one triangle there is isosceles. Beside a cusp the leg is long and what follows is short, which a wall on the
other side of the edge has to stand.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fubini.sampling._kernels_legs import chord_parameter
from fubini.sampling.network import Network
from fubini.sampling.outline import Outline
from fubini.sampling.ratios import (
    EASE,
    LONG_STEP,
    MOST_GAPS,
    SHARP,
    STEP,
    best_ratio,
    chained,
    largest_ratio,
    least_steps,
)
from fubini.sampling.tables import EdgeTables, SizeOptions
from fubini.tracks import evaluate
from fubini.tracks.table import LINE
from fubini.triangulation.value import LOCKED, Boundary

Float = NDArray[np.float64]

#: Corners below this (degrees) have one triangle alone that will do, or none: its legs are held in all faces.
NARROW = 27.0
#: Legs are short enough where their chords open by this share of the angle between the tangents; of narrow corners, by
#: the second: their one triangle is as much worse than the best.
OPENING = (0.93, 0.96)
#: Share of the shorter edge that the triangle of a sharp corner may take.
LEG_SHARE = 0.34
#: ... and that a leg beside a wall may take of an edge that has no other leg.
LONG_SHARE = 0.9
#: Where that cannot be had, a ratio up to this is tried ...
LARGEST_STEP = 15.0
#: ... and where no leg would be long enough for that; with two walls one leg must be longer by so many gaps then.
FLATTEST, TILT = 2.95, 1.45
#: In corners below this (degrees) the other edge starts with a segment that one triangle beside the leg can stand.
TIGHT = 65.0
#: Segments beside a leg are so many gaps long for the sake of other sharp corners, and longer only as far as needed.
GOOD_GAPS = 2.0
#: A valid triangle's base is no longer than so many times its height, which in a wedge is that where it ends.
MOST_FLAT = 3.1
#: For the sake of ``STEP`` a leg may be this many times as long as asked; for ``LONG_STEP`` as long as need be.
LONGEST_LEG = 1.7
#: Other edges at the vertex of a leg longer than asked start with a segment no shorter than the leg over this.
BESIDE_LEG = 2.0
#: ... and over the length of the shortest edge at its vertex, such as the height of the wall, no more than this.
WALL_SHARE = 1.3
#: A leg that misses ``LARGEST_STEP`` without tilt, however long, is no longer than this share of that edge: the fans
#: at its end need the room.
SLENDER_SHARE = 0.3
#: Sharp corners so many times as wide as that of the leg are walls to it as well: between the base of their triangle
#: and the next segment there are three valid triangles at most, which span a ratio of 5.
WIDER = 4.0
#: In a face where it belongs to no sharp corner, a leg may be longer than the gap across it allows by one over this.
ROOM = 0.85


class Legs:
    """Lengths of the legs at the ends of all edges; without sharp corners ``radius`` and ``longest`` alone.

    Attributes
    ----------
    radius : (e, 2) length of the first and of the last segment of an edge; 0 where it is no leg.
    held : (e, 2) legs that no face may split.
    lengthened : (e, 2) legs that are as long as a wall beside them needs.
    tilt : (e, 2) by how much one leg of a corner is longer than ``radius``, for the sake of walls on both sides.
    longest : (v,) longest leg over the size at a vertex.
    factor : (e, 2) by how much legs are longer than ``radius`` in proportion, 1 at most.
    hopeless : (e, 2) legs beside which no valid triangles fit on one side or the other, whatever their lengths.
    narrowest : (e, 2) least angle (degrees) of the sharp corners, of whatever faces, that a leg belongs to.
    """

    def __init__(self, network: Network, options: SizeOptions, tables: EdgeTables) -> None:
        self.outlines, self.ends, self.options, self.tables = network.outlines, network.ends, options, tables
        self.radius = np.zeros((len(self.ends), 2))
        self.longest = np.empty(network.vertices)
        self.longest.fill(1.0)
        self._walled: list[tuple[Outline, int, int, float, list[tuple[int, int]]]] = []
        if network.sharpest >= SHARP:
            return
        self.shared = network.uses > 1
        self.held, self.lengthened, self.hopeless = np.zeros((3, *self.radius.shape), bool)
        self.tilt, self.factor = np.zeros(self.radius.shape), np.ones(self.radius.shape)
        self._tight: list[tuple[tuple[int, int], tuple[int, int], float]] = []
        self._skewed: list[tuple[float, tuple[tuple[int, int], tuple[int, int]]]] = []
        self._across: dict[tuple[int, int], tuple[int, int]] = {}
        self.narrowest = np.full(self.radius.shape, SHARP)
        for face, outline in enumerate(self.outlines):
            if outline.sharpest < SHARP:
                self._protect_corners(outline, options.fields[face] if options.fields is not None else None)

    def _protect_corners(self, outline: Outline, field: Callable[[Float], Float] | None) -> None:
        """Give both edges of every sharp corner a first segment of one length."""
        for c, before in outline.pairs():
            if outline.angles[c] >= SHARP or (c == before and outline.angles[c] >= 180.0):
                continue
            sides = corner_sides(outline, c, before)
            most = LEG_SHARE * min(self.tables[e][1][-1] for e, _ in sides)
            asked = min(self._asked(e) for e, _ in sides)
            if field is not None:
                asked = min(asked, float(field(self._leg_end(outline, c, sides[0][1], 0.0)[None])[0]))
            leg = self._leg_of_true_angle(outline, c, before, min(asked, most))
            for e, i in sides:
                old = self.radius[e, i]
                self.radius[e, i] = min(old, leg) if old > 0.0 else leg
                self.held[e, i] |= outline.angles[c] < NARROW
                self.narrowest[e, i] = min(self.narrowest[e, i], outline.angles[c])

    def _asked(self, e: int) -> float:
        """Size that is asked on edge e, whatever its curvature."""
        length, options = float(self.tables[e][1][-1]), self.options
        return min(options.size, options.edge_size.get(e, math.inf), length / options.edge_segments.get(e, 1))

    def lengthen(self) -> None:
        """Lengthen legs that lie beside another face too, where the next segment would be too short for that face."""
        self._widest = widest = self._widest_corners()
        if not ((widest > self.narrowest) & (self.radius > 0.0)).any():
            return
        self._tell_factors()
        self._find_tight()
        shortest = np.full(len(self.longest), np.inf)
        for (_t, s, _h), ends in zip(self.tables, self.ends, strict=True):
            shortest[ends] = np.minimum(shortest[ends], s[-1])
        for outline in self.outlines:
            for c, before in outline.pairs():
                sides = corner_sides(outline, c, before)
                beside = [side for side in sides if widest[side] > outline.angles[c]]
                if outline.angles[c] >= SHARP or not beside or self.radius[sides[0]] == 0.0:
                    continue
                walls = [side for side in beside if is_wall(widest[side], outline.angles[c])]
                self._walled.append((outline, c, before, MOST_GAPS[max(len(walls), 1) - 1], beside))
                if not walls:
                    continue
                v = int(self.ends[sides[0]])
                leg = float(self.radius[sides[0]])
                longer = self._leg_beside_wall(outline, c, before, leg, float(shortest[v]))
                if longer > leg:
                    self.longest[v] *= longer / leg
                    for side in sides:
                        self.radius[side], self.lengthened[side] = longer, True
                elif LARGEST_STEP * self._walled[-1][3] * self._opening(outline, c, before, leg) < leg:
                    for side in sides:
                        self.radius[side] = min(leg, SLENDER_SHARE * shortest[v])

    def _widest_corners(self) -> Float:
        """Angle in degrees of the widest corner, of whatever face, at each end of the edges (e, 2).

        Notes the other side of each of them.
        """
        widest = np.zeros((len(self.ends), 2))
        for outline in self.outlines:
            for c, before in outline.pairs():
                sides = corner_sides(outline, c, before)
                for side, other in (sides, sides[::-1]):
                    if outline.angles[c] > widest[side]:
                        widest[side], self._across[side] = outline.angles[c], other
        return widest

    def _tell_factors(self) -> None:
        """Let legs differ at corners whose neighbours are so narrow that equal ones leave no room for valid triangles.

        Ratios are passed on from edge to edge about a vertex; where they do not close up, its legs stay equal.
        """
        links: dict[int, list[tuple[tuple[int, int], tuple[int, int], float]]] = {}
        for outline in self.outlines:
            for c, before in outline.pairs():
                if outline.angles[c] < SHARP and self.radius[(sides := corner_sides(outline, c, before))[0]] > 0.0:
                    gaps = (self._gap_beyond(side, c, outline) for side in sides)
                    ratio = best_ratio(float(outline.angles[c]), *gaps)
                    if ratio != 1.0:
                        self._skewed.append((float(outline.angles[c]), sides))
                    links.setdefault(int(self.ends[sides[0]]), []).append((*sides, ratio))
        for at_vertex in links.values():
            if any(ratio != 1.0 for *_, ratio in at_vertex):
                factors = chained(at_vertex)
                for side, factor in factors.items():
                    self.factor[side] = factor / max(factors.values())

    def _find_tight(self) -> None:
        """Note corners of one triangle, or two that are almost alike, between a leg and an edge without one."""
        for outline in self.outlines:
            for c, before in outline.pairs():
                if SHARP <= outline.angles[c] < TIGHT:
                    sides = corner_sides(outline, c, before)
                    least = largest_ratio(math.radians(outline.angles[c]), 1) ** -EASE[0]
                    for side, other in (sides, sides[::-1]):
                        if self.radius[side] > 0.0 and self.radius[other] == 0.0:
                            self._tight.append((side, other, least))

    def _gap_beyond(self, side: tuple[int, int], c: int, outline: Outline) -> float:
        """Width at the end of a leg, over its length, of the narrowest corner beyond; infinite for none narrower."""
        narrowest = float(self.narrowest[side])
        return 2.0 * math.sin(math.radians(0.5 * narrowest)) if narrowest < outline.angles[c] else math.inf

    def _leg_beside_wall(self, outline: Outline, c: int, before: int, start: float, shortest: float) -> float:
        """Lengthen the leg from ``start`` until a next segment of no less than the leg over ``STEP`` fits the gap.

        In a cusp the gap grows with the square of the distance: where no length will do, the longest comes nearest.
        Unchanged where that misses ``LARGEST_STEP``, too, and in a wedge, where length gains nothing.
        """
        size, most_gaps = self.options.size, self._walled[-1][3]
        room = [(LEG_SHARE if self.radius[e].all() else LONG_SHARE) * self.tables[e][1][-1]
                for e in outline.edges[[c, before]].tolist()]  # fmt: skip
        most = min(WALL_SHARE * shortest, *room)
        leg, gap = start, self._opening(outline, c, before, start)
        for step, longest in ((STEP, LONGEST_LEG * size), (LONG_STEP, np.inf)):
            while step * most_gaps * gap < leg and 1.05 * leg <= min(most, longest):
                wider = self._opening(outline, c, before, 1.05 * leg)
                if wider < 1.06 * gap:
                    break
                leg, gap = 1.05 * leg, wider
        return leg if LARGEST_STEP * FLATTEST * gap >= leg else start

    def _opening(self, outline: Outline, c: int, before: int, leg: float) -> float:
        """Distance between the ends of two legs of this length."""
        p, q = (self._leg_end(outline, j, side, leg) for j, side in leg_tracks(outline, c, before))
        return math.dist(p, q)

    def steps(self, radius: Float) -> Float:
        """Lengths (e, 2) of the segments beside the legs that a wall sees too; 0 where sizes alone decide.

        They are stretched, as far as valid triangles across the gap go, to be no less than the leg over ``STEP``, or
        than what triangles beside that of the other corner need (``least_steps``). Where two walls would need more than
        ``LONG_STEP``, one of the two legs gets its ``tilt``.
        """
        steps = np.zeros((len(self.ends), 2))
        self.tilt[:], self.hopeless[:] = radius * (self.factor - 1.0), False
        for outline, c, before, most_gaps, walls in self._walled:
            sides = corner_sides(outline, c, before)
            leg = float(radius[sides[0]] * self.factor[sides[0]])
            gap = self._opening(outline, c, before, leg)
            needs = {side: self._needs(side) for side in walls}
            wanted = min(leg * max(enough for _, enough, _ in needs.values()) / gap, FLATTEST)
            if wanted > most_gaps:
                if len(walls) == 2:
                    self.tilt[sides[0]] += TILT * gap * (wanted - most_gaps) / (FLATTEST - most_gaps)
                most_gaps = wanted
            for side in walls:
                self.hopeless[side] |= leg * needs[side][2] * (leg - MOST_FLAT * gap) > MOST_FLAT * gap * leg
                self._stretch(side, leg, gap, needs[side], most_gaps, steps)
        for side, other, least in self._tight:
            start = min(least * radius[side] * self.factor[side], LEG_SHARE * self.tables[other[0]][1][-1])
            if self._size_beside(other, 0.5 * start) < start:
                steps[other] = max(steps[other], start)
        for angle, sides in self._skewed:
            for side in sides:
                if self._widest[side] == self.narrowest[side] == angle:
                    leg = float(radius[side] * self.factor[side])
                    self._stretch(side, leg, math.inf, self._needs(side), math.inf, steps)
        return steps

    def _needs(self, side: tuple[int, int]) -> tuple[float, float, float]:
        """``least_steps`` of the widest corner beside a leg."""
        return least_steps(float(self._widest[side]), float(self.factor[self._across[side]] / self.factor[side]))

    def _stretch(
        self, side: tuple[int, int], leg: float, gap: float, needs: tuple[float, ...], most: float, steps: Float
    ) -> None:
        """Stretch the segment beside a leg to what is needed, ``most`` gaps at most, where sizes make it shorter."""
        flat, wanted = self._widest[side] >= SHARP, leg * needs[0]
        if not flat:
            wanted = max(min(wanted, GOOD_GAPS * gap), leg * needs[1])
        if (flat and wanted <= self.options.gap * gap) or (not flat and self._size_beside(side, leg) >= wanted):
            return
        step = min(wanted, most * gap)
        if flat:
            step = min(max(self.options.size, leg / LARGEST_STEP), step)
        self._start_beside(int(self.ends[side]), leg, steps)
        steps[side] = min(steps[side], step) if steps[side] > 0.0 else step

    def _size_beside(self, side: tuple[int, int], leg: float) -> float:
        """Size that the table of an edge has where its leg ends."""
        _, s, h = self.tables[side[0]]
        return float(np.interp(leg if side[1] == 0 else s[-1] - leg, s, h))

    def _start_beside(self, vertex: int, leg: float, steps: Float) -> None:
        """Let edges without a leg at the vertex of one start with a segment that the triangles at the leg can stand."""
        if leg <= BESIDE_LEG * self.options.size:
            return
        for side in np.argwhere((self.ends == vertex) & (self.radius == 0.0)).tolist():
            steps[side[0], side[1]] = min(leg / BESIDE_LEG, LEG_SHARE * self.tables[side[0]][1][-1])

    def _leg_of_true_angle(self, outline: Outline, c: int, before: int, leg: float) -> float:
        """Shorten the leg until the chords open about as wide as the tangents do, as long as that helps."""
        last, least = 0.0, OPENING[int(outline.angles[c] < NARROW)]
        for _ in range(12):
            p = [self._leg_end(outline, j, side, leg) for j, side in leg_tracks(outline, c, before)]
            corner = evaluate(outline.tracks, c, 0.0 if outline.forward[c] else 1.0)[0]
            u, v = p[0] - corner, p[1] - corner
            opening = np.degrees(np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v))
            if opening > least * outline.angles[c] and opening > 1e-3:
                break
            if 0.0 < opening < 1.01 * last:  # in a cusp the chords open in proportion to the leg
                return leg / 0.6
            last, leg = opening, 0.6 * leg
        return leg

    def _leg_end(self, outline: Outline, j: int, side: int, leg: float) -> Float:
        """Point as far as ``leg`` from the given end of curve j."""
        t, s, _ = self.tables[outline.edges[j]]
        at = float(np.interp(leg if side == 0 else s[-1] - leg, s, t))
        if outline.tracks.kinds[j] != LINE and leg > 0.0:
            at = chord_parameter(*outline.tracks, j, side, leg, at)
        return evaluate(outline.tracks, j, at)[0]

    def shorten(self, outline: Outline, boundary: Boundary, want: Float, feet: tuple[Float, Float]) -> set[int]:
        """The triangle of a sharp corner must not be larger than the gap beside it, nor reach what lies between legs.

        ``want`` (n,) holds sizes at the nodes; ``feet`` shares (k,) of the segments and sizes (k,) there. Where a leg
        bounds a narrower corner, too, the gap there shrinks with the leg: it is no reason to shorten it.
        """
        changed: set[int] = set()
        ends, first = boundary.segments, np.where(outline.forward, 0.0, 1.0)[boundary.track]
        arriving = {int(boundary.track[k]): k for k in np.flatnonzero(boundary.t[:, 1] == 1.0 - first).tolist()}
        sharp = outline.angles[boundary.track] < SHARP
        for leave in np.flatnonzero(sharp & (boundary.t[:, 0] == first)).tolist():
            reach = arriving[int(outline.before[boundary.track[leave]])]
            p, q = ends[leave, 1], ends[reach, 0]
            base = self._share(outline, boundary, leave) * self._base(outline, boundary, leave, p, q)
            ratio = min(want[p], want[q]) / base if base > 0.0 else 1.0
            for k, share in ((leave, feet[0][leave]), (reach, 1.0 - feet[0][reach])):
                ratio = min(ratio, self._clear_of(share, feet[1][k], math.dist(*boundary.points[ends[k]]), base))
            if ratio >= 0.85:
                continue
            for k, at_start in ((leave, True), (reach, False)):
                j = int(boundary.track[k])
                e = int(outline.edges[j])
                i = 0 if at_start == bool(outline.forward[j]) else 1
                self.radius[e, i] *= max(0.4, ratio)
                changed.add(e)
        return changed

    def _clear_of(self, share: float, size: float, leg: float, base: float) -> float:
        """How much shorter a leg has to be for the size wanted at a place on it, as a share of it.

        From that place, this share of the leg away from the corner, sizes grow back to the end of the shorter leg; they
        must reach the base of its triangle there.
        """
        growth = self.options.gradient * leg
        return (size + share * growth) / (base + growth)

    def make_room(self, outline: Outline, boundary: Boundary, across: Float) -> set[int]:
        """Shorten legs that belong to corners of other faces and are longer than the gap ``across`` (k,) them in this.

        Those that were lengthened stay: shorter ones leave more flaws. Returns the edges.
        """
        changed: set[int] = set()
        ends = boundary.points[boundary.segments]
        ratio = across / np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        for k in np.flatnonzero(ratio < ROOM).tolist():
            e = int(outline.edges[boundary.track[k]])
            for side, i in itertools.product((0, 1), (0, 1)):
                at_end = boundary.t[k, side] == i and boundary.angle[boundary.segments[k, side]] >= SHARP
                if at_end and self.radius[e, i] > 0.0 and not self.lengthened[e, i]:
                    self.radius[e, i] *= max(0.4, ratio[k])
                    changed.add(e)
        return changed

    def _share(self, outline: Outline, boundary: Boundary, leave: int) -> float:
        """Base of the narrowest corner that shares a leg with the one where segment ``leave`` starts, over its base."""
        c = int(boundary.track[leave])
        narrowest = min(float(self.narrowest[side]) for side in corner_sides(outline, c, int(outline.before[c])))
        half, own = (math.radians(0.5 * angle) for angle in (narrowest, float(outline.angles[c])))
        return math.sin(half) / math.sin(own) if half < own else 1.0

    def _base(self, outline: Outline, boundary: Boundary, leave: int, p: int, q: int) -> float:
        """Base from node p to q of the triangle at the start of segment ``leave``, as it is without tilt."""
        base, c = math.dist(boundary.points[p], boundary.points[q]), int(boundary.track[leave])
        first, second = corner_sides(outline, c, int(outline.before[c]))
        longer = self.tilt[first] - self.tilt[second]
        return math.sqrt(max(0.0, base * base - longer * longer)) if longer else base

    def shrink(self, outline: Outline, boundary: Boundary, k: int) -> set[int]:
        """Shorten the protected legs that segment k is; the edge when there is one."""
        e = int(outline.edges[boundary.track[k]])
        legs = [i for i, t in enumerate((0.0, 1.0)) if t in boundary.t[k] and self.radius[e, i] > 0.0]
        self.radius[e, legs] *= 0.6
        return {e} if legs else set()

    def hold(self, outline: Outline, boundary: Boundary) -> None:
        """Lock segments that are legs of a sharp corner of another face: split here, they would be split there too."""
        e = outline.edges[boundary.track]
        for side in (0, 1):
            for i, t in enumerate((0.0, 1.0)):
                others = self.shared[e] | (boundary.angle[boundary.segments[:, side]] >= SHARP)
                boundary.mode[(boundary.t[:, side] == t) & self.held[e, i] & others] = LOCKED


def is_wall(widest: Float, angle: Float) -> NDArray[np.bool_]:
    """Whether an edge at whose end the widest corner has this angle is beside a wall, for a corner of ``angle``."""
    return (widest > angle) & (widest >= np.minimum(SHARP, WIDER * angle))


def corner_sides(outline: Outline, c: int, before: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Edge and end (0 or 1) of the curves that leave and reach the start of curve c."""
    leaving = (int(outline.edges[c]), 0 if outline.forward[c] else 1)
    arriving = (int(outline.edges[before]), 1 if outline.forward[before] else 0)
    return leaving, arriving


def leg_tracks(outline: Outline, c: int, before: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Curve and end (0 or 1) of the two legs at the start of curve c."""
    return (c, 0 if outline.forward[c] else 1), (before, 1 if outline.forward[before] else 0)
