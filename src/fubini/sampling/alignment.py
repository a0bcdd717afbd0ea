"""A lattice laid along the boundary: rows on the straight edge, and in its nodes, that suits most of the others.

Beside such an edge the triangles are equilateral; beside an edge that the lattice meets by chance they make up for the
difference. The lattice stays the hexagonal one, turned, moved, and its spacing that of the nodes on the edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.sampling import _kernels_alignment as kernels
from fubini.sampling.interior import Lattice, lattice_with_core
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
    best = np.empty(5)
    kernels.place(boundary.points, boundary.segments, boundary.track, kinds, size, np.empty((CANDIDATES, 6)), best)
    x, y, dx, dy, spacing = best.tolist()
    return Placement((x, y), (dx, dy), spacing)


def placed_lattice(boundary: Boundary, placement: Placement, gradient: float, least: int) -> Lattice:
    """The lattice of a placement inside the boundary; see ``lattice_with_core``."""
    spacing, direction, node = placement.spacing, placement.direction, placement.node
    return lattice_with_core(boundary, spacing, gradient, (0.0, 0.0), least, direction, node)
