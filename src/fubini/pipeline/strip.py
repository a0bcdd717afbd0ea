"""Large faces: only the strip along the boundary is triangulated, optimised and refined; the core is written down.

The rim of the core bounds the strip as frozen nodes and locked segments of no track, so that nothing there
changes and both parts fit together node by node.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.model import Frame
from fubini.pipeline._kernels_assemble import rim_last, write_strip
from fubini.sampling.interior import Core
from fubini.triangulation.value import FROZEN, LOCKED, Boundary, Triangulation

Float = NDArray[np.float64]
Int = NDArray[np.int32]


@dataclass(frozen=True)
class FaceMesh:
    """Mesh of one face in its plane: a triangulation, and the core that it leaves out.

    Nodes are numbered: boundary nodes, rim of the core, other nodes of the triangulation, nodes of the core alone.

    Attributes
    ----------
    boundary : of the face alone.
    points : (n, 2) boundary nodes, rim, others.
    triangles : (m, 3) of these.
    core : None where the triangulation is all.
    """

    boundary: Boundary
    points: Float
    triangles: Int
    core: Core | None = None

    @property
    def inner_nodes(self) -> int:
        """Number of nodes that are not on the boundary."""
        return len(self.points) - len(self.boundary.points) + (self.core.nodes if self.core else 0)

    @property
    def triangle_count(self) -> int:
        """Number of triangles."""
        return len(self.triangles) + (self.core.triangles if self.core else 0)

    def write(self, frame: Frame, numbers: NDArray[np.int64], first: int, points: Float, triangles: Int) -> None:
        """Write what is inside into space: nodes (inner_nodes, 3) and triangles (triangle_count, 3), in place.

        numbers : what the boundary nodes are called there. first : number of the first node inside.
        """
        b, n, m = len(self.boundary.points), len(self.points), len(self.triangles)
        flat, corners = (x if x.flags.writeable else x.copy() for x in (self.points, self.triangles))
        write_strip(frame.axes, flat, corners, numbers, first, points[: n - b], triangles[:m])
        if self.core is not None:
            self.core.write(frame.axes, first, first + n - b, points[n - b :], triangles[m:])


def strip_boundary(boundary: Boundary, core: Core, size: float) -> Boundary:
    """Boundary of the strip: the face's, then the rim of the core with the strip on its left."""
    n, k, r = len(boundary.points), len(core.rim), len(core.on_rim)
    return Boundary(
        points=np.concatenate([boundary.points, core.on_rim]),
        kind=np.concatenate([boundary.kind, np.full(r, FROZEN, np.uint8)]),
        size=np.concatenate([boundary.size, np.full(r, size)]),
        angle=np.concatenate([boundary.angle, np.full(r, 180.0)]),
        segments=np.concatenate([boundary.segments, np.int32(n) + core.rim[:, ::-1]]),
        track=np.concatenate([boundary.track, np.full(k, -1, np.int32)]),
        t=np.concatenate([boundary.t, np.zeros((k, 2))]),
        mode=np.concatenate([boundary.mode, np.full(k, LOCKED, np.uint8)]),
    )


def with_core(strip: Triangulation, core: Core | None) -> FaceMesh:
    """The strip and the core as one mesh.

    ``strip`` comes from ``strip_boundary`` and may have split, merged and moved all but the rim, whose nodes and
    segments are still there in their order.
    """
    if core is None:
        return FaceMesh(strip.boundary, strip.points, strip.triangles)
    old, points, triangles = strip.boundary, np.array(strip.points), np.array(strip.triangles)
    real, segments = np.empty(len(old.points), np.int32), np.empty_like(old.segments)
    b, k = rim_last(points, triangles, old.segments, old.track, real, segments)
    kept, along = real[:b], old.track >= 0
    boundary = Boundary(
        points[:b], old.kind[kept], old.size[kept], old.angle[kept],
        segments[:k], old.track[along], old.t[along], old.mode[along],
    )  # fmt: skip
    return FaceMesh(boundary, points, triangles, core)
