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
from fubini.triangulation.value import Boundary

#: Lattice nodes keep this distance (times the size) from boundary segments of full size.
CLEARANCE = 0.62


@dataclass(frozen=True)
class Core:
    """The part of a lattice far from the boundary: its triangles are known without a triangulator.

    Attributes
    ----------
    triangles : (m, 3) int32, lattice nodes.
    neighbours : (m, 3) int32 as in ``Triangulation``; -1 - k where edge k of the rim has no triangle across.
    rim : (k, 2) edges of the rim, the core on the left of each.
    on_rim, inside, outside : lattice nodes on the rim, of the core alone, and of no core triangle.
    """

    triangles: NDArray[np.int32]
    neighbours: NDArray[np.int32]
    rim: NDArray[np.int32]
    on_rim: NDArray[np.intp]
    inside: NDArray[np.intp]
    outside: NDArray[np.intp]


def lattice_points(
    boundary: Boundary, size: float, gradient: float = 0.35, shift: tuple[float, float] = (0.0, 0.0)
) -> NDArray[np.float64]:
    """Lattice nodes (n, 2) of edge length ``size`` inside the boundary and clear of it.

    ``shift`` moves the origin of the lattice by fractions of ``size``. Where boundary segments are
    finer than the size, the zone in which the size grows (by ``gradient``) is left empty for the
    refinement to fill.
    """
    return _lattice(boundary, size, gradient, shift)[0]


def lattice_with_core(
    boundary: Boundary, size: float, gradient: float, shift: tuple[float, float], least: int
) -> tuple[NDArray[np.float64], Core | None]:
    """Lattice nodes as ``lattice_points`` gives them, and the core, None where it has fewer than ``least`` triangles.

    Two rings of lattice nodes or more lie between the core and the boundary. Every triangle of a lattice without
    gaps is Delaunay: its circle reaches 0.58 sizes, less than the nodes keep from the boundary.
    """
    points, inside = _lattice(boundary, size, gradient, shift)
    if 2 * len(points) < least:
        return points, None
    deep = np.empty_like(inside)
    kernels.erode(inside, deep)
    twice = np.empty_like(inside)
    kernels.erode(deep, twice)
    number = np.cumsum(inside.ravel(), dtype=np.int32).reshape(inside.shape) - np.int32(1)
    triangles, neighbours = (np.empty((2 * int(twice.sum()) + 8, 3), np.int32) for _ in range(2))
    m, edges = kernels.core_triangles(twice, number, np.empty((2, *inside.shape), np.int32), triangles, neighbours)
    if m < least:
        return points, None
    triangles, neighbours = triangles[:m], neighbours[:m]
    t, side = np.nonzero(neighbours < 0)
    rim = np.empty((edges, 2), np.int32)
    rim[-1 - neighbours[t, side]] = np.column_stack([triangles[t, (side + 1) % 3], triangles[t, (side + 2) % 3]])
    role = np.zeros(len(points), np.uint8)
    role[triangles] = 2
    role[rim] = 1
    return points, Core(triangles, neighbours, rim, *(np.flatnonzero(role == k) for k in (1, 2, 0)))


def _lattice(
    boundary: Boundary, size: float, gradient: float, shift: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Lattice nodes (n, 2), row by row, and the table (rows, columns) of where they are."""
    low, high = boundary.points.min(axis=0), boundary.points.max(axis=0)
    x0, y0 = low[0] - size * (1.0 + shift[0]), low[1] - size * (1.0 + shift[1])
    columns = math.ceil((high[0] - x0) / size) + 2
    rows = math.ceil((high[1] - y0) / (size * kernels.ROW)) + 2
    return kernels.lattice(
        boundary.points, boundary.segments, boundary.size, size, x0, y0, columns, rows, CLEARANCE, gradient
    )
