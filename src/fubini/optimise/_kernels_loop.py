"""The loop: worst triangle first, levels of moves, bounded uphill kicks with the best state kept."""

from __future__ import annotations

import numpy as np

from fubini._jit import kernel
from fubini.optimise._kernels_moves import (
    mend,
    relax_patch,
    try_collapses,
    try_deletions,
    try_flips,
    try_insertions,
    try_splits,
    try_wide,
)
from fubini.optimise._kernels_quality import covers_corner, is_flawed, triangle_cost, triangle_quality
from fubini.optimise._kernels_state import (
    ATTEMPTS,
    BUDGET,
    FIRST_MOVE,
    FREED,
    KICK,
    NODES,
    PATCH,
    QUEUED,
    RANDOM,
    SEGMENTS,
    TRIANGLES,
)

FALL = 1e-3
DONE, STUCK, FULL, SPENT = 0, 1, 2, 3


@kernel
def room(S):
    """Whether every array has room for one more move."""
    c = S.counts
    return (
        c[NODES] + 8 < S.points.shape[0]
        and c[TRIANGLES] + 96 < S.tri.shape[0]
        and c[SEGMENTS] + 8 < S.track.shape[0]
    )


@kernel
def take_queue(S):
    """The flawed triangles of the queue, each once, worst first; the queue is emptied."""
    n = S.counts[QUEUED]
    listed = np.unique(S.queue[:n])
    S.counts[QUEUED] = 0
    value = np.empty(listed.shape[0])
    k = 0
    for q in range(listed.shape[0]):
        t = listed[q]
        if S.tri[t, 0] >= 0 and is_flawed(S, t):
            listed[k] = t
            value[k] = triangle_quality(S, t)
            k += 1
    return listed[:k][np.argsort(value[:k], kind="mergesort")]


@kernel
def descend(S, W):
    """Mend the queued triangles until none is flawed or no move lowers the cost. Returns a status.

    The queue holds what is still flawed.
    """
    level = 0
    while True:
        todo = take_queue(S)
        if todo.shape[0] == 0:
            return DONE
        moves = 0
        for q in range(todo.shape[0]):
            t = int(todo[q])
            if S.tri[t, 0] < 0 or not is_flawed(S, t):
                continue
            if not room(S):
                for z in range(q, todo.shape[0]):
                    keep(S, int(todo[z]))
                return FULL
            if mend(S, W, t, level, FALL):
                moves += 1
            keep(S, t)
            if S.counts[ATTEMPTS] > S.counts[BUDGET]:
                for z in range(q, todo.shape[0]):
                    keep(S, int(todo[z]))
                return SPENT
        if moves == 0:
            if level == 2:
                return STUCK
            level += 1


@kernel
def keep(S, t):
    """Put triangle t back into the queue, where there is room (the queue is twice as long as needed)."""
    if S.counts[QUEUED] < S.queue.shape[0]:
        S.queue[S.counts[QUEUED]] = t
        S.counts[QUEUED] += 1


@kernel
def draw(S, n):
    """A pseudo-random number in 0 .. n - 1 (xorshift; its state is ``counts[RANDOM]``)."""
    x = S.counts[RANDOM]
    x ^= (x << 13) & 0x7FFFFFFF
    x ^= x >> 17
    x ^= (x << 5) & 0x7FFFFFFF
    S.counts[RANDOM] = x
    return x % n


@kernel
def total_cost(S):
    """Cost of all triangles."""
    total = 0.0
    for t in range(S.counts[TRIANGLES]):
        if S.tri[t, 0] >= 0:
            total += triangle_cost(S, t)
    return total


@kernel
def copy_state(a, b):
    """Copy the mesh of state a into state b of the same capacities."""
    n, m, k = a.counts[NODES], a.counts[TRIANGLES], a.counts[SEGMENTS]
    b.points[:n] = a.points[:n]
    b.kind[:n] = a.kind[:n]
    b.size[:n] = a.size[:n]
    b.sharp[:n] = a.sharp[:n]
    b.tri_of[:n] = a.tri_of[:n]
    b.tri[:m] = a.tri[:m]
    b.nbr[:m] = a.nbr[:m]
    b.mark[:m] = a.mark[:m]
    b.free[: a.counts[FREED]] = a.free[: a.counts[FREED]]
    b.queue[: a.counts[QUEUED]] = a.queue[: a.counts[QUEUED]]
    b.track[:k] = a.track[:k]
    b.t[:k] = a.t[:k]
    b.mode[:k] = a.mode[:k]
    kept = b.counts.copy()
    b.counts[:] = a.counts
    b.counts[ATTEMPTS:FIRST_MOVE] = kept[ATTEMPTS:FIRST_MOVE]  # effort and randomness are never taken back


@kernel
def kick(S, W, t):
    """One random change near triangle t that may raise the cost, so that the flaw can travel; whether made."""
    u = t
    for _ in range(draw(S, 3)):
        w = int(S.nbr[u, draw(S, 3)])
        if w >= 0 and covers_corner(S, w) < 0:
            u = w
    fall = -0.25 - 0.25 * draw(S, 16)
    which = draw(S, 6)
    if which == 0:
        return try_flips(S, W, u, fall)
    if which == 1:
        return try_deletions(S, W, u, fall)
    if which == 2:
        return try_insertions(S, W, u, fall)
    if which == 3:
        return try_splits(S, W, u, 0, fall)
    if which == 4:
        return try_collapses(S, W, u, fall)
    return try_wide(S, W, u, fall)


@kernel
def requeue(S):
    """Queue every flawed triangle; their number."""
    S.counts[QUEUED] = 0
    for t in range(S.counts[TRIANGLES]):
        if S.tri[t, 0] >= 0 and is_flawed(S, t):
            keep(S, t)
    return S.counts[QUEUED]


@kernel
def search(S, B, W, rounds, patience):
    """Relax, kick and descend in turns; S ends as the best state seen. B: a second state. Returns a status.

    Meant for a small patch: each round costs time in proportion to its size.
    """
    requeue(S)
    copy_state(S, B)
    best = total_cost(S)
    stale = 0
    for turn in range(rounds):
        n = requeue(S)
        if n == 0:
            return DONE
        if not room(S):
            copy_state(B, S)
            return FULL
        t = int(S.queue[draw(S, n)])
        if turn % 3 == 0:
            relax_patch(S, W, t, 2 + draw(S, 2), 4)
            S.counts[PATCH] += 1
        elif kick(S, W, t):
            S.counts[KICK] += 1
        requeue(S)
        status = descend(S, W)
        cost = total_cost(S)
        if cost < best - 1e-9:
            best = cost
            stale = 0
            copy_state(S, B)
        else:
            stale += 1
        if stale > 0 and stale % patience == 0:
            copy_state(B, S)
        if status == SPENT:
            break
    copy_state(B, S)
    return DONE if requeue(S) == 0 else STUCK
