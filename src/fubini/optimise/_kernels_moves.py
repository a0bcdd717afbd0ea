"""The moves: which cavities are tried around a flawed triangle, cheap ones before dear ones."""

from __future__ import annotations

from fubini._jit import kernel
from fubini.optimise._kernels_cavity import EITHER, PROGRAMME, replace, star
from fubini.optimise._kernels_relocate import shift, soften
from fubini.optimise._kernels_state import (
    ATTEMPTS,
    COLLAPSE,
    DELETION,
    FLIP,
    INSERTION,
    LIMIT,
    REMOVAL,
    SPLIT,
)

#: neighbours that join a triangle in a cavity, as bits of its edges; larger cavities first
MASKS = (7, 3, 5, 6, 1, 2, 4, 0)


@kernel
def refill(S, W, m, mode, fall, split_at, segment, share, dropped, move):
    """``replace`` with its books: counts the attempt, and the move when it is made."""
    S.counts[ATTEMPTS] += 1
    done, starred = replace(S, W, m, mode, fall, split_at, segment, share, dropped)
    if done:
        S.counts[INSERTION if starred and move == FLIP else move] += 1
    return done


@kernel
def around(S, W, t, mask):
    """Cavity of triangle t and its neighbours across the edges of ``mask``; its size, or 0 at the boundary."""
    W.cavity[0] = t
    m = 1
    for i in range(3):
        if mask & (1 << i):
            u = int(S.nbr[t, i])
            if u < 0:
                return 0
            W.cavity[m] = u
            m += 1
    return m


@kernel
def join_star(S, W, m, v):
    """Add the triangles around node v to the cavity of m triangles; the new size, or -1."""
    k, closed = star(S, W, v)
    if k < 0:
        return -1
    for q in range(k):
        known = False
        for z in range(m):
            known = known or W.cavity[z] == W.fan[q]
        if not known:
            if m >= LIMIT - 6:
                return -1
            W.cavity[m] = W.fan[q]
            m += 1
    return m


@kernel
def try_flips(S, W, t, fall):
    """Flip one of the edges of t."""
    for i in range(3):
        m = around(S, W, t, 1 << i)
        if m > 0 and refill(S, W, m, PROGRAMME, fall, -1, -1, 0.5, -1, FLIP):
            return True
    return False


@kernel
def try_shifts(S, W, t, fall):
    """Relocate or slide one of the nodes of t."""
    for i in range(3):
        if shift(S, W, int(S.tri[t, i]), fall):
            return True
    return False


@kernel
def try_deletions(S, W, t, fall):
    """Delete an interior node of t, or remove a boundary node and merge its segments."""
    for i in range(3):
        v = int(S.tri[t, i])
        kind = S.kind[v]
        if kind == 0:
            m = join_star(S, W, 0, v)
            if m > 0 and refill(S, W, m, PROGRAMME, fall, -1, -1, 0.5, -1, DELETION):
                return True
        elif kind == 1:
            m = join_star(S, W, 0, v)
            if m > 0 and refill(S, W, m, EITHER, fall, -1, -1, 0.5, v, REMOVAL):
                return True
    return False


@kernel
def try_insertions(S, W, t, fall):
    """Refill t and some of its neighbours, with or without a new node."""
    for mask in MASKS:
        m = around(S, W, t, mask)
        if m > 0 and refill(S, W, m, EITHER, fall, -1, -1, 0.5, -1, FLIP):
            return True
    return False


@kernel
def try_splits(S, W, t, beside, fall):
    """Split a boundary edge of t, with or without a new node inside; ``beside``: bit of a neighbour that joins."""
    for i in range(3):
        s = int(-1 - S.nbr[t, i])
        if s < 0 or S.mode[s] > 1:
            continue
        a = int(S.tri[t, (i + 1) % 3])
        for mask in MASKS:
            if mask & (1 << i):
                continue
            for third in range(3):
                m = around(S, W, t, mask | beside)
                share = 0.5 if third == 0 else (0.38 if third == 1 else 0.62)
                if m > 0 and refill(S, W, m, EITHER, fall, a, s, share, -1, SPLIT):
                    return True
    return False


