"""Planar regions of exact curves: loops, areas, corners, membership, validation."""

from fubini.region.corners import Corner, end_direction, interior_angle, start_direction
from fubini.region.loop import Loop, with_ends
from fubini.region.problems import Problem
from fubini.region.region import Region

__all__ = [
    "Corner",
    "Loop",
    "Problem",
    "Region",
    "end_direction",
    "interior_angle",
    "start_direction",
    "with_ends",
]
