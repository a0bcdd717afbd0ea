"""Point membership against polygons, distances and closed forms."""

import math
import time

import numpy as np
import pytest

from fubini.region import Region
from regions import blob, circle, gear, plate, quarter_disk, random_polygon


def slow_contains(region, points):
    """Even-odd count of a fine polygon, one point at a time."""
    fine = [np.concatenate([c.point(np.linspace(0, 1, 2001))[:-1] for c in lp.curves]) for lp in region.loops]
    result = []
    for x, y in points:
        count = 0
        for p in fine:
            q = np.roll(p, -1, axis=0)
            up = (p[:, 1] > y) != (q[:, 1] > y)
            cut = p[up, 0] + (y - p[up, 1]) * (q[up, 0] - p[up, 0]) / (q[up, 1] - p[up, 1])
            count += int((cut > x).sum())
        result.append(count % 2 == 1)
    return np.array(result)


@pytest.mark.parametrize(
    "make", [quarter_disk, blob, gear, plate, lambda: random_polygon(3), lambda: random_polygon(8)]
)
def test_against_a_slow_count(make):
    region = make()
    low, high = region.bounding_box
    points = low + (high - low) * np.random.default_rng(0).uniform(-0.05, 1.05, (120, 2))
    distance = np.min([c.closest(points)[1] for c in region.curves], axis=0)
    clear = distance > 1e-5 * region.diagonal
    assert (region.contains(points)[clear] == slow_contains(region, points[clear])).all()


def test_rays_through_vertices_and_along_edges():
    region = Region.polygon([(0, 0), (4, 0), (4, 2), (3, 1), (2, 2), (1, 1), (0, 2)], [[(1, 0.5), (2, 0.5), (1.5, 1)]])
    x = np.linspace(-1, 5, 61)
    for y in (0.0, 0.5, 1.0, 2.0):
        points = np.c_[x, np.full(61, y)]
        assert (region.contains(points, 0.0)[slow_safe(region, points)] ==
                slow_contains(region, points)[slow_safe(region, points)]).all()  # fmt: skip


def slow_safe(region, points):
    return np.min([c.closest(points)[1] for c in region.curves], axis=0) > 1e-9


@pytest.mark.parametrize("make", [quarter_disk, blob, gear, plate])
def test_boundary_points_count_as_inside(make):
    region = make()
    points = np.concatenate([c.point(np.linspace(0, 1, 23)) for c in region.curves])
    assert region.contains(points).all()
    assert region.contains(points + 1e-3 * region.diagonal, 3e-3 * region.diagonal).all()


def test_tolerance_is_a_distance():
    disk = Region(circle(0, 0, 1))
    a = np.linspace(0, 6, 50)
    ring = np.c_[np.cos(a), np.sin(a)]
    assert disk.contains(1.0099 * ring, 0.01).all()
    assert not disk.contains(1.0101 * ring, 0.01).any()
    assert not disk.contains(1.000001 * ring).any()


def test_winding_of_a_ring_and_no_points():
    ring = Region(circle(0, 0, 2), (circle(0.5, 0, 1),))
    assert ring.contains([(1.7, 0), (0.5, 0.2), (-1, 0), (3, 0)]).tolist() == [True, False, True, False]
    assert ring.contains(np.empty((0, 2))).shape == (0,)


def test_many_edges_and_points_are_fast():
    region = gear(200)
    points = np.random.default_rng(1).uniform(-1.1, 1.1, (10_000, 2))
    region.contains(points[:1])
    start = time.perf_counter()
    inside = region.contains(points)
    assert time.perf_counter() - start < 1.0
    radius = np.hypot(*points.T)
    assert inside[(radius < 0.84) & (radius > 0.251)].all()
    assert not inside[(radius > 1.001) | (radius < 0.249)].any()
    assert inside.mean() == pytest.approx(region.area / 2.2**2, abs=4 * math.sqrt(0.25 / len(points)))
