"""Reference points, the mapping, and the facts of the paper's first example."""

import math

import numpy as np
import pytest
from scipy.spatial import Delaunay, cKDTree

from fubini.cells import decompose
from fubini.errors import OptionError
from fubini.quality import areas, flawed, skewness
from fubini.region import Region
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
from regions import annulus_quarter, blob, quarter_disk


def symmetric(points):
    mirrored = {(-u, v) for u, v in points.tolist()}
    return mirrored == {(u, v) for u, v in points.tolist()}


@pytest.mark.parametrize(("name", "count"), [("SP13", 13), ("SP41", 41), ("ASP20", 20), ("ASP48", 48)])
def test_counts_and_symmetry(name, count):
    points = reference_points(name.lower())
    assert points.shape == (count, 2)
    assert len(np.unique(points, axis=0)) == count
    assert np.abs(points).max() == 1.0
    assert symmetric(points)
    for corner in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        assert (points == corner).all(axis=1).any()
    upper, lower = (points[:, 1] > 0).sum(), (points[:, 1] < 0).sum()
    assert upper == lower if name.startswith("SP") else upper > 1.5 * lower


def test_quincunx_family():
    for n in range(2, 7):
        for m in range(2, 7):
            points = quincunx(n, m)
            assert len(points) == n * m + (n - 1) * (m - 1)
            assert symmetric(points) and symmetric(turn(points, 1))
    assert (quincunx(3) == sp13()).all() and (quincunx(5, 5) == sp41()).all()
    stretched = quincunx(4, 4) * (math.sqrt(3), 1)
    gaps = np.hypot(*(stretched[:, None] - stretched[None]).reshape(-1, 2).T)
    inner = np.sort(gaps[gaps > 0])
    assert inner[0] == pytest.approx(inner[40], rel=1e-12)  # hexagonal: many equal nearest distances


def test_graded_family():
    points = graded((3, 3, 3), 0.5)
    assert np.unique(points[:, 1]) == pytest.approx([-1, 1 / 3, 1])
    even = graded((4, 3, 2))
    v = np.unique(even[:, 1])
    assert (v[1] - v[0]) / (v[2] - v[1]) == pytest.approx((2 / 3 + 1) / (1 + 2))
    for bad in ((3,), (3, 1)):
        with pytest.raises(OptionError):
            graded(bad)
    with pytest.raises(OptionError):
        graded((3, 3), 0.0)
    with pytest.raises(OptionError, match="SP13, SP41, ASP20, ASP48"):
        reference_points("SP99")


@pytest.mark.parametrize("make", [asp20, asp48])
def test_turns_are_exact(make):
    points = make()
    assert (turn(points, 1)[:, 0] < 0).sum() == (points[:, 1] > 0).sum()
    assert (turn(turn(points, 1), 3) == points).all()
    assert (turn(points, 2) == -points).all() and (turn(points, -1) == turn(points, 3)).all()


def test_distinct_keeps_the_first():
    points = np.array([(0, 0), (1, 0), (0, 1e-12), (1, 1), (1e-12, 0), (1, 1)])
    kept, number = distinct(points, 1e-9)
    assert kept.tolist() == [[0, 0], [1, 0], [1, 1]]
    assert number.tolist() == [0, 1, 0, 2, 0, 2]
    assert distinct(np.empty((0, 2)), 1e-9)[0].shape == (0, 2)


@pytest.mark.parametrize("scale", [(1.0, 1.0), (0.0, 1.0), (0.01, 1.0)])
def test_what_is_dropped_lies_within_the_tolerance_of_an_earlier_point_that_is_kept(scale):
    points = np.random.default_rng(4).random((400, 2)) * scale
    tolerance = 0.02
    kept, number = distinct(points, tolerance)
    pairs = sorted(cKDTree(points).query_pairs(tolerance), key=lambda pair: (pair[1], pair[0]))
    keeper = list(range(len(points)))
    for i, j in pairs:
        if keeper[j] == j and keeper[i] == i:
            keeper[j] = i
    assert kept.tolist() == points[sorted(set(keeper))].tolist()
    assert kept[number].tolist() == points[keeper].tolist()


