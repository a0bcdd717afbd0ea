"""What every solver format writes: used nodes, elements, segments and names, renumbered without gaps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fubini.errors import ExportError
from fubini.naming import Names, Parts, name_parts, overlap, primary

if TYPE_CHECKING:
    from fubini.result import Mesh

Float = NDArray[np.float64]
Int = NDArray[np.int32]

#: Nodes farther than this (times the diagonal) from one plane are not in it.
FLAT = 1e-9


@dataclass(frozen=True)
class Layout:
    """A mesh as solvers see it.

    Attributes
    ----------
    points : (n, 3), corners before mid-side nodes.
    cells : (m, 3) or (m, 6): corners, then the middles of sides 0-1, 1-2 and 2-0.
    segments : (k, 2) or (k, 3): ends, then the middle.
    face, edge : CAD index of every cell (m,) and segment (k,).
    regions, boundaries, named_points : name to cell, segment and node indices.
    """

    points: Float
    cells: Int
    segments: Int
    face: Int
    edge: Int
    regions: Mapping[str, Int]
    boundaries: Mapping[str, Int]
    named_points: Mapping[str, Int]

    @property
    def order(self) -> int:
        """1 or 2."""
        return 1 if self.cells.shape[1] == 3 else 2

    @property
    def region_of_cell(self) -> NDArray[np.int64]:
        """Number of the first region that holds each cell."""
        return primary(self.regions, len(self.cells))

    @property
    def names(self) -> tuple[str, ...]:
        """All names, each once: of regions, boundaries, points."""
        return tuple(dict.fromkeys([*self.regions, *self.boundaries, *self.named_points]))

    def boundary_nodes(self, name: str) -> Int:
        """Nodes of a boundary, sorted, mid-side nodes among them."""
        return np.unique(self.segments[self.boundaries[name]])

    def refuse_overlap(self, what: str, fix: str) -> None:
        """Raise ``ExportError`` where an element has two regions and ``what`` knows only one."""
        shared = overlap(self.regions, len(self.cells))
        if shared:
            raise ExportError(f"{what} holds one region of each element, and {' and '.join(shared)} overlap", fix=fix)

    def refuse_points(self, what: str) -> None:
        """Raise ``ExportError`` where there are named points, which ``what`` does not know."""
        if self.named_points:
            raise ExportError(
                f"{what} would lose the named points {', '.join(self.named_points)}",
                fix="use .msh, .inp, .unv, .vtu or .npz, or name no points",
            )


def layout(mesh: Mesh) -> Layout:
    """The nodes that elements use, in their old order, and everything that refers to them.

    Raises ``ExportError`` for a mesh without triangles or with a point that is not finite.
    """
    if not len(mesh.triangles):
        raise ExportError("the mesh has no triangle to write")
    used = np.zeros(len(mesh.points), bool)
    used[mesh.nodes] = True
    points = np.ascontiguousarray(mesh.points[used])
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise ExportError(f"point {np.flatnonzero(used)[bad[0]]} of the mesh is not finite")
    number = np.cumsum(used, dtype=np.int32) - 1
    segments = mesh.segments
    if mesh.segment_midsides is not None:
        segments = np.column_stack([segments, mesh.segment_midsides])
    names = _names(mesh)
    return Layout(
        points,
        number[mesh.nodes].astype(np.int32),
        number[segments].astype(np.int32),
        np.asarray(mesh.face_of_triangle, np.int32),
        np.asarray(mesh.edge_of_segment, np.int32),
        names.regions,
        names.boundaries,
        {name: number[rows[used[rows]]] for name, rows in names.points.items()},
    )


def flatten(found: Layout) -> tuple[Float, Int]:
    """Plane coordinates (n, 2) and counter-clockwise cells of a mesh that lies in one plane.

    In a plane of constant z these are x and y; else the coordinates of axes within the plane, about its
    origin nearest to that of space. Raises ``ExportError`` when the mesh lies in no single plane.
    """
    p, t = found.points, found.cells[:, :3]
    normals = np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]])
    total = normals.sum(axis=0)
    length = float(np.linalg.norm(total))
    diagonal = float(np.linalg.norm(np.ptp(p, axis=0)))
    normal = total / max(length, 1e-300)
    height = (p - p[0]) @ normal
    if not length > 0.0 or np.abs(height).max() > FLAT * diagonal or (normals @ normal <= 0.0).any():
        raise ExportError(
            "the mesh does not lie in one plane with all triangles on one side",
            fix="mesh one face, or write shells in space",
        )
    if abs(normal[2]) > 1.0 - 1e-12:
        flat = np.ascontiguousarray(p[:, :2])
        return flat, found.cells if normal[2] > 0.0 else _mirrored(found.cells)
    x_axis = np.cross([0.0, 0.0, 1.0], normal)
    x_axis /= np.linalg.norm(x_axis)
    return np.stack([p @ x_axis, p @ np.cross(normal, x_axis)], axis=1), found.cells


def _mirrored(cells: Int) -> Int:
    """The same elements run the other way."""
    return np.ascontiguousarray(cells[:, [0, 2, 1] if cells.shape[1] == 3 else [0, 2, 1, 5, 4, 3]])


def _names(mesh: Mesh) -> Names:
    """The names of the mesh; automatic ones where it was made without."""
    if mesh.regions:
        return Names(mesh.regions, mesh.boundaries, mesh.named_points)
    return name_parts(
        Parts(
            mesh.points, mesh.triangles, mesh.face_of_triangle, mesh.segments, mesh.edge_of_segment,
            mesh.face_names, mesh.edge_names,
        )
    )  # fmt: skip
