"""``optimise``: from any triangulation of a region to one without avoidable flaws."""

from __future__ import annotations

import math

from numpy.typing import ArrayLike

from fubini.optimise._kernels_loop import COUNT, DISTURB, MEND, POLISH, RELAX, WHOLE, drive
from fubini.optimise._kernels_state import (
    AFTER,
    ATTEMPTS,
    BEFORE,
    BUDGET,
    EXCESS,
    FILL,
    FIRST_MOVE,
    FULL,
    INSERTED,
    MOVES,
    POOR,
    PREPARE,
    QUEUED,
    ROOM,
    SMOOTH,
    SPENT,
    STUCK,
    THINNED,
    TRIANGLES,
    State,
    Work,
)
from fubini.optimise.options import OptimiseOptions, OptimiseOutcome
from fubini.optimise.refine import advanced
from fubini.optimise.smooth import ROUNDS as SMOOTHINGS
from fubini.optimise.smooth import kept_shapes
from fubini.optimise.state import (
    ReadOut,
    build_state,
    copy_of,
    extend_state,
    new_state,
    read_state,
    scratch_space,
    started,
)
from fubini.tracks import NO_TRACKS, Tracks
from fubini.triangulation.value import Triangulation

#: skewness in degrees that valid triangles are raised to where nothing is in the way
IMPROVED_SKEW = 66.0

#: flaws that are searched for before refinement, and rounds of refinement and search
FEW, ROUNDS = 6, 4


def optimise(triangulation: Triangulation, tracks: Tracks, options: OptimiseOptions | None = None) -> OptimiseOutcome:
    """Remove every avoidable flaw, then raise the worst triangles.

    Local moves worst first, then kicks; see method.md, section 6 (Perumal 2019, Fig. 4). Never raises for a mesh that
    it cannot mend: the outcome says how many triangles are left flawed, and where.
    """
    options = options or OptimiseOptions()
    spare = 200 + len(triangulation.points) // 8
    state = _driven(build_state(triangulation, tracks, options, spare), options)
    changed = state.counts[INSERTED] > 0 or state.counts[FIRST_MOVE:].any()
    return _outcome(state, read_state(state, triangulation) if changed else ReadOut(triangulation))


def refine_and_optimise(
    triangulation: Triangulation,
    tracks: Tracks,
    h: float,
    gradient: float,
    options: OptimiseOptions,
    size: ArrayLike | None = None,
    core: tuple[int, float] | None = None,
) -> tuple[OptimiseOutcome, tuple[int, float]]:
    """``refine``, ``smooth``, ``optimise`` and ``even_out`` one after the other, with no copy in between.

    The outcome, and what ``level`` asks of one that is evened out: pairs left above the limit, and the longest edge.
    """
    state, _ = advanced(triangulation, tracks, h, gradient, size, options, SMOOTHINGS, core)
    state = _driven(state, options)
    found = read_state(state, triangulation, options.growth, kept_shapes(options))
    return _outcome(state, found), (found.left, found.longest)


