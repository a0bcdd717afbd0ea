"""Validation: every kind of fault found at its place, no fault on valid outlines."""

import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fubini
from fubini.curves import Bezier, BSpline, CircularArc, Line
from fubini.errors import GeometryError
from fubini.region import Region
from regions import blob, chain, circle, gear, loop, plate, quarter_disk, random_polygon, slot, wedge

SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]


def faults(region):
    return [(p.kind, tuple(round(x, 6) for x in p.place)) for p in region.validate()]


@pytest.mark.parametrize(
    "make",
    [quarter_disk, blob, gear, plate, slot, lambda: slot(1e-6), lambda: wedge(0.5), lambda: wedge(359)],
)
def test_valid_outlines_have_no_fault(make):
    region = make()
    assert region.validate() == ()
    assert region.check() is region
    c, s = math.cos(0.7), math.sin(0.7)
    assert region.transform([[c, -s], [s, c]], (100, -20)).validate() == ()


def test_self_crossing_outline():
    region = Region(loop([(0, 0), (2, 2), (2, 0), (0, 3)]))
    ((kind, place),) = faults(region)
    assert kind == "self-crossing"
    assert place == (1.2, 1.2)
    problem = region.validate()[0]
    assert problem.curves == (0, 2) and problem.edges == (0, 2) and problem.loops == (0, 0)
    with pytest.raises(GeometryError, match=r"edge 0: at \(1\.2, 1\.2\): self-crossing: edges 0 and 2"):
        region.check()


def test_vertex_on_an_edge_and_repeated_vertex():
    assert faults(Region(loop([(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)]))) == [("self-touching", (2, 0))]
    pinched = Region(loop([(0, 0), (2, 2), (4, 0), (4, 4), (2, 2), (0, 4)]))
    assert faults(pinched) == [("repeated vertex", (2, 2))]


def test_spike_of_no_width():
    spike = Region(loop([(0, 0), (4, 0), (4, 4), (2, 4), (2, 6), (2, 4), (0, 4)]))
    assert spike.validate()
    curved = CircularArc((4, 2), 2, math.pi, math.pi / 2)
    corner = (Line((0, 0), (4, 0)), Line((4, 0), (4, 4)))
    there_and_back = (*corner, curved.reverse(), curved, Line((4, 4), (0, 4)), Line((0, 4), (0, 0)))
    assert chain(*there_and_back).validate()


def test_loops_that_cross_touch_or_lie_apart():
    def kinds(*holes):
        return [p.kind for p in Region(loop(SQUARE), holes).validate()]

    assert kinds(circle(2, 2, 1)) == []
    assert kinds(circle(2, 2, 2.5)) == ["crossing loops"] * 8
    assert kinds(circle(3, 2, 1)) == ["touching loops"]
    assert kinds(circle(1.5, 2, 0.5), circle(2.5, 2, 0.5)) == ["touching loops"]
    assert kinds(circle(1.5, 2, 0.5), circle(2.3, 2, 0.5)) == ["crossing loops"] * 2
    assert kinds(circle(7, 2, 1)) == ["hole outside"]
    assert kinds(circle(2, 2, 1.5), circle(2, 2, 0.5)) == ["nested hole"]
    assert set(kinds(loop([(4, 4), (3, 4), (3, 3)]))) == {"touching loops"}
    assert "touching loops" in kinds(circle(2, 2, 1), circle(2, 2, 1))


def test_thin_rings_are_valid():
    for gap in (1e-2, 1e-4, 1e-6):
        region = Region(circle(0, 0, 1), (circle(0, 0, 1 - gap),))
        assert region.validate() == ()
        shifted = Region(circle(0, 0, 1), (circle(1.5 * gap, 0, 1 - gap),)).validate()
        # below a crossing angle of 1e-5 the two cannot be told apart within the tolerance
        assert shifted and {p.kind for p in shifted} <= {"crossing loops", "touching loops"}


def test_zero_area():
    line = Region(loop([(0, 0), (1, 1), (3, 3)]))
    assert "zero area" in [p.kind for p in line.validate()]
    assert "zero area" in [p.kind for p in Region(loop([(0, 0), (2, 2), (2, 0), (0, 2)])).validate()]


