"""The loop: worst triangle first, by levels of moves; the steps of the search around it."""

from __future__ import annotations

import math

from fubini._jit import inner, kernel
from fubini.optimise._kernels_moves import CLASSES, LEVELS, mend, patch_nodes
from fubini.optimise._kernels_polish import polish
from fubini.optimise._kernels_quality import covers_corner, is_flawed, triangle_cost, triangle_quality
from fubini.optimise._kernels_state import (
    AFTER,
    ATTEMPTS,
    BEFORE,
    BUDGET,
    DONE,
    EXCESS,
    FULL,
    HARD,
    KICK,
    LEVEL,
    LOW,
    NODES,
    PATCH,
    POOR,
    QUEUED,
    RANDOM,
    SEGMENTS,
    SOFT,
    SPENT,
    STUCK,
    TRIANGLES,
)
from fubini.optimise._kernels_words import state_of, work_of

#: quality of the skewness 50 degrees
FAIR = math.tan(math.radians(5.0))
#: a move is made when the cost falls by more than this
FALL = 0.01
#: what ``drive`` does
MEND, COUNT, RELAX, DISTURB, WHOLE, POLISH = range(6)


@inner
def room(S):
    """Whether every array has room for one more move."""
    c = S.counts
    return (
        c[NODES] + 8 < S.points.shape[0] and c[TRIANGLES] + 96 < S.tri.shape[0] and c[SEGMENTS] + 8 < S.track.shape[0]
    )


@inner
def keep(S, t):
    """Put triangle t into the queue, where there is room."""
    if S.counts[QUEUED] < S.queue.shape[0]:
        S.queue[S.counts[QUEUED]] = t
        S.counts[QUEUED] += 1


@inner
def sort_by(key, item, n):
    """Sort item[:n] by rising key[:n] (both changed), ties by rising item: Shell's method."""
    gap = 1
    while gap < n // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, n):
            k, t = key[i], item[i]
            j = i
            while j >= gap and (key[j - gap] > k or (key[j - gap] == k and item[j - gap] > t)):
                key[j], item[j] = key[j - gap], item[j - gap]
                j -= gap
            key[j], item[j] = k, t
        gap //= 3


@inner
def take_queue(S):
    """Move the flawed triangles of the queue to S.todo, each once, worst first; their number."""
    n = 0
    for q in range(S.counts[QUEUED]):
        t = S.queue[q]
        if S.tri[t, 0] >= 0 and is_flawed(S, t):
            S.todo[n] = t
            S.key[n] = triangle_quality(S, t)
            n += 1
    S.counts[QUEUED] = 0
    sort_by(S.key, S.todo, n)
    k = 0
    for q in range(n):
        if q == 0 or S.todo[q] != S.todo[q - 1]:
            S.todo[k] = S.todo[q]
            k += 1
    return k


@inner
def draw(S, n):
    """A pseudo-random number in 0 .. n - 1 (xorshift; its state is ``counts[RANDOM]``)."""
    x = S.counts[RANDOM]
    x ^= (x << 13) & 0x7FFFFFFF
    x ^= x >> 17
    x ^= (x << 5) & 0x7FFFFFFF
    S.counts[RANDOM] = x
    return x % n


@inner
def requeue(S):
    """Queue every flawed triangle; the total cost of all triangles."""
    S.counts[QUEUED] = 0
    total = 0.0
    for t in range(S.counts[TRIANGLES]):
        if S.tri[t, 0] >= 0:
            total += triangle_cost(S, t)
            if is_flawed(S, t):
                keep(S, t)
    return total


@inner
def wander(S, t):
    """A triangle at most two random steps away from t, not the one of an unavoidable corner."""
    for _ in range(draw(S, 3)):
        u = S.nbr[t, draw(S, 3)]
        if u >= 0 and covers_corner(S, u) < 0:
            t = u
    return t


@inner
def random_step(S, W, task):
    """Choose a step of the search near a random queued triangle, into S.todo[0]; (moves first, last, fall).

    RELAX: gentle shifts of all nodes within two or three rings. DISTURB: some move that may raise the cost, so that the
    flaw can travel.
    """
    t = S.queue[draw(S, S.counts[QUEUED])]
    S.todo[0] = t
    if task == RELAX:
        S.counts[PATCH] += 1
        return CLASSES[9], CLASSES[9] + patch_nodes(S, W, t, 2 + draw(S, 2)), 1e-4
    S.counts[KICK] += 1
    S.todo[0] = wander(S, t)
    fall = -0.25 - 0.25 * draw(S, 16)
    which = draw(S, 8)
    return CLASSES[which], CLASSES[which + 1], fall


@inner
def unchanged(S, t, since):
    """Whether all cheap moves on triangle t failed after attempt ``since``, and nothing near it changed later."""
    last = max(S.moved[S.tri[t, 0]], max(S.moved[S.tri[t, 1]], S.moved[S.tri[t, 2]]))
    return S.tried[t] > since and last <= S.tried[t]


