"""Boundary nodes: on their curves, of the asked size, graded, equal at sharp corners, fine across gaps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import regions
from fubini.curves import Bezier, Line
from fubini.errors import GeometryError
from fubini.region import Region
from fubini.sampling.boundary import BoundarySizing, Outline, SizeOptions
from fubini.sampling.network import Network
from fubini.tracks import evaluate
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.value import CORNER, Boundary
from regions import discretise


def lengths(boundary: Boundary) -> np.ndarray:
    p = boundary.points[boundary.segments]
    return np.linalg.norm(p[:, 1] - p[:, 0], axis=1)


CLASSICS = {
    "quarter disk": (regions.quarter_disk, 0.1),
    "plate": (regions.plate, 0.15),
    "slot": (regions.slot, 0.5),
    "thin slot": (lambda: regions.slot(0.004), 0.5),
    "gear": (regions.gear, 0.1),
    "blob": (regions.blob, 0.12),
    "wedge of 3 degrees": (lambda: regions.wedge(3), 0.1),
}


@pytest.mark.parametrize("name", CLASSICS)
def test_nodes_lie_on_their_tracks_and_loops_close(name):
    make, size = CLASSICS[name]
    boundary, sizing, _ = discretise(make(), size)
    tracks = sizing.outlines[0].tracks
    for side in (0, 1):
        on_curve = evaluate(tracks, boundary.track, boundary.t[:, side])
        gap = np.abs(on_curve - boundary.points[boundary.segments[:, side]])
        assert gap.max() <= 1e-15 * 10
    assert sorted(boundary.segments[:, 0]) == sorted(boundary.segments[:, 1]) == list(range(len(boundary.points)))


@pytest.mark.parametrize("name", CLASSICS)
def test_every_curve_end_is_a_corner_node(name):
    make, size = CLASSICS[name]
    boundary, _sizing, _ = discretise(make(), size)
    starts = np.array([c.start for loop in make().loops for c in loop.curves])
    corners = boundary.points[boundary.kind == CORNER]
    assert len(corners) == len(starts)
    gap = np.linalg.norm(corners[:, None] - starts, axis=2).min(axis=1)
    assert gap.max() <= 1e-9 * make().diagonal


@pytest.mark.parametrize("name", CLASSICS)
def test_boundary_alone_can_be_triangulated(name):
    make, size = CLASSICS[name]
    boundary, _, _ = discretise(make(), size)
    seen = constrained_delaunay(boundary.points, boundary)
    assert len(seen.unrecovered) == 0
    assert len(seen.triangles) == len(boundary.points) - 2 + 2 * (len(make().loops) - 1)


def test_size_is_followed_where_nothing_asks_for_less():
    boundary, _, _ = discretise(regions.square(), 0.05)
    assert np.allclose(lengths(boundary), 0.05)


def test_turning_bounds_the_segments_of_an_arc():
    boundary, _, _ = discretise(Region.from_loops([regions.circle(0, 0, 1.0)]), 100.0, turn=0.5)
    n = len(boundary.points)
    assert 12 <= n <= 14  # 2 pi / 0.5 = 12.6


def test_growth_between_neighbouring_segments_is_limited():
    points = [(0, 0), (1, 0), (1, 1), (0.5001, 1), (0.5, 1), (0, 1)]
    boundary, _, _ = discretise(regions.polygon(points), 0.2)
    size = lengths(boundary)
    assert size.min() < 2e-4
    ratio = size / np.roll(size, 1)
    assert max(ratio.max(), (1 / ratio).max()) < 2.0


@pytest.mark.parametrize("degrees", [2, 5, 10, 24, 30, 45])
def test_sharp_corner_starts_with_equal_legs(degrees):
    boundary, _, _ = discretise(regions.wedge(degrees), 0.2)
    corner = int(np.argmin(np.linalg.norm(boundary.points, axis=1)))
    legs = lengths(boundary)[(boundary.segments == corner).any(axis=1)]
    assert len(legs) == 2
    assert legs[0] == pytest.approx(legs[1], rel=1e-12)


@pytest.mark.parametrize("degrees", [0.743, 5.5, 20.0])
def test_legs_end_before_a_hole_between_them(degrees):
    width = 0.08 * np.tan(np.radians(degrees))
    outline = regions.loop([(0, 0), (1, 0), (np.cos(np.radians(degrees)), np.sin(np.radians(degrees)))])
    region = Region.from_loops([outline, regions.circle(0.08, 0.5 * width, 0.4 * width)])
    boundary, sizing, _ = discretise(region, 0.1)
    legs = sizing.legs.radius[sizing.legs.radius > 0.0]
    assert len(legs) == 2
    assert legs.max() < 0.08 - 0.4 * width
    assert lengths(boundary)[boundary.angle[boundary.segments].min(axis=1) < 50.0].max() < 0.08


def test_nodes_across_a_gap_are_as_close_as_the_gap_is_wide():
    width = 0.02
    outer = [(0, 0), (10, 0), (10, 6), (0, 6)]
    region = regions.polygon(outer, [(2, width), (8, width), (8, 3), (2, 3)])
    boundary, _, _ = discretise(region, 1.0)
    p = boundary.points[boundary.segments].mean(axis=1)
    over_gap = (p[:, 1] < 1.5 * width) & (p[:, 0] > 3) & (p[:, 0] < 7)
    assert lengths(boundary)[over_gap].max() < 1.6 * width


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([0.3, 0.1, 0.05]))
def test_random_polygons_are_resolved(seed, size):
    region = regions.random_polygon(seed, 6, 25)
    boundary, _, nodes = discretise(region, size)
    assert len(constrained_delaunay(boundary.points, boundary).unrecovered) == 0
    assert lengths(boundary).max() < 1.7 * size
    for e in range(len(nodes.first) - 1):
        t = nodes.of(e)
        assert t[0] == 0.0 and t[-1] == 1.0 and (np.diff(t) > 0).all()


def test_sizes_scale_with_the_region():
    big, _, _ = discretise(regions.plate().transform(np.eye(2) * 1024.0, (0, 0)), 0.15 * 1024)
    small, _, _ = discretise(regions.plate(), 0.15)
    assert np.allclose(big.points / 1024.0, small.points, rtol=0, atol=1e-9)


def test_shared_edge_has_one_set_of_nodes():
    left = regions.polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
    outline = Outline.of(left, {0: 0, 1: 1, 2: 2, 3: 3}.__getitem__)
    right = regions.polygon([(1, 0), (1.01, 0), (1.01, 1), (1, 1)])
    right = Region.from_loops([type(right.outer)(right.outer.curves, (4, 5, 6, 1), (True, True, True, False))])
    other = Outline.of(right, int)
    network = Network.of([outline, other], [(0, 1), (1, 2), (2, 3), (3, 0), (1, 4), (4, 5), (5, 2)])
    sizing = BoundarySizing(network, SizeOptions(0.3))
    nodes = sizing.resolve()
    a, b = (sizing.boundary(f, nodes) for f in (0, 1))
    on_line = [{tuple(p) for p in x.points if p[0] == 1.0} for x in (a, b)]
    assert on_line[0] == on_line[1]
    assert len(on_line[0]) > 80  # the thin face needs nodes 0.0115 apart


def test_too_many_nodes_are_refused_with_the_place_on_an_edge_of_uneven_parameter():
    bottom = Bezier([(0, 0), (0.02, 0), (0.1, 0), (3, 0)])  # half of its parameter for a seventh of its length
    region = regions.chain(bottom, *(Line(a, b) for a, b in [((3, 0), (3, 1)), ((3, 1), (0, 1)), ((0, 1), (0, 0))]))
    finest = np.array([1.1, 0.0])
    field = [lambda p: 1e-4 + 0.3 * np.linalg.norm(p - finest, axis=1)]
    with pytest.raises(GeometryError, match="more than 40 nodes") as refused:
        discretise(region, 0.5, most=40, fields=field)
    assert refused.value.edge == region.edges[[c.kind for c in region.curves].index("bezier")]
    assert refused.value.at[:2] == pytest.approx(finest, abs=0.03)
