"""Quality of triangles against the definitions they stand for."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fubini.quality import (
    angles,
    areas,
    aspect_ratios,
    corner_limit,
    edge_ratios,
    flawed,
    growth_rates,
    skewness,
)

SEED = np.random.default_rng(20190824)
#: cot of half the sharpest valid angle; everything about the 45-degree bound follows from it.
C45 = 2.0 + math.sqrt(7.0)


def from_angles(alpha, beta):
    """Triangles (m, 3, 2) with angles alpha at the first and beta at the second corner, in degrees."""
    a, b = (np.radians(x) for x in np.broadcast_arrays(np.atleast_1d(alpha), np.atleast_1d(beta)))
    p = np.zeros((a.size, 3, 2))
    p[:, 1, 0] = np.sin(a + b)
    p[:, 2, 0] = np.sin(b) * np.cos(a)
    p[:, 2, 1] = np.sin(b) * np.sin(a)
    return p


def angle_grid(n=400):
    """Triangles with angles alpha <= beta <= gamma on a grid over all shapes, and those angles (m, 3)."""
    alpha, beta = np.meshgrid(np.linspace(0.5, 60, n), np.linspace(0.5, 90, n))
    gamma = 180 - alpha - beta
    keep = (alpha <= beta) & (beta <= gamma)
    return from_angles(alpha[keep], beta[keep]), np.stack([alpha[keep], beta[keep], gamma[keep]], axis=1)


def paper_skewness(p):
    """Section 3.1 of the paper, word for word: smallest angle between a median and the opposite mid-line."""
    smallest = []
    for corners in p:
        found = []
        for i in range(3):
            a, b, c = corners[i], corners[(i + 1) % 3], corners[(i + 2) % 3]
            median = (b + c) / 2 - a
            midline = (a + c) / 2 - (a + b) / 2
            cosine = abs(median @ midline) / (np.linalg.norm(median) * np.linalg.norm(midline))
            found.append(math.degrees(math.acos(min(1.0, cosine))))
        smallest.append(min(found))
    return np.array(smallest)


def ratio_of_radii(p):
    """R / 2r from the two circles themselves, each found by solving for its centre."""
    out = []
    for a, b, c in p:
        centre = np.linalg.solve(2 * np.array([b - a, c - a]), [b @ b - a @ a, c @ c - a @ a])
        sides = np.array([np.linalg.norm(c - b), np.linalg.norm(a - c), np.linalg.norm(b - a)])
        incentre = (sides @ np.array([a, b, c])) / sides.sum()
        normal = np.array([a[1] - b[1], b[0] - a[0]]) / sides[2]
        out.append(np.linalg.norm(centre - a) / (2 * abs((incentre - a) @ normal)))
    return np.array(out)


def test_skewness_is_the_smallest_angle_between_median_and_midline():
    p = from_angles(*angle_grid(60)[1][:, :2].T)
    assert skewness(p) == pytest.approx(paper_skewness(p), abs=1e-6)


def test_aspect_ratio_is_circumradius_over_twice_inradius():
    p = SEED.normal(size=(500, 3, 2))
    p = p[np.abs(areas(p)) > 1e-2]
    assert aspect_ratios(p) == pytest.approx(ratio_of_radii(p), rel=1e-9)


def test_aspect_ratio_is_equation_2_of_the_paper():
    p, _ = angle_grid(60)
    a, b, c = np.linalg.norm(p - p[:, [1, 2, 0]], axis=2).T
    s = (a + b + c) / 2
    assert aspect_ratios(p) == pytest.approx(a * b * c / (8 * (s - a) * (s - b) * (s - c)), rel=1e-8)


def test_equilateral_is_the_best_triangle():
    p = from_angles(60, 60)
    assert aspect_ratios(p) == pytest.approx(1)
    assert skewness(p) == pytest.approx(90)
    assert angles(p) == pytest.approx(np.full((1, 3), 60))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=9, max_size=9), st.floats(1e-6, 1e6), st.floats(-180, 180))
def test_figures_do_not_change_with_size_place_and_turn(values, scale, turn):
    p = np.array(values).reshape(1, 3, 3)
    if areas(p)[0] < 1e-3:
        return
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    moved = scale * (p @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]) + [3.0, -2.0, 1.0])
    for figure in (skewness, aspect_ratios):
        assert figure(moved) == pytest.approx(figure(p), rel=1e-6)
    assert angles(moved) == pytest.approx(angles(p), abs=1e-5)
    assert angles(p).sum() == pytest.approx(180)


def test_orientation_shows_in_the_plane():
    p = from_angles(50, 60)
    turned = p[:, ::-1]
    assert areas(turned) == pytest.approx(-areas(p))
    assert skewness(turned) == pytest.approx(-skewness(p))
    assert flawed(turned).all()
    assert aspect_ratios(turned) == pytest.approx(aspect_ratios(p))


def test_triangles_of_no_area_are_the_worst():
    p = np.array([[[0, 0], [1, 0], [2, 0]], [[0, 0], [0, 0], [1, 1]], [[1, 1], [1, 1], [1, 1]]], float)
    assert np.isinf(aspect_ratios(p)).all()
    assert (skewness(p) == 0).all()
    assert flawed(p).all()


def test_skewness_45_bounds_the_aspect_ratio():
    # the worst is the obtuse isosceles triangle with tan(alpha) = sqrt(7) - 2
    alpha = math.atan(math.sqrt(7) - 2)
    bound = 1 / (4 * (1 - math.cos(alpha)) * math.cos(alpha))
    assert bound == pytest.approx(1.8608, abs=5e-5)
    p, _ = angle_grid()
    assert aspect_ratios(p)[skewness(p) >= 45].max() <= bound
    worst = from_angles(math.degrees(alpha), math.degrees(alpha))
    assert skewness(worst) == pytest.approx(45)
    assert aspect_ratios(worst) == pytest.approx(bound)


def test_valid_angles_lie_between_the_two_isosceles_triangles():
    p, corner = angle_grid()
    valid = ~flawed(p)
    smallest, largest = 2 * math.degrees(math.atan(1 / C45)), 2 * math.degrees(math.atan(C45 / 3))
    assert (smallest, largest) == pytest.approx((24.295, 114.295), abs=5e-4)
    assert corner[valid].min() > smallest
    assert corner[valid].max() < largest
    for edge, sign in ((smallest, 1), (largest, -1)):
        rest = (180 - edge) / 2
        inside, outside = rest - sign * 1e-3, rest + sign * 1e-3
        assert not flawed(from_angles(inside, inside))[0]
        assert flawed(from_angles(outside, outside))[0]


def test_smallest_angle_of_33_degrees_is_enough():
    p, corner = angle_grid()
    enough = math.degrees(math.atan(math.sqrt(7) - 2))
    assert enough == pytest.approx(32.8524, abs=1e-4)
    assert not flawed(p)[corner[:, 0] > enough].any()
    assert flawed(from_angles(enough - 1e-3, enough - 1e-3))[0]


def test_valid_third_vertices_fill_the_closed_region():
    """Discs of radius 1/sin t about (0, +-k), (1, +-k), k = cot t, and two lines through the middle."""
    x, y = (SEED.uniform(low, high, 20000) for low, high in ((-1, 2), (0, 3)))
    p = np.zeros((x.size, 3, 2))
    p[:, 1, 0] = 1
    p[:, 2] = np.stack([x, y], axis=1)
    for t in (20.0, 45.0, 60.0):
        k, r = 1 / math.tan(math.radians(t)), 1 / math.sin(math.radians(t))
        inside = np.abs(2 * x - 1) <= 2 * k * y
        for centre in (0.0, 1.0):
            inside &= np.hypot(x - centre, y - k) <= r
            inside &= np.hypot(x - centre, y + k) >= r
        assert inside.any()
        assert (inside == (skewness(p) >= t)).all()


@pytest.mark.parametrize("min_skew", [20.0, 45.0, 50.0, 60.0, 80.0])
def test_corner_limit_is_where_the_isosceles_triangle_turns_valid(min_skew):
    limit = corner_limit(min_skew, math.inf)
    for apex, good in ((limit + 1e-6, True), (limit - 1e-6, False)):
        base = (180 - apex) / 2
        assert (skewness(from_angles(base, base))[0] > min_skew) == good
    # no other triangle with that apex does better
    base = np.linspace(0.1, 179.9 - limit, 2001)
    assert skewness(from_angles(limit - 1e-3, base)).max() < min_skew


def test_corner_limit_of_an_aspect_ratio():
    limit = corner_limit(45.0, 1.2)
    assert limit > corner_limit(45.0)
    for apex, good in ((limit + 1e-6, True), (limit - 1e-6, False)):
        base = (180 - apex) / 2
        assert (aspect_ratios(from_angles(base, base))[0] < 1.2) == good


def test_corner_limit_at_the_defaults():
    assert corner_limit() == pytest.approx(24.295188945, abs=1e-9)
    assert corner_limit() == pytest.approx(2 * math.degrees(math.atan((math.sqrt(28.0) - 4.0) / 6.0)), abs=1e-12)
    assert corner_limit(45.0, 2.0) == corner_limit()


def test_growth_rates_and_edge_ratios_pair_by_pair():
    from scipy.spatial import Delaunay

    points = np.vstack([np.random.default_rng(3).random((60, 2)), [(9.0, 9.0)]])
    triangles = Delaunay(points[:60]).simplices.astype(np.int32)
    size, at_edge, at_node = [], {}, {}
    for number, corners in enumerate(triangles.tolist()):
        sides = [(corners[i], corners[i - 1]) for i in range(3)]
        lengths = [math.dist(points[a], points[b]) for a, b in sides]
        size.append(sum(lengths) / 3)
        for side, length in zip(sides, lengths, strict=True):
            at_edge.setdefault(frozenset(side), []).append(number)
            for node in side:
                at_node.setdefault(node, []).append(length)
    pairs = [both for both in at_edge.values() if len(both) == 2]
    rates = sorted(max(size[a], size[b]) / min(size[a], size[b]) for a, b in pairs)
    np.testing.assert_allclose(np.sort(growth_rates(points, triangles)), rates, rtol=1e-12)
    ratios = [max(at_node[v]) / min(at_node[v]) if v in at_node else 1.0 for v in range(61)]
    np.testing.assert_allclose(edge_ratios(points, triangles), ratios, rtol=1e-12)
    assert len(growth_rates(points, triangles[:1])) == 0
