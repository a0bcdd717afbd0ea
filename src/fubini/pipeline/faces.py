"""Meshing all faces so that shared edges keep one set of nodes."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fubini._values import value
from fubini.errors import GeometryError, OptionError
from fubini.optimise import (
    OptimiseOptions,
    OptimiseOutcome,
    level,
    optimise,
    refine,
    refine_and_optimise,
    refine_within,
    shortened,
    smooth,
    thinned,
)
from fubini.pipeline.across import evened_across
from fubini.pipeline.ears import find_ears, with_ears, without_ears
from fubini.pipeline.options import MeshOptions, Progress
from fubini.pipeline.pattern import PatternPoints, pattern_nodes
from fubini.pipeline.points import clear_of, crowded, with_lone
from fubini.pipeline.strip import FaceMesh, strip_boundary, with_core
from fubini.quality import corner_limit
from fubini.sampling.boundary import BoundarySizing, EdgeNodes, Outline
from fubini.sampling.fans import clear_of_segments, long_segments, with_fans
from fubini.sampling.interior import NO_CORE, Core, Lattice, best_lattice, lattice_with_core
from fubini.sampling.ratios import SHARP
from fubini.triangulation.constrained import constrained_delaunay, delaunay_around
from fubini.triangulation.value import CORNER, FROZEN, LOCKED, ON_CURVE, SPLIT_ONLY, Boundary, Byte, Triangulation

Float = NDArray[np.float64]

#: Origins of the lattice, tried one after the other, in steps of its size.
SHIFTS = ((0.0, 0.0), (0.5, 0.3), (0.25, 0.65), (0.75, 0.1), (0.1, 0.85), (0.6, 0.55), (0.35, 0.4), (0.9, 0.7))
#: With so many lattices tried, edges shared with other faces may be split.
SPLIT_SHARED_FROM = 2
#: Splits of shared edges are followed until the edges hold this many times the nodes that they started with.
MOST_SPLITS = 4
#: Moves that the optimiser may attempt on a face: so many, and so many more for each triangle. Another lattice or
#: a finer boundary helps more than a longer search: of 2,100 faces without a flaw none took a thousand.
MOVES, MOVES_EACH = 50_000, 20
#: ... and on all attempts on one face that leave a flaw, however often it is meshed: twice what the worst face of
#: thousands needed that came out without one.
EFFORT = 200_000
#: Finer boundaries in a row that leave no fewer flaws, before a face is given up: beside a cusp they only shift them.
PATIENCE = 2
#: Flaws no further from a leg than this many times its length are there because of it.
HOPELESS_REACH = 1.5
#: Corners so little (degrees) above what one triangle can cover leave no choice for its legs.
TIGHT = 3.0
#: Fewer triangles than this inside do not pay for a strip of their own.
LEAST_CORE = 400
#: Faces of most models have no points of their own inside.
NO_POINTS: Float = np.empty((0, 2))
#: ... nor corners to be cut off.
NO_EARS: NDArray[np.intp] = np.empty((0, 2), np.intp)
#: Budget of rounds that shorten the boundary beside such points.
POINT_ROUNDS = 20
#: Budget of refinements towards a size field.
FIELD_ROUNDS = 30


@value(frozen=True)
class FaceResult:
    """Mesh of one face, the optimiser's outcome, and the version of the nodes on edges that it was made for."""

    mesh: FaceMesh
    outcome: OptimiseOutcome
    version: int


