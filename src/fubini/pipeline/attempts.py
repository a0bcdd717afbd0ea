"""One attempt on a face: its boundary, a lattice inside and the optimiser, as the number of the attempt asks for."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

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
from fubini.pipeline.ears import NO_EARS, find_ears, with_ears, without_ears
from fubini.pipeline.options import MeshOptions
from fubini.pipeline.points import clear_of, with_lone
from fubini.pipeline.strip import strip_boundary
from fubini.quality import corner_limit
from fubini.sampling.fans import clear_of_segments, long_segments, with_fans
from fubini.sampling.interior import NO_CORE, Core, Lattice, best_lattice, lattice_with_core
from fubini.sampling.outline import Outline
from fubini.sampling.ratios import SHARP
from fubini.triangulation.constrained import constrained_delaunay, delaunay_around
from fubini.triangulation.value import CORNER, FROZEN, LOCKED, ON_CURVE, SPLIT_ONLY, Boundary, Byte, Triangulation

Float = NDArray[np.float64]

#: Origins of the lattice, tried one after the other, in steps of its size.
SHIFTS = ((0.0, 0.0), (0.5, 0.3), (0.25, 0.65), (0.75, 0.1), (0.1, 0.85), (0.6, 0.55), (0.35, 0.4), (0.9, 0.7))
#: With so many lattices tried, edges shared with other faces may be split.
SPLIT_SHARED_FROM = 2
#: Moves that the optimiser may attempt on a face: so many, and so many more for each triangle. Another lattice or
#: a finer boundary helps more than a longer search: of 2,100 faces without a flaw none took a thousand.
MOVES, MOVES_EACH = 50_000, 20
#: Corners so little (degrees) above what one triangle can cover leave no choice for its legs.
TIGHT = 3.0
#: Fewer triangles than this inside do not pay for a strip of their own.
LEAST_CORE = 400
#: Faces of most models have no points of their own inside.
NO_POINTS: Float = np.empty((0, 2))
#: Budget of refinements towards a size field.
FIELD_ROUNDS = 30


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