def test_curves_that_cross_themselves():
    knot = Bezier([(0, 0), (4, 3), (-3, 3), (1, 0)])
    region = chain(knot, Line((1, 0), (0, 0)))
    ((kind, place),) = faults(region)
    assert kind == "self-crossing"
    assert place[0] == pytest.approx(0.5, abs=1e-5)
    bulge = chain(Line((0, 0), (4, 0)), Bezier([(4, 0), (5, 4), (2, -8), (0, 3)]), Line((0, 3), (0, 0)))
    assert [k for k, _ in faults(bulge)] == ["self-crossing"] * 2


@pytest.mark.parametrize("spans", [6, 12, 50, 400])
@pytest.mark.parametrize("fall", [0.03, 0.3])
def test_a_spline_that_crosses_its_neighbour_beside_their_corner_is_found(spans, fall):
    """It leaves the corner on the wrong side, crosses the line within a few knots, then runs on as if nothing were."""
    x = np.linspace(0.0, 1.0, spans + 3)
    wide = 3.0 / (spans + 3)
    y = np.where(x < wide, 0.2 * wide * np.sin(np.pi * x / wide), -fall * (x - wide))
    edge = BSpline(3, np.concatenate([[0.0] * 3, np.linspace(0.0, 1.0, spans + 1), [1.0] * 3]), np.c_[x, y])
    region = chain(edge, Line((1, y[-1]), (1, 0)), Line((1, 0), (0, 0)))
    c, s = math.cos(0.6), math.sin(0.6)
    for turned in (region, region.transform([[c, -s], [s, c]])):
        (problem,) = turned.validate()
        assert problem.kind == "self-crossing"
        assert math.hypot(*problem.place) == pytest.approx(wide, rel=0.6)


def doubled_back(size, weights=None):
    """A square, one edge of which is a cubic B-spline whose control points go back by twice ``size`` amid it."""
    poles = [(0, 0), (0.2, 0.05), (0.5, 0), (0.5 + size, 0), (0.5 - size, 0), (0.5, 0), (0.8, 0.05), (1, 0)]
    edge = BSpline(3, [0, 0, 0, 0, 1, 2, 3, 4, 5, 5, 5, 5], poles, weights)
    return chain(edge, Line((1, 0), (1, 1)), Line((1, 1), (0, 1)), Line((0, 1), (0, 0)))


@pytest.mark.parametrize("weights", [None, [1, 1.4, 1.5, 1.1, 0.6, 0.5, 0.9, 1.3]])
@pytest.mark.parametrize("size", [1e-2, 1e-4, 1e-5, 1e-6, 1e-8])
def test_a_loop_in_an_edge_is_found_however_small(size, weights):
    (problem,) = doubled_back(size, weights).validate()
    assert problem.kind == "self-crossing" and problem.message.endswith("edge 0 of loop 0 crosses itself")
    assert problem.place == pytest.approx((0.5, 0.0), abs=0.2 * size)


@pytest.mark.parametrize("weights", [None, [1, 1.4, 1.5, 1.1, 0.6, 0.5, 0.9, 1.3]])
@pytest.mark.parametrize("size", [1e-9, 1e-11, 0.0])
def test_a_loop_below_the_tolerance_counts_as_a_point(size, weights):
    """Neither the loop nor what rounding makes of coincident control points calls for small triangles."""
    region = doubled_back(size, weights)
    assert region.validate() == ()
    mesh = fubini.mesh(region, 0.1)
    assert mesh.certificate.certified
    assert 200 < len(mesh.triangles) < 600


@pytest.mark.parametrize("wait", [1.0, 100.0, 1e4])
def test_a_spline_that_stays_in_one_place_is_meshed(wait):
    """Offsets that CAD kernels make: a sharp kink at which the parameter runs on while the point stays."""
    tip = (4.0, 1.7)
    poles = [(0, 0), (1.9, 0.4), (3.2, 1), tip, tip, tip, tip, (-10, -1.8), (-16, -3.6), (0, 0)]
    knots = [0.0] * 4 + [1.0] * 3 + [1.0 + wait] * 3 + [3.0 + wait] * 4
    region = chain(BSpline(3, knots, poles))
    assert region.validate() == ()
    certificate = fubini.mesh(region, 1.0).certificate
    assert certificate.certified
    assert certificate.faces[0].area_error < 0.02


