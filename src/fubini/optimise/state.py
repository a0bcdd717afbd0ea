"""From a triangulation to the mutable state of the moves, and back."""

from __future__ import annotations

import functools
import math
import threading
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fubini.optimise._kernels_copy import read_out
from fubini.optimise._kernels_start import start
from fubini.optimise._kernels_state import (
    AR,
    ATTEMPTS,
    FILL,
    HARD,
    LOW,
    NODES,
    SAG,
    SEGMENTS,
    SOFT,
    STRETCH,
    TRIANGLES,
    WAIVED,
    WEIGHT,
    State,
    Work,
    work,
)
from fubini.optimise.options import LONGEST, OptimiseOptions, implied_aspect_ratio
from fubini.quality import corner_limit
from fubini.tracks import Tracks
from fubini.triangulation.value import LOCKED, Boundary, Triangulation

#: f = tan(skewness - 45 deg) that the moves aim at lies this far above the bound
MARGIN = 4e-3

#: nodes and boundary segments, and half the triangles, that arrays kept from one state to the next have room for
ROOMS = 2048, 8192, 32768

#: circumradius times sqrt(3) over the wanted size above which a triangle gets a point
OVERSIZE = 1.25

#: corners below this (degrees) are filled by one triangle; marked so in ``State.sharp``
ACUTE = 50.0


@functools.lru_cache(maxsize=16)
def rule_of(options: OptimiseOptions) -> NDArray[np.float64]:
    """The numbers that kernels judge triangles by (``State.rule``, which takes a copy)."""
    rule = np.zeros(7)
    hard = math.tan(math.radians(options.min_skew - 45.0))
    rule[HARD] = hard + 1e-9
    rule[SOFT] = hard + MARGIN
    rule[WEIGHT] = 1.0 / (1.0 - rule[SOFT])
    rule[WAIVED] = 0.95 * MARGIN
    if options.max_aspect_ratio <= implied_aspect_ratio(options.min_skew):
        # the scale of f is steeper in the aspect ratio: a margin of its own
        rule[AR] = 1.0 + (options.max_aspect_ratio - 1.0) * (1.0 - MARGIN)
    rule[SAG], rule[STRETCH] = options.max_sag, min(options.growth, LONGEST)
    return rule


#: rounds of evening out where there is to be none, sizes beyond segments where nothing is there
NOTHING = np.empty(0)
#: A core of which nothing is known.
NO_ROOM = 0, -1.0


class ReadOut(NamedTuple):
    """What a state holds: the mesh, and the splits of its shared segments, (track, t) each.

    Where it was evened out: nodes moved by that, pairs left above the limit, and the length of the longest edge.
    """

    mesh: Triangulation
    splits: tuple[tuple[int, float], ...] = ()
    moves: int = 0
    left: int = 0
    longest: float = 0.0


#: types of the arrays that kernels take
FLOATS, INTS, BYTES = np.dtype(np.float64), np.dtype(np.int32), np.dtype(np.uint8)

_kept = threading.local()


def scratch_space() -> Work:
    """The scratch space of this thread: what is left in it from before does not matter."""
    if not hasattr(_kept, "work"):
        _kept.work = work()
    found: Work = _kept.work
    return found


def writable(array: NDArray, kind: np.dtype) -> NDArray:
    """The array, or a copy that kernels take: they are compiled for writable C arrays of one type."""
    if array.dtype is kind and array.flags.carray:
        return array
    return np.array(array, kind, order="C")


def grown(array: NDArray, used: int, length: int) -> NDArray:
    """An array of ``length`` rows that starts with the first ``used`` rows of ``array``; the others are not set."""
    out = np.empty((length, *array.shape[1:]), array.dtype)
    out[:used] = array[:used]
    return out


def build_state(
    tri: Triangulation,
    tracks: Tracks,
    options: OptimiseOptions,
    spare: int,
    passing: bool = False,
) -> State:
    """State of the triangulation with room for about ``spare`` more nodes, sizes of its nodes those of ``started``.

    passing : see ``new_state``.
    """
    state = new_state(tri, tracks, options, spare, passing)
    started(state, tri, options, FILL)
    return state


