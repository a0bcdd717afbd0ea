"""The loop: worst triangle first, by levels of moves; the steps of the search around it."""

from __future__ import annotations

from fubini._jit import inner, kernel
from fubini.optimise._kernels_moves import CLASSES, LEVELS, mend, patch_nodes
from fubini.optimise._kernels_quality import covers_corner, is_flawed, triangle_cost, triangle_quality
from fubini.optimise._kernels_relocate import shift
from fubini.optimise._kernels_state import (
    ATTEMPTS,
    BUDGET,
    KICK,
    NODES,
    PATCH,
    QUEUED,
    RANDOM,
    SEGMENTS,
    TOP,
    TRIANGLES,
)

#: a move is made when the cost falls by more than this
FALL = 1e-3
#: what ``drive`` reports
DONE, STUCK, FULL, SPENT = 0, 1, 2, 3
#: what ``drive`` does before it descends
DESCEND, COUNT, RELAX, DISTURB = 0, 1, 2, 3


@inner
def room(S):
    """Whether every array has room for one more move."""
    c = S.counts
    return (
        c[NODES] + 8 < S.points.shape[0]
        and c[TRIANGLES] + 96 < S.tri.shape[0]
        and c[SEGMENTS] + 8 < S.track.shape[0]
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
def descend(S, W):
    """Mend the queued triangles until none is flawed or no move up to level TOP lowers the cost. Returns a status.

    The queue holds what is still flawed.
    """
    level = 0
    while True:
        todo = take_queue(S)
        if todo == 0:
            return DONE
        moves = 0
        status = DONE
        for q in range(todo):
            t = S.todo[q]
            if status == DONE and not room(S):
                status = FULL
            if status == DONE and S.counts[ATTEMPTS] > S.counts[BUDGET]:
                status = SPENT
            if status == DONE and S.tri[t, 0] >= 0 and is_flawed(S, t):
                if mend(S, W, t, 0, LEVELS[level], FALL):
                    moves += 1
            keep(S, t)
        if status != DONE:
            return status
        if moves == 0:
            if level == S.counts[TOP]:
                return STUCK
            level += 1


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
def relax(S, W, t, depth, sweeps):
    """Max-min relaxation of all nodes within ``depth`` rings of t, ``sweeps`` times at most."""
    n = patch_nodes(S, W, t, depth)
    for _ in range(sweeps):
        moved = False
        for q in range(n):
            if shift(S, W, W.nodes[q], 1e-4, True):
                moved = True
        if not moved:
            break
    S.counts[PATCH] += 1


@inner
def disturb(S, W, t):
    """One random change near triangle t that may raise the cost, so that the flaw can travel."""
    u = t
    for _ in range(draw(S, 3)):
        w = S.nbr[u, draw(S, 3)]
        if w >= 0 and covers_corner(S, w) < 0:
            u = w
    fall = -0.25 - 0.25 * draw(S, 16)
    which = draw(S, 8)
    if mend(S, W, u, CLASSES[which], CLASSES[which + 1], fall):
        S.counts[KICK] += 1


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


@kernel
def drive(S, W, task):
    """Descend from the queued triangles, after a step of the search around one of them. (status, total cost)

    task : DESCEND (no step; the cost is not computed), COUNT (cost only), RELAX or DISTURB. For the steps the state should be small: each
    costs time in proportion to its size.
    """
    if task == DESCEND:
        return descend(S, W), 0.0
    total = requeue(S)
    if S.counts[QUEUED] == 0:
        return DONE, total
    if task == COUNT:
        return STUCK, total
    if not room(S):
        return FULL, 0.0
    t = S.queue[draw(S, S.counts[QUEUED])]
    if task == RELAX:
        relax(S, W, t, 2 + draw(S, 2), 4)
    else:
        disturb(S, W, t)
    requeue(S)
    status = descend(S, W)
    return status, requeue(S)
