"""From a triangulation to the mutable state of the moves, and back."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fubini.optimise._kernels_state import (
    AR,
    ATTEMPTS,
    FLOOR,
    HARD,
    NODES,
    QUEUED,
    RANDOM,
    REMOVED,
    SAG,
    SEGMENTS,
    SOFT,
    STRETCH,
    TRIANGLES,
    WAIVED,
    WEIGHT,
    State,
)
from fubini.optimise.options import OptimiseOptions, implied_aspect_ratio
from fubini.quality import corner_limit
from fubini.tracks import Tracks
from fubini.triangulation.value import LOCKED, Boundary, Triangulation

#: f = tan(skewness - 45 deg) that the moves aim at lies this far above the bound
MARGIN = 4e-3

#: corners below this (degrees) are filled by one triangle; marked so in ``State.sharp``
ACUTE, ACUTE_MARK = 50.0, 2


def rule_of(options: OptimiseOptions) -> NDArray[np.float64]:
    """The numbers that kernels judge triangles by (``State.rule``)."""
    rule = np.zeros(8)
    hard = math.tan(math.radians(options.min_skew - 45.0))
    rule[HARD] = hard + 1e-9
    rule[SOFT] = hard + MARGIN
    rule[WEIGHT] = 1.0 / (1.0 - rule[SOFT])
    rule[FLOOR] = -2.0
    rule[WAIVED] = 0.95 * MARGIN
    if options.max_aspect_ratio <= implied_aspect_ratio(options.min_skew):
        # the scale of f is steeper in the aspect ratio: a margin of its own
        rule[AR] = 1.0 + (options.max_aspect_ratio - 1.0) * (1.0 - MARGIN)
    rule[SAG], rule[STRETCH] = options.max_sag, options.growth
    return rule


def sharp_nodes(boundary: Boundary, min_skew: float) -> NDArray[np.uint8]:
    """1 at boundary nodes in whose corner no valid triangle fits, else 0."""
    return (np.asarray(boundary.angle) < corner_limit(min_skew)).astype(np.uint8)


def readonly(array: NDArray, kind: type) -> NDArray:
    """A read-only view for kernels that only look: one array type, no copy of what is frozen already."""
    view: NDArray = np.ascontiguousarray(array, kind).view()
    view.flags.writeable = False
    return view


def grown(array: NDArray, length: int) -> NDArray:
    """A writable copy with ``length`` rows; the new ones are zero."""
    out = np.zeros((length, *array.shape[1:]), array.dtype)
    out[: len(array)] = array
    return out


def build_state(
    tri: Triangulation,
    tracks: Tracks,
    options: OptimiseOptions,
    spare: int,
    size: NDArray[np.float64] | None = None,
) -> State:
    """State of the triangulation with room for about ``spare`` more nodes.

    size : (n,) wanted edge length at the nodes; None: the boundary's, and inside the mean length of the edges there.
    """
    from fubini.optimise._kernels_refine import prepare

    boundary, n, m, k = tri.boundary, len(tri.points), len(tri.triangles), len(tri.boundary.segments)
    nodes, triangles, segments = n + spare, m + 2 * spare + 200, k + spare
    kind = np.zeros(n, np.uint8)
    kind[: len(boundary.kind)] = boundary.kind
    sharp = np.zeros(n, np.uint8)
    sharp[: len(boundary.kind)] = np.where(boundary.angle < ACUTE, ACUTE_MARK, 0)
    sharp[: len(boundary.kind)][sharp_nodes(boundary, options.min_skew) == 1] = 1
    mode = boundary.mode if options.allow_splits else np.full(k, LOCKED, np.uint8)
    tri_of, sizes = np.zeros(nodes, np.int32), np.zeros(nodes)
    sizes[: len(boundary.kind)] = boundary.size
    if size is not None:
        sizes[: len(size)] = size
    points, corners = readonly(tri.points, np.float64), readonly(tri.triangles, np.int32)
    prepare(points, corners, len(boundary.kind) if size is None else n, sizes, tri_of)
    counts = np.zeros(32, np.int64)
    counts[[NODES, TRIANGLES, SEGMENTS, QUEUED]] = n, m, k, 0
    counts[RANDOM] = 1 + options.seed % 0x7FFFFFFE
    return State(
        grown(np.asarray(tri.points, float), nodes),
        grown(kind, nodes),
        sizes,
        grown(sharp, nodes),
        tri_of,
        grown(np.asarray(tri.triangles, np.int32), triangles),
        grown(np.asarray(tri.neighbours, np.int32), triangles),
        np.zeros(triangles, np.int32),
        np.zeros(2 * triangles, np.int32),
        np.zeros(triangles, np.int32),
        np.zeros(2 * triangles, np.int32),
        np.zeros(2 * triangles),
        np.zeros(triangles, np.int32),
        grown(np.asarray(boundary.track, np.int32), segments),
        grown(np.asarray(boundary.t, float), segments),
        grown(np.asarray(mode, np.uint8), segments),
        counts,
        rule_of(options),
        *tracks,
    )


def extend_state(state: State, spare: int) -> State:
    """The same state with room for about ``spare`` more nodes."""
    c = state.counts
    nodes, triangles, segments = c[NODES] + spare, c[TRIANGLES] + 2 * spare + 200, c[SEGMENTS] + spare

    def longer(array: NDArray, used: int, length: int) -> NDArray:
        return grown(array[:used], int(length))

    n, m, k = int(c[NODES]), int(c[TRIANGLES]), int(c[SEGMENTS])
    return State(
        longer(state.points, n, nodes),
        longer(state.kind, n, nodes),
        longer(state.size, n, nodes),
        longer(state.sharp, n, nodes),
        longer(state.tri_of, n, nodes),
        longer(state.tri, m, triangles),
        longer(state.nbr, m, triangles),
        longer(state.free, len(state.free), triangles),
        longer(state.queue, len(state.queue), 2 * triangles),
        np.zeros(triangles, np.int32),
        np.zeros(2 * triangles, np.int32),
        np.zeros(2 * triangles),
        longer(state.mark, m, triangles),
        longer(state.track, k, segments),
        longer(state.t, k, segments),
        longer(state.mode, k, segments),
        c,
        state.rule,
        state.track_kinds,
        state.track_offsets,
        state.track_data,
    )


def copy_of(state: State, effort: NDArray[np.int64] | None = None) -> State:
    """A copy of the mesh; its effort, moves and randomness continue from the counts ``effort``, if given."""
    copy = State(*(np.array(array) for array in state))
    if effort is not None:
        copy.counts[ATTEMPTS:] = effort[ATTEMPTS:]
    return copy


def segment_nodes(state: State, live: NDArray[np.int64]) -> NDArray[np.int32]:
    """Nodes (K, 2) of every segment, read off the live triangles."""
    nodes = np.full((int(state.counts[SEGMENTS]), 2), -1, np.int32)
    triangles, neighbours = state.tri[live], state.nbr[live]
    for i in range(3):
        at = np.flatnonzero(neighbours[:, i] < 0)
        s = -1 - neighbours[at, i]
        nodes[s, 0] = triangles[at, (i + 1) % 3]
        nodes[s, 1] = triangles[at, (i + 2) % 3]
    return nodes


def read_state(state: State, tri: Triangulation) -> tuple[Triangulation, tuple[tuple[int, float], ...]]:
    """The triangulation of the state, boundary nodes first, and the splits of shared segments.

    ``tri`` is where the state started from: it gives the modes of the segments and the angles of the nodes.
    """
    n, m, k = (int(state.counts[i]) for i in (NODES, TRIANGLES, SEGMENTS))
    live = np.flatnonzero(state.tri[:m, 0] >= 0)
    segments = segment_nodes(state, live)
    alive = np.flatnonzero(segments[:, 0] >= 0)
    kind = state.kind[:n]
    old = len(tri.boundary.kind)
    on_boundary = (kind != 0) & (kind != REMOVED)
    order = np.concatenate([np.flatnonzero(on_boundary), np.flatnonzero(kind == 0)])
    number = np.full(n, -1, np.int32)
    number[order] = np.arange(len(order), dtype=np.int32)
    renumber = np.full(m, -1, np.int32)
    renumber[live] = np.arange(len(live), dtype=np.int32)
    rename = np.full(k, -1, np.int32)
    rename[alive] = np.arange(len(alive), dtype=np.int32)
    across = state.nbr[:m][live]
    neighbours = np.where(across >= 0, renumber[np.maximum(across, 0)], -1 - rename[np.maximum(-1 - across, 0)])
    count = int(on_boundary.sum())
    angle = np.full(n, 180.0)
    angle[:old] = tri.boundary.angle
    mode = state.mode[:k].copy()
    mode[: len(tri.boundary.mode)] = np.where(mode[: len(tri.boundary.mode)] == REMOVED, REMOVED, tri.boundary.mode)
    boundary = Boundary(
        points=state.points[order[:count]],
        kind=kind[order[:count]],
        size=state.size[order[:count]],
        angle=angle[order[:count]],
        segments=number[segments[alive]],
        track=state.track[alive],
        t=state.t[alive],
        mode=mode[alive],
    )
    fresh = [s for s in alive if state.mode[s] == 1 and segments[s, 0] >= old]
    splits = tuple((int(state.track[s]), float(state.t[s, 0])) for s in fresh)
    result = Triangulation(
        points=state.points[order],
        triangles=number[state.tri[:m][live]],
        neighbours=neighbours.astype(np.int32),
        boundary=boundary,
        unrecovered=tri.unrecovered,
    )
    return result, splits
