"""Cells cover the region once, their limits are its edges, slices lie only where they must."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fubini.cells import check_cells, decompose
from fubini.curves import CircularArc
from fubini.errors import GeometryError, OptionError
from fubini.region import Region
from regions import blob, chain, circle, gear, loop, plate, polygon, quarter_disk, random_polygon, slot, wedge

MAKERS = [quarter_disk, blob, gear, plate, slot, lambda: wedge(20), lambda: wedge(300)]


@pytest.mark.parametrize("direction", ["x", "y"])
@pytest.mark.parametrize("at_vertices", [False, True])
@pytest.mark.parametrize("make", MAKERS)
def test_cells_cover_the_region_once(make, direction, at_vertices):
    region = make()
    cells = decompose(region, direction, at_vertices)
    assert check_cells(region, cells).passed
    low, high = region.bounding_box
    points = low + (high - low) * np.random.default_rng(0).random((2000, 2))
    count = np.sum([cell.contains(points) for cell in cells], axis=0)
    distance = np.min([c.closest(points)[1] for c in region.curves], axis=0)
    clear = distance > 1e-9
    assert (count[clear] == region.contains(points)[clear]).all()


@given(st.integers(0, 10_000), st.booleans())
@settings(max_examples=15, deadline=None)
def test_random_polygons(seed, at_vertices):
    region = random_polygon(seed)
    for direction in ("x", "y"):
        cells = decompose(region, direction, at_vertices)
        assert check_cells(region, cells).passed
        for cell in cells:
            x = np.linspace(cell.a, cell.b, 50)[1:-1]
            assert (cell.s(x) > cell.r(x)).all()


def test_the_quarter_disk_is_one_cell():
    (cell,) = decompose(quarter_disk(), "y")
    assert (cell.kind, cell.a, cell.b, cell.neighbours) == ("I2", 0.0, 1.0, ())
    y = np.linspace(0, 1, 21)
    assert np.allclose(cell.r(y), 0, atol=1e-16)
    assert np.allclose(cell.s(y), np.sqrt(1 - y * y), atol=1e-15)
    assert cell.edges == (1, 2)
    assert [len(decompose(quarter_disk(), d)) for d in ("x", "auto")] == [1, 1]


def test_slices_only_where_intervals_change():
    """A bridge of two spans: the notches begin and end, other vertices are passed."""
    points = [(0, 0), (1, 1), (2, 1.2), (3, 0), (4, 0), (5, 1), (6, 0), (8, 0), (8, 3), (4, 4), (0, 3)]
    region = polygon(points)
    assert len(decompose(region, "x")) == 1
    assert len(decompose(region, "x", at_vertices=True)) == 7
    cells = decompose(region, "y")
    assert sorted(c.neighbours for c in cells) == sorted([(3,), (2,), (1, 3), (0, 2, 4), (3,)]) or len(cells) == 5
    (cell,) = decompose(region, "x")
    assert cell.r.breaks.tolist() == [0, 1, 2, 3, 4, 5, 6, 8]
    assert cell.s.breaks.tolist() == [0, 4, 8]
    assert cell.r.edges == tuple(range(7)) and cell.s.edges == (9, 8)


def test_limits_return_vertices_bit_for_bit():
    region = blob().transform([[0.6, -0.8], [0.8, 0.6]], (0.1, 0.2))
    for direction, axis in (("x", 0), ("y", 1)):
        vertices = {tuple(c.start) for c in region.curves}
        for cell in decompose(region, direction):
            for side in (cell.r, cell.s):
                for x in side.breaks[1:-1]:
                    y = side(x)
                    assert any((v[axis], v[1 - axis]) == (x, y) for v in vertices)


def test_a_round_hole_splits_at_its_extremes():
    region = Region(loop([(-3, -3), (3, -3), (3, 3), (-3, 3)]), (circle(0, 0, 1),))
    cells = decompose(region, "x")
    assert [(c.a, c.b) for c in cells] == [(-3, -1), (-1, 1), (-1, 1), (1, 3)]
    assert [c.neighbours for c in cells] == [(1, 2), (0, 3), (0, 3), (1, 2)]
    assert cells[1].s(0.6) == pytest.approx(-0.8, abs=1e-15)
    assert cells[2].r(0.6) == pytest.approx(0.8, abs=1e-15)


def test_holes_in_line_share_their_slices():
    holes = tuple(circle(0, y, 1) for y in (-4.0, 0.0, 4.0))
    region = Region(loop([(-3, -6), (3, -6), (3, 6), (-3, 6)]), holes)
    assert len(decompose(region, "x")) == 6
    assert len(decompose(region, "y")) == 10
    nudged = (circle(0, -4, 1), circle(1e-9, 0, 1), circle(-1e-9, 4, 1))
    region = Region(loop([(-3, -6), (3, -6), (3, 6), (-3, 6)]), nudged)
    cells = decompose(region, "x")
    assert check_cells(region, cells).passed


def test_steps_and_collinear_vertical_edges():
    tee = polygon([(0, 0), (6, 0), (6, 1), (4, 1), (4, 4), (2, 4), (2, 1), (0, 1)])
    assert [(c.a, c.b) for c in decompose(tee, "x")] == [(0, 2), (2, 4), (4, 6)]
    assert len(decompose(tee, "y")) == 2
    stairs = polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (2, 2), (2, 3), (0, 3)])
    cells = decompose(stairs, "x")
    assert [(c.a, c.b, c.neighbours) for c in cells] == [(0, 1, (1, 2)), (1, 2, (0,)), (1, 2, (0,))]


def test_vertices_that_line_up_but_for_rounding():
    c, s = math.cos(math.pi / 2), math.sin(math.pi / 2)  # c is 6e-17
    tee = polygon([(0, 0), (6, 0), (6, 1), (4, 1), (4, 4), (2, 4), (2, 1), (0, 1)])
    turned = tee.transform([[c, -s], [s, c]], (1e3, 1e3))
    assert len(decompose(turned, "x")) == 2
    assert len(decompose(turned, "y")) == 3
    assert check_cells(turned, decompose(turned, "x")).area_error < 1e-12


@pytest.mark.parametrize("size", [1e-4, 1e-7, 1e-10])
def test_tiny_edges(size):
    points = [(0, 0), (3, 0), (3 + size, size), (3, 2), (3 - size, 2 + 0.5 * size), (1, 2 + size), (0, 2)]
    for direction in ("x", "y"):
        cells = decompose(polygon(points), direction)
        assert check_cells(polygon(points), cells).passed


def test_auto_takes_the_fewer_cells():
    comb = [(0, 0), (9, 0), (9, 5), (8, 5), (8, 1), (5, 1), (5, 5), (4, 5), (4, 1), (1, 1), (1, 5), (0, 5)]
    assert len(decompose(polygon(comb), "x")) == 5
    assert len(decompose(polygon(comb), "y")) == 4
    assert {c.kind for c in decompose(polygon(comb), "auto")} == {"I2"}
    turned = polygon([(y, -x) for x, y in comb])
    assert {c.kind for c in decompose(turned)} == {"I1"}


def test_neighbours_are_mutual_and_connect_the_region():
    for make in (gear, plate, blob, lambda: random_polygon(5)):
        for direction in ("x", "y"):
            cells = decompose(make(), direction)
            for i, cell in enumerate(cells):
                assert all(i in cells[j].neighbours for j in cell.neighbours)
            seen, todo = {0}, [0]
            while todo:
                new = set(cells[todo.pop()].neighbours) - seen
                seen |= new
                todo += new
            assert len(seen) == len(cells)


def test_horns_of_a_crescent():
    outer = CircularArc((0, 0), 1, -math.pi / 2, math.pi / 2)
    inner = CircularArc((-1, 0), math.sqrt(2), math.pi / 4, -math.pi / 4)
    region = chain(outer, inner)
    for direction, n in (("x", 3), ("y", 1)):
        cells = decompose(region, direction)
        assert len(cells) == n
        assert check_cells(region, cells).passed


def test_errors():
    with pytest.raises(OptionError, match="'x', 'y', 'auto'"):
        decompose(quarter_disk(), "z")
    crossed = Region(loop([(0, 0), (6, 6), (6, 0), (1, 2), (0, 3)]))
    with pytest.raises(GeometryError, match="crosses itself"):
        decompose(crossed, "x")


def test_same_cells_every_time():
    one, two = decompose(gear()), decompose(gear())
    assert [(c.a, c.b, c.edges, c.neighbours) for c in one] == [(c.a, c.b, c.edges, c.neighbours) for c in two]