def improved(triangulation: Triangulation, options: OptimiseOptions) -> Triangulation:
    """``smooth`` and ``optimise`` one after the other, with no copy in between; boundary nodes stay where they are."""
    state = new_state(triangulation, NO_TRACKS, options, 200 + len(triangulation.points) // 8, passing=True)
    started(state, triangulation, options, FILL | SMOOTH | PREPARE, rounds=SMOOTHINGS)
    return read_state(_driven(state, options), triangulation).mesh


def _driven(state: State, options: OptimiseOptions) -> State:
    """A state that has its effort still before it, optimised."""
    state.counts[BUDGET] = options.budget_of(int(state.counts[TRIANGLES]))
    return run(state, scratch_space(), options)


def _outcome(state: State, found: ReadOut) -> OptimiseOutcome:
    """What came of an optimised state, as it was read out."""
    counts = state.counts.tolist()
    excess: int = counts[EXCESS]
    worst: tuple[tuple[float, float], ...] = ()
    if excess:
        worst = tuple((x, y) for x, y in state.points[state.tri[state.low[:excess]]].mean(1).tolist())
    return OptimiseOutcome(
        found.mesh, dict(zip(MOVES, counts[FIRST_MOVE:], strict=False)), counts[BEFORE], counts[AFTER], excess,
        found.splits, excess > 0 and counts[ATTEMPTS] > counts[BUDGET], worst, counts[ATTEMPTS], counts[ROOM],
        counts[THINNED] > 0, counts[POOR],
    )  # fmt: skip


def improvement_goal(options: OptimiseOptions) -> float:
    """Tangent of the skewness to reach once the bound is met; 0 where no improvement is asked for or it lies below."""
    wanted = options.improve > 0.0 and options.min_skew < IMPROVED_SKEW
    return math.tan(math.radians(IMPROVED_SKEW)) if wanted else 0.0


def run(state: State, scratch: Work, options: OptimiseOptions) -> State:
    """Descend, search with kicks, refine and search again, polish; the state may move to larger arrays."""
    goal = improvement_goal(options)
    status, _ = drive(state.words, scratch.words, WHOLE, 2, goal, options.improve)
    if status not in (FULL, STUCK):
        return state
    if status == FULL:
        state, status = descend(extend_state(state, 2 * len(state.points)), scratch)
    if status == STUCK and state.counts[QUEUED] <= FEW:
        state, status = search(state, scratch, 24, 12)
    for _ in range(ROUNDS):
        if status != STUCK:
            break
        state, status = refine_flaws(state, scratch)
        if status == STUCK:
            state, status = search(state, scratch, 24, 12)
    drive(state.words, scratch.words, POLISH, 0, goal, options.improve)
    return state


def step(state: State, scratch: Work, task: int) -> tuple[int, float]:
    """One step of the search: (status, total cost)."""
    status, cost = drive(state.words, scratch.words, task, 2, 0.0, 0.0)
    return status, cost


def descend(state: State, scratch: Work) -> tuple[State, int]:
    """Mend the queued triangles by moves of all levels until none lowers the cost. (state, status)

    The state may move to larger arrays.
    """
    while (status := step(state, scratch, MEND)[0]) == FULL:
        state = extend_state(state, 2 * len(state.points))
    return state, status


def refine_flaws(state: State, scratch: Work) -> tuple[State, int]:
    """Delaunay refinement at what is flawed, then moves again; the better of the states before and after."""
    from fubini.optimise._kernels_rescue import rescue

    before, after = copy_of(state), FULL
    _, old = step(state, scratch, COUNT)
    for _ in range(6):
        while (status := rescue(state.words, scratch.words, 4 + 2 * int(state.counts[QUEUED]))) == FULL:
            state = extend_state(state, 2 * len(state.points))
        state, after = descend(state, scratch)
        if after != STUCK or status == STUCK:
            break
    _, cost = step(state, scratch, COUNT)
    return (state, after) if cost < old else (copy_of(before, state.counts), after)


def search(state: State, scratch: Work, rounds: int, patience: int) -> tuple[State, int]:
    """Relax, disturb and descend in turns, until nothing is flawed or ``rounds`` are over. (best state seen, status)"""
    best, stale = copy_of(state), 0
    reached, lowest = step(state, scratch, COUNT)
    for turn in range(rounds):
        status, _ = step(state, scratch, RELAX if turn % 3 == 0 else DISTURB)
        if status == FULL:
            state = extend_state(state, 2 * len(state.points))
            continue
        state, status = descend(state, scratch)
        _, cost = step(state, scratch, COUNT)
        if cost < lowest - 1e-9:
            best, lowest, stale, reached = copy_of(state), cost, 0, status
        else:
            stale += 1
        if status == SPENT:
            reached = SPENT
        if reached != STUCK:
            break
        if stale > 0 and stale % patience == 0:
            state = copy_of(best, state.counts)
    return copy_of(best, state.counts), reached
