"""The mutable mesh that the moves work on, and the scratch space of the primitive.

``State`` and ``Work`` are tuples of arrays, allocated once per face, so that every kernel here is
compiled for one signature only: it takes their ``words``. Names of the entries of ``State.counts`` stand below.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fubini._packed import words_of

# entries of State.counts
NODES, TRIANGLES, SEGMENTS, FREED, QUEUED, STAMP, ATTEMPTS, BUDGET, RANDOM, INSERTED = range(10)
#: level of a descent that ran out of room; triangles in State.low; flawed before, flawed now, beyond the unavoidable;
#: triangles of the wanted size that there is room for, where points were put in and that size is wanted everywhere
LEVEL, LOW, BEFORE, AFTER, EXCESS, ROOM = range(10, 16)
FIRST_MOVE = 16
#: nodes taken out before smoothing as there were too many triangles; triangles that polishing left below 50 degrees
THINNED, POOR = 27, 28
#: accepted moves, counted from ``FIRST_MOVE`` on in this order
MOVES = (
    "relocation",
    "slide",
    "flip",
    "insertion",
    "deletion",
    "boundary_split",
    "boundary_removal",
    "collapse",
    "patch",
    "kick",
    "refinement",
)
RELOCATION, SLIDE, FLIP, INSERTION, DELETION, SPLIT, REMOVAL, COLLAPSE, PATCH, KICK, REFINEMENT = range(16, 27)

# what a step reports: nothing flawed, some left, no room in the arrays, budget spent
DONE, STUCK, FULL, SPENT = range(4)
# tasks of ``_kernels_start.start``, to be added up
FILL, ADVANCE, SMOOTH, PREPARE = 1, 2, 4, 8

# entries of State.rule
SOFT, HARD, AR, WEIGHT, SAG, STRETCH, WAIVED = range(7)

REMOVED = 255
#: largest polygon of a cavity; larger ones are refused
LIMIT = 40
#: triangles that smoothing works out at a time, and how many numbers for all of them
LANES = 32
LANE_NUMBERS = 11 * LANES


class StateArrays(NamedTuple):
    """One face's mesh with room to grow; capacities N nodes, M triangles, K segments.

    Attributes
    ----------
    points (N, 2), kind (N,) uint8 (255: removed), size (N,), sharp (N,) uint8 (corners; 1: unavoidable, 2: acute)
    tri_of (N,) int32 : one triangle of each node; not used for corners and frozen nodes.
    tri (M, 3), nbr (M, 3) int32 : as in ``Triangulation``; ``tri[t, 0] = -1``: removed.
    free (M,) int32 : numbers of removed triangles, ``counts[FREED]`` of them.
    queue, todo (2 M,) int32, key (2 M,) : triangles that a move left flawed, ``counts[QUEUED]`` of them; their order.
        In polishing, nodes that wait. In smoothing todo has 4 N entries and key 9 N, where that is more.
    stack (M,) int32 : triangles to make Delaunay.
    mark (M,) int32 : stamps of the cavity at hand.
    low (M,) int32 : triangles to be raised, and in the end the flawed ones.
    moved (N,), tried (M,) int32 : attempt that last changed the triangles at a node, that last failed on a triangle.
        In polishing, moved is -1 where a node waits.
    track (K,) int32, t (K, 2), mode (K,) uint8 : of the segments; mode 255: removed.
    counts (32,) int64, rule (7,) float64 : see the names above.
    track_kinds, track_offsets, track_data : the tracks.
    """

    points: Any
    kind: Any
    size: Any
    sharp: Any
    tri_of: Any
    tri: Any
    nbr: Any
    free: Any
    queue: Any
    stack: Any
    todo: Any
    key: Any
    mark: Any
    low: Any
    moved: Any
    tried: Any
    track: Any
    t: Any
    mode: Any
    counts: Any
    rule: Any
    track_kinds: Any
    track_offsets: Any
    track_data: Any


#: Types of these, see ``fubini._packed``.
STATE_FIELDS = "d2 b d b i i3 i3 i i i i d i i i i i d2 b l d i i d"


class State(StateArrays):
    """The arrays, with what kernels take in their place."""

    @functools.cached_property
    def words(self) -> NDArray[np.int64]:
        """See ``fubini._packed``; the arrays must not be exchanged."""
        return words_of(self, STATE_FIELDS)


class WorkArrays(NamedTuple):
    """Scratch space of the primitive; all integers int64.

    cavity, fan : triangles. poly, code, px, py, ear : polygon of the cavity: nodes, what lies across the
    edge to the next node, coordinates relative to node 0, mark of a sharp corner between two
    segments. ring, rx, ry : nodes around a node. best, cut (LIMIT, LIMIT) : dynamic programme.
    fill (2 LIMIT, 3) : local corners of the new triangles. ea, eb, ec : loose edges. inner : nodes that go.
    circles (6 LIMIT, 4) : constraints of the valid region. lanes (LANE_NUMBERS,) : see ``_kernels_pull``.
    """

    cavity: Any
    fan: Any
    poly: Any
    code: Any
    px: Any
    py: Any
    ear: Any
    ring: Any
    rx: Any
    ry: Any
    best: Any
    cut: Any
    fill: Any
    ea: Any
    eb: Any
    ec: Any
    inner: Any
    circles: Any
    nodes: Any
    job: Any
    lanes: Any


#: Types of these.
WORK_FIELDS = f"l l l l d d l l d d d{LIMIT} l{LIMIT} l3 l l l l d4 l l d"


class Work(WorkArrays):
    """The arrays, with what kernels take in their place."""

    @functools.cached_property
    def words(self) -> NDArray[np.int64]:
        """See ``fubini._packed``."""
        return words_of(self, WORK_FIELDS)


def work() -> Work:
    """Scratch space, about 30 kB."""

    def ints(*shape: int) -> Any:
        return np.empty(shape, np.int64)

    n = 2 * LIMIT
    return Work(
        ints(n), ints(n), ints(n), ints(n), np.empty(n), np.empty(n), ints(n), ints(n), np.empty(n), np.empty(n),
        np.empty((LIMIT, LIMIT)), ints(LIMIT, LIMIT), ints(n, 3), ints(n), ints(n), ints(n), ints(n),
        np.empty((6 * LIMIT, 4)), ints(1024), ints(16), np.empty(LANE_NUMBERS),
    )  # fmt: skip
