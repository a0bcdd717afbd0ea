"""Constrained Delaunay triangulation of a region."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.errors import FubiniError, GeometryError, OptionError
from fubini.triangulation._kernels_cdt import NOT_A_POINT, NOT_DELAUNAY, NOT_FINITE, triangulate
from fubini.triangulation.value import Boundary, Patch, Triangulation

#: Edges between nodes of a patch, where there is none; nodes and triangles of one, neighbours of these, open edges.
NO_EDGES = np.empty((0, 2), np.int32)
NO_PATCH = np.empty(0, np.int32), np.empty((0, 3), np.int32), np.empty((0, 3), np.int32), np.empty(0, np.int32)


def constrained_delaunay(points: ArrayLike, boundary: Boundary) -> Triangulation:
    """Triangulate the region on the left of the boundary's segments with the given points.

    The result holds every segment as an edge of one triangle, and each triangle's circle holds no vertex that
    can be seen from inside the triangle. Of cocircular points any triangulation may come out, always the
    same.

    Parameters
    ----------
    points : (n, 2), the boundary's nodes first and in its order, then interior points.
    boundary : nodes and segments of the region.

    Returns
    -------
    Triangulation. ``dropped`` names interior points that are left out, because they equal an earlier point or
    lie outside the region; ``unrecovered`` names segments that could not be made edges, because a point lies
    on them, they cross another segment, or an end equals another point.

    Raises
    ------
    GeometryError : all segments are edges and yet enclose no region (loops open or of the wrong sense).
    OptionError : points that are not finite, or fewer than the boundary has.
    """
    xy = np.array(points, np.float64, order="C", ndmin=2)
    fixed = len(boundary.points)
    if xy.ndim != 2 or xy.shape[1:] != (2,) or len(xy) < max(fixed, 3):
        raise OptionError(f"points must be (n, 2) with n >= {max(fixed, 3)}, not {xy.shape}")
    segments = np.array(boundary.segments, np.int32, order="C")
    triangles, neighbours, dropped, unrecovered, status = triangulate_all(xy, segments, fixed)
    if status & NOT_FINITE:
        raise OptionError("points must be finite")
    if status & NOT_A_POINT:
        raise OptionError("segments must be indices of points")
    if status & NOT_DELAUNAY:
        raise FubiniError("the triangulation did not become Delaunay within its budget of flips", at=xy[0])
    if status and not len(unrecovered):
        raise GeometryError(
            "the segments do not enclose a region on their left",
            at=xy[segments[0, 0]],
            fix="close the loops; outer loop counter-clockwise, holes clockwise",
        )
    if len(dropped):
        xy = np.delete(xy, dropped, axis=0)
    for array in (xy, triangles, neighbours, dropped, unrecovered):
        array.flags.writeable = False
    return Triangulation(xy, triangles, neighbours, boundary, unrecovered, dropped)


def delaunay_around(points: NDArray[np.float64], boundary: Boundary, outer: Boundary, patch: Patch) -> Triangulation:
    """``constrained_delaunay`` where a patch is known: the rest alone is triangulated.

    outer : the part of the boundary that does not lie at the patch: the first nodes and segments of ``boundary``, those
    that the patch was made for.
    """
    triangles, neighbours, dropped, unrecovered, status = triangulate(
        patch.points, patch.segments, len(outer.points), len(outer.segments), patch.hanging,
        patch.nodes, patch.triangles, patch.neighbours, patch.open,
    )  # fmt: skip
    if status or len(dropped) or len(unrecovered):
        return constrained_delaunay(points, boundary)
    return Triangulation(points, triangles, neighbours, boundary)


def triangulate_all(points: NDArray[np.float64], segments: NDArray[np.int32], fixed: int) -> Any:
    """``triangulated`` (``_kernels_cdt``) where nothing is known."""
    return triangulate(points, segments, fixed, len(segments), NO_EDGES, *NO_PATCH)
