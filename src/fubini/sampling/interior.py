"""Interior points: the hexagonal lattice, laid into horizontal slices of the region.

Every slice between two constant lines maps the reference family SP(n, m) by Eq. (1) with constant
limits, an affine map, so that the rows of neighbouring slices line up and the lattice stays
undistorted; the limit functions of the slice decide which points are inside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.sampling import _kernels_interior as kernels
from fubini.sampling._kernels_core import divide
from fubini.triangulation.value import Boundary, Patch

Float = NDArray[np.float64]
Table = NDArray[np.uint8]

#: Lattice nodes keep this distance (times the size) from boundary segments of full size.
CLEARANCE = 0.62
#: More triangles than any core has.
NO_CORE = 2**62


@dataclass(frozen=True)
class Core:
    """The part of a lattice far from the boundary: its triangles are known without a triangulator.

    Attributes
    ----------
    role : (rows, columns) uint8, NONE, OUTSIDE, RIM or INNER (``_kernels_core``).
    place : (3,), x0, y0 and step of the lattice.
    on_rim : (r, 2) nodes of the rim, row by row.
    rim : (k, 2) int32, edges of the rim by numbers of its nodes, the core on the left of each.
    nodes, triangles : how many nodes it has beside the rim, and how many triangles.
    direction : (2,) of the rows, a unit vector; ``place`` is in axes turned that way, ``on_rim`` in those of the plane.
    """

    role: NDArray[np.uint8]
    place: Float
    on_rim: Float
    rim: NDArray[np.int32]
    nodes: int
    triangles: int
    direction: tuple[float, float] = (1.0, 0.0)

    def write(self, axes: Float, rim: int, inner: int, points: Float, triangles: NDArray[np.int32]) -> None:
        """Write nodes (nodes, 3) and triangles (triangles, 3) into parts of larger arrays.

        axes : (3, 3), origin and axes of the plane in space. rim, inner : numbers of the first node of the rim and of
        the first of the core alone; each kind goes row by row.
        """
        scratch = np.empty((2, self.role.shape[1]), np.int32)
        c, s = self.direction
        axes = np.array([axes[0], c * axes[1] + s * axes[2], c * axes[2] - s * axes[1]])
        kernels.write_core(self.role, self.place, axes, scratch, rim, inner, points, triangles)


@dataclass(frozen=True)
class Lattice:
    """The nodes of a lattice inside a boundary and clear of it, and the triangles that they are known to make.

    A ring of nodes or more lies between the core and the boundary. Every triangle of a lattice without
    gaps is Delaunay: its circle reaches 0.58 sizes, less than the nodes keep from the boundary.

    Attributes
    ----------
    points : (n, 2) nodes outside the core, row by row.
    core : None where it would have fewer triangles than asked.
    patch : the triangles of these nodes and those on the rim of the core. Nodes are numbered: the boundary's, then
        the rim's, then ``points``; segments: the boundary's, then the rim's.
    """

    points: Float
    core: Core | None
    patch: Patch


def lattice_points(
    boundary: Boundary, size: float, gradient: float = 0.35, shift: tuple[float, float] = (0.0, 0.0)
) -> Float:
    """Lattice nodes (n, 2) of edge length ``size`` inside the boundary and clear of it, row by row.

    ``shift`` moves the origin of the lattice by fractions of ``size``. Where boundary segments are
    finer than the size, the zone in which the size grows (by ``gradient``) is left empty for the
    refinement to fill.
    """
    return lattice_with_core(boundary, size, gradient, shift, NO_CORE).points


def lattice_with_core(
    boundary: Boundary,
    size: float,
    gradient: float,
    shift: tuple[float, float],
    least: int,
    direction: tuple[float, float] = (1.0, 0.0),
    node: tuple[float, float] | None = None,
) -> Lattice:
    """``lattice_points`` with a core, if it has ``least`` triangles, and with rows along ``direction``, a unit vector.

    ``node`` : where a node of the lattice is to lie; ``shift`` is not used then.
    """
    c, s = direction
    turned = np.empty_like(boundary.points)
    low_x, low_y, high_x, high_y = kernels.turned_box(boundary.points, c, -s, turned)
    if node is not None:
        shift = _shift((c * node[0] + s * node[1] - low_x) / size, (c * node[1] - s * node[0] - low_y) / size)
    x0, y0 = low_x - size * (1.0 + shift[0]), low_y - size * (1.0 + shift[1])
    columns = math.ceil((high_x - x0) / size) + 2
    rows = math.ceil((high_y - y0) / (size * kernels.ROW)) + 2
    role = np.zeros((rows, columns), np.uint8)
    kernels.mark_inside(turned, boundary.segments, boundary.size, size, x0, y0, CLEARANCE, gradient, role)
    cells = role.reshape(-1)
    ends = np.flatnonzero(cells[1:] != cells[:-1])
    place = np.array([x0, y0, size, c, s])
    core, nodes, points, on_rim, rim, triangles, neighbours, half_edges, bare, edges = divide(
        cells, columns, ends, least, len(turned), len(boundary.segments), place
    )
    patch = Patch(triangles, neighbours, half_edges, bare, edges)
    return Lattice(points, Core(role, place[:3], on_rim, rim, nodes, core, direction) if core else None, patch)


def _shift(x: float, y: float) -> tuple[float, float]:
    """The shift that puts a node at (x, y), in sizes from the lowest corner of the bounding box."""
    row = math.ceil((1.0 + y) / kernels.ROW - 1e-9)
    column = math.ceil(1.0 + x - 0.5 * (row % 2) - 1e-9) + 0.5 * (row % 2)
    return column - 1.0 - x, row * kernels.ROW - 1.0 - y