@kernel
def try_collapses(S, W, t, fall):
    """Join two interior nodes of t into one."""
    for i in range(3):
        a, b = int(S.tri[t, i]), int(S.tri[t, (i + 1) % 3])
        if S.kind[a] == 0 and S.kind[b] == 0:
            m = join_star(S, W, 0, a)
            if m > 0:
                m = join_star(S, W, m, b)
            if m > 0 and refill(S, W, m, EITHER, fall, -1, -1, 0.5, -1, COLLAPSE):
                return True
    return False


@kernel
def try_wide(S, W, t, fall):
    """The star of an interior node of t with one more triangle outside it."""
    for i in range(3):
        v = int(S.tri[t, i])
        if S.kind[v] != 0:
            continue
        k, closed = star(S, W, v)
        if k > 12:
            continue
        for z in range(k):
            m = join_star(S, W, 0, v)
            inside = W.cavity[z]
            for j in range(3):
                if S.tri[inside, j] == v and S.nbr[inside, j] >= 0:
                    W.cavity[m] = S.nbr[inside, j]
                    m += 1
            if m > k and refill(S, W, m, EITHER, fall, -1, -1, 0.5, -1, COLLAPSE):
                return True
    return False


@kernel
def try_splits_beside(S, W, t, fall):
    """Split a boundary edge of a neighbour of t, t in the cavity."""
    for i in range(3):
        u = int(S.nbr[t, i])
        if u < 0:
            continue
        for j in range(3):
            if S.nbr[u, j] == t and try_splits(S, W, u, 1 << j, fall):
                return True
    return False


@kernel
def try_ring(S, W, t, fall):
    """Shift a node of the ring around a node of t."""
    for i in range(3):
        v = int(S.tri[t, i])
        if S.kind[v] > 1:
            continue
        k, closed = star(S, W, v)
        n = k if closed else k + 1
        for z in range(max(n, 0)):
            W.nodes[z] = W.ring[z]
        for z in range(max(n, 0)):
            if shift(S, W, W.nodes[z], fall):
                return True
    return False


@kernel
def mend(S, W, t, level, fall):
    """Try the moves on triangle t, the first that lowers the cost by ``fall`` is made; whether one was.

    Level 0: flips and shifts; 1: insertion, deletion, the boundary; 2: wider cavities. (The paper relocates, inserts,
    deletes, then turns to the boundary; flips come first here because they are the cheapest.)
    """
    if try_flips(S, W, t, fall) or try_shifts(S, W, t, fall):
        return True
    if level >= 1:
        if try_deletions(S, W, t, fall) or try_insertions(S, W, t, fall) or try_splits(S, W, t, 0, fall):
            return True
    if level >= 2:
        if try_collapses(S, W, t, fall) or try_wide(S, W, t, fall) or try_splits_beside(S, W, t, fall):
            return True
        return try_ring(S, W, t, fall)
    return False


@kernel
def patch_nodes(S, W, t, depth):
    """Nodes within ``depth`` rings of triangle t into W.nodes; their number. Rings are not walked at corners."""
    n = 0
    for i in range(3):
        W.nodes[n] = S.tri[t, i]
        n += 1
    low = 0
    for _ in range(depth):
        high = n
        for q in range(low, high):
            if S.kind[W.nodes[q]] > 1:
                continue
            k, closed = star(S, W, W.nodes[q])
            for z in range(k if closed else k + 1):
                known = False
                for w in range(n):
                    known = known or W.nodes[w] == W.ring[z]
                if not known and n < W.nodes.shape[0]:
                    W.nodes[n] = W.ring[z]
                    n += 1
        low = high
    return n


@kernel
def relax_patch(S, W, t, depth, sweeps):
    """Max-min relaxation of all nodes within ``depth`` rings of t, ``sweeps`` times at most."""
    n = patch_nodes(S, W, t, depth)
    for _ in range(sweeps):
        moved = False
        for q in range(n):
            v = W.nodes[q]
            if S.kind[v] == 0:
                moved = soften(S, W, v) or moved
            elif S.kind[v] == 1:
                moved = shift(S, W, v, 1e-4) or moved
        if not moved:
            break
