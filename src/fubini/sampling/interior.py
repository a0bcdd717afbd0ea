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

Float = NDArray[np.float64]
Table = NDArray[np.uint8]

#: Lattice nodes keep this distance (times the size) from boundary segments of full size.
CLEARANCE = 0.62


#: What a lattice node is (``Core.role``): outside the core, on its rim, of it alone.
OUTSIDE, RIM, INNER = 1, 2, 3


@dataclass(frozen=True)
class Core:
    """The part of a lattice far from the boundary: its triangles are known without a triangulator.

    Attributes
    ----------
    role : (rows, columns) uint8, 0 where the lattice has no node, else OUTSIDE, RIM or INNER.
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


def lattice_points(
    boundary: Boundary, size: float, gradient: float = 0.35, shift: tuple[float, float] = (0.0, 0.0)
) -> Float:
    """Lattice nodes (n, 2) of edge length ``size`` inside the boundary and clear of it, row by row.

    ``shift`` moves the origin of the lattice by fractions of ``size``. Where boundary segments are
    finer than the size, the zone in which the size grows (by ``gradient``) is left empty for the
    refinement to fill.
    """
    inside, place = _lattice(boundary, size, gradient, shift)
    return _positions(np.flatnonzero(inside), inside.shape[1], place)


def lattice_with_core(
    boundary: Boundary, size: float, gradient: float, shift: tuple[float, float], least: int
) -> tuple[Float, Core | None]:
    """Lattice nodes outside the core, and the core; all nodes and None where it has fewer than ``least`` triangles.

    A ring of lattice nodes or more lies between the core and the boundary. Every triangle of a lattice without
    gaps is Delaunay: its circle reaches 0.58 sizes, less than the nodes keep from the boundary.
    """
    inside, place = _lattice(boundary, size, gradient, shift)
    columns = inside.shape[1]
    core = _core(inside, place, least) if 2 * np.count_nonzero(inside) >= least else None
    outside = inside if core is None else core.role == OUTSIDE
    return _positions(np.flatnonzero(outside), columns, place), core


def _core(inside: Table, place: Float, least: int) -> Core | None:
    """The core of a lattice; None where it has fewer than ``least`` triangles."""
    deep = _eroded(inside)
    inner = _eroded(deep)
    near = _around(deep)
    in_triangle = np.zeros_like(deep)
    for rows, (middle, *ring) in near:
        some = ring[5] & ring[0]
        for k in range(5):
            some |= ring[k] & ring[k + 1]
        in_triangle[rows, 1:-1] = middle & some
    on_rim = np.flatnonzero(in_triangle > inner)
    columns = deep.shape[1]
    rim, count = _rim(deep.ravel(), on_rim, columns)
    nodes = int(np.count_nonzero(inner))
    triangles = 2 * nodes + count // 3  # each has three corners, and a node of the core alone has six triangles
    if triangles < least:
        return None
    return Core(inside + in_triangle + inner, place, _positions(on_rim, columns, place), rim, nodes, triangles)


def _rim(deep: Table, nodes: NDArray[np.intp], columns: int) -> tuple[NDArray[np.int32], int]:
    """Edges (k, 2) of the rim by numbers of its nodes, and how many corners of triangles lie there.

    ``deep`` is the table as one row, ``nodes`` (r,) the places in it of the nodes on the rim.
    """
    odd = (nodes // columns & 1)[:, None]
    right, left = columns + odd, columns - 1 + odd
    one = np.ones_like(odd)
    # counter-clockwise: right, up right, up left, left, down left, down right
    ring = nodes[:, None] + np.hstack([one, right, left, -one, odd - columns - 1, odd - columns])
    there = deep[ring] == 1
    triangle = there & np.roll(there, -1, axis=1)
    row, way = np.nonzero(triangle & ~np.roll(triangle, 1, axis=1))
    ends = np.searchsorted(nodes, ring[row, way])
    return np.column_stack([row, ends]).astype(np.int32), int(np.count_nonzero(triangle))


def _around(table: Table) -> list[tuple[slice, list[Table]]]:
    """Even rows, then odd rows, of a table without its rim: the rows, the nodes and their six neighbours in turn."""
    found = []
    for odd in (0, 1):
        first = 2 - odd
        rows = slice(first, -1, 2)
        row, up, down = table[rows], table[first + 1 :: 2], table[first - 1 : -2 : 2]
        a, b = slice(odd, odd - 2), slice(1 + odd, odd - 1 or None)
        found.append((rows, [row[:, 1:-1], row[:, 2:], up[:, b], up[:, a], row[:, :-2], down[:, a], down[:, b]]))
    return found


def _eroded(table: Table) -> Table:
    """Which nodes (rows, columns) have all six neighbours; none on the rim of the table."""
    out = np.zeros_like(table)
    for rows, (middle, *ring) in _around(table):
        part = out[rows, 1:-1]
        np.bitwise_and(middle, ring[0], out=part)
        for other in ring[1:]:
            part &= other
    return out


def _positions(nodes: NDArray[np.intp], columns: int, place: Float) -> Float:
    """Lattice nodes (n, 2) at these places of the table, row after row."""
    j, i = np.divmod(nodes, columns)
    x0, y0, h = place
    return np.column_stack([np.where(j & 1, x0 + 0.5 * h, x0) + i * h, y0 + j * (h * kernels.ROW)])


def _lattice(
    boundary: Boundary, size: float, gradient: float, shift: tuple[float, float]
) -> tuple[Table, Float]:
    """The table (rows, columns) of where lattice nodes are, 1 or 0, and x0, y0 and step of the lattice."""
    low, high = boundary.points.min(axis=0), boundary.points.max(axis=0)
    x0, y0 = low[0] - size * (1.0 + shift[0]), low[1] - size * (1.0 + shift[1])
    columns = math.ceil((high[0] - x0) / size) + 2
    rows = math.ceil((high[1] - y0) / (size * kernels.ROW)) + 2
    inside = np.zeros((rows, columns), np.uint8)
    kernels.mark_inside(
        boundary.points, boundary.segments, boundary.size, size, x0, y0, CLEARANCE, gradient, inside
    )
    return inside, np.array([x0, y0, size])