@inner
def sweep(S, W, task, level, since):
    """One round of the loop. Returns (status, moves made, total cost); the queue holds what is still flawed.

    task : MEND, the queued triangles, each once, worst first, by moves up to ``level``; the cost is not
    computed. COUNT, nothing but the cost and the queue. RELAX or DISTURB, a step of the search; cost and queue are
    computed anew. Only MEND takes less time than in proportion to the number of triangles.
    ``since`` : attempts made when the descent began, from which on MEND knows what it tried.
    """
    number, first, last, fall = 0, 0, LEVELS[level], FALL
    if task == MEND:
        number = take_queue(S)
    else:
        total = requeue(S)
        if task == COUNT or S.counts[QUEUED] == 0:
            return DONE if S.counts[QUEUED] == 0 else STUCK, 0, total
        number = 1
        first, last, fall = random_step(S, W, task)
    moves, status = 0, STUCK
    for q in range(number):
        t = S.todo[q]
        if status == STUCK and not room(S):
            status = FULL
        if status == STUCK and S.counts[ATTEMPTS] > S.counts[BUDGET]:
            status = SPENT
        if status == STUCK and S.tri[t, 0] >= 0 and (task != MEND or is_flawed(S, t)):
            start = LEVELS[0] if task == MEND and unchanged(S, t, since) else first
            done = 0
            for _ in range(4 if task == RELAX else 1):
                done += mend(S, W, t, start, last, fall, task == RELAX)
            if done == 0:
                S.tried[t] = S.counts[ATTEMPTS]
            moves += done
        keep(S, t)
    if task != MEND:
        return status, moves, requeue(S)
    return DONE if number == 0 else status, moves, 0.0


@inner
def run(S, W, task, top):
    """A step of the search, or the queued triangles mended until no move up to level ``top`` lowers the cost.

    Returns (status, total cost; 0 for MEND). A descent that was FULL goes on where it stopped.
    """
    since = S.counts[ATTEMPTS]
    while True:
        status, moves, total = sweep(S, W, task, S.counts[LEVEL], since)
        if task == MEND and status == FULL:
            return FULL, total
        if task != MEND or status != STUCK or (moves == 0 and S.counts[LEVEL] == top):
            S.counts[LEVEL] = 0
            return status, total
        if moves == 0:
            S.counts[LEVEL] += 1


@inner
def excuse(S, n):
    """Put those of the n triangles S.low that unavoidable corners excuse, one each, last; their number."""
    kept = 0
    for q in range(n):
        t = S.low[q]
        excused = False
        for i in range(3):
            v = S.tri[t, i]
            if not excused and S.sharp[v] == 1:
                excused = True
                for z in range(kept, q):
                    excused = excused and S.stack[z] != v
                if excused:
                    S.stack[q] = v
        if not excused:
            S.low[q], S.low[kept] = S.low[kept], t
            S.stack[q] = S.stack[kept]
            kept += 1
    return n - kept


@inner
def survey(S, bound):
    """Note the triangles below ``bound`` in S.low, queue those below the soft bound; how many none excuses."""
    n = S.counts[BEFORE] = S.counts[QUEUED] = 0
    for t in range(S.counts[TRIANGLES]):
        if S.tri[t, 0] >= 0:
            f = triangle_quality(S, t)
            if f < bound:
                S.low[n] = t
                n += 1
                if f < S.rule[SOFT]:
                    keep(S, t)
                if f < S.rule[HARD]:
                    S.counts[BEFORE] += 1
    S.counts[LOW] = n
    return n - excuse(S, n)


@inner
def find_low(S, bound):
    """Note the triangles below ``bound`` in S.low."""
    n = 0
    for t in range(S.counts[TRIANGLES]):
        if S.tri[t, 0] >= 0 and triangle_quality(S, t) < bound:
            S.low[n] = t
            n += 1
    S.counts[LOW] = n


@inner
def count_poor(S):
    """Count those of the triangles S.low that are not flawed, and yet no more than 5 degrees better than 45."""
    S.counts[POOR] = 0
    for q in range(S.counts[LOW]):
        S.counts[POOR] += S.rule[HARD] <= triangle_quality(S, S.low[q]) < FAIR


@inner
def judge(S):
    """Count the flawed triangles and those beyond the unavoidable, which come first in S.low."""
    n = 0
    for t in range(S.counts[TRIANGLES]):
        if S.tri[t, 0] >= 0 and triangle_quality(S, t) < S.rule[HARD]:
            S.low[n] = t
            n += 1
    S.counts[AFTER] = n
    S.counts[EXCESS] = n - excuse(S, n)


@kernel
def drive(S, W, task, top, goal, share):
    """The steps of the optimiser, in one kernel since all of them make moves. Returns (status, total cost).

    task : MEND, COUNT, RELAX, DISTURB as ``run`` does them. WHOLE: survey, mend and, where that leaves nothing to
    search for (the status is not STUCK), polish and judge. POLISH: polish and judge alone. Call again after FULL,
    with larger arrays and MEND for the rest of a WHOLE. ``goal`` : tangent of the skewness to polish to, 0 for none;
    ``share`` : of the effort spent on polishing.
    """
    S, W = state_of(S), work_of(W)
    status, total, bound = DONE, 0.0, max(S.rule[SOFT], (goal - 1.0) / (goal + 1.0))
    if task == WHOLE:
        if survey(S, bound) == 0:
            S.counts[LOW] = S.counts[AFTER] = S.counts[EXCESS] = 0
            if S.counts[BEFORE] > 0:
                judge(S)
            return DONE, 0.0
        if S.counts[BUDGET] < 0:
            S.counts[BUDGET] = 50000 + 4000 * S.counts[QUEUED]
    known = task == WHOLE and S.counts[QUEUED] == 0
    if task < WHOLE or (task == WHOLE and not known):
        status, total = run(S, W, MEND if task == WHOLE else task, top)
    if task < WHOLE or status == STUCK or status == FULL:
        return status, total
    if goal > 0.0:
        if not known:
            find_low(S, bound)
        m = S.counts[TRIANGLES]
        # all that is done for a small mesh takes as long as 1000 visits, and 4.5 more for each triangle
        polish(S, W, goal, int(share * min(1000.0 + 4.5 * m, 4000.0 + 200.0 * math.sqrt(m))))
        count_poor(S)
    S.counts[AFTER] = S.counts[EXCESS] = 0
    if not known:  # polishing makes no triangle worse than the soft bound
        judge(S)
    return status, total