def new_state(tri: Triangulation, tracks: Tracks, options: OptimiseOptions, spare: int, passing: bool = False) -> State:
    """A state with room for the triangulation and about ``spare`` more nodes, in which nothing is set but the rule.

    passing : the state is read out before this thread builds another. All but the largest then share their arrays.
    """
    n, m, k = len(tri.points), len(tri.triangles), len(tri.boundary.segments)
    nodes, triangles, segments = n + spare, m + 2 * spare + 200, k + spare
    wanted = max(nodes, segments, (triangles + 1) // 2)
    if passing and wanted <= ROOMS[-1]:
        return _kept_state(next(room for room in ROOMS if room >= wanted), options, tracks)
    return State(*[*_arrays(nodes, triangles, segments), rule_of(options).copy(), *tracks])


def started(
    state: State,
    tri: Triangulation,
    options: OptimiseOptions,
    tasks: int,
    most: float = math.inf,
    size: NDArray[np.float64] | None = None,
    gradient: float = 0.0,
    rounds: int = 0,
    core: tuple[int, float] | None = None,
) -> tuple[int, int]:
    """Do these tasks of ``_kernels_start`` to a state and the triangulation that it starts from: (status, changes).

    The wanted edge length is ``size`` (n,) at all nodes; where it is None, that of the boundary's nodes there, and
    inside ``most`` or, where this is infinite, the mean length of the edges at a node. core : see ``refine_within``.
    """
    boundary = tri.boundary
    own = writable(boundary.size, FLOATS)
    status, changes = start(
        state.words, scratch_space().words, tasks, writable(tri.points, FLOATS), writable(tri.triangles, INTS),
        writable(tri.neighbours, INTS), writable(boundary.kind, BYTES), writable(boundary.track, INTS),
        writable(boundary.t, FLOATS), _modes(boundary, options), 1 + options.seed % 0x7FFFFFFE,
        own if size is None else writable(size, FLOATS), writable(boundary.angle, FLOATS), own, ACUTE,
        corner_limit(options.min_skew), float(most), float(gradient), OVERSIZE,
        *(core or NO_ROOM), rounds,
    )  # fmt: skip
    return status, changes


def _modes(boundary: Boundary, options: OptimiseOptions) -> NDArray[np.uint8]:
    """Modes of the segments: all locked where splits are not allowed."""
    return writable(boundary.mode if options.allow_splits else np.full(len(boundary.mode), LOCKED), BYTES)


def _arrays(nodes: int, triangles: int, segments: int) -> list[NDArray]:
    """The arrays from ``points`` to ``counts``, not set."""
    return [
        np.empty((nodes, 2)), np.empty(nodes, np.uint8), np.empty(nodes), np.empty(nodes, np.uint8),
        np.empty(nodes, np.int32), np.empty((triangles, 3), np.int32), np.empty((triangles, 3), np.int32),
        *_scratch(nodes, triangles),
        np.empty(segments, np.int32), np.empty((segments, 2)), np.empty(segments, np.uint8), np.empty(32, np.int64),
    ]  # fmt: skip


def _kept_state(room: int, options: OptimiseOptions, tracks: Tracks) -> State:
    """A state of so many nodes and segments, in a thread always of the same arrays: to make them takes long."""
    kept: dict[int, tuple[list[NDArray], NDArray[np.int64]]] = _kept.__dict__.setdefault("states", {})
    if room not in kept:
        arrays = [*_arrays(room, 2 * room, room), np.empty(len(rule_of(options)))]
        kept[room] = arrays, State(*[*arrays, *tracks]).words
    arrays, words = kept[room]
    arrays[-1][:] = rule_of(options)
    words[-len(tracks.words) :] = tracks.words
    state = State(*[*arrays, *tracks])
    state.__dict__["words"] = words
    return state


def _scratch(nodes: int, triangles: int) -> list[NDArray]:
    """The arrays from ``free`` to ``tried``; for ``_kernels_smooth`` four and nine numbers a node in two of them."""
    todo, key = max(2 * triangles, 4 * nodes), max(2 * triangles, 9 * nodes)
    return [
        np.empty(triangles, np.int32), np.empty(2 * triangles, np.int32), np.empty(triangles, np.int32),
        np.empty(todo, np.int32), np.empty(key), np.zeros(triangles, np.int32),
        np.empty(triangles, np.int32), np.zeros(nodes, np.int32), np.zeros(triangles, np.int32),
    ]  # fmt: skip


def extend_state(state: State, spare: int) -> State:
    """The same state with room for about ``spare`` more nodes."""
    n, m, k, low = (int(state.counts[i]) for i in (NODES, TRIANGLES, SEGMENTS, LOW))
    nodes, triangles, segments = n + spare, m + 2 * spare + 200, k + spare
    arrays = [grown(array, n, nodes) for array in state[:5]]
    arrays += [grown(array, m, triangles) for array in state[5:7]]
    arrays += _scratch(nodes, triangles)
    arrays += [grown(array, k, segments) for array in (state.track, state.t, state.mode)]
    arrays += state[-5:]
    longer = State(*arrays)
    for new, old, used in (
        (longer.free, state.free, len(state.free)),
        (longer.queue, state.queue, len(state.queue)),
        (longer.mark, state.mark, m),
        (longer.low, state.low, low),
    ):
        new[:used] = old[:used]
    return longer


def copy_of(state: State, effort: NDArray[np.int64] | None = None) -> State:
    """A copy of the mesh; its effort, moves and randomness continue from the counts ``effort``, if given."""
    copy = State(*(np.array(array) for array in state))
    if effort is not None:
        copy.counts[ATTEMPTS:] = effort[ATTEMPTS:]
    return copy


def read_state(
    state: State,
    tri: Triangulation,
    limit: float = 0.0,
    kept: NDArray[np.float64] = NOTHING,
    outside: NDArray[np.float64] = NOTHING,
) -> ReadOut:
    """The triangulation of the state, boundary nodes first; evened out, where ``kept`` has rounds (``even_out``).

    ``tri`` is where the state started from: it gives the modes of the segments and the angles of the nodes.
    """
    old = tri.boundary
    points, triangles, neighbours, kind, size, angle, segments, track, t, mode, fresh, moves, left, square = read_out(
        state.words, writable(old.angle, FLOATS), writable(old.mode, BYTES), limit, kept, outside
    )
    boundary = Boundary(points[: len(kind)], kind, size, angle, segments, track, t, mode)
    splits = tuple((int(track[s]), float(t[s, 0])) for s in fresh.tolist()) if len(fresh) else ()
    mesh = Triangulation(points, triangles, neighbours, boundary, tri.unrecovered)
    return ReadOut(mesh, splits, moves, left, math.sqrt(square))
