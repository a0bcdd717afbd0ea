"""Boundaries whose nodes lie so far apart that nothing has to be triangulated to see that no gap is narrow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import random_regions
import regions
from fubini.sampling import boundary as boundaries
from fubini.sampling._kernels_apart import all_apart


def claimed(sizing, boundary):
    """What the kernel says of a boundary."""
    options = sizing.options
    return all_apart(
        boundary.points, boundary.segments, boundary.size, boundary.angle, boundaries.SHARP, options.gradient,
        options.gap, boundaries.RESOLVED,
    )  # fmt: skip


def cases():
    for seed in range(40):
        region = random_regions.random_region(seed)
        yield region, region.diagonal / (15, 40, 120)[seed % 3]
        yield regions.random_polygon(seed), regions.random_polygon(seed).diagonal / 150
    for share in (5, 10, 20, 40, 80, 160):
        for region in (regions.plate(4), regions.gear(), regions.square(), regions.Region(regions.circle(0, 0, 1))):
            yield region, region.diagonal / share


def test_where_nodes_are_apart_a_triangulation_of_the_boundary_lowers_nothing():
    apart = 0
    for region, size in cases():
        boundary, sizing, nodes = regions.discretise(region, size)
        for placed in (nodes, sizing._place()):
            boundary = sizing.boundary(0, placed)
            if claimed(sizing, boundary):
                changed = np.zeros(len(sizing.ends), np.uint8)
                tangled = sizing._look_across(0, placed, changed, False)
                assert not tangled
                assert not changed.any()
                apart += 1
    assert apart > 20


@pytest.mark.parametrize("share", [30, 40, 60])
def test_gaps_as_wide_as_their_nodes_allow_need_no_triangulation(share):
    """Nodes across the teeth and beside the holes are less than a size apart, and far enough for what lies there."""
    for region in (regions.gear(), regions.plate(4)):
        boundary, sizing, _ = regions.discretise(region, region.diagonal / share)
        assert claimed(sizing, boundary)


@pytest.mark.parametrize("gap", [0.5, 0.05, 1e-3])
def test_a_neck_is_no_place_apart(gap):
    """Two squares joined by a neck, narrower than its nodes are apart."""
    corners = [(0, 0), (1, 0), (1, 0.5), (2, 0.5), (2, 0), (3, 0), (3, 1), (2, 1), (2, 0.5 + gap * 0.1)]
    region = regions.polygon([*corners, (1, 0.5 + gap * 0.1), (1, 1), (0, 1)])
    boundary, sizing, nodes = regions.discretise(region, 0.1)
    sizing.tables.h[: sizing.tables.fill] = 0.1  # as it was before anything was seen
    assert not claimed(sizing, sizing.boundary(0, sizing._place()))


def test_chords_that_cross_are_not_apart():
    square = regions.square()
    boundary, sizing, _ = regions.discretise(square, 0.25)
    assert claimed(sizing, boundary)
    points = boundary.points.copy()
    points[0] = points[len(points) // 2] + 0.01
    assert not claimed(sizing, replace(boundary, points=points))
