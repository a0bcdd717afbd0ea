"""Tables of sizes along edges: two samples where they are straight, a pool that grows, moved nodes found."""

from __future__ import annotations

import math

import numpy as np
import pytest

import regions
from fubini.curves import CircularArc, EllipticalArc, Line
from fubini.region import Region
from fubini.sampling import tables
from fubini.sampling._kernels_boundary import find_moved
from fubini.sampling.boundary import Outline, sample_track
from fubini.sampling.network import Network
from fubini.sampling.tables import EdgeTables, SizeOptions
from regions import discretise


def tables_of(region: Region, **options) -> EdgeTables:
    outline = Outline.of(region, int)
    ends = [(e, e + 1) for e in range(len(outline.edges))]
    return EdgeTables(Network.of([outline], ends), SizeOptions(100.0, **options))


@pytest.mark.parametrize("angle", [0.5, 1.0, 4.0, 2 * math.pi])
@pytest.mark.parametrize("sense", [1, -1])
def test_the_table_of_a_circle_has_two_samples_and_agrees_with_a_sampled_one(angle, sense):
    arc = CircularArc((3.0, 1.0), 2.0, 0.3, 0.3 + sense * angle)
    closing = [] if angle > 6.0 else [Line(arc.end, arc.start)]
    region = regions.chain(*([arc, *closing] if sense > 0 else [*(c.reverse() for c in closing), arc.reverse()]))
    t, s, h = tables_of(region)[len(closing) if sense < 0 else 0]
    _, dense_s, dense_h = sample_track(region.rounded_tracks, len(closing) if sense < 0 else 0, 0.75)
    assert t.tolist() == [0.0, 1.0]
    assert s.tolist() == pytest.approx([0.0, 2.0 * angle], rel=1e-8)
    assert s[-1] == pytest.approx(dense_s[-1], rel=2e-4)  # 128 chords of a full turn
    if angle >= 0.75:
        assert h == pytest.approx(np.full(2, 1.5), rel=1e-8)
        assert np.median(dense_h) == pytest.approx(1.5, rel=0.07)  # in steps of a sample
    else:
        assert h.tolist() == pytest.approx([2.0 * angle] * 2)


def test_curves_whose_tables_bend_keep_their_samples():
    ellipse = EllipticalArc((0, 0), (3.0, 0), (0, 1.0), 0.0, 2 * math.pi)
    assert len(tables_of(regions.chain(ellipse))[0][0]) > 100
    circle = Region.from_loops([regions.circle(0, 0, 1.0)])
    assert len(tables_of(circle, chord_tolerance=0.01)[0][0]) > 100  # its curvature is read off the samples


def test_the_pool_grows_as_needed(monkeypatch):
    points = [(0, 0), (10, 0), (10, 6), (0, 6)]
    region = regions.polygon(points, [(2, 0.02), (8, 0.02), (8, 3), (2, 3)])
    ample, sizing, _ = discretise(region, 1.0)
    monkeypatch.setattr(tables, "SPARE", 1)
    scarce, other, _ = discretise(region, 1.0)
    assert np.array_equal(ample.points, scarce.points)
    assert len(other.tables.t) < len(sizing.tables.t)
    for e in range(len(sizing.tables)):
        t, s, h = other.tables[e]
        assert (np.diff(t) > 0.0).all() and (np.diff(s) > 0.0).all() and (h > 0.0).all()
        assert np.array_equal(np.array([t, s, h]), np.array(sizing.tables[e]))


def test_moved_nodes_are_found_edge_by_edge():
    first, t = np.array([0, 3, 7]), np.array([0, 0.5, 1, 0, 0.2, 0.5, 1])
    for shift, number, found in ((0.0, 0, [0, 0]), (0.049, 1, [0, 0]), (0.051, 1, [1, 0]), (0.021, 4, [0, 1])):
        moved, other = np.empty(2, np.uint8), t.copy()
        other[number] += shift
        find_moved(first, other, first, t, 0.1, moved)
        assert moved.tolist() == found
    find_moved(np.array([0, 2, 6]), t[[0, 2, 3, 4, 5, 6]], first, t, 0.1, moved)
    assert moved.tolist() == [1, 0]


def test_edges_far_from_a_gap_keep_their_tables():
    points = [(0, 0), (10, 0), (10, 6), (0, 6)]
    boundary, sizing, _ = discretise(regions.polygon(points, [(2, 0.02), (8, 0.02), (8, 3), (2, 3)]), 1.0)
    assert sizing.tables[0][2].min() < 0.03 < 0.9 < sizing.tables[2][2].min()
    assert len(boundary.points) > 500


@pytest.mark.parametrize("length", [1.4, 1.43, 2.44, 2.46, 9.4, 9.55])
def test_segments_deviate_from_the_asked_size_by_at_most_a_factor(length):
    """As many as come nearest by ratio: sqrt(n (n + 1)) is the border between n and n + 1."""
    boundary, _, nodes = discretise(regions.polygon([(0, 0), (length, 0), (length + 40, 60), (-40, 60)]), 1.0)
    n = math.floor(length)
    assert len(nodes.of(0)) - 1 == (n if length < math.sqrt(n * (n + 1)) else n + 1)
    ends = boundary.points[boundary.segments]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max() <= math.sqrt(2.0)
