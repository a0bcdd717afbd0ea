"""The mesh as values of other libraries, and as bare arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fubini.errors import DependencyError, ExportError
from fubini.export.layout import layout

if TYPE_CHECKING:
    from fubini.result import Mesh


def compact(mesh: Mesh) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Points (n, 3) that a triangle uses, in their old order, and triangles (m, 3) that refer to them.

    Raises
    ------
    ExportError : the mesh has no triangle, or a point that is not finite.
    """
    if not len(mesh.triangles):
        raise ExportError("the mesh has no triangle to write")
    used = np.zeros(len(mesh.points), bool)
    used[mesh.triangles] = True
    points = np.ascontiguousarray(mesh.points[used])
    bad = np.flatnonzero(~np.isfinite(points).all(1))
    if len(bad):
        raise ExportError(f"point {np.flatnonzero(used)[bad[0]]} of the mesh is not finite")
    number = np.cumsum(used, dtype=np.int32) - 1
    return points, number[mesh.triangles].astype(np.int32)


def to_trimesh(mesh: Mesh) -> Any:
    """``trimesh.Trimesh`` with points as they are, and the face attribute ``face`` (CAD face index)."""
    try:
        import trimesh
    except ImportError as error:  # a core dependency, yet it may be broken
        raise DependencyError("trimesh cannot be imported", fix="pip install trimesh") from error
    points, triangles = compact(mesh)
    faces = np.asarray(mesh.face_of_triangle, np.int32)
    return trimesh.Trimesh(points, triangles, process=False, face_attributes={"face": faces})


def to_meshio(mesh: Mesh, names: bool = True) -> Any:
    """``meshio.Mesh`` of triangles with the cell data array ``face`` (CAD face index, from 0).

    With ``names`` there are lines and vertices too, the cell data array ``edge`` (-1 but on lines), and
    names as cell sets.
    """
    try:
        import meshio
    except ImportError as error:
        raise DependencyError("meshio cannot be imported", fix="pip install meshio") from error
    found = layout(mesh)
    second = found.order == 2
    blocks = [("triangle6" if second else "triangle", found.cells)]
    if not names:
        return meshio.Mesh(found.points, blocks, cell_data={"face": [found.face]})
    groups: list[Mapping[str, NDArray[np.int32]]] = [found.regions]
    if len(found.segments):
        blocks.append(("line3" if second else "line", found.segments))
        groups.append(found.boundaries)
    if found.named_points:
        every, at = np.unique(np.concatenate(list(found.named_points.values())), return_inverse=True)
        blocks.append(("vertex", every[:, None]))
        ends = np.cumsum([len(rows) for rows in found.named_points.values()])[:-1]
        groups.append(dict(zip(found.named_points, np.split(at.astype(np.int32), ends), strict=True)))
    none = np.empty(0, np.int32)
    sets = {name: [group.get(name, none) for group in groups] for group in groups for name in group}
    unknown = [np.full(len(cells), -1, np.int32) for _, cells in blocks]
    faces, edges = [found.face, *unknown[1:]], list(unknown)
    if len(found.segments):
        edges[1] = found.edge
    return meshio.Mesh(found.points, blocks, cell_data={"face": faces, "edge": edges}, cell_sets=sets)
