"""The moves: which cavities are tried around a flawed triangle, cheap ones before dear ones.

Every possible move on a triangle has a number; ``propose`` fills in the job of a number, ``mend`` does it where
the cost falls. One place does all, because the code of a kernel is compiled anew into each of its callers.
"""

from __future__ import annotations

from fubini._jit import inner
from fubini.optimise._kernels_cavity import local, replace, star
from fubini.optimise._kernels_fill import EITHER, PROGRAMME
from fubini.optimise._kernels_quality import cost_of, quality
from fubini.optimise._kernels_relocate import look_again, relocate, slide
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
#: where a boundary edge is split
SHARES = (0.5, 0.38, 0.62)
#: first number of each class of moves: flips, shifts, deletions, insertions, splits, collapses, wide cavities,
#: splits beside, shifts of the ring; from the last on, gentle shifts of the nodes ``W.nodes``
CLASSES = (0, 3, 6, 9, 17, 89, 92, 128, 200, 272)
#: end of the moves of levels 0, 1, 2
LEVELS = (6, 89, 272)
WIDEST = 12
RING = 24

# entries of W.job: what to do, and with what
NOTHING, REPLACE, SHIFT = 0, 1, 2
WHAT, SIZE, FILLS, START, SEGMENT, SHARE, DROPPED, MOVE, NODE = range(9)


@inner
def around(S, W, t, mask):
    """Cavity of triangle t and its neighbours across the edges of ``mask``; its size, or 0 at the boundary."""
    W.cavity[0] = t
    m = 1
    for i in range(3):
        if mask & (1 << i):
            u = S.nbr[t, i]
            if u < 0:
                return 0
            W.cavity[m] = u
            m += 1
    return m


@inner
def join_star(S, W, m, v):
    """Add the triangles around node v to the cavity of m triangles; the new size, or 0 when it is too large."""
    k, closed = star(S, W, v)
    if k < 0:
        return 0
    for q in range(k):
        known = False
        for z in range(m):
            known = known or W.cavity[z] == W.fan[q]
        if not known:
            if m >= LIMIT - 6:
                return 0
            W.cavity[m] = W.fan[q]
            m += 1
    return m


@inner
def job(W, m, fills, move):
    """Note that a cavity of m triangles is to be refilled, if m > 0."""
    W.job[WHAT] = REPLACE if m > 0 else NOTHING
    W.job[SIZE], W.job[FILLS], W.job[MOVE] = m, fills, move
    W.job[START] = W.job[SEGMENT] = W.job[DROPPED] = -1
    W.job[SHARE] = 0