def attempt(
    boundary: Boundary,
    outline: Outline,
    size: float,
    options: MeshOptions,
    number: int,
    inside: Float | None,
    sizes: Callable[[Float], Float] | None = None,
    lone: Float = NO_POINTS,
    along: Float | None = None,
    tried: list[tuple[Float, Boundary]] | None = None,
    cut: bool = True,
) -> tuple[OptimiseOutcome, Core | None] | None:
    """Mesh one face with the points ``inside``, or with the lattice of this number where there are none given.

    ``lone`` (p, 2) become nodes and stay where they are; ``along`` (c,) sizes asked of single edges. Returns the
    triangulation, and the core that it leaves out; None where the start is one of those ``tried``, which it joins.
    With ``cut`` corners of known triangles are cut off before and put back after (``find_ears``).
    Raises ``GeometryError`` where boundary segments cross.
    """
    cut = cut and outline.sharpest < SHARP and inside is None and not len(lone) and number % 4 < 2
    ears = find_ears(boundary, options.min_skew, options.max_aspect_ratio) if cut else NO_EARS
    boundary = held(boundary, outline, options, number, number % 2 == 0 and inside is None)
    boundary = with_lone(boundary, lone, size)
    asked = optimiser_options(options.min_skew, options.max_aspect_ratio, options.growth, options.max_sag)
    if inside is not None:
        start = whole(constrained_delaunay(np.concatenate([boundary.points, inside]), boundary), outline)
        return optimise(start, outline.tracks, asked), None
    gradient, long = options.inner_gradient, long_segments(boundary, size)
    # a size field may ask for anything inside: no core stays as it is
    least = LEAST_CORE if sizes is None and not len(lone) and not len(long) else NO_CORE
    lattice = lattice_of(boundary, outline, size, gradient, number, least)
    inner, core, face = clear_of_segments(lattice.points, long, size), lattice.core, boundary
    inner = clear_of(inner, boundary, len(lone), size, gradient) if len(lone) else inner
    boundary = without_ears(boundary, ears) if len(ears) else boundary
    inner, at_fans = with_fans(inner, boundary, size) if number % 2 or len(long) else (inner, NO_POINTS)
    boundary = strip_boundary(boundary, core, size) if core is not None else boundary
    points = np.concatenate([boundary.points, inner])
    if tried is not None and was_tried(points, boundary, tried):
        return None
    if inner is lattice.points and not len(ears):
        start = whole(delaunay_around(points, boundary, face, lattice.patch), outline)
    else:
        start = constrained_delaunay(points, boundary)
        if len(ears) and len(start.unrecovered):
            return attempt(face, outline, size, options, number, inside, sizes, lone, along, tried, False)
        start = whole(start, outline)
    others = sizes is not None or along is not None or len(lone) or len(long)
    beside = None if others else room_of(core, lattice.spacing / size)
    found: tuple[OptimiseOutcome, tuple[int, float] | None]
    if sizes is not None:
        filled = follow(refine(start, outline.tracks, size, gradient), outline, size, options.gradient, sizes)
        found = optimise(smooth(filled, outline.tracks), outline.tracks, asked), None
    elif len(long):
        most = float(np.hypot(*(long[:, 1] - long[:, 0]).T).max())
        found = refine_and_optimise(start, outline.tracks, most, gradient, asked, sizes_of(start, inner, at_fans))
    else:
        found = refine_within(start, outline.tracks, size, gradient, asked, beside)
    outcome = finished(found, outline, size, asked, sizes, along, beside)
    return with_ears(outcome, face, ears) if len(ears) else outcome, core


def finished(
    found: tuple[OptimiseOutcome, tuple[int, float] | None],
    outline: Outline,
    size: float,
    asked: OptimiseOptions,
    sizes: Callable[[Float], Float] | None,
    along: Float | None,
    beside: tuple[int, float] | None,
) -> OptimiseOutcome:
    """An outcome, and what ``level`` asks of it, with neighbours of like size, no long edges, no triangles too many."""
    outcome, longest = level(found[0], outline.tracks, asked, found[1])
    outcome = shortened(outcome, outline.tracks, size, asked, sizes, along, longest)
    return thinned(outcome, size, asked, beside)


def room_of(core: Core | None, spacing: float) -> tuple[int, float]:
    """Triangles of a core whose nodes are ``spacing`` sizes apart, and how many of the size there is room for there."""
    return (core.triangles, core.triangles * spacing**2) if core is not None else (0, 0.0)


def was_tried(points: Float, boundary: Boundary, tried: list[tuple[Float, Boundary]]) -> bool:
    """Whether an attempt that starts alike is among those tried; joins them otherwise."""
    if any(same_start(points, boundary, *start) for start in tried):
        return True
    tried.append((points, boundary))
    return False


def same_start(points: Float, boundary: Boundary, others: Float, beside: Boundary) -> bool:
    """Whether two attempts start with the same nodes, none of which may do what it may not in the other."""
    return (
        np.array_equal(points, others)
        and np.array_equal(boundary.kind, beside.kind)
        and np.array_equal(boundary.mode, beside.mode)
    )