@pytest.mark.parametrize("direction", ["x", "y"])
def test_the_mapping_sends_sides_to_limits(direction):
    for region in (quarter_disk(), annulus_quarter(), blob()):
        for cell in decompose(region, direction):
            w = np.linspace(-1, 1, 9)
            one = np.ones(9)
            column = cell.axis
            for end, value in ((-1, cell.a), (1, cell.b)):
                p = map_points(cell, np.stack([end * one, w] if column == 0 else [w, end * one], axis=1))
                assert (p[:, column] == value).all()
            for end, limit in ((-1, cell.r), (1, cell.s)):
                p = map_points(cell, np.stack([w, end * one] if column == 0 else [end * one, w], axis=1))
                assert (p[:, 1 - column] == limit(p[:, column])).all()
            inside = map_points(cell, np.random.default_rng(0).uniform(-1, 1, (200, 2)))
            assert cell.contains(inside, 1e-14).all()
            assert region.contains(inside).all()


def test_the_mapping_is_equation_one():
    (cell,) = decompose(quarter_disk(), "y")
    u, v = 0.3, -0.2
    y = 0.5 * v + 0.5
    x = 0.5 * math.sqrt(1 - y * y) * (u + 1)
    assert map_points(cell, [(u, v)])[0] == pytest.approx([x, y], abs=1e-15)


def plain_delaunay(points):
    triangles = Delaunay(points).simplices
    wrong = areas(points[triangles]) < 0
    triangles[wrong] = triangles[wrong][:, [0, 2, 1]]
    return triangles


def quarter_disk_example(name):
    (cell,) = decompose(quarter_disk(), "y")
    points, _ = distinct(map_points(cell, reference_points(name)), 1e-9)
    return cell, points, plain_delaunay(points)


def arc_polygon(n=400):
    a = np.linspace(0, math.pi / 2, n)
    return np.concatenate([[(0, 0)], np.c_[np.cos(a), np.sin(a)]])


def test_paper_example_1_sp13():
    cell, points, triangles = quarter_disk_example("SP13")
    assert len(points) == 11
    assert len(triangles) == 13
    assert not by_limits((cell,), points, triangles).any()
    assert not by_polygon([arc_polygon()], points, triangles).any()
    bad = flawed(points[triangles])
    assert bad.sum() == 1
    assert skewness(points[triangles][bad])[0] == pytest.approx(37.09, abs=0.005)
    hull = np.unique(Delaunay(points).convex_hull)
    off = [p for p in points[hull] if min(c.closest(p)[1][0] for c in quarter_disk().curves) > 1e-9]
    assert len(off) == 1
    assert off[0] == pytest.approx([0.496, 0.75], abs=5e-4)


def test_paper_example_1_sp41():
    cell, points, triangles = quarter_disk_example("SP41")
    assert len(points) == 37
    assert len(triangles) == 59
    assert not by_limits((cell,), points, triangles).any()
    bad = points[triangles[flawed(points[triangles])]].mean(axis=1)
    assert len(bad) == 7
    near_top, near_arc = bad[:, 1] > 0.79, np.hypot(*bad.T) > 0.86
    assert near_top.any() and near_arc.any() and (near_top | near_arc).all()


@pytest.mark.parametrize(("name", "distinct_points", "bad"), [("ASP20", 18, 1), ("ASP48", 44, 4)])
def test_graded_sets_capture_the_narrow_top(name, distinct_points, bad):
    _, points, triangles = quarter_disk_example(name)
    assert len(points) == distinct_points
    assert flawed(points[triangles]).sum() == bad
    assert (points[:, 1] > 0.5).mean() > 0.5


@pytest.mark.parametrize("make", [annulus_quarter, blob])
def test_redundant_triangles_by_either_way(make):
    region = make()
    cells = decompose(region, "x")
    points = np.concatenate([map_points(c, quincunx(9, 7)) for c in cells])
    points, _ = distinct(points, 1e-9)
    triangles = plain_delaunay(points)
    limits = by_limits(cells, points, triangles)
    fine = [np.concatenate([c.point(np.linspace(0, 1, 500))[:-1] for c in lp.curves]) for lp in region.loops]
    polygon = by_polygon(fine, points, triangles)
    assert limits.any()
    assert (limits == polygon).all()
    kept = np.abs(areas(points[triangles[~limits]])).sum()
    assert kept == pytest.approx(region.area, rel=0.1)


def test_redundant_triangles_in_a_hole():
    square, hole = [(0, 0), (4, 0), (4, 4), (0, 4)], [(1, 1), (3, 1), (3, 3), (1, 3)]
    region = Region.polygon(square, [hole])
    points = np.array(square + hole, float)
    triangles = plain_delaunay(points)
    outside = by_polygon([square, hole], points, triangles)
    assert outside.sum() == 2
    assert (outside == by_limits(decompose(region), points, triangles)).all()


def test_every_set_is_listed():
    assert list(REFERENCE_SETS) == ["SP13", "SP41", "ASP20", "ASP48"]
