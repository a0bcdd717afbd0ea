"""Interior angles: corners, smooth joints, cusps of both kinds, ends without a derivative."""

import math

import numpy as np
import pytest

from fubini.curves import Bezier, CircularArc, Line
from fubini.region import Loop, Region, end_direction, start_direction
from regions import chain, circle, gear, random_polygon, wedge


def angles(region, loop=0):
    return [c.angle for c in region.corners() if c.loop == loop]


def test_square_with_a_hole():
    region = Region.polygon([(0, 0), (3, 0), (3, 3), (0, 3)], [[(1, 1), (2, 1), (2, 2)]])
    assert angles(region) == pytest.approx([90] * 4)
    assert sorted(angles(region, 1)) == pytest.approx([270, 315, 315])
    corner = region.corners()[1]
    assert (corner.index, corner.point) == (1, (3.0, 0.0))


@pytest.mark.parametrize("degrees", [1, 10, 24.3, 60, 120, 179.5, 270, 350])
def test_wedge(degrees):
    assert angles(wedge(degrees)) == pytest.approx([degrees, 90, 90], abs=1e-9)


def test_angles_of_a_polygon_add_up():
    for seed in range(12):
        region = random_polygon(seed)
        for k, part in enumerate(region.loops):
            turns = 2 if k == 0 else -2
            assert sum(angles(region, k)) == pytest.approx(180 * (len(part) - turns), abs=1e-6)
    assert sum(angles(gear())) == pytest.approx(180 * (len(gear().outer) - 2))


def test_closed_single_curve_is_smooth():
    assert angles(Region(circle(0, 0, 1))) == pytest.approx([180])
    drop = Region(Loop((Bezier([(0, 0), (2, -1), (2, 1), (0, 0)]),)))
    assert angles(drop) == pytest.approx([2 * math.degrees(math.atan(0.5))])


def cusp_of_material():
    """Between the x axis and a circle that rests on it at the origin."""
    return chain(Line((0, 0), (1, 0)), Line((1, 0), (1, 1)), CircularArc((0, 1), 1, 0, -math.pi / 2))


def cusp_of_air():
    """The square around, with that sliver cut out."""
    return chain(
        CircularArc((0, 1), 1, -math.pi / 2, 0), Line((1, 1), (-1, 1)), Line((-1, 1), (-1, -1)),
        Line((-1, -1), (1, -1)), Line((1, -1), (1, 0)), Line((1, 0), (0, 0)),
    )  # fmt: skip


def test_tangential_cusps_are_told_apart():
    assert min(angles(cusp_of_material())) == pytest.approx(0, abs=1e-9)
    assert max(angles(cusp_of_air())) == pytest.approx(360, abs=1e-9)
    assert not cusp_of_material().validate() and not cusp_of_air().validate()


@pytest.mark.parametrize("degrees", [0.005, 0.02])
def test_cusps_whose_ends_cross_within_the_accuracy_of_cad_data(degrees):
    """The circle dips below the axis it leaves, by less than 1e-7, and rises over it."""
    turned = CircularArc((math.sin(a := math.radians(degrees)), math.cos(a)), 1, 0.0, -math.pi / 2 - a)
    region = chain(Line((0, 0), (2, 0)), Line((2, 0), turned.start), turned)
    assert not region.validate()
    assert region.corners()[0].angle == 0.0


@pytest.mark.parametrize("turn", np.linspace(0, 6, 25))
@pytest.mark.parametrize("radius", [2.0, 1.0001, -3.0])
def test_cusps_between_arcs_in_every_direction(turn, radius):
    """Two circles that touch: a crescent horn for like centres, a wedge of air for opposite ones."""
    first = CircularArc((0, 1), 1, -math.pi / 2, -math.pi / 4)
    bow = abs(radius)
    sweep = math.pi / (4 * bow) * (1 if radius > 0 else -1)
    start = -math.pi / 2 if radius > 0 else math.pi / 2
    second = CircularArc((0, radius), bow, start, start + sweep)
    region = chain(second, Line(second.end, first.end), first.reverse())
    c, s = math.cos(turn), math.sin(turn)
    image = region.transform([[c, -s], [s, c]], (5, 7))
    assert image.corners()[0].angle == pytest.approx(0, abs=1e-6)
    mirrored = image.transform([[-1, 0], [0, 1]])
    assert min(angles(mirrored)) == pytest.approx(0, abs=1e-6)


def test_vanishing_derivatives():
    doubled = Bezier([(0, 0), (0, 0), (1, 2), (3, 3), (3, 3)])
    assert start_direction(doubled) == pytest.approx(np.array([1, 2]) / math.sqrt(5))
    assert end_direction(doubled) == pytest.approx(np.array([2, 1]) / math.sqrt(5))
    tripled = Bezier([(0, 0), (0, 0), (0, 0), (1, 1)])
    assert start_direction(tripled) == pytest.approx(np.array([1, 1]) / math.sqrt(2))
    assert end_direction(tripled.reverse()) == pytest.approx(-np.array([1, 1]) / math.sqrt(2))


def test_curvature_comparable_with_noise_of_the_tangent():
    """A fillet whose tangent is off by 1e-6 rad is smooth, and no cusp."""
    a = 1e-6
    arc = CircularArc((0, 1), 1, -math.pi / 2 + a, 0)
    region = chain(Line((-1, arc.start[1]), arc.start), arc, Line((1, 1), (-1, 1)), Line((-1, 1), (-1, arc.start[1])))
    assert region.corners()[1].angle == pytest.approx(180, abs=1e-3)
