"""The triangulation as a value, with the boundary that it must respect."""

from __future__ import annotations

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from fubini._values import value
from fubini.triangulation._kernels_topology import CORNER, FREE, FROZEN, INTERIOR, LOCKED, ON_CURVE, SPLIT_ONLY

__all__ = [
    "CORNER", "FREE", "FROZEN", "INTERIOR", "LOCKED", "NONE", "ON_CURVE", "SPLIT_ONLY",
    "Boundary", "Byte", "Float", "Int", "Patch", "Triangulation",
]  # fmt: skip

Float = NDArray[np.float64]
Int = NDArray[np.int32]
Byte = NDArray[np.uint8]

#: No indices.
NONE: Int = np.empty(0, np.int32)


@value(frozen=True)
class Boundary:
    """Boundary nodes and segments of one region, ready for triangulation.

    The nodes are the first ``n`` nodes of every triangulation that respects this boundary.

    Attributes
    ----------
    points : (n, 2) node positions.
    kind : (n,) uint8, one of ON_CURVE, CORNER, FROZEN.
    size : (n,) wanted edge length at the node.
    angle : (n,) interior angle in degrees between the tangents at a corner; 180 on smooth curves.
    segments : (k, 2) int32, the region on the left of each.
    track : (k,) int32, number of the track that the segment lies on; -1 for a straight segment of no track.
    t : (k, 2) track parameters of the two ends.
    mode : (k,) uint8, one of FREE, SPLIT_ONLY, LOCKED.
    """

    points: Float
    kind: Byte
    size: Float
    angle: Float
    segments: Int
    track: Int
    t: Float
    mode: Byte


@value(frozen=True)
class Triangulation:
    """Triangles of one region and the boundary segments they end at.

    Attributes
    ----------
    points : (n, 2).
    triangles : (m, 3) int32, counter-clockwise.
    neighbours : (m, 3) int32; the triangle across the edge opposite to the local corner, or
        ``-1 - s`` where that edge is boundary segment ``s``.
    boundary : nodes ``0 .. len(boundary.points)`` of ``points``, in the same order.
    unrecovered : boundary segments that are no edges (crossed, or a point lies on them); empty when all is
    well.
    dropped : indices, into the points that were given, of interior points left out (doubles, or outside the
    region).
    """

    points: Float
    triangles: Int
    neighbours: Int
    boundary: Boundary
    unrecovered: Int = field(default_factory=lambda: NONE)
    dropped: Int = field(default_factory=lambda: NONE)


@value(frozen=True)
class Patch:
    """Triangles of a triangulation that are known before it is made.

    No vertex lies in their circles or on them, and no segment crosses them, but those at which they end.

    Attributes
    ----------
    triangles : (m, 3) int32, by numbers of all points.
    neighbours : (m, 3) int32, as in ``Triangulation``; anything across open edges.
    open : (e,) int32, 3 t + i for each edge i of a triangle t beyond which nothing is known.
    nodes : (z,) int32, points that lie at open edges, or in no triangle of the patch.
    hanging : (h, 2) int32, ends of edges with no triangle of the patch on either side, each both ways, one behind the
        other, numbered as those in ``segments``. No segment crosses them either, but they need not be edges in the end.
    points : (b + z, 2), the boundary's nodes, then ``nodes``.
    segments : (k + e, 2) int32, the boundary's, then the open edges, the unknown on the left of all, by place in
        ``points``.
    """

    triangles: Int
    neighbours: Int
    open: Int
    nodes: Int
    hanging: Int
    points: Float
    segments: Int
