"""Points: reference sets and the mapping of Eq. (1), boundary nodes, size field, interior lattices."""

from fubini.sampling.mapping import map_points
from fubini.sampling.redundant import by_limits, by_polygon
from fubini.sampling.reference import (
    REFERENCE_SETS,
    asp20,
    asp48,
    distinct,
    graded,
    quincunx,
    reference_points,
    sp13,
    sp41,
    turn,
)

__all__ = [
    "REFERENCE_SETS",
    "asp20",
    "asp48",
    "by_limits",
    "by_polygon",
    "distinct",
    "graded",
    "map_points",
    "quincunx",
    "reference_points",
    "sp13",
    "sp41",
    "turn",
]
