"""``optimise``: from any triangulation of a region to one without avoidable flaws."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fubini.optimise._kernels_state import (
    AR,
    ATTEMPTS,
    BUDGET,
    FIRST_MOVE,
    FLOOR,
    HARD,
    MOVES,
    QUEUED,
    SOFT,
    TRIANGLES,
    WEIGHT,
    State,
    Work,
    work,
)
from fubini.optimise.options import OptimiseOptions, OptimiseOutcome
from fubini.optimise.state import (
    build_state,
    copy_of,
    extend_state,
    read_state,
    readonly,
    rule_of,
    sharp_nodes,
)
from fubini.quality import aspect_ratios, skewness
from fubini.tracks import Tracks
from fubini.triangulation.value import Triangulation

#: skewness in degrees that valid triangles are raised to, in turn; at 56 the aspect ratio is below 1.5
IMPROVED_SKEW = (49.0, 52.0, 55.0, 58.0)

#: flaws that are searched for before refinement, and rounds of refinement and search
FEW, ROUNDS = 6, 4


def flawed_triangles(tri: Triangulation, rule: NDArray[np.float64], bound: float) -> NDArray[np.int32]:
    """Numbers of the triangles with f below ``bound``."""
    from fubini.optimise._kernels_quality import find_flawed

    points, triangles = readonly(tri.points, float), readonly(tri.triangles, np.int32)
    out = np.empty(64, np.int32)
    n = find_flawed(points, triangles, bound, rule, out)
    if n > len(out):
        out = np.empty(n, np.int32)
        find_flawed(points, triangles, bound, rule, out)
    return out[:n]


def qualities(tri: Triangulation, which: NDArray[np.int32], rule: NDArray[np.float64]) -> NDArray[np.float64]:
    """f of some of the triangles."""
    p = tri.points[tri.triangles[which]]
    f = np.tan(np.radians(np.maximum(skewness(p), 0.0) - 45.0))
    if rule[AR] > 0.0:
        scaled = (rule[AR] - aspect_ratios(p)) / (rule[AR] - 1.0)
        f = np.minimum(f, rule[SOFT] + (1.0 - rule[SOFT]) * scaled)
    return f


def excess_of(tri: Triangulation, flawed: NDArray[np.int32], options: OptimiseOptions) -> NDArray[np.int32]:
    """Those of the flawed triangles that no unavoidable corner excuses."""
    from fubini.optimise._kernels_quality import excess_flawed

    if len(flawed) == 0:
        return flawed
    sharp = np.zeros(len(tri.points), np.uint8)
    sharp[: len(tri.boundary.angle)] = sharp_nodes(tri.boundary, options.min_skew)
    triangles = readonly(tri.triangles, np.int32)
    rest = flawed.copy()
    n = excess_flawed(triangles, sharp, rest, np.zeros(len(sharp), np.uint8))
    return rest[:n]


def optimise(triangulation: Triangulation, tracks: Tracks, options: OptimiseOptions | None = None) -> OptimiseOutcome:
    """Remove every avoidable flaw, then raise the worst triangles.

    Local moves worst first, then kicks; see method.md, section 6 (Perumal 2019, Fig. 4). Never raises for a mesh that
    it cannot mend: the outcome says how many triangles are left flawed, and where.
    """
    options = options or OptimiseOptions()
    rule = rule_of(options)
    goals = improvement_goals(options)
    low = flawed_triangles(triangulation, rule, goals[-1] if goals else rule[SOFT])
    low_f = qualities(triangulation, low, rule)
    before = int((low_f < rule[HARD]).sum())
    soft = low[low_f < rule[SOFT]]
    if len(excess_of(triangulation, low, options)) == 0:
        return OptimiseOutcome(triangulation, dict.fromkeys(MOVES, 0), before, before)
    state = build_state(triangulation, tracks, options, 200 + 4 * len(soft))
    scratch = work()
    if len(soft):
        state.counts[BUDGET] = 50000 + 4000 * len(soft) if options.budget is None else options.budget
        state = run(fill_queue(state, soft), scratch)
    if goals:
        state = improve(state, scratch, low, goals, options)
    if not state.counts[FIRST_MOVE:].any():
        return judge(triangulation, (), state, options, before)
    result, splits = read_state(state, triangulation)
    return judge(result, splits, state, options, before)


def improvement_goals(options: OptimiseOptions) -> list[float]:
    """Values of f to reach in turn once the bound is met: skewness 49 to 58 degrees, as far as above the bound."""
    if options.improve <= 0.0:
        return []
    return [math.tan(math.radians(s - 45.0)) for s in IMPROVED_SKEW if s > options.min_skew + 1.0]


def fill_queue(state: State, triangles: NDArray[np.int32]) -> State:
    """The state with these triangles queued, besides those queued already; doubles do no harm."""
    n = int(state.counts[QUEUED])
    room = triangles[: len(state.queue) - n]
    state.queue[n : n + len(room)] = room
    state.counts[QUEUED] = n + len(room)
    return state


def improve(
    state: State,
    scratch: Work,
    low: NDArray[np.int32],
    goals: list[float],
    options: OptimiseOptions,
) -> State:
    """Raise triangles below each goal in turn by flips and shifts; no triangle falls below the bound again.

    The effort is ``options.improve`` times 4000 attempts, and 200 for the square root of the number of triangles.
    """
    spent, budget = int(state.counts[ATTEMPTS]), int(state.counts[BUDGET])
    effort = options.improve * (4000 + 200 * math.sqrt(state.counts[TRIANGLES]))
    saved = state.rule.copy()
    state.rule[FLOOR] = saved[SOFT]
    for i, goal in enumerate(goals):
        state.rule[SOFT], state.rule[WEIGHT] = goal, 1.0 / (1.0 - goal)
        state.counts[BUDGET] = spent + int(effort * (i + 1) / len(goals))
        state.counts[QUEUED] = 0
        state, _ = descend(fill_queue(state, low), scratch, 0)
    state.rule[:] = saved
    state.counts[[ATTEMPTS, BUDGET]] = spent, budget
    return state


def judge(
    result: Triangulation,
    splits: tuple[tuple[int, float], ...],
    state: State,
    options: OptimiseOptions,
    before: int,
) -> OptimiseOutcome:
    """The outcome, counted on the final triangulation."""
    rule = state.rule
    after = flawed_triangles(result, rule, rule[HARD])
    rest = excess_of(result, after, options)
    worst = result.points[result.triangles[rest]].mean(1)
    return OptimiseOutcome(
        result,
        {name: int(state.counts[FIRST_MOVE + i]) for i, name in enumerate(MOVES)},
        before,
        len(after),
        len(rest),
        splits,
        bool(len(rest) and state.counts[ATTEMPTS] > state.counts[BUDGET]),
        tuple((float(x), float(y)) for x, y in worst),
    )


def descend(state: State, scratch: Work, top: int) -> tuple[State, int]:
    """Mend the queued triangles by moves up to level ``top`` until no move lowers the cost. (state, status)

    The state may move to larger arrays.
    """
    from fubini.optimise._kernels_loop import FULL, MEND, STUCK, sweep

    level = 0
    while True:
        status, moves, _ = sweep(state, scratch, MEND, level)
        if status == FULL:
            state = extend_state(state, 2 * len(state.points))
        elif status != STUCK or (moves == 0 and level == top):
            return state, status
        elif moves == 0:
            level += 1


def run(state: State, scratch: Work) -> State:
    """Descend, then search with kicks, then refine and search again; the state may move to larger arrays."""
    from fubini.optimise._kernels_loop import STUCK

    state, status = descend(state, scratch, 2)
    if status == STUCK and state.counts[QUEUED] <= FEW:
        state, status = search(state, scratch, 24, 12)
    for _ in range(ROUNDS):
        if status != STUCK:
            break
        state, status = refine_flaws(state, scratch)
        if status == STUCK:
            state, status = search(state, scratch, 24, 12)
    return state


def refine_flaws(state: State, scratch: Work) -> tuple[State, int]:
    """Delaunay refinement at what is flawed, then moves again; the better of the states before and after."""
    from fubini.optimise._kernels_loop import COUNT, FULL, STUCK, sweep
    from fubini.optimise._kernels_rescue import rescue

    before, after = copy_of(state), FULL
    _, _, old = sweep(state, scratch, COUNT, 0)
    for _ in range(6):
        while (status := rescue(state, scratch, 4 + 2 * int(state.counts[QUEUED]))) == FULL:
            state = extend_state(state, 2 * len(state.points))
        state, after = descend(state, scratch, 2)
        if after != STUCK or status == STUCK:
            break
    _, _, cost = sweep(state, scratch, COUNT, 0)
    return (state, after) if cost < old else (copy_of(before, state.counts), after)


def search(state: State, scratch: Work, rounds: int, patience: int) -> tuple[State, int]:
    """Relax, disturb and descend in turns, until nothing is flawed or ``rounds`` are over. (best state seen, status)"""
    from fubini.optimise._kernels_loop import COUNT, DISTURB, FULL, RELAX, SPENT, STUCK, sweep

    best, stale = copy_of(state), 0
    reached, _, lowest = sweep(state, scratch, COUNT, 0)
    for turn in range(rounds):
        status, _, _ = sweep(state, scratch, RELAX if turn % 3 == 0 else DISTURB, 0)
        if status == FULL:
            state = extend_state(state, 2 * len(state.points))
            continue
        state, status = descend(state, scratch, 2)
        _, _, cost = sweep(state, scratch, COUNT, 0)
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
