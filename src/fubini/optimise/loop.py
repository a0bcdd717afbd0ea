"""``optimise``: from any triangulation of a region to one without avoidable flaws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fubini.optimise._kernels_state import (
    ATTEMPTS,
    BUDGET,
    FIRST_MOVE,
    HARD,
    MOVES,
    QUEUED,
    SOFT,
    State,
    Work,
    work,
)
from fubini.optimise.options import OptimiseOptions, OptimiseOutcome
from fubini.optimise.state import build_state, copy_of, extend_state, read_state, readonly, rule_of, sharp_nodes
from fubini.tracks import Tracks
from fubini.triangulation.value import Triangulation


def flawed_triangles(
    tri: Triangulation, rule: NDArray[np.float64], bound: float
) -> NDArray[np.int32]:
    """Numbers of the triangles with f below ``bound``."""
    from fubini.optimise._kernels_quality import find_flawed

    points, triangles = readonly(tri.points, float), readonly(tri.triangles, np.int32)
    out = np.empty(64, np.int32)
    n = find_flawed(points, triangles, bound, rule, out)
    if n > len(out):
        out = np.empty(n, np.int32)
        find_flawed(points, triangles, bound, rule, out)
    return out[:n]


def excess_of(
    tri: Triangulation, flawed: NDArray[np.int32], options: OptimiseOptions
) -> NDArray[np.int32]:
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


def optimise(
    triangulation: Triangulation, tracks: Tracks, options: OptimiseOptions | None = None
) -> OptimiseOutcome:
    """Remove every avoidable flaw: local moves worst first, then kicks, then refinement.

    See method.md, section 6 (Perumal 2019, Fig. 4). Never raises for a mesh that it cannot mend: the outcome
    says how many triangles are left flawed, and where.
    """
    options = options or OptimiseOptions()
    rule = rule_of(options)
    soft = flawed_triangles(triangulation, rule, rule[SOFT])
    hard = flawed_triangles(triangulation, rule, rule[HARD]) if len(soft) else soft
    if len(excess_of(triangulation, soft, options)) == 0:
        return OptimiseOutcome(triangulation, dict.fromkeys(MOVES, 0), len(hard), len(hard))
    state = build_state(triangulation, tracks, options, 200 + 4 * len(soft))
    state.queue[: len(soft)] = soft
    state.counts[QUEUED] = len(soft)
    state.counts[BUDGET] = 20000 + 1000 * len(soft) if options.budget is None else options.budget
    state = run(state, work())
    result, splits = read_state(state, triangulation)
    return judge(result, splits, state, options, len(hard))


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


def run(state: State, scratch: Work) -> State:
    """Descend, then search with kicks; the state may move to larger arrays."""
    from fubini.optimise._kernels_loop import DESCEND, DONE, FULL, SPENT, drive

    status = FULL
    while status == FULL:
        status, _ = drive(state, scratch, DESCEND)
        if status == FULL:
            state = extend_state(state, 2 * len(state.points))
    if status in (DONE, SPENT):
        return state
    return search(state, scratch, 60, 12)


def search(state: State, scratch: Work, rounds: int, patience: int) -> State:
    """Relax, disturb and descend in turns; the best state seen. Ends when nothing is flawed, or after ``rounds``."""
    from fubini.optimise._kernels_loop import COUNT, DISTURB, DONE, FULL, RELAX, SPENT, drive

    best, stale = copy_of(state), 0
    _, lowest = drive(state, scratch, COUNT)
    for turn in range(rounds):
        status, cost = drive(state, scratch, RELAX if turn % 3 == 0 else DISTURB)
        if status == FULL:
            state = extend_state(state, 2 * len(state.points))
            continue
        if cost < lowest - 1e-9:
            best, lowest, stale = copy_of(state), cost, 0
        else:
            stale += 1
        if status in (DONE, SPENT):
            break
        if stale > 0 and stale % patience == 0:
            state = copy_of(best, state.counts)
    return copy_of(best, state.counts)
