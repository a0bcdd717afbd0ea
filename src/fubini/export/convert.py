"""The mesh as values of other libraries, and as bare arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fubini.errors import DependencyError, ExportError

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


def to_meshio(mesh: Mesh) -> Any:
    """``meshio.Mesh`` of triangles with the cell data array ``face`` (CAD face index, from 0)."""
    try:
        import meshio
    except ImportError as error:
        raise DependencyError("meshio cannot be imported", fix="pip install meshio") from error
    points, triangles = compact(mesh)
    faces = np.asarray(mesh.face_of_triangle, np.int32)
    return meshio.Mesh(points, [("triangle", triangles)], cell_data={"face": [faces]})
