"""Large faces: only the strip along the boundary is triangulated, optimised and refined; the core is written down.

The rim of the core bounds the strip as frozen nodes and locked segments of no track, so that nothing there
changes and both parts fit together node by node.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini._values import value
from fubini.optimise.state import FLOATS, INTS, writable
from fubini.pipeline._kernels_assemble import with_rim, without_rim
from fubini.sampling.interior import Core
from fubini.triangulation.value import Boundary, Triangulation

Float = NDArray[np.float64]
Int = NDArray[np.int32]


@value(frozen=True)
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


def strip_boundary(boundary: Boundary, core: Core, size: float) -> Boundary:
    """Boundary of the strip: the face's, then the rim of the core with the strip on its left."""
    return Boundary(*with_rim(*_arrays(boundary), core.on_rim, core.rim, float(size)))


def with_core(strip: Triangulation, core: Core | None) -> FaceMesh:
    """The strip and the core as one mesh.

    ``strip`` comes from ``strip_boundary`` and may have split, merged and moved all but the rim, whose nodes and
    segments are still there in their order.
    """
    if core is None:
        return FaceMesh(strip.boundary, strip.points, strip.triangles)
    flat, corners = writable(strip.points, FLOATS), writable(strip.triangles, INTS)
    points, triangles, kind, *rest = without_rim(flat, corners, *_arrays(strip.boundary)[1:])
    return FaceMesh(Boundary(points[: len(kind)], kind, *rest), points, triangles, core)


def _arrays(boundary: Boundary) -> list[NDArray[Any]]:
    """The arrays of a boundary as kernels take them."""
    b = boundary
    return [writable(x, x.dtype) for x in (b.points, b.kind, b.size, b.angle, b.segments, b.track, b.t, b.mode)]


def stacked(parts: list[NDArray[Any]]) -> NDArray[Any]:
    """Arrays one behind the other, as kernels take them; the only one as it is, if they take it."""
    return writable(parts[0], parts[0].dtype) if len(parts) == 1 else np.concatenate(parts)
