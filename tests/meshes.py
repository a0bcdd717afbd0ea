"""Figures of a mesh, reckoned from its arrays alone."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree


def edge_uses(mesh):
    """Mesh edges (n, 2) and how many triangles have each."""
    t = mesh.triangles
    sides = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    return np.unique(sides, axis=0, return_counts=True)


def area(mesh, rows=slice(None)):
    """Area of all triangles, or of some."""
    p, q, r = (mesh.points[mesh.triangles[rows, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(q - p, r - p), axis=1).sum())


def volume(mesh):
    """Enclosed volume, positive where the triangles face outwards."""
    p, q, r = (mesh.points[mesh.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", p, np.cross(q, r)).sum() / 6)


def length(mesh, rows):
    """Length of some segments."""
    a, b = (mesh.points[mesh.segments[rows, k]] for k in range(2))
    return float(np.linalg.norm(b - a, axis=1).sum())


def apart(mesh):
    """Least distance of two nodes: 0 where one was made twice."""
    return float(cKDTree(mesh.points).query(mesh.points, k=2)[0][:, 1].min())
