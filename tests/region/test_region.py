"""Loops and regions: closure, orientation, exact areas and moments."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fubini.curves import Bezier, BSpline, CircularArc, EllipticalArc, Line
from fubini.errors import GeometryError
from fubini.region import Loop, Region, with_ends
from regions import TURN, blob, circle, loop, plate, quarter_disk, random_polygon


def test_a_loop_must_meet_bit_for_bit():
    nearly = (Line((0, 0), (1, 0)), Line((1, 1e-16), (0, 1)), Line((0, 1), (0, 0)))
    with pytest.raises(GeometryError, match=r"edge 0: at \(1, 0\).*open by 1e-16"):
        Loop(nearly)
    closed = Loop.closed(nearly, 1e-9)
    for i, curve in enumerate(closed.curves):
        assert np.array_equal(curve.end, closed.curves[(i + 1) % 3].start)


def test_a_wide_gap_is_an_error_with_its_place():
    with pytest.raises(GeometryError) as caught:
        Loop.closed((Line((0, 0), (3, 4)), Line((3, 4.5), (0, 0))), 0.1, edges=(7, 8))
    assert caught.value.edge == 7
    assert caught.value.at == (3.0, 4.0)
    assert "0.5" in str(caught.value)


def test_a_gap_moves_the_straight_edge():
    arc = CircularArc((0, 0), 1, 0, math.pi / 2)
    closed = Loop.closed((Line((0, 0), (1, 1e-8)), arc, Line((1e-8, 1), (0, 0))), 1e-6)
    assert closed.curves[1] is arc
    assert np.array_equal(closed.curves[0].end, arc.start)
    assert np.array_equal(closed.curves[2].start, arc.end)


@pytest.mark.parametrize(
    "curve",
    [
        Line((0, 0), (1, 2)),
        CircularArc((0, 0), 1, 0.2, 1),
        EllipticalArc((0, 0), (2, 0), (0, 1), 0, 1),
        Bezier([(0, 0), (1, 2), (3, 1)]),
        BSpline(2, [0, 0, 0, 1, 2, 2, 2], [(0, 0), (1, 2), (2, 0), (3, 1)], [1, 2, 1, 1]),
    ],
)
def test_with_ends_replaces_the_stored_ends_alone(curve):
    moved = with_ends(curve, curve.start + 1e-8, curve.end - 1e-8)
    assert np.array_equal(moved.point(0.0), curve.start + 1e-8)
    assert np.array_equal(moved.point(1.0), curve.end - 1e-8)
    assert np.allclose(moved.point(0.5), curve.point(0.5), atol=1e-8)


def test_reverse_turns_edges_and_directions():
    one = Loop((Line((0, 0), (1, 0)), Line((1, 0), (0, 1)), Line((0, 1), (0, 0))), (5, 6, 7), (True, False, True))
    back = one.reverse()
    assert back.edges == (7, 6, 5)
    assert back.forward == (False, True, False)
    assert back.signed_area == -one.signed_area == -0.5
    assert np.array_equal(back.vertices, [(0, 0), (0, 1), (1, 0)])


def test_region_orients_its_loops():
    outer, hole = loop([(0, 0), (0, 3), (3, 3), (3, 0)]), circle(1.5, 1.5, 0.5)
    for region in (Region(outer, (hole,)), Region.from_loops([hole, outer])):
        assert region.outer.signed_area == 9.0
        assert region.holes[0].signed_area < 0
        assert abs(region.area - (9 - math.pi / 4)) < 1e-14
        assert region.perimeter == pytest.approx(12 + math.pi, rel=1e-14)


def test_from_loops_refuses_two_outlines():
    with pytest.raises(GeometryError, match="outside the outer loop"):
        Region.from_loops([circle(0, 0, 2), circle(5, 0, 1)])
    with pytest.raises(GeometryError, match="at least one loop"):
        Region.from_loops([])


def test_moments_of_the_quarter_disk():
    region = quarter_disk()
    c = 4 / (3 * math.pi)
    assert region.area == pytest.approx(math.pi / 4, rel=1e-15)
    assert region.centroid == pytest.approx([c, c], rel=1e-14)
    second = math.pi / 16 - math.pi / 4 * c * c
    assert region.second_moments == pytest.approx([second, 1 / 8 - math.pi / 4 * c * c, second], rel=1e-13)


@given(st.integers(0, 200), st.floats(-1e4, 1e4), st.floats(-3, 3))
@settings(max_examples=12, deadline=None)
def test_area_and_moments_keep_their_figures_far_from_the_origin(seed, far, angle):
    region = random_polygon(seed)
    matrix = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    image = region.transform(matrix, (far, -2 * far))
    noise = 1e-15 * (1 + abs(far)) * region.perimeter
    assert abs(image.area - region.area) < 10 * noise
    assert image.centroid == pytest.approx(matrix @ region.centroid + (far, -2 * far), abs=20 * noise / region.area)
    assert image.second_moments[[0, 2]].sum() == pytest.approx(region.second_moments[[0, 2]].sum(), abs=20 * noise)


def test_a_mirror_image_stays_a_region():
    image = plate().transform([[-1, 0], [0, 2]], (3, 0))
    assert image.area == pytest.approx(2 * plate().area, rel=1e-14)
    assert image.outer.signed_area > 0 and all(h.signed_area < 0 for h in image.holes)
    assert image.check() is image


def test_polygon_numbers_its_edges_through():
    region = Region.polygon([(0, 0), (2, 0), (2, 2), (0, 2), (0, 0)], [[(0.5, 0.5), (1, 0.5), (1, 1)]])
    assert region.edges == (0, 1, 2, 3, 6, 5, 4)
    assert len(region.curves) == 7


def test_bounding_box_holds_curved_edges():
    box = blob().bounding_box
    points = np.concatenate([c.point(np.linspace(0, 1, 2000)) for c in blob().curves])
    assert (points >= box[0]).all() and (points <= box[1]).all()
    assert np.allclose(points.min(axis=0), box[0], atol=1e-5) and np.allclose(points.max(axis=0), box[1], atol=1e-5)
    assert Region(circle(0, 0, 1)).diagonal == pytest.approx(math.sqrt(8))
    assert circle(0, 0, 1).length == pytest.approx(TURN)


def test_canonical_numbering_depends_on_the_shape_alone():
    square = np.array([(0, 0), (4, 0), (4, 4), (0, 4)], float)
    small = np.array([(3, 1), (3, 2), (2, 2), (2, 1)], float)
    holes = [small, small - (1.5, 0), 0.5 * small + (1, 2)]
    noise = 1e-14 * np.array([(1, -1), (-1, 1), (0, 1), (1, 0)])
    wanted = Region.polygon(square, holes).canonical()
    assert wanted.outer.curves[0].start.tolist() == [0, 0]
    starts = [hole.curves[0].start.tolist() for hole in wanted.holes]
    assert starts == [[0.5, 1], [2, 1], [2, 2.5]]  # by area, then from the left
    for k in range(4):
        others = [np.roll(hole + noise, k + i, axis=0) for i, hole in enumerate(reversed(holes))]
        found = Region.polygon(np.roll(square + noise, k, axis=0), others).canonical()
        for a, b in zip(wanted.curves, found.curves, strict=True):
            assert b.start == pytest.approx(a.start, abs=1e-12)
        # the edges keep the numbers that they came with
        assert sorted(found.edges) == list(range(16))
        assert found.outer.edges == tuple((i + k) % 4 for i in range(4))
