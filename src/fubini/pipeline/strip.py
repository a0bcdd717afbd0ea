"""Large faces: only the strip along the boundary is triangulated, optimised and refined; the core is written down.

The rim of the core bounds the strip as frozen nodes and locked segments of no track, so that nothing there
changes and both parts fit together node by node.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fubini.sampling.interior import Core
from fubini.triangulation.value import FROZEN, LOCKED, Boundary, Triangulation

Float = NDArray[np.float64]


def strip_boundary(boundary: Boundary, lattice: Float, core: Core, size: float) -> Boundary:
    """Boundary of the strip: the face's, then the rim of the core with the strip on its left."""
    n, k, r = len(boundary.points), len(core.rim), len(core.on_rim)
    number = np.zeros(len(lattice), np.int32)
    number[core.on_rim] = n + np.arange(r, dtype=np.int32)
    return Boundary(
        points=np.concatenate([boundary.points, lattice[core.on_rim]]),
        kind=np.concatenate([boundary.kind, np.full(r, FROZEN, np.uint8)]),
        size=np.concatenate([boundary.size, np.full(r, size)]),
        angle=np.concatenate([boundary.angle, np.full(r, 180.0)]),
        segments=np.concatenate([boundary.segments, number[core.rim[:, ::-1]]]),
        track=np.concatenate([boundary.track, np.full(k, -1, np.int32)]),
        t=np.concatenate([boundary.t, np.zeros((k, 2))]),
        mode=np.concatenate([boundary.mode, np.full(k, LOCKED, np.uint8)]),
    )


def with_core(strip: Triangulation, lattice: Float, core: Core) -> Triangulation:
    """The strip and the core as one triangulation: boundary nodes, rim, inner nodes of the strip, of the core.

    ``strip`` comes from ``strip_boundary`` and may have split, merged and moved all but the rim, whose nodes and
    segments are still there in their order.
    """
    old = strip.boundary
    locked = old.track < 0
    on_rim = np.zeros(len(old.points), bool)
    on_rim[old.segments[locked]] = True
    real, rim = np.flatnonzero(~on_rim), np.flatnonzero(on_rim)
    order = np.concatenate([real, rim, np.arange(len(old.points), len(strip.points))])
    number = np.empty(len(order), np.int32)
    number[order] = np.arange(len(order), dtype=np.int32)
    of_lattice = np.empty(len(lattice), np.int32)
    of_lattice[core.on_rim] = number[rim]
    of_lattice[core.inside] = len(order) + np.arange(len(core.inside), dtype=np.int32)
    boundary = Boundary(
        old.points[real], old.kind[real], old.size[real], old.angle[real],
        number[old.segments[~locked]], old.track[~locked], old.t[~locked], old.mode[~locked],
    )  # fmt: skip
    return replace(
        strip,
        points=np.concatenate([strip.points[order], lattice[core.inside]]),
        triangles=np.concatenate([number[strip.triangles], of_lattice[core.triangles]]),
        neighbours=_neighbours(strip, core, locked),
        boundary=boundary,
    )


def _neighbours(strip: Triangulation, core: Core, locked: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Neighbours of the strip's triangles, then of the core's, across the rim as well."""
    m = len(strip.triangles)
    first, second = strip.neighbours.copy(), np.where(core.neighbours >= 0, core.neighbours + m, core.neighbours)
    t, side = np.nonzero(core.neighbours < 0)
    beyond = np.empty(len(core.rim), np.int64)  # core triangle at each edge of the rim
    beyond[-1 - core.neighbours[t, side]] = t
    u, i = np.nonzero(first < 0)
    code = -1 - first[u, i]
    across = locked[code]
    segment = np.cumsum(~locked) - 1
    rim = np.cumsum(locked) - 1
    first[u, i] = np.where(across, m + beyond[rim[code] * across], -1 - segment[code])
    behind = np.empty(len(core.rim), np.int64)  # strip triangle at each edge of the rim
    behind[rim[code[across]]] = u[across]
    second[t, side] = behind[-1 - core.neighbours[t, side]]
    return np.concatenate([first, second]).astype(np.int32)
