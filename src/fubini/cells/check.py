"""The check of cells by themselves: their areas and moments add up to those of the region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.cells.cell import Cell
from fubini.cells.integrate import integrate
from fubini.region import Region
from fubini.tolerance import AREA

Float = NDArray[np.float64]


@dataclass(frozen=True)
class CellCheck:
    """Figures of a decomposition, from quadrature through the mapping.

    Attributes
    ----------
    cells : number of cells.
    area, region_area : sum of the cell areas, exact area of the region.
    area_error : their difference over the region's area.
    centroid_error : distance of the centroids over the region's diagonal.
    moment_error : largest difference of second moments about the centroid over their sum
        (the polar moment of the region).
    """

    cells: int
    area: float
    region_area: float
    area_error: float
    centroid_error: float
    moment_error: float

    @property
    def passed(self) -> bool:
        """Areas agree to 1e-12, centroid and second moments to 1e-9."""
        return self.area_error <= AREA and max(self.centroid_error, self.moment_error) <= 1e-9


def check_cells(region: Region, cells: Sequence[Cell]) -> CellCheck:
    """Compare the sums over ``cells`` with the boundary integrals of ``region``."""
    origin = region.bounding_box.mean(axis=0)

    def moments(p: Float) -> Float:
        x, y = (p - origin).T
        return np.stack([np.ones(len(p)), x, y, x * x, x * y, y * y], axis=1)

    area, mx, my, xx, xy, yy = integrate(cells, moments, order=3)
    second = np.array([xx - mx * mx / area, xy - mx * my / area, yy - my * my / area])
    exact = region.second_moments
    centroid = origin + np.array([mx, my]) / area
    return CellCheck(
        cells=len(cells),
        area=float(area),
        region_area=region.area,
        area_error=float(abs(area - region.area) / abs(region.area)),
        centroid_error=float(np.hypot(*(centroid - region.centroid)) / region.diagonal),
        moment_error=float(np.abs(second - exact).max() / (exact[0] + exact[2])),
    )