def whole(start: Triangulation, outline: Outline) -> Triangulation:
    """The same; raises ``GeometryError`` where a boundary segment is no edge of it: the optimiser relies on them."""
    if len(start.unrecovered):
        raise outline.crossing(start.boundary, int(start.unrecovered[0]))
    return start


def sizes_of(start: Triangulation, inner: Float, wanted: Float) -> Float:
    """Sizes at the nodes of a triangulation whose interior nodes are those of ``inner`` that lie in the region."""
    n = len(start.boundary.points)
    size = dict(zip(map(tuple, inner.tolist()), wanted.tolist(), strict=True))
    return np.array([*start.boundary.size.tolist(), *(size[x, y] for x, y in start.points[n:].tolist())])


def lattice_of(boundary: Boundary, outline: Outline, size: float, gradient: float, number: int, least: int) -> Lattice:
    """The lattice of this attempt: the first along the boundary, others with their rows along x."""
    if number == 0:
        return best_lattice(boundary, outline.tracks.kinds, size, gradient, least)
    return lattice_with_core(boundary, size, gradient, SHIFTS[number % len(SHIFTS)], least)


@functools.lru_cache(maxsize=16)
def optimiser_options(min_skew: float, max_aspect_ratio: float, growth: float, max_sag: float) -> OptimiseOptions:
    """What the optimiser is asked; faces of one run, and runs alike, share it and what is derived from it."""
    return OptimiseOptions(
        min_skew, max_aspect_ratio, budget=MOVES, budget_each=MOVES_EACH, growth=growth, max_sag=max_sag
    )


def follow(
    filled: Triangulation, outline: Outline, size: float, gradient: float, sizes: Callable[[Float], Float]
) -> Triangulation:
    """Refine until the nodes meet a size field: every round asks it at the nodes of the round before."""
    for _ in range(FIELD_ROUNDS):
        wanted = np.clip(sizes(np.array(filled.points)), 1e-7 * size, size)
        n = len(filled.boundary.size)
        wanted[:n] = np.minimum(wanted[:n], filled.boundary.size)
        finer = refine(filled, outline.tracks, size, gradient, wanted)
        if len(finer.points) == len(filled.points):
            break
        filled = finer
    return filled


def held(boundary: Boundary, outline: Outline, options: MeshOptions, number: int, legs: bool) -> Boundary:
    """The boundary with what attempt ``number`` must not change: shared edges at first, the place of nodes that keep
    a chord tolerance, and with ``legs`` the equal legs of corners that leave no choice for them.
    """
    kind, mode = boundary.kind, boundary.mode
    if number < SPLIT_SHARED_FROM and np.count_nonzero(mode):
        mode = np.where(mode == SPLIT_ONLY, LOCKED, mode).astype(np.uint8)
    if options.chord_tolerance is not None:
        kind = np.where(kind == ON_CURVE, FROZEN, kind).astype(np.uint8)
    tightest = corner_limit(options.min_skew) + TIGHT
    if legs and outline.sharpest < tightest:
        kind, mode = hold_legs(boundary, kind, mode, tightest)
    return boundary if kind is boundary.kind and mode is boundary.mode else replace(boundary, kind=kind, mode=mode)


def hold_legs(boundary: Boundary, kind: Byte, mode: Byte, angle: float) -> tuple[Byte, Byte]:
    """Kinds and modes that keep the equal legs of corners below ``angle`` degrees: any other triangle is worse."""
    a, b = boundary.segments.T
    tight = (boundary.kind == CORNER) & (boundary.angle < angle)
    legs = tight[a] | tight[b]
    kind, mode = kind.copy(), mode.copy()
    ends = np.unique(boundary.segments[legs])
    kind[ends[kind[ends] == ON_CURVE]] = FROZEN
    mode[legs] = LOCKED
    return kind, mode


