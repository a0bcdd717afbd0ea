"""What happens to a triangulation before it is searched for flaws, in one kernel: each call from Python costs time."""

from __future__ import annotations

import math

from fubini._jit import kernel
from fubini.optimise._kernels_copy import derive, fill
from fubini.optimise._kernels_refine import advance, most_of
from fubini.optimise._kernels_smooth import smooth
from fubini.optimise._kernels_state import ADVANCE, DONE, FILL, FULL, PREPARE, ROOM, SMOOTH, THINNED, TRIANGLES
from fubini.optimise._kernels_thin import thin
from fubini.optimise._kernels_words import state_of, work_of

#: Where a face has more triangles than it may, nodes are taken out down to this share of those: some are split later.
ENOUGH = 0.98


@kernel
def start(
    S, W, tasks, points, triangles, neighbours, kind, track, t, mode, seed, size, angle, own, acute, unavoidable,
    most, gradient, limit, core, beside, rounds,
):  # fmt: skip
    """Fill a state, insert points, smooth, and derive what the moves need. Status, DONE or FULL; changes by smoothing.

    tasks : FILL writes the triangulation into the state, with ``size`` wanted at its first nodes and ``most`` at the
    others (see ``derive``). ADVANCE inserts points up to size ``most`` and ``limit``, and takes out nodes where that
    makes more than ``most_of`` ``core`` and ``beside``; after FULL the state needs larger arrays, and all tasks but
    FILL are to do.
    SMOOTH takes that many ``rounds``. PREPARE derives sizes anew, from those that the boundary has by itself, ``own``.
    """
    S, W = state_of(S), work_of(W)
    moved = 0
    if tasks & FILL:
        fill(S, points, triangles, neighbours, kind, track, t, mode, seed)
        derive(S, size, angle, most, acute, unavoidable)
    if tasks & ADVANCE:
        if advance(S, W, most, gradient, limit) == FULL:
            return FULL, moved
        fair = most_of(S.counts[ROOM], core, beside)
        if S.counts[TRIANGLES] > fair:
            S.counts[THINNED] = thin(S, W, int(ENOUGH * fair))
    if tasks & SMOOTH:
        moved = smooth(S, W, kind.shape[0], rounds)
    if tasks & PREPARE:
        derive(S, own, angle, math.inf, acute, unavoidable)
    return DONE, moved
