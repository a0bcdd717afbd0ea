"""``refine``: interior points where the boundary is finer than what lies inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fubini.errors import OptionError
from fubini.optimise._kernels_state import ADVANCE, FILL, FULL, INSERTED, NODES, PREPARE, SMOOTH, TRIANGLES, State
from fubini.optimise.options import OptimiseOptions
from fubini.optimise.state import extend_state, new_state, started
from fubini.tracks import Tracks
from fubini.triangulation.value import Triangulation


def refine(
    triangulation: Triangulation,
    tracks: Tracks,
    h: float,
    gradient: float = 0.35,
    size: ArrayLike | None = None,
) -> Triangulation:
    """Insert interior points until every triangle meets the graded size; the boundary stays as it is.

    The size wanted at a place is the least of ``h`` and ``size_i + gradient * distance`` over the nodes. Points
    are placed frontally, from the boundary inwards, so that triangles come out nearly equilateral; there may
    be no interior points at all to begin with.

    Parameters
    ----------
    triangulation : constrained Delaunay.
    tracks : of the region (nothing is evaluated: no boundary node is made).
    h : largest wanted edge length.
    gradient : growth of the size with distance.
    size : (n,) wanted edge length at all nodes; None: the boundary's own, ``h`` inside.

    Returns
    -------
    The triangulation, the new points behind the old ones.
    """
    state, _ = advanced(triangulation, tracks, h, gradient, size, OptimiseOptions())
    n, m = int(state.counts[NODES]), int(state.counts[TRIANGLES])
    if state.counts[INSERTED] == 0:
        return triangulation
    return Triangulation(
        points=state.points[:n],
        triangles=state.tri[:m],
        neighbours=state.nbr[:m],
        boundary=triangulation.boundary,
        unrecovered=triangulation.unrecovered,
    )


def advanced(
    triangulation: Triangulation,
    tracks: Tracks,
    h: float,
    gradient: float,
    size: ArrayLike | None,
    options: OptimiseOptions,
    rounds: int = 0,
    core: tuple[int, float] | None = None,
) -> tuple[State, int]:
    """The state that holds the refined triangulation; nothing of it is removed or renumbered.

    With ``rounds`` smoothed so many times, and ready for the moves: sizes inside are then mean lengths of edges, the
    state is one that passes (``new_state``). How many changes smoothing made comes second.
    """
    if not (h > 0.0 and gradient > 0.0):
        raise OptionError(f"size {h} and gradient {gradient} must be positive")
    sizes = None if size is None else np.array(size, float)
    state = new_state(triangulation, tracks, options, len(triangulation.points) + 500, passing=rounds > 0)
    todo = ADVANCE | SMOOTH | PREPARE if rounds else ADVANCE
    status, changes = started(state, triangulation, options, FILL | todo, h, sizes, gradient, rounds, core)
    while status == FULL:
        state = extend_state(state, 2 * len(state.points))
        status, changes = started(state, triangulation, options, todo, h, sizes, gradient, rounds, core)
    return state, changes