@inner
def propose_split(S, W, t, c, beside):
    """Split a boundary edge of t: 24 numbers an edge; ``beside``: bits of neighbours that join in any case."""
    i, rest = c // 24, c % 24
    mask, share = MASKS[rest // 3], rest % 3
    job(W, 0, EITHER, SPLIT)
    s = -1 - S.nbr[t, i]
    if s < 0 or S.mode[s] > 1 or mask & (1 << i) or mask & beside:
        return
    job(W, around(S, W, t, mask | beside), EITHER, SPLIT)
    W.job[START], W.job[SEGMENT], W.job[SHARE] = S.tri[t, (i + 1) % 3], s, share


@inner
def propose_wide(S, W, t, c):
    """The star of an interior node of t with one more triangle outside it: WIDEST numbers a node."""
    v = S.tri[t, c // WIDEST]
    job(W, 0, EITHER, COLLAPSE)
    if S.kind[v] != 0:
        return
    m = join_star(S, W, 0, v)
    if c % WIDEST >= m or m > WIDEST:
        return
    inside = W.cavity[c % WIDEST]
    u = S.nbr[inside, local(S, inside, v)]
    if u >= 0:
        W.cavity[m] = u
        job(W, m + 1, EITHER, COLLAPSE)


@inner
def propose_split_beside(S, W, t, c):
    """Split a boundary edge of a neighbour of t, t in the cavity: 24 numbers a neighbour."""
    i, rest = c // 24, c % 24
    u = S.nbr[t, i]
    job(W, 0, EITHER, SPLIT)
    if u < 0:
        return
    for j in range(3):
        if S.nbr[u, j] == t:
            edge = (j + 1 + rest // 12) % 3
            propose_split(S, W, u, 24 * edge + 2 * (rest % 12), 1 << j)


@inner
def propose_ring(S, W, t, c):
    """Shift a node of the ring around a node of t: RING numbers a node."""
    W.job[WHAT] = NOTHING
    v = S.tri[t, c // RING]
    if S.kind[v] > 1:
        return
    k, closed = star(S, W, v)
    if c % RING < (k if closed else k + 1):
        W.job[WHAT], W.job[NODE] = SHIFT, W.ring[c % RING]


@inner
def propose_near(S, W, t, c):
    """The moves of levels 0 and 1 but splits."""
    if c < CLASSES[1]:
        job(W, around(S, W, t, 1 << c), PROGRAMME, FLIP)
    elif c < CLASSES[2]:
        W.job[WHAT], W.job[NODE] = SHIFT, S.tri[t, c - CLASSES[1]]
    elif c < CLASSES[3]:
        v = S.tri[t, c - CLASSES[2]]
        kind = S.kind[v]
        m = join_star(S, W, 0, v) if kind <= 1 else 0
        job(W, m, PROGRAMME if kind == 0 else EITHER, DELETION if kind == 0 else REMOVAL)
        if kind == 1:
            W.job[DROPPED] = v
    else:
        job(W, around(S, W, t, MASKS[c - CLASSES[3]]), EITHER, FLIP)


@inner
def propose(S, W, t, c):
    """Fill W.job with move number c on triangle t; WHAT is NOTHING where there is no such move."""
    if c < CLASSES[4]:
        propose_near(S, W, t, c)
    elif c < CLASSES[5]:
        propose_split(S, W, t, c - CLASSES[4], 0)
    elif c < CLASSES[6]:
        a, b = S.tri[t, c - CLASSES[5]], S.tri[t, (c - CLASSES[5] + 1) % 3]
        m = join_star(S, W, 0, a) if S.kind[a] == 0 and S.kind[b] == 0 else 0
        job(W, join_star(S, W, m, b) if m > 0 else 0, EITHER, COLLAPSE)
    elif c < CLASSES[7]:
        propose_wide(S, W, t, c - CLASSES[6])
    elif c < CLASSES[8]:
        propose_split_beside(S, W, t, c - CLASSES[7])
    elif c < CLASSES[9]:
        propose_ring(S, W, t, c - CLASSES[8])
    else:
        W.job[WHAT], W.job[NODE] = SHIFT, W.nodes[c - CLASSES[9]]


@inner
def cost_at(S, a, b, c):
    """Cost of the triangle of nodes a, b, c that fills no sharp corner."""
    p = S.points
    return cost_of(quality(p[a, 0], p[a, 1], p[b, 0], p[b, 1], p[c, 0], p[c, 1], S.rule), S.rule)


@inner
def may_flip(S, t, i, fall):
    """Whether the cost may fall by more than ``fall`` when edge i of t is flipped: a look before ``replace``.

    Says yes beside sharp corners, whose triangles have costs of their own.
    """
    u = S.nbr[t, i]
    j = 0 if S.nbr[u, 0] == t else (1 if S.nbr[u, 1] == t else 2)
    p, a, b, d = S.tri[t, i], S.tri[t, (i + 1) % 3], S.tri[t, (i + 2) % 3], S.tri[u, j]
    if S.sharp[p] + S.sharp[a] + S.sharp[b] + S.sharp[d] > 0:
        return True
    old = cost_at(S, p, a, b) + cost_at(S, d, b, a)
    return cost_at(S, p, a, d) + cost_at(S, p, d, b) < old - fall + 1e-9


@inner
def mend(S, W, t, first, last, fall, every):
    """Do the first of the moves ``first <= c < last`` on triangle t that lowers the cost by more than ``fall``.

    ``every``: do all of them that do. Returns the number done. Level 0 holds flips and shifts; 1: deletion,
    insertion, the boundary; 2: wider cavities. (The paper relocates, inserts, deletes, then turns to the boundary;
    flips come first here because they are the cheapest.)
    """
    number = 0
    for c in range(first, last):
        propose(S, W, t, c)
        if W.job[WHAT] == NOTHING:
            continue
        S.counts[ATTEMPTS] += 1
        if c < CLASSES[1] and not may_flip(S, t, c, fall):
            continue
        if W.job[WHAT] == SHIFT:
            v = W.job[NODE]
            if S.kind[v] == 0:
                done = relocate(S, W, v, fall, c >= CLASSES[9])
            else:
                done = S.kind[v] == 1 and slide(S, W, v, fall)
            if done:
                look_again(S, W, v)
        else:
            done, starred = replace(
                S, W, W.job[SIZE], W.job[FILLS], fall,
                W.job[START], W.job[SEGMENT], SHARES[W.job[SHARE]], W.job[DROPPED],
            )  # fmt: skip
            if done:
                S.counts[INSERTION if starred and W.job[MOVE] == FLIP else W.job[MOVE]] += 1
        if done:
            number += 1
            if not every:
                break
    return number


@inner
def patch_nodes(S, W, t, depth):
    """Nodes within ``depth`` rings of triangle t into W.nodes; their number. Rings are not walked at corners."""
    n = 3
    for i in range(3):
        W.nodes[i] = S.tri[t, i]
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
