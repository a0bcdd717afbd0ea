"""Tables of sizes along edges: two samples where they are straight, a pool that grows, moved nodes found."""

from __future__ import annotations

import math

import numpy as np
import pytest

import regions
from fubini.curves import BSpline, CircularArc, EllipticalArc, Line
from fubini.region import Region
from fubini.sampling import tables
from fubini.sampling._kernels_boundary import find_moved
from fubini.sampling.boundary import Outline, sample_track
from fubini.sampling.network import Network
from fubini.sampling.tables import EdgeTables, SizeOptions
from fubini.tracks import evaluate
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


def sharpest_turn(tracks, j, t) -> float:
    """Largest angle in degrees between successive chords of the points at t."""
    d = np.diff(evaluate(tracks, j, t), axis=0)
    return float(np.degrees(np.abs(np.diff(np.unwrap(np.arctan2(d[:, 1], d[:, 0]))))).max())


@pytest.mark.parametrize("ratio", [100.0, 1000.0, 2000.0])
@pytest.mark.parametrize("seam", [0.0, 1.0])
def test_samples_gather_at_the_ends_of_slender_ellipses(ratio, seam):
    ellipse = EllipticalArc((0, 0), (1.0, 0), (0, 1.0 / ratio), seam, seam + 2 * math.pi)
    t, _, h = tables_of(regions.chain(ellipse))[0]
    assert sharpest_turn(Outline.of(regions.chain(ellipse), int).tracks, 0, t) < 0.4 * 0.75 * 57.3
    assert 0.3 < h.min() * ratio**2 < 2.0  # segments where the ellipse turns most, as its radius there asks for
    assert len(t) < 400


def test_samples_of_uneven_weights_get_ahead_evenly():
    weights = [1.0, 1e-4, 1e5, 1e-5, 1e4, 1.0]
    poles = [(0, 0), (0, 2), (1, 3), (3, 3), (4, 2), (4, 0)]
    spline = BSpline(2, [0, 0, 0, 1, 2, 3, 4, 4, 4], poles, weights)
    region = regions.chain(spline.reverse(), Line((0, 0), (4, 0)))
    _, s, _ = tables_of(region)[0]
    assert np.diff(s).max() < 0.3 * s[-1]
    exact, near = region.tracks, region.rounded_tracks
    t = np.linspace(0.0, 1.0, 1001) ** 8
    for at in (t, 1.0 - t):
        off = np.hypot(*(evaluate(exact, 0, at) - evaluate(near, 0, at)).T)
        assert off.max() < 1e-7  # small weights are as near as large ones


def test_both_legs_of_a_slender_corner_on_a_curve_are_as_long():
    ellipse = EllipticalArc((0, 0), (1.0, 0), (0, 3e-4), 0.5, 3.0)
    boundary, sizing, nodes = discretise(regions.chain(ellipse, Line(ellipse.end, ellipse.start)), 0.5)
    assert len(boundary.points) < 50_000
    tip, legs = np.array(ellipse.end), sizing.legs.radius
    arc = sizing.outlines[0].tracks
    p = evaluate(arc, 0, nodes.of(0)[-2])[0], evaluate(arc, 1, nodes.of(1)[1])[0]
    lengths = [float(np.hypot(*(q - tip))) for q in p]
    assert lengths == pytest.approx([legs[0, 1]] * 2, rel=1e-6)
    assert legs[0, 1] > 1e-3


def test_long_tables_hold_nothing_that_tells_nothing():
    ellipse = EllipticalArc((0, 0), (1.0, 0), (0, 3e-4), 0.0, math.pi)
    boundary, sizing, _ = discretise(regions.chain(ellipse, Line((-1, 0), (1, 0))), 0.5)
    assert 5_000 < len(boundary.points) < 30_000
    assert sum(len(table[0]) for table in sizing.tables) < 4 * len(boundary.points)


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
