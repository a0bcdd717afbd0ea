"""Which triangles of a mesh are valid, flawed, or flawed and excused by a sharp corner."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fubini.certificate import excuse
from fubini.measure import triangle_figures

if TYPE_CHECKING:
    from fubini.result import Mesh

VALID, EXCUSED, FLAWED = 0, 1, 2


def triangle_states(mesh: Mesh) -> NDArray[np.uint8]:
    """Per triangle (m,): ``VALID``, ``EXCUSED`` (unavoidable) or ``FLAWED``."""
    limits = (mesh.certificate.min_skew, mesh.certificate.max_aspect_ratio)
    flawed = triangle_figures(mesh.points, mesh.triangles).flawed(*limits)
    states = np.where(flawed, FLAWED, VALID).astype(np.uint8)
    for face in mesh.certificate.faces:
        if not face.corners:
            continue
        rows = np.flatnonzero(flawed & (mesh.face_of_triangle == face.face))
        nodes = _nodes_at(mesh, rows, [c.point for c in face.corners])
        states[rows[excuse(mesh.triangles[rows], nodes)]] = EXCUSED
    return states


def _nodes_at(mesh: Mesh, rows: NDArray[np.intp], places: list[tuple[float, float, float]]) -> NDArray[np.int32]:
    """Corners of the triangles ``rows`` that lie at the places, bit for bit; -1 where there is none."""
    nodes = np.unique(mesh.triangles[rows])
    if not len(nodes):
        return np.full(len(places), -1, np.int32)
    same = (mesh.points[nodes][None] == np.array(places)[:, None]).all(2)
    return np.where(same.any(1), nodes[same.argmax(1)], -1).astype(np.int32)