@pytest.mark.parametrize("size", [1e-7, 1e-8, 1e-9])
def test_pieces_of_splines_beside_the_origin_are_functions_there(size):
    """Their coordinates are far smaller than those of the curve that they are cut from, whose rounding they keep."""
    for seed in range(20):
        poles = size * np.random.default_rng(seed).normal(size=(5, 2))
        edge = Bezier([(0, 0), *poles, (0.5, 0.05), (1, 0)])
        region = chain(edge, Line((1, 0), (1, 1)), Line((1, 1), (0, 1)), Line((0, 1), (0, 0)))
        assert region.contains([(0.5, 0.5), (0.5, -0.5)]).tolist() == [True, False]


@pytest.mark.parametrize("size", [1e-3, 1e-5, 1e-7])
def test_tiny_edges_are_no_fault(size):
    points = [(0, 0), (1, 0), (1 + size, size), (1 + size, 1), (1, 1 + size), (size, 1), (0, 1 - size)]
    assert Region(loop(points)).validate() == ()
    sharp = [(0, 0), (1, 0.1), (1 + size, 0.1), (1, 0.1 + size), (0, 0.2)]
    assert Region(loop(sharp)).validate() == ()


@pytest.mark.parametrize("noise", [0.0, 1e-9, 1e-8, -1e-8])
def test_tangent_joints_and_cusps_with_cad_noise(noise):
    """A line and an arc that should just touch at their joint, off by the accuracy of CAD data."""
    cusp = chain(Line((0, 0), (1, noise)), Line((1, noise), (1, 1)), CircularArc((0, 1), 1, 0, -math.pi / 2))
    assert cusp.validate() == ()
    straight = (Line((1, 1), (-1, 1)), Line((-1, 1), (-1, noise)), Line((-1, noise), (0, 0)))
    assert chain(CircularArc((0, 1), 1, -math.pi / 2, 0), *straight).validate() == ()


@given(st.integers(0, 10_000))
@settings(max_examples=15, deadline=None)
def test_random_polygons_are_valid_until_two_edges_are_swapped(seed):
    region = random_polygon(seed, 10, 40)
    assert region.validate() == ()
    points = region.outer.vertices.copy()
    k = seed % (len(points) - 3)
    points[[k, k + 2]] = points[[k + 2, k]]
    swapped = loop(points)
    assert (Region(swapped).validate() != ()) == slow_crossing(points)


def slow_crossing(p):
    def side(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    n = len(p)
    for i in range(n):
        for j in range(i + 2, n):
            a, b, c, d = p[i], p[(i + 1) % n], p[j], p[(j + 1) % n]
            if (i or j < n - 1) and side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
                return True
    return False


def test_a_thousand_edges_validate_fast():
    region = gear(205)
    assert len(region.curves) > 1000
    start = time.perf_counter()
    assert region.validate() == ()
    assert time.perf_counter() - start < 1.5


def test_scale_does_not_matter():
    for scale in (1e-6, 1.0, 1e6):
        matrix = scale * np.eye(2)
        assert plate().transform(matrix).validate() == ()
        crossed = Region(loop(SQUARE), (circle(2, 2, 2.5),)).transform(matrix)
        assert len(crossed.validate()) == 8


@pytest.mark.parametrize("sides", [3, 4, 7, 40])
def test_convex_polygons_are_valid_until_they_are_too_thin(sides):
    turn = 2.0 * math.pi * (np.arange(sides) + 0.2) / sides
    corners = np.array([np.cos(turn), np.sin(turn)]).T
    for height in (1.0, 1e-3, 1e-12):
        region = Region(loop(corners * (1.0, height)))
        assert bool(region.validate()) == (height < 1e-9)


def test_polygons_that_turn_twice_around_or_stop_short_are_not_convex():
    star = [(math.cos(a), math.sin(a)) for a in (2.0 * math.pi * 2 * k / 5 for k in range(5))]
    assert any(p.kind == "self-crossing" for p in Region(loop(star)).validate())
    assert Region(loop([(0, 0), (1, 0), (1, 1), (1, 0)])).validate()
