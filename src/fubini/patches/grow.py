"""Triangles of a surface, joined where corners coincide, and the planar patches that they form."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from fubini.errors import DependencyError, InputError

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: Corners this close (times the diagonal) are one: single precision keeps 24 bits.
SAME_CORNER = 1e-7


@dataclass(frozen=True)
class Facets:
    """Triangles (m, 3) of points (n, 3); corners in one place are one point, none is used twice by a triangle."""

    label: str
    points: Float
    triangles: Int
    dropped: int = 0

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @cached_property
    def normals(self) -> Float:
        """Normals (m, 3), as long as twice the area."""
        p, q, r = (self.points[self.triangles[:, k]] for k in range(3))
        return np.cross(q - p, r - p)

    @cached_property
    def across(self) -> Int:
        """The triangle (m, 3) beyond side i, which runs from corner i to corner i + 1.

        -1 where the side has no neighbour, several, or one that runs the same way.
        """
        n, m = len(self.points), len(self.triangles)
        start, end = self.triangles.ravel(), np.roll(self.triangles, -1, axis=1).ravel()
        key = np.minimum(start, end) * n + np.maximum(start, end)
        order = np.argsort(key, kind="stable")
        first = np.flatnonzero(np.diff(key[order], prepend=-1))
        count = np.diff(first, append=len(key))
        a, b = order[first[count == 2]], order[first[count == 2] + 1]
        opposite = start[a] != start[b]
        a, b = a[opposite], b[opposite]
        result = np.full(3 * m, -1, np.int64)
        result[a], result[b] = b // 3, a // 3
        return result.reshape(m, 3)


def read_facets(source: Any) -> Facets:
    """Facets of a file that trimesh reads (.stl, .obj, .ply, .off, .glb, .3mf), of a ``trimesh.Trimesh``, or of
    a pair of points (n, 3) and triangles (m, 3).

    Raises ``InputError`` where there is no triangle of any area.
    """
    label = str(source) if isinstance(source, str | os.PathLike) else type(source).__name__
    points, triangles = _arrays(source, label)
    if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles):
        raise InputError("no triangles in it", file=label, fix="give a surface of triangles in space")
    if triangles.min() < 0 or triangles.max() >= len(points) or not np.isfinite(points).all():
        raise InputError("triangles must be indices of finite points", file=label)
    number = _joined(points)
    _, first = np.unique(number, return_index=True)
    corners = number[triangles]
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    if not whole.any():
        raise InputError("no triangle of any area", file=label)
    return Facets(label, points[first], corners[whole], int((~whole).sum()))


def grow(facets: Facets, tolerance: float, angle: float) -> Int:
    """Number (m,) of the planar patch that each triangle belongs to.

    A patch starts with the largest triangle left and takes in neighbours whose corners lie within
    ``tolerance`` of its plane and whose normals lean by less than ``angle`` degrees; slivers thinner than
    the tolerance lean as they like.
    """
    patch = np.full(len(facets.triangles), -1, np.int64)
    double = np.linalg.norm(facets.normals, axis=1)
    corners = facets.points[facets.triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    thin = double <= 4.0 * tolerance * longest
    limit = np.cos(np.radians(angle))
    count = 0
    for seed in np.argsort(-double, kind="stable").tolist():
        if patch[seed] >= 0 or double[seed] == 0.0:
            continue
        normal = facets.normals[seed] / double[seed]
        patch[seed], front = count, np.array([seed])
        while len(front):
            near = np.unique(facets.across[front])
            near = near[near >= 0]
            near = near[patch[near] < 0]
            off = np.abs((corners[near] - corners[seed, 0]) @ normal).max(axis=1, initial=0.0)
            leans = facets.normals[near] @ normal < limit * double[near]
            front = near[(off <= tolerance) & (thin[near] | ~leans)]
            patch[front] = count
        count += 1
    return patch


def _arrays(source: Any, label: str) -> tuple[Float, Int]:
    """Points and triangles of a source of any kind."""
    if isinstance(source, str | os.PathLike):
        source = _read_file(str(source))
    if hasattr(source, "vertices") and hasattr(source, "faces"):
        source = (source.vertices, source.faces)
    if not isinstance(source, Sequence) or len(source) != 2:
        raise InputError(f"cannot remesh a {label}", fix="give a path, a trimesh.Trimesh, or points and triangles")
    return np.array(source[0], np.float64), np.array(source[1], np.int64)


def _read_file(path: str) -> Any:
    if not os.path.isfile(path):
        raise InputError("no such file", file=path, fix="check the path")
    try:
        import trimesh
    except ImportError as error:
        raise DependencyError("reading triangles needs trimesh", fix="pip install trimesh") from error
    try:
        return trimesh.load(path, process=False, force="mesh")
    except Exception as error:  # readers of many formats, each with errors of its own
        raise InputError(f"not readable as a triangle mesh ({type(error).__name__}: {error})", file=path) from error


def _joined(points: Float) -> Int:
    """Number (n,) of the corner that each point is."""
    reach = SAME_CORNER * float(np.linalg.norm(np.ptp(points, axis=0)))
    same, number = np.unique(points, axis=0, return_inverse=True)
    pairs = cKDTree(same).query_pairs(reach, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(same), len(same)))
    _, label = connected_components(links, directed=False)
    return label[number.ravel()].astype(np.int64)