class FaceMesher:
    """Meshes the faces of a model one by one and follows splits of shared edges through all of them.

    ``pattern`` gives mapped points of every face in place of sized edges and lattices, ``points`` those (p, 2) inside
    faces that are to be nodes, by face.
    """

    def __init__(
        self,
        sizing: BoundarySizing,
        sizes: list[float],
        options: MeshOptions,
        pattern: list[PatternPoints] | None = None,
        points: Mapping[int, Float] | None = None,
    ) -> None:
        self.sizing = sizing
        self.sizes = sizes
        self.options = options
        self.pattern = pattern
        self.base = sizing.resolve() if pattern is None else pattern_nodes(len(sizing.ends), sizing.outlines, pattern)
        self.extra: dict[int, list[float]] = {}
        self.points = points or {}
        self._approach_points()
        self.nodes = self.base
        self.version = 0
        self.renewed = np.zeros(len(sizing.ends), np.int64)  # version that came with the present nodes of an edge
        self.results: dict[int, FaceResult] = {}
        self.finer: dict[int, int] = {}
        self.effort: dict[int, int] = {}
        self.settled = False

    def run(self, progress: Progress | None = None) -> list[FaceResult]:
        """Mesh until every face matches the nodes of its edges.

        When the budget is spent, or the splits of shared edges go on and on, the nodes are settled: the faces that
        wait are meshed once more without splits, so that all fit together, flawed where they must be.
        """
        count = len(self.sizing.outlines)
        budget = 6 * count + 20
        most = MOST_SPLITS * len(self.base.t) + 1000
        pending = list(range(count))
        while pending:
            self.settled = budget <= 0 or len(self.nodes.t) > most
            for f in pending:
                budget -= 1
                self._mesh_face(f)
                if progress:
                    progress("faces", min(len(self.results), count), count)
            pending = [f for f in range(count) if self._is_stale(f)]
        return self._evened([self.results[f] for f in range(count)])

    def _evened(self, results: list[FaceResult]) -> list[FaceResult]:
        """The faces, evened out across the edges that they share."""
        first, o = self.sizing.outlines[0], self.options
        if self.pattern is not None or (len(results) == 1 and first.inner == len(first.edges)):
            return results
        asked = optimiser_options(o.min_skew, o.max_aspect_ratio, o.growth, o.max_sag)
        return evened_across(self.sizing.network, self.nodes, results, asked)

    def _approach_points(self) -> None:
        """Shorten boundary segments that a point inside their face lies close to."""
        for f, points in self.points.items():
            for _ in range(POINT_ROUNDS):
                close = crowded(self.sizing.boundary(f, self.base), points)
                if not close.any() or not self.sizing.lower_near(f, points[close], self.base, 0.7):
                    break
                self.base = self.sizing.resolve()

    def _is_stale(self, f: int) -> bool:
        """Whether an edge of a face has got other nodes since it was meshed."""
        version = self.results[f].version
        return version < self.version and bool((self.renewed[self.sizing.outlines[f].edges] > version).any())

    def _renew(self, nodes: EdgeNodes) -> None:
        """Take other nodes, as a new version."""
        self.version += 1
        self.renewed[nodes.differs(self.nodes)] = self.version
        self.nodes = nodes

    def _mesh_face(self, f: int) -> None:
        """Try lattices, then finer boundaries, until no flawed triangle is left that could be avoided."""
        left: list[int] = []
        while True:
            best, core = self._best_attempt(f)
            left.append(best.excess)
            done = self.finer.get(f, 0)
            if not best.excess or self.settled or self.pattern is not None or done >= self.options.rounds:
                break
            if self._is_hopeless(f, best):
                break
            if self._spent(f):
                best = replace(best, budget_exhausted=True)
                break
            if len(left) > PATIENCE and min(left[-PATIENCE:]) >= min(left[:-PATIENCE]):
                break
            self.finer[f] = done + 1
            if not self._refine_boundary(f, best):
                break
        if core is None and not len(best.triangulation.triangles):
            at = self.sizing.boundary(f, self.nodes).points[0]
            raise GeometryError("nothing lies inside the outline: it crosses itself or runs backwards", face=f, at=at)
        self._follow_splits(f, best)
        self.results[f] = FaceResult(with_core(best.triangulation, core), best, self.version)

    def _best_attempt(self, f: int) -> tuple[OptimiseOutcome, Core | None]:
        """The attempt that leaves fewest avoidable flaws, the first of those that leave none."""
        best: tuple[OptimiseOutcome, Core | None] | None = None
        tried: list[tuple[Float, Boundary]] = []
        outline = self.sizing.outlines[f]
        inside = self.pattern[f].inside if self.pattern is not None else None
        field = self.sizing.options.fields[f] if self.sizing.options.fields is not None else None
        along = self._asked_along(f)
        for number in self._attempts(f):
            boundary, size = self._boundary(f), self.sizes[f]
            lone = self.points.get(f, NO_POINTS)
            try:
                found = attempt(boundary, outline, size, self.options, number, inside, field, lone, along, tried)
            except GeometryError as error:
                error.face = f
                raise
            if found is not None and (best is None or found[0].excess < best[0].excess):
                best = found
            if found is not None and found[0].excess:
                self.effort[f] = self.effort.get(f, 0) + found[0].effort
            if best is not None and (best[0].excess == 0 or self._spent(f)):
                break
            if best is not None and number >= SPLIT_SHARED_FROM and self._is_hopeless(f, best[0]):
                break
        if best is None:
            raise OptionError(f"attempts is {self.options.attempts}", fix="allow at least one")
        return best

    def _boundary(self, f: int) -> Boundary:
        """The boundary of a face with its nodes, none larger than the size of the face but where segments are long."""
        boundary, size = self.sizing.boundary(f, self.nodes), self.sizes[f]
        if size >= self.sizing.options.size or len(long_segments(boundary, size)):
            return boundary
        return replace(boundary, size=np.minimum(boundary.size, size))

    def _asked_along(self, f: int) -> Float | None:
        """Sizes (c,) asked of the edges of a face; None where none is smaller than that of the face."""
        asked, edges = self.sizing.options.edge_size, self.sizing.outlines[f].edges.tolist()
        if not asked or min(asked.get(e, np.inf) for e in edges) >= self.sizes[f]:
            return None
        return np.array([asked.get(e, np.inf) for e in edges])

    def _spent(self, f: int) -> bool:
        """Whether the effort that a face may cost is spent."""
        return self.effort.get(f, 0) > EFFORT

    def _is_hopeless(self, f: int, outcome: OptimiseOutcome) -> bool:
        """Whether all flaws of a face lie at legs beside which there are no valid triangles at any size.

        A finer boundary may help once at other legs that faces share, by chance: sizes there are in proportion to it.
        """
        legs = self.sizing.legs
        if not legs.radius.any():
            return False
        known = legs.hopeless if f not in self.finer else legs.hopeless | (legs.held & legs.shared[:, None])
        return self._lie_at(f, outcome, known)

    def _lie_at(self, f: int, outcome: OptimiseOutcome, legs: NDArray[np.bool_]) -> bool:
        """Whether all flaws of a face lie at some of these ``legs`` (e, 2)."""
        edges = self.sizing.outlines[f].edges
        if not legs[edges].any():
            return False
        boundary = self.sizing.boundary(f, self.nodes)
        at_end = legs[edges[boundary.track], :, None] & (boundary.t[:, None] == np.array([[0.0], [1.0]]))
        ends = boundary.points[boundary.segments[at_end.any(axis=(1, 2))]]
        reach = HOPELESS_REACH * np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        away = np.linalg.norm(np.array(outcome.worst)[:, None, None] - ends, axis=3).min(axis=2)
        return bool((away <= reach).any(axis=1).all())

    def _attempts(self, f: int) -> Sequence[int]:
        """Numbers of the attempts to make; none that splits shared edges once their nodes are settled."""
        if self.settled or self._spent(f):
            return range(SPLIT_SHARED_FROM)
        return range(self.options.attempts) if self.pattern is None else (0, SPLIT_SHARED_FROM)

    def _refine_boundary(self, f: int, outcome: OptimiseOutcome) -> bool:
        """Ask for a finer boundary where flawed triangles are left."""
        if not self.sizing.lower_near(f, np.array(outcome.worst), self.nodes, 0.7):
            return False
        base = self.sizing.resolve()
        for e in list(self.extra):
            if not np.array_equal(base.of(e), self.base.of(e)):
                del self.extra[e]
        self.base = base
        self._renew(base.with_nodes(self.extra) if self.extra else base)
        return True

    def _follow_splits(self, f: int, outcome: OptimiseOutcome) -> None:
        """Put the nodes that the optimiser added on shared edges into the discretisation."""
        if not outcome.splits:
            return
        edges = self.sizing.outlines[f].edges
        for j, t in outcome.splits:
            self.extra.setdefault(int(edges[j]), []).append(float(t))
        self._renew(self.base.with_nodes(self.extra))


__all__ = ["EdgeNodes", "FaceMesher", "FaceResult"]
