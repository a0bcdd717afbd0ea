"""The loop: worst triangle first, by levels of moves; the steps of the search around it."""

from __future__ import annotations

from fubini._jit import inner, kernel
from fubini.optimise._kernels_moves import CLASSES, LEVELS, mend, patch_nodes
from fubini.optimise._kernels_quality import covers_corner, is_flawed, triangle_cost, triangle_quality
from fubini.optimise._kernels_state import (
    ATTEMPTS,
    BUDGET,
    KICK,
    NODES,
    PATCH,
    QUEUED,
    RANDOM,
    SEGMENTS,
    TRIANGLES,
)

#: a move is made when the cost falls by more than this
FALL = 0.01
#: what ``sweep`` reports: nothing flawed, some left, no room in the arrays, budget spent
DONE, STUCK, FULL, SPENT = 0, 1, 2, 3
#: what ``sweep`` does
MEND, COUNT, RELAX, DISTURB = 0, 1, 2, 3


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


@kernel
def sweep(S, W, task, level):
    """One round of the loop. Returns (status, moves made, total cost); the queue holds what is still flawed.

    task : MEND, the queued triangles, each once, worst first, by moves up to ``level``; the cost is not
    computed. COUNT, nothing but the cost and the queue. RELAX or DISTURB, a step of the search; cost and queue are
    computed anew. Only MEND takes less time than in proportion to the number of triangles.
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
            for _ in range(4 if task == RELAX else 1):
                moves += mend(S, W, t, first, last, fall, task == RELAX)
        keep(S, t)
    if task != MEND:
        return status, moves, requeue(S)
    return DONE if number == 0 else status, moves, 0.0
