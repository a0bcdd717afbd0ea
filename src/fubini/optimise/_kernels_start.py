"""What happens to a triangulation before it is searched for flaws, in one kernel: each call from Python costs time."""

from __future__ import annotations

import math

from fubini._jit import kernel
from fubini.optimise._kernels_copy import derive, fill
from fubini.optimise._kernels_refine import advance
from fubini.optimise._kernels_smooth import smooth
from fubini.optimise._kernels_state import ADVANCE, DONE, FILL, FULL, PREPARE, SMOOTH
from fubini.optimise._kernels_words import state_of, work_of


@kernel
def start(
    S, W, tasks, points, triangles, neighbours, kind, track, t, mode, seed, size, angle, own, acute, unavoidable,
    most, gradient, limit, enough, rounds,
):  # fmt: skip
    """Fill a state, insert points, smooth, and derive what the moves need. Status, DONE or FULL; changes by smoothing.

    tasks : FILL writes the triangulation into the state, with ``size`` wanted at its first nodes and ``most`` at the
    others (see ``derive``). ADVANCE inserts points up to size ``most`` and ``limit``, and ``enough`` triangles (0 for
    as many as ``advance`` finds right); after FULL the state needs larger arrays, and all tasks but FILL are to do.
    SMOOTH takes that many ``rounds``. PREPARE derives sizes anew, from those that the boundary has by itself, ``own``.
    """
    S, W = state_of(S), work_of(W)
    moved = 0
    if tasks & FILL:
        fill(S, points, triangles, neighbours, kind, track, t, mode, seed)
        derive(S, size, angle, most, acute, unavoidable)
    if tasks & ADVANCE and advance(S, W, most, gradient, limit, enough) == FULL:
        return FULL, moved
    if tasks & SMOOTH:
        moved = smooth(S, W, kind.shape[0], rounds)
    if tasks & PREPARE:
        derive(S, own, angle, math.inf, acute, unavoidable)
    return DONE, moved
