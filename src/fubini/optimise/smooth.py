"""``smooth``: nodes moved and edges flipped until triangles are as near to equilateral as can be.

``even_out``: neighbouring triangles of about the same size.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from fubini.optimise._kernels_state import FILL, SMOOTH
from fubini.optimise.options import OptimiseOptions, implied_aspect_ratio
from fubini.optimise.state import NOTHING, build_state, new_state, read_state, started
from fubini.tracks import NO_TRACKS, Tracks
from fubini.triangulation.value import Triangulation

#: Rounds of sweeps and flips.
ROUNDS = 2
#: Room for nodes that are split.
SPARE = 500
#: Skewness (degrees) below which evening out brings no triangle, in each of its rounds.
KEPT_SKEW = (64.0, 62.0, 60.0, 58.0, 55.0, 50.0)


def smooth(triangulation: Triangulation, tracks: Tracks | None = None, rounds: int = ROUNDS) -> Triangulation:
    """Raise the mean quality: nodes move, edges are flipped to be Delaunay again, few nodes are split in two.

    All nodes move at once, towards a lower cost of the triangles around them (see ``_kernels_smooth``), and go back
    where one turned upside down; a node on the boundary moves along its curve, where its segments belong to this face
    alone, and not at all without ``tracks``. Splits give a triangle more to nodes that
    have too few for their angle (see ``_kernels_degrees``). The work is in proportion to the number of triangles.
    """
    options = OptimiseOptions(allow_splits=tracks is not None)
    state = new_state(triangulation, NO_TRACKS if tracks is None else tracks, options, SPARE)
    if not started(state, triangulation, options, FILL | SMOOTH, rounds=rounds)[1]:
        return triangulation
    return read_state(state, triangulation).mesh


def even_out(triangulation: Triangulation, options: OptimiseOptions) -> Triangulation:
    """Move interior nodes where triangles with a common edge differ in size by more than ``options.growth``.

    The size of a triangle is the mean length of its edges. A node moves only where that lessens the differences, and
    makes no triangle worse that is then below skewness 50 degrees, or below what the bounds of the options ask for.
    """
    return evened(triangulation, options)[0]


def evened(
    triangulation: Triangulation, options: OptimiseOptions, outside: NDArray[np.float64] = NOTHING
) -> tuple[Triangulation, int, float]:
    """``even_out``, then the number of pairs left that differ by more than the limit, and the longest edge.

    outside : sizes (k,) of the triangles beyond the boundary segments, 0 for none; empty for none at all.
    """
    state = build_state(triangulation, NO_TRACKS, options, 0, passing=True)
    found = read_state(state, triangulation, options.growth, kept_shapes(options), outside)
    if found.moves:
        old = triangulation
        triangulation = Triangulation(
            found.mesh.points, old.triangles, old.neighbours, old.boundary, old.unrecovered, old.dropped
        )
    return triangulation, found.left, found.longest


def least_kept(options: OptimiseOptions) -> float:
    """Shape, (Lmax^2 - Lmin^2) / 4 A, of the worst triangle that evening out makes."""
    return float(kept_shapes(options)[-1])


@functools.lru_cache(maxsize=16)
def kept_shapes(options: OptimiseOptions) -> NDArray[np.float64]:
    """Cotangents of the skewness below which evening out brings no triangle, in each of its rounds.

    At least so much that a triangle is within both bounds of the options, with a margin.
    """
    least = options.min_skew + 0.5
    while implied_aspect_ratio(least) > 0.99 * options.max_aspect_ratio and least < 89.0:
        least += 0.5
    return np.array([1.0 / math.tan(math.radians(max(least, skew))) for skew in KEPT_SKEW])
