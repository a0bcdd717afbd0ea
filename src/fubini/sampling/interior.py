"""Interior points: the hexagonal lattice, laid into horizontal slices of the region.

Every slice between two constant lines maps the reference family SP(n, m) by Eq. (1) with constant
limits, an affine map, so that the rows of neighbouring slices line up and the lattice stays
undistorted; the limit functions of the slice decide which points are inside.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fubini.sampling import _kernels_interior as kernels
from fubini.triangulation.value import Boundary

#: Lattice nodes keep this distance (times the size) from boundary segments of full size.
CLEARANCE = 0.62


def lattice_points(
    boundary: Boundary, size: float, gradient: float = 0.35, shift: tuple[float, float] = (0.0, 0.0)
) -> NDArray[np.float64]:
    """Lattice nodes (n, 2) of edge length ``size`` inside the boundary and clear of it.

    ``shift`` moves the origin of the lattice by fractions of ``size``. Where boundary segments are
    finer than the size, the zone in which the size grows (by ``gradient``) is left empty for the
    refinement to fill.
    """
    low, high = boundary.points.min(axis=0), boundary.points.max(axis=0)
    x0, y0 = low[0] - size * (1.0 + shift[0]), low[1] - size * (1.0 + shift[1])
    columns = math.ceil((high[0] - x0) / size) + 2
    rows = math.ceil((high[1] - y0) / (size * kernels.ROW)) + 2
    return kernels.lattice(
        boundary.points, boundary.segments, boundary.size, size, x0, y0, columns, rows, CLEARANCE, gradient
    )
