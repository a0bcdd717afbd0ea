"""A lattice laid along the boundary: rows on the straight edge, and in its nodes, that suits most of the others.

Beside such an edge the triangles are equilateral; beside an edge that the lattice meets by chance they make up for the
difference. The lattice stays the hexagonal one, turned, moved, and its spacing that of the nodes on the edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fubini.sampling import _kernels_alignment as kernels
from fubini.sampling._kernels_interior import ROW
from fubini.sampling.interior import Core, lattice_with_core
from fubini.triangulation.value import Boundary

Float = NDArray[np.float64]

#: Straight edges whose lattices are compared.
CANDIDATES = 6


@dataclass(frozen=True)
class Placement:
    """A hexagonal lattice in the plane: one node, the unit direction of its rows, its spacing."""

    node: tuple[float, float]
    direction: tuple[float, float]
    spacing: float


def best_placement(boundary: Boundary, kinds: NDArray[np.int32], size: float) -> Placement:
    """The lattice of about ``size`` that leaves least to make up for at the boundary.

    ``kinds`` (c,) tells the kinds of the tracks. Where no straight edge has two segments of about full size the rows
    run along x, from the lowest corner of the bounding box.
    """
    low = boundary.points.min(axis=0) - size
    best = np.array([*low, 1.0, 0.0, size])
    kernels.place(
        boundary.points, boundary.segments, boundary.track, kinds, size, np.empty((CANDIDATES, 6)), best
    )
    x, y, dx, dy, spacing = best.tolist()
    return Placement((x, y), (dx, dy), spacing)


def placed_lattice(
    boundary: Boundary, placement: Placement, gradient: float, least: int
) -> tuple[Float, Core | None]:
    """Nodes of a placed lattice inside the boundary, outside its core, and the core; see ``lattice_with_core``."""
    dx, dy = placement.direction
    turned = replace(boundary, points=_turn(boundary.points, dx, -dy))
    node = _turn(np.array([placement.node]), dx, -dy)[0]
    inner, core = lattice_with_core(
        turned, placement.spacing, gradient, _shift(node - turned.points.min(axis=0), placement.spacing), least
    )
    if core is not None:
        core = replace(core, on_rim=_turn(core.on_rim, dx, dy), direction=placement.direction)
    return _turn(inner, dx, dy), core


def _turn(points: Float, c: float, s: float) -> Float:
    """Points (n, 2) turned by the angle of cosine c and sine s; as they are at none."""
    if s == 0.0 and c == 1.0:
        return points
    x, y = points.T
    return np.column_stack([c * x - s * y, s * x + c * y])


def _shift(node: Float, spacing: float) -> tuple[float, float]:
    """The shift of ``lattice_with_core`` that puts a node at ``node`` over the lowest corner of the bounding box."""
    x, y = (node / spacing).tolist()
    row = math.ceil((1.0 + y) / ROW - 1e-9)
    column = math.ceil(1.0 + x - 0.5 * (row % 2) - 1e-9) + 0.5 * (row % 2)
    return column - 1.0 - x, row * ROW - 1.0 - y
