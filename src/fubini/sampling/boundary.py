"""Boundary nodes of all faces at once: every edge is discretised one time, for all faces that share it.

The size along an edge follows the asked size, the turning of the curve, the length of short edges,
the gaps that a triangulation of the boundary alone sees across thin parts, and a growth limit that
also acts through shared vertices. At corners too sharp for two triangles both edges start with a
segment of the same length, so that the one triangle there is isosceles.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves import Curve, track
from fubini.errors import GeometryError
from fubini.region import Region
from fubini.sampling import _kernels_boundary as kernels
from fubini.tracks import TrackBuilder, Tracks, evaluate, rounded
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.value import CORNER, FROZEN, LOCKED, Boundary, Triangulation

Float = NDArray[np.float64]
Int = NDArray[np.int32]

#: Corners below this (degrees) are covered by one triangle: two halves would be too sharp.
SHARP = 50.0
#: Corners below this (degrees) have one triangle alone that will do, or none: its legs are held in all faces.
NARROW = 27.0
#: Share of the shorter edge that the triangle of a sharp corner may take.
LEG_SHARE = 0.34
#: Where a leg borders another face too, the next segment there must not be shorter by more than this: five valid
#: triangles about a node on a straight edge span at most a ratio of 16.4.
STEP = 8.0
#: Where that cannot be had, a ratio up to this is tried.
LARGEST_STEP = 13.0
#: Gaps that the next segment may be long where one side of the corner is beside a wall, and where both are.
MOST_GAPS = (2.6, 1.8)
#: For the sake of ``STEP`` a leg may be this many times as long as asked.
LONGEST_LEG = 1.7
#: Decisions are taken on coordinates rounded to the diagonal over two to this.
GRID_BITS = 32
#: A gap is resolved when the nodes beside it are no further apart than the wanted size over this.
RESOLVED = 0.85
#: Curves are sampled more densely where segments are to turn by less than this (radians), up to so many samples.
FINE_TURN, MOST_SAMPLES = 0.75, 16385
#: Crossing chords looked at in one round.
MOST_CROSSINGS = 200


@dataclass(frozen=True)
class SizeOptions:
    """How large boundary segments may be.

    Attributes
    ----------
    size : asked edge length, model units.
    gradient : growth of the size with distance; 0.35 keeps neighbours within a factor of about 1.5.
    turn : largest turning of the tangent along one segment, radians.
    gap : size over the width of a gap; 2 / sqrt(3) makes one row of equilateral triangles.
    edge_size : asked size on single edges, by edge number.
    edge_segments : least number of segments on single edges, by edge number.
    vertex_size : asked size at single vertices, by vertex number.
    chord_tolerance : largest distance of a segment from its curve; None for no limit.
    keep_turn : never let rounding to whole segments exceed ``turn``.
    fields : for each face the size at plane coordinates (n, 2), or None.
    rounds : budget of gap detections.
    smallest : sizes below this (times the asked size) are not followed any further.
    most : budget of boundary nodes of the whole model.
    """

    size: float
    gradient: float = 0.35
    turn: float = 0.75
    gap: float = 1.15
    edge_size: Mapping[int, float] = field(default_factory=dict)
    edge_segments: Mapping[int, int] = field(default_factory=dict)
    vertex_size: Mapping[int, float] = field(default_factory=dict)
    chord_tolerance: float | None = None
    keep_turn: bool = False
    fields: list[Callable[[Float], Float]] | None = None
    rounds: int = 24
    smallest: float = 1e-7
    most: int = 4_000_000


@dataclass(frozen=True)
class Outline:
    """One face as the boundary discretisation sees it: its curves as tracks, in loop order.

    ``exact`` holds the curves as they are, ``tracks`` the same rounded to ``GRID_BITS``: decisions are
    taken on rounded curves, so that models that differ by rounding alone (a live object and its STEP
    file) get the same mesh; positions come from the exact ones. Track j is curve j in the direction
    of its edge. ``edges`` (c,) numbers the model's edges, ``forward`` (c,) tells whether the loop runs
    along the edge, ``angles`` (c,) holds the interior angle in degrees at the start of curve j, and
    ``loop_first`` (l + 1,) delimits the loops. Edges inside the face follow the outline: each is a loop of
    two curves, there and back, from curve ``inner`` on.
    """

    tracks: Tracks
    exact: Tracks
    loop_first: NDArray[np.int64]
    edges: NDArray[np.int64]
    forward: NDArray[np.bool_]
    angles: Float
    inner: int

    @classmethod
    def of(
        cls, region: Region, edge_number: Callable[[int], int], inner: Iterable[tuple[Curve, int]] = ()
    ) -> Outline:
        """Outline of a region; ``edge_number`` turns its edge ids, and those of ``inner`` edges, into numbers."""
        builder = TrackBuilder()
        edges, forward, first = [], [], [0]
        for loop in region.loops:
            for curve, edge, along in zip(loop.curves, loop.edges, loop.forward, strict=True):
                track(builder, curve if along else curve.reverse())
                edges.append(edge_number(edge))
                forward.append(along)
            first.append(len(edges))
        bounding = len(edges)
        for curve, edge in inner:
            for along in (True, False):
                track(builder, curve)
                edges.append(edge_number(edge))
                forward.append(along)
            first.append(len(edges))
        angles = np.full(len(edges), 180.0)
        for corner in region.corners():
            angles[first[corner.loop] + corner.index] = corner.angle
        exact = builder.build()
        coarse = rounded(exact, region.diagonal, GRID_BITS)
        return cls(
            coarse, exact, np.array(first), np.array(edges, np.int64), np.array(forward), np.round(angles, 6), bounding
        )


class BoundarySizing:
    """Sizes along all edges of a model, lowered until every gap is resolved; then the nodes.

    Parameters
    ----------
    outlines : the faces.
    ends : (e, 2) vertex numbers of the edges.
    options : sizes and limits.
    """

    def __init__(self, outlines: list[Outline], ends: NDArray[np.int64], options: SizeOptions) -> None:
        self.outlines = outlines
        self.ends = np.ascontiguousarray(ends, np.int64)
        self.options = options
        self.uses = np.zeros(len(ends), np.int64)
        self._samples: list[tuple[Float, Float, Float]] = [None] * len(ends)  # type: ignore[list-item]
        self._at_least = np.ones(len(ends), np.int64)
        self._radius = np.zeros((len(ends), 2))
        self._walled: list[tuple[Outline, int, int, float]] = []
        self.held = np.zeros((len(ends), 2), bool)
        for f, outline in enumerate(outlines):
            np.add.at(self.uses, outline.edges, 1)
            self._sample_edges(outline)
            if options.fields is not None:
                self._sample_field(outline, options.fields[f])
        for outline in outlines:
            self._protect_corners(outline)
            self._count_closed_loops(outline)
        self._longest = np.ones(int(self.ends.max(initial=-1)) + 1)
        self._grade(self._radius)
        self._longest[:] = 1.0 / options.gradient
        self._lengthen_legs()

    # ---- set-up --------------------------------------------------------------------------------

    def _sample_edges(self, outline: Outline) -> None:
        """Tables of parameter, arc length and size of every edge not seen before."""
        size = self.options.size
        for j, e in enumerate(outline.edges):
            if self._samples[e] is not None:
                continue
            t, s, h = sample_track(outline.tracks, j, self.options.turn)
            asked = self.options.edge_segments.get(int(e), 1)
            curved = self.options.keep_turn or self.options.chord_tolerance is not None
            bend = bending(outline.tracks, j, t, s) if curved else np.zeros(len(t))
            if self.options.keep_turn:
                asked = max(asked, math.ceil(np.trapezoid(bend, s) / self.options.turn - 1e-3))
            if self.options.chord_tolerance is not None and bend.any():
                h = np.minimum(h, np.sqrt(8.0 * self.options.chord_tolerance / np.maximum(bend, 1e-300)))
                asked = max(asked, math.ceil(np.trapezoid(1.0 / h, s) - 1e-6))
            h = np.minimum(h, min(size, self.options.edge_size.get(int(e), size), s[-1] / asked))
            self._samples[e] = (t, s, h)
            self._at_least[e] = max(self._at_least[e], asked)

    def _sample_field(self, outline: Outline, sizes: Callable[[Float], Float]) -> None:
        """Lower the tables of all edges of a face to its size field, at no less than 129 places of each."""
        for j, e in enumerate(outline.edges):
            t, s, h = self._samples[e]
            places = np.union1d(t, np.linspace(0.0, 1.0, 129))
            along = np.interp(places, t, s)
            asked = sizes(np.ascontiguousarray(evaluate(outline.tracks, j, places)))
            least = self.options.smallest * self.options.size
            self._samples[e] = (places, along, np.minimum(np.interp(along, s, h), np.maximum(asked, least)))

    def _protect_corners(self, outline: Outline) -> None:
        """Give both edges of every sharp corner a first segment of one length."""
        for c, before in loop_pairs(outline.loop_first):
            if outline.angles[c] >= SHARP or (c == before and outline.angles[c] >= 180.0):
                continue
            sides = self._corner_sides(outline, c, before)
            most = LEG_SHARE * min(self._samples[e][1][-1] for e, _ in sides)
            leg = self._leg_of_true_angle(outline, c, before, min(self.options.size, most))
            for e, i in sides:
                old = self._radius[e, i]
                self._radius[e, i] = min(old, leg) if old > 0.0 else leg
                self.held[e, i] |= outline.angles[c] < NARROW

    def _corner_sides(self, outline: Outline, c: int, before: int) -> tuple[tuple[int, int], tuple[int, int]]:
        """Edge and end (0 or 1) of the curves that leave and reach the start of curve c."""
        leaving = (int(outline.edges[c]), 0 if outline.forward[c] else 1)
        arriving = (int(outline.edges[before]), 1 if outline.forward[before] else 0)
        return leaving, arriving

    def _lengthen_legs(self) -> None:
        """Lengthen legs that lie beside another face too, where the next segment would be too short for that face."""
        flat = self._wall_ends = self._flat_ends()
        if not (flat & (self._radius > 0.0)).any():
            return
        shortest = np.full(len(self._longest), np.inf)
        for (_t, s, _h), ends in zip(self._samples, self.ends, strict=True):
            shortest[ends] = np.minimum(shortest[ends], s[-1])
        for outline in self.outlines:
            for c, before in loop_pairs(outline.loop_first):
                sides = self._corner_sides(outline, c, before)
                walls = sum(bool(flat[side]) for side in sides)
                if outline.angles[c] >= SHARP or not walls or self._radius[sides[0]] == 0.0:
                    continue
                self._walled.append((outline, c, before, MOST_GAPS[walls - 1]))
                v = int(self.ends[sides[0]])
                leg = float(self._radius[sides[0]])
                longer = self._leg_beside_wall(outline, c, before, leg, float(shortest[v]))
                if longer > leg:
                    self._longest[v] *= longer / leg
                    for side in sides:
                        self._radius[side] = longer

    def _flat_ends(self) -> NDArray[np.bool_]:
        """Which edge ends (e, 2) lie at a corner of some face that is not sharp."""
        flat = np.zeros((len(self.ends), 2), bool)
        for outline in self.outlines:
            for c, before in loop_pairs(outline.loop_first):
                if outline.angles[c] >= SHARP:
                    for side in self._corner_sides(outline, c, before):
                        flat[side] = True
        return flat

    def _leg_beside_wall(self, outline: Outline, c: int, before: int, leg: float, shortest: float) -> float:
        """Lengthen the leg until the gap at its end allows a next segment of no less than the leg over ``STEP``.

        In a cusp the gap grows with the square of the distance; unchanged where no length will do.
        """
        size = self.options.size
        most_gaps = self._walled[-1][3]
        edges = (int(outline.edges[j]) for j in (c, before))
        most = min(LONGEST_LEG * size, LONGEST_LEG * shortest, LEG_SHARE * min(self._samples[e][1][-1] for e in edges))
        for ratio in (STEP, LARGEST_STEP):
            longer = leg
            while longer <= most:
                gap = self._opening(outline, c, before, longer)
                if ratio * min(size, most_gaps * gap) >= longer:
                    return longer
                longer *= 1.05
        return leg

    def _opening(self, outline: Outline, c: int, before: int, leg: float) -> float:
        """Distance between the ends of two legs of this length."""
        p, q = (self._leg_end(outline, j, side, leg) for j, side in self._leg_tracks(outline, c, before))
        return math.dist(p, q)

    def _steps(self, radius: Float) -> Float:
        """Lengths (e, 2) of the segments beside the legs that a flat wall sees too; 0 where sizes alone decide.

        They are stretched, as far as valid triangles across the gap go, to be no less than the leg over ``STEP``.
        """
        steps = np.zeros((len(self.ends), 2))
        for outline, c, before, most_gaps in self._walled:
            sides = self._corner_sides(outline, c, before)
            leg = float(radius[sides[0]])
            gap = self._opening(outline, c, before, leg)
            gaps = leg / (STEP * gap)
            if gaps <= self.options.gap or LARGEST_STEP * most_gaps * gap < leg:
                continue
            for side in sides:
                if self._wall_ends[side]:
                    step = min(self.options.size, min(gaps, most_gaps) * gap)
                    steps[side] = min(steps[side], step) if steps[side] > 0.0 else step
        return steps

    def _leg_of_true_angle(self, outline: Outline, c: int, before: int, leg: float) -> float:
        """Shorten the leg until the chords open about as wide as the tangents do."""
        for _ in range(12):
            p = [self._leg_end(outline, j, side, leg) for j, side in self._leg_tracks(outline, c, before)]
            corner = evaluate(outline.tracks, c, 0.0 if outline.forward[c] else 1.0)[0]
            u, v = p[0] - corner, p[1] - corner
            opening = np.degrees(np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v))
            if opening > 0.93 * outline.angles[c] and opening > 1e-3:
                break
            leg *= 0.6
        return leg

    def _leg_tracks(self, outline: Outline, c: int, before: int) -> tuple[tuple[int, int], tuple[int, int]]:
        return (c, 0 if outline.forward[c] else 1), (before, 1 if outline.forward[before] else 0)

    def _leg_end(self, outline: Outline, j: int, side: int, leg: float) -> Float:
        """Point at arc length ``leg`` from the given end of curve j."""
        t, s, _ = self._samples[outline.edges[j]]
        at = leg if side == 0 else s[-1] - leg
        return evaluate(outline.tracks, j, np.interp(at, s, t))[0]

    def _count_closed_loops(self, outline: Outline) -> None:
        """A loop of one curve needs three segments, one of two curves two on a curved one."""
        for a, b in zip(outline.loop_first[:-1], outline.loop_first[1:], strict=True):
            if b - a == 1:
                e = outline.edges[a]
                self._at_least[e] = max(self._at_least[e], 3)
            elif b - a == 2:
                for j in (a, a + 1):
                    if outline.tracks.kinds[j] != 0:
                        e = outline.edges[j]
                        self._at_least[e] = max(self._at_least[e], 2)

    # ---- the loop ------------------------------------------------------------------------------

    def resolve(self) -> EdgeNodes:
        """Lower the sizes until no face sees a gap narrower than its nodes allow; then place the nodes.

        Raises GeometryError when the boundary of a face cannot be triangulated at any size, or not
        within the budget of nodes; its ``face`` and ``edge`` are running numbers, ``at`` plane coordinates.
        """
        dirty = set(range(len(self.outlines)))
        for round_ in range(self.options.rounds):
            nodes = self._place()
            changed: set[int] = set()
            for f in sorted(dirty):
                changed |= self._look_across(f, nodes, last=round_ == self.options.rounds - 1)
            if not changed:
                return nodes
            dirty = self._faces_of(changed)
        return self._place()

    def lower_near(self, face: int, places: ArrayLike, nodes: EdgeNodes, factor: float) -> bool:
        """Ask for smaller segments of one face near ``places`` (k, 2); False when nothing changed."""
        boundary = self.boundary(face, nodes)
        mid = boundary.points
        distance = np.min(np.linalg.norm(mid[:, None] - np.atleast_2d(places)[None], axis=2), axis=1)
        near = distance <= 2.5 * boundary.size
        if not near.any():
            near[np.argmin(distance)] = True
        want = np.where(near, factor * boundary.size, boundary.size)
        return bool(self._lower(face, boundary, want, None, 0.97))

    def _place(self) -> EdgeNodes:
        """Nodes of all edges from the present sizes."""
        radius = self._radius.copy()
        first, t, s, cap, h = self._grade(radius)
        first, t, s, h = kernels.envelope(first, t, s, cap, h, self.options.gradient)
        counts = np.empty(len(self.ends), np.int64)
        step = self._steps(radius)
        kernels.count_nodes(first, s, h, radius, step, self._at_least, counts)
        if counts.sum() > self.options.most or counts.min(initial=1) < 1:
            self._refuse(counts)
        node_first = np.zeros(len(counts) + 1, np.int64)
        np.cumsum(counts + 1, out=node_first[1:])
        node_t = np.empty(node_first[-1])
        kernels.place_nodes(first, s, t, h, radius, step, counts, node_first, node_t)
        return EdgeNodes(node_first, node_t)

    def _grade(self, radius: Float) -> tuple[NDArray[np.int64], Float, Float, Float, Float]:
        """Flat tables of the edges, sizes ungraded and graded; ``radius`` is shortened to fit the vertices."""
        first, t, s, cap = self._flat()
        sizes, legs = np.full((2, int(self.ends.max(initial=-1)) + 1), np.inf)
        for v, asked in self.options.vertex_size.items():
            sizes[v] = asked
        h = cap.copy()
        kernels.grade(first, s, h, self.ends, radius, sizes, legs, self.options.gradient, self._longest)
        return first, t, s, cap, h

    def _refuse(self, counts: NDArray[np.int64]) -> None:
        """Raise for the edge that would need most nodes."""
        e = int(np.argmax(np.where(counts < 1, np.iinfo(np.int64).max, counts)))
        face = next(f for f, outline in enumerate(self.outlines) if e in outline.edges)
        outline = self.outlines[face]
        j = int(np.flatnonzero(outline.edges == e)[0])
        _, s, h = self._samples[e]
        at = evaluate(outline.tracks, j, np.interp(s[np.argmin(h)] / s[-1], [0, 1], [0, 1]))[0]
        raise GeometryError(
            f"the boundary would need more than {self.options.most:,} nodes",
            face=face, edge=e, at=at, fix="look for parts that all but touch here, or ask for a larger size",
        )  # fmt: skip

    def _flat(self) -> tuple[NDArray[np.int64], Float, Float, Float]:
        lengths = [len(x[0]) for x in self._samples]
        first = np.zeros(len(lengths) + 1, np.int64)
        np.cumsum(lengths, out=first[1:])
        t, s, h = (np.concatenate([x[i] for x in self._samples]) for i in range(3))
        return first, t, s, h

    def boundary(self, face: int, nodes: EdgeNodes) -> Boundary:
        """The boundary of one face, built from the nodes of its edges."""
        outline = self.outlines[face]
        shared = self.uses[outline.edges] > 1
        n = int((nodes.first[outline.edges + 1] - nodes.first[outline.edges] - 1).sum())
        points, params = np.empty((n, 2)), np.empty((n, 2))
        kind, mode = np.empty(n, np.uint8), np.empty(n, np.uint8)
        angle, size = np.empty(n), np.empty(n)
        segments, tracks = np.empty((n, 2), np.int32), np.empty(n, np.int32)
        kernels.gather_face(
            *outline.tracks, outline.loop_first, outline.edges, outline.forward, outline.angles, shared,
            nodes.first, nodes.t, points, kind, angle, segments, tracks, params, mode,
        )  # fmt: skip
        kernels.node_sizes(points, segments, angle, SHARP, self.options.size, size)
        if self.held.any():
            self._hold_legs(outline, segments, tracks, params, angle, mode)
        whole = Boundary(points, kind, size, angle, segments, tracks, params, mode)
        return whole if outline.inner == len(outline.edges) else welded(whole, outline.inner)

    def _hold_legs(
        self, outline: Outline, segments: Int, tracks: Int, params: Float, angle: Float, mode: NDArray[np.uint8]
    ) -> None:
        """Lock segments that are legs of a sharp corner of another face: split here, they would be split there too."""
        e = outline.edges[tracks]
        for side in (0, 1):
            for i, t in enumerate((0.0, 1.0)):
                leg = (params[:, side] == t) & self.held[e, i] & (angle[segments[:, side]] >= SHARP)
                mode[leg] = LOCKED

    def _look_across(self, face: int, nodes: EdgeNodes, last: bool) -> set[int]:
        """Triangulate the boundary of one face alone and lower sizes where it sees gaps."""
        boundary = self.boundary(face, nodes)
        seen = constrained_delaunay(boundary.points, boundary)
        if len(seen.unrecovered) or len(seen.triangles) == 0:
            if last:
                k = int(seen.unrecovered[0]) if len(seen.unrecovered) else 0
                at = boundary.points[boundary.segments[k, 0]]
                edge = int(self.outlines[face].edges[boundary.track[k]])
                raise GeometryError("the boundary crosses or touches itself", face=face, edge=edge, at=at)
            return self._untangle(face, boundary, seen)
        want, foot, foot_want = (np.empty(len(x)) for x in (boundary.points, boundary.track, boundary.track))
        kernels.gap_sizes(
            boundary.points, np.array(seen.triangles), np.array(seen.neighbours), boundary.size,
            boundary.angle < SHARP, self.options.gradient, self.options.gap, want, foot, foot_want,
        )  # fmt: skip
        least = self.options.smallest * self.options.size
        return self._lower(
            face, boundary, np.maximum(want, least), (foot, np.maximum(foot_want, least)), RESOLVED
        )

    def _untangle(self, face: int, boundary: Boundary, seen: Triangulation) -> set[int]:
        """Chords cross where the curves do not: halve those that leave their curves most, on both sides."""
        outline = self.outlines[face]
        ends = boundary.points[boundary.segments]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        sag = chord_sags(outline.tracks, boundary)
        halve = np.zeros(len(length), bool)
        for k in seen.unrecovered[:MOST_CROSSINGS] if len(seen.unrecovered) else range(len(length)):
            pair = np.append(np.flatnonzero(crossed(ends, int(k))), k)
            halve[pair] |= sag[pair] >= 0.25 * sag[pair].max()
        want, foot_want = boundary.size.copy(), np.where(halve, 0.5 * length, np.inf)
        for side in (0, 1):
            np.minimum.at(want, boundary.segments[halve, side], 0.5 * length[halve])
        feet = (np.full(len(length), 0.5), foot_want)
        changed = self._lower(face, boundary, want, feet, RESOLVED)
        for k in np.flatnonzero(halve):
            changed |= self._shrink_ends(outline, boundary, int(k))
        return changed

    def _shrink_ends(self, outline: Outline, boundary: Boundary, k: int) -> set[int]:
        """Shorten the protected legs that segment k is; the edge when there is one."""
        e = int(outline.edges[boundary.track[k]])
        legs = [i for i, t in enumerate((0.0, 1.0)) if t in boundary.t[k] and self._radius[e, i] > 0.0]
        self._radius[e, legs] *= 0.6
        return {e} if legs else set()

    def _lower(
        self,
        face: int,
        boundary: Boundary,
        want: Float,
        feet: tuple[Float, Float] | None,
        threshold: float,
    ) -> set[int]:
        """Write wanted sizes into the tables of the edges where they fall below ``threshold`` times the present.

        ``want`` (n,) holds sizes at the nodes; ``feet`` shares (k,) of the segments and sizes (k,) there.
        Returns the edges whose tables changed.
        """
        outline = self.outlines[face]
        a, b = boundary.segments.T
        low = (want < threshold * boundary.size)[boundary.segments].any(axis=1)
        foot, foot_want = feet if feet is not None else (np.zeros(len(a)), np.full(len(a), np.inf))
        share = foot * boundary.size[b] + (1.0 - foot) * boundary.size[a]
        low |= foot_want < threshold * share
        changed = self._shorten_legs(outline, boundary, want)
        want = np.where(want < 0.999 * boundary.size, want, np.inf)
        foot_want = np.where(foot_want < 0.999 * share, foot_want, np.inf)
        t0, t1 = boundary.t.T
        for j in np.unique(boundary.track[low]):
            of = boundary.track == j
            at = np.concatenate([t0[of], t1[of], t0[of] + foot[of] * (t1[of] - t0[of])])
            asked = np.concatenate([want[a[of]], want[b[of]], foot_want[of]])
            if self._lower_edge(int(outline.edges[j]), at, asked):
                changed.add(int(outline.edges[j]))
        return changed

    def _lower_edge(self, e: int, at: Float, asked: Float) -> bool:
        """Lower the table of one edge to sizes ``asked`` at parameters ``at``; whether it changed.

        Infinite sizes ask for nothing: they keep what is asked elsewhere from spreading.
        """
        t, s, h = self._samples[e]
        node, where = np.unique(at, return_inverse=True)
        value = np.full(len(node), np.inf)
        np.minimum.at(value, where, asked)
        free = np.isinf(value)
        value[free] = np.interp(np.interp(node[free], t, s), s, h)
        t_new = np.union1d(t, node)
        s_new = np.interp(t_new, t, s)
        keep = np.concatenate([[True], np.diff(s_new) > 1e-14 * s[-1]])
        t_new, s_new = t_new[keep], s_new[keep]
        h_old = np.interp(s_new, s, h)
        h_new = np.minimum(h_old, np.interp(t_new, node, value))
        if not (h_new < 0.999 * h_old).any():
            return False
        self._samples[e] = (t_new, s_new, h_new)
        return True

    def _shorten_legs(self, outline: Outline, boundary: Boundary, want: Float) -> set[int]:
        """The triangle of a sharp corner must not be larger than the gap beside it."""
        changed: set[int] = set()
        ends = boundary.segments
        for v in np.flatnonzero(boundary.angle < SHARP):
            leave = int(np.flatnonzero(ends[:, 0] == v)[0])
            reach = int(np.flatnonzero(ends[:, 1] == v)[0])
            p, q = ends[leave, 1], ends[reach, 0]
            base = float(np.linalg.norm(boundary.points[p] - boundary.points[q]))
            ratio = min(want[p], want[q]) / base if base > 0.0 else 1.0
            if ratio >= 0.85:
                continue
            for k, at_start in ((leave, True), (reach, False)):
                j = int(boundary.track[k])
                e = int(outline.edges[j])
                i = 0 if at_start == bool(outline.forward[j]) else 1
                self._radius[e, i] *= max(0.4, ratio)
                changed.add(e)
        return changed

    def _faces_of(self, edges: set[int]) -> set[int]:
        """Faces whose discretisation may have changed with these edges (their vertices' edges too)."""
        vertices = set(self.ends[sorted(edges)].ravel().tolist())
        out = set()
        for f, outline in enumerate(self.outlines):
            if not vertices.isdisjoint(self.ends[outline.edges].ravel().tolist()):
                out.add(f)
        return out


@dataclass(frozen=True)
class EdgeNodes:
    """Parameters of the nodes on every edge, ends included: ``t[first[e] : first[e + 1]]``."""

    first: NDArray[np.int64]
    t: Float

    def of(self, edge: int) -> Float:
        """Parameters on one edge, ascending from 0 to 1."""
        return self.t[self.first[edge] : self.first[edge + 1]]

    def differs(self, other: EdgeNodes) -> NDArray[np.bool_]:
        """Edges (e,) whose nodes are not those of ``other``."""
        lengths, others = np.diff(self.first), np.diff(other.first)
        out = lengths != others
        edge = np.repeat(np.arange(len(out)), lengths)
        out[edge[~out[edge]][self.t[~out[edge]] != other.t[np.repeat(~out, others)]]] = True
        return out

    def with_nodes(self, extra: Mapping[int, list[float]]) -> EdgeNodes:
        """The same with more nodes on some edges."""
        parts = [self.of(e) for e in range(len(self.first) - 1)]
        for e, t in extra.items():
            parts[e] = np.union1d(parts[e], t)
        first = np.zeros(len(parts) + 1, np.int64)
        np.cumsum([len(p) for p in parts], out=first[1:])
        return EdgeNodes(first, np.concatenate(parts))


def loop_pairs(loop_first: NDArray[np.int64]) -> list[tuple[int, int]]:
    """For every curve its number and that of the curve before it in its loop."""
    pairs = []
    for a, b in itertools.pairwise(loop_first):
        pairs += [(c, c - 1 if c > a else int(b) - 1) for c in range(int(a), int(b))]
    return pairs


def welded(boundary: Boundary, inner: int) -> Boundary:
    """One node for all that lie in one place, where segments from track ``inner`` on run inside the region.

    Both sides of such a segment must keep the same nodes, so these are fixed.
    """
    inside = boundary.track >= inner
    touched = np.zeros(len(boundary.points), bool)
    touched[boundary.segments[inside]] = True
    _, first, number = np.unique(boundary.points, axis=0, return_index=True, return_inverse=True)
    number = first[number.ravel()]  # the earliest of those in one place: the outline comes first
    kept = np.flatnonzero((number == np.arange(len(number))) | ~touched)
    number = np.where(touched, number, np.arange(len(number)))
    size = boundary.size.copy()
    np.minimum.at(size, number, boundary.size)
    kind = np.where(touched & (boundary.kind != CORNER), FROZEN, boundary.kind).astype(np.uint8)
    renumber = np.full(len(number), -1, np.int32)
    renumber[kept] = np.arange(len(kept), dtype=np.int32)
    return Boundary(
        boundary.points[kept], kind[kept], size[kept], boundary.angle[kept], renumber[number[boundary.segments]],
        boundary.track, boundary.t, np.where(inside, LOCKED, boundary.mode).astype(np.uint8),
    )  # fmt: skip


def bending(tracks: Tracks, j: int, t: Float, s: Float) -> Float:
    """Curvature (n,) of track j at the parameters t of arc lengths s, from the turning of its chords."""
    if len(t) < 3:
        return np.zeros(len(t))
    step = np.diff(evaluate(tracks, j, t), axis=0)
    turn = np.abs(np.diff(np.unwrap(np.arctan2(step[:, 1], step[:, 0]))))
    curvature = turn / (0.5 * (s[2:] - s[:-2]))
    return np.concatenate([curvature[:1], curvature, curvature[-1:]])


def chord_sags(tracks: Tracks, boundary: Boundary) -> Float:
    """Distance (k,) of each segment's middle from the curve at the middle parameter."""
    middle = boundary.points[boundary.segments].mean(axis=1)
    for j in np.unique(boundary.track):
        of = boundary.track == j
        middle[of] -= evaluate(tracks, int(j), boundary.t[of].mean(axis=1))
    return np.hypot(*middle.T)


def crossed(ends: Float, k: int) -> NDArray[np.bool_]:
    """Which segments with ``ends`` (n, 2, 2) cross or touch segment k, apart from its neighbours' shared ends."""
    a, b = ends[k]

    def side(p: Float, q: Float, r: Float) -> Float:
        u, v = q - p, r - p
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    p, q = ends[:, 0], ends[:, 1]
    apart = (side(a, b, p) * side(a, b, q) > 0.0) | (side(p, q, a) * side(p, q, b) > 0.0)
    apart |= (np.maximum(p, q) < np.minimum(a, b)).any(axis=1) | (np.minimum(p, q) > np.maximum(a, b)).any(axis=1)
    joined = (p == a).all(1) | (p == b).all(1) | (q == a).all(1) | (q == b).all(1)
    return ~apart & ~joined


def sample_track(tracks: Tracks, j: int, turn: float) -> tuple[Float, Float, Float]:
    """Parameters, arc lengths and curvature-bound sizes (n,) along track j; two samples for a line."""
    if tracks.kinds[j] == 0:
        x = evaluate(tracks, j, [0.0, 1.0])
        return np.array([0.0, 1.0]), np.array([0.0, np.hypot(*(x[1] - x[0]))]), np.full(2, np.inf)
    n = 129
    if tracks.kinds[j] == 2:
        n = int(np.clip(16 * tracks.data[tracks.offsets[j] + 4] + 1, 65, 4097))
    n = min(MOST_SAMPLES, (n - 1) * max(1, math.ceil(FINE_TURN / turn)) + 1)
    t = np.linspace(0.0, 1.0, n)
    x = evaluate(tracks, j, t)
    s = np.zeros(n)
    np.cumsum(np.hypot(*np.diff(x, axis=0).T), out=s[1:])
    keep = np.concatenate([[True], np.diff(s) > 0.0])
    t, s, x = t[keep], s[keep], np.ascontiguousarray(x[keep])
    h = np.empty(len(s))
    kernels.turning_sizes(x, s, turn, h)
    return t, s, h


__all__ = ["BoundarySizing", "Curve", "EdgeNodes", "Outline", "SizeOptions"]
