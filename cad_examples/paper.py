"""The paper's first triangulations, before anything is optimised, and the figures it reports of them.

Reference points are mapped into hand-made cells by Eq. (1), points that coincide are kept once, and plain Delaunay
joins them. Triangles outside the region are redundant and go; what is left is counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

#: Mapped points this near to each other (times the diagonal) are one; nodes this near to a curve are on it.
SAME = 1e-9


@dataclass(frozen=True)
class FirstMesh:
    """A first triangulation and what is wrong with it.

    Attributes
    ----------
    points, triangles : (n, 2) and (m, 3), redundant triangles left out.
    redundant : triangles that lay outside the region.
    skewness, aspect_ratio : (m,), degrees and ratio.
    off_boundary : (k, 2) nodes of the hull that lie on no curve.
    """

    points: np.ndarray
    triangles: np.ndarray
    redundant: int
    skewness: np.ndarray
    aspect_ratio: np.ndarray
    off_boundary: np.ndarray

    @property
    def flawed(self) -> int:
        """Triangles with skewness 45 degrees or less or aspect ratio 2 or more."""
        return int(np.count_nonzero((self.skewness <= 45) | (self.aspect_ratio >= 2)))

    def __str__(self) -> str:
        """One line of figures."""
        off = ", ".join(f"({x:.3f}, {y:.3f})" for x, y in self.off_boundary) or "none"
        return (
            f"{len(self.points)} distinct points, {len(self.triangles)} triangles, {self.redundant} redundant, "
            f"{self.flawed} flawed (worst skewness {self.skewness.min():.2f}); hull nodes off the boundary: {off}"
        )


def first_mesh(shape: Any, pattern: str, direction: str) -> FirstMesh:
    """Map a reference set into the cells of a face and triangulate.

    Parameters
    ----------
    shape : whatever ``fubini.load`` takes, with one planar face.
    pattern : "SP13", "SP41", "ASP20" or "ASP48".
    direction : "x" for cells of kind I1, "y" for I2; sliced at every vertex, as the paper draws them.
    """
    from scipy.spatial import Delaunay

    import fubini
    from fubini.quality import aspect_ratios, skewness
    from fubini.sampling import mapping, reference

    region = fubini.load(shape).faces[0].region
    unit = reference.reference_points(pattern)
    mapped = [mapping.map_points(cell, unit) for cell in fubini.decompose(region, direction, at_vertices=True)]
    points, _ = reference.distinct(np.concatenate(mapped), SAME * region.diagonal)
    triangles = Delaunay(points).simplices
    inside = region.contains(points[triangles].mean(axis=1))
    kept = triangles[inside]
    corners = points[kept]
    return FirstMesh(
        points,
        kept,
        int(np.count_nonzero(~inside)),
        skewness(corners),
        aspect_ratios(corners),
        _off_boundary(region, points, kept),
    )


def _off_boundary(region: Any, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Nodes on the rim of the triangles that no curve of the region passes through."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    rim, count = np.unique(sides, axis=0, return_counts=True)
    nodes = points[np.unique(rim[count == 1])]
    distance = np.min([curve.closest(nodes)[1] for curve in region.curves], axis=0)
    return nodes[distance > SAME * region.diagonal]
