"""Redundant triangles: those that a Delaunay triangulation of points puts outside the region."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.cells import Cell
from fubini.region import Region

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]


def by_limits(cells: Sequence[Cell], points: ArrayLike, triangles: ArrayLike) -> Bool:
    """Which triangles (m, 3) have their centroid outside the limits a, b, r, s of every cell."""
    centers = _centroids(points, triangles)
    outside = np.ones(len(centers), dtype=bool)
    for cell in cells:
        left = np.flatnonzero(outside)
        outside[left] = ~cell.contains(centers[left])
    return outside


def by_polygon(loops: Sequence[ArrayLike], points: ArrayLike, triangles: ArrayLike) -> Bool:
    """Which triangles (m, 3) have their centroid outside the polygon, the outer loop (k, 2) first."""
    return ~Region.polygon(loops[0], loops[1:]).contains(_centroids(points, triangles), 0.0)


def _centroids(points: ArrayLike, triangles: ArrayLike) -> Float:
    p = np.asarray(points, float)
    return p[np.asarray(triangles)].mean(axis=1)
