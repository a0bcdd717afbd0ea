"""Interior points: the hexagonal lattice, laid into horizontal slices of the region.

Every slice between two constant lines maps the reference family SP(n, m) by Eq. (1) with constant
limits, an affine map, so that the rows of neighbouring slices line up and the lattice stays
undistorted; the limit functions of the slice decide which points are inside.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fubini._values import value
from fubini.sampling._kernels_alignment import BEST, NODE, SHIFT
from fubini.sampling._kernels_interior import write_core
from fubini.sampling._kernels_lattice import lay_divided
from fubini.triangulation.value import Boundary, Patch

Float = NDArray[np.float64]
Table = NDArray[np.uint8]

#: Lattice nodes keep this distance (times the size) from boundary segments of full size.
CLEARANCE = 0.62
#: More triangles than any core has.
NO_CORE = 2**62


@value(frozen=True)
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
        write_core(self.role, self.place, axes, scratch, rim, inner, points, triangles)


@value(frozen=True)
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
    direction, spacing : of the rows, a unit vector, and of the nodes on them.
    """

    points: Float
    core: Core | None
    patch: Patch
    direction: tuple[float, float]
    spacing: float


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
    how, at = (SHIFT, shift) if node is None else (NODE, node)
    given, no_kinds = np.array([*at, *direction, size, 0.0, 0.0]), np.empty(0, np.int32)
    return _laid(boundary, how, given, no_kinds, size, gradient, least)


def best_lattice(
    boundary: Boundary, kinds: NDArray[np.int32], size: float, gradient: float, least: int = NO_CORE
) -> Lattice:
    """The lattice of about ``size`` that leaves least to make up for at the boundary.

    A row lies on the straight edge, and in its nodes, that suits most of the others: beside such an edge the triangles
    are equilateral; beside one that the lattice meets by chance they make up for the difference. The lattice stays the
    hexagonal one, turned, moved, its spacing that of the nodes on the edge. Where no straight edge has two segments of
    about full size the rows run along x, from the lowest corner of the bounding box. ``kinds`` (c,) : of the tracks.
    """
    return _laid(boundary, BEST, np.empty(7), kinds, size, gradient, least)


def _laid(
    boundary: Boundary, how: int, lattice: Float, kinds: NDArray[np.int32], size: float, gradient: float, least: int
) -> Lattice:
    """The lattice that ``lay`` is told, divided."""
    points, segments = boundary.points, boundary.segments
    role, core, nodes, inner, on_rim, rim, triangles, neighbours, half_edges, bare, hanging, strip, ends = lay_divided(
        points, segments, boundary.size, boundary.track, kinds, how, lattice, size, CLEARANCE, gradient, least
    )
    _, _, c, s, spacing, x0, y0 = lattice.tolist()
    patch = Patch(triangles, neighbours, half_edges, bare, hanging, strip, ends)
    far = Core(role, np.array([x0, y0, spacing]), on_rim, rim, nodes, core, (c, s)) if core else None
    return Lattice(inner, far, patch, (c, s), spacing)
