"""Integrals through the mapping against closed forms and boundary integrals."""

import math

import numpy as np
import pytest

from fubini.cells import check_cells, decompose, integrate
from fubini.curves import BSpline, EllipticalArc
from fubini.errors import OptionError
from fubini.region import Loop, Region
from regions import blob, circle, gear, plate, quarter_disk, random_polygon, wedge


def test_monomials_over_the_quarter_disk():
    for i in range(6):
        for j in range(6):
            exact = 0.5 * math.gamma((i + 1) / 2) * math.gamma((j + 1) / 2) / math.gamma((i + j + 4) / 2) / 2
            value = integrate(quarter_disk(), lambda p, i=i, j=j: p[:, 0] ** i * p[:, 1] ** j)
            assert value == pytest.approx(exact, rel=1e-13)


def test_smooth_function_over_an_ellipse_with_a_hole():
    ellipse = Loop((EllipticalArc((0, 0), (2, 1), (-0.5, 1), 0.3, 0.3 + 2 * math.pi),))
    value = integrate(Region(ellipse), lambda p: np.exp(p[:, 0]), order=20)
    # by the affine image of the disk: 2 pi |det| I1(k) / k with k the length of the row (2, -0.5)
    k = math.hypot(2, 0.5)
    series = sum((k / 2) ** (2 * n + 1) / (math.factorial(n) * math.factorial(n + 1)) for n in range(40))
    assert value == pytest.approx(2 * math.pi * 2.5 * series / k, rel=1e-12)
    ring = Region(circle(0, 0, 2), (circle(0.3, 0.2, 1),))
    assert integrate(ring, lambda p: (p**2).sum(axis=1)) == pytest.approx(
        8 * math.pi - math.pi * (0.5 + 0.13), rel=1e-13
    )


def test_domains_and_shapes():
    region = plate()
    cells = decompose(region, "x")
    total = integrate(cells, lambda p: np.ones(len(p)))
    assert isinstance(total, float)
    assert total == pytest.approx(region.area, rel=1e-13)
    assert sum(c.area() for c in cells) == pytest.approx(region.area, rel=1e-13)
    assert integrate(cells[0], lambda p: np.ones(len(p))) == cells[0].area()
    both = integrate(region, lambda p: np.stack([np.ones(len(p)), p[:, 0]], axis=1))
    assert both == pytest.approx([region.area, region.area * region.centroid[0]], rel=1e-13)
    mixed = [*decompose(quarter_disk(), "x"), *decompose(quarter_disk(), "y")]
    assert integrate(mixed, lambda p: np.ones(len(p))) == pytest.approx(math.pi / 2, rel=1e-14)
    with pytest.raises(OptionError):
        integrate([], lambda p: np.ones(len(p)))


def test_points_lie_inside():
    region = blob()
    seen = []
    integrate(region, lambda p: seen.append(p) or np.ones(len(p)))
    assert region.contains(np.concatenate(seen), 1e-12).all()


def vertical_inflection() -> Region:
    """Outline with an edge x = t^3 that stands upright without turning back."""
    edge = BSpline(3, [0, 0, 0, 0, 1, 1, 1, 1], [(-1, -1), (1, -1 / 3), (-1, 1 / 3), (1, 1)])
    return Region.from_loops([Loop.closed((edge, *Loop.polygon([(1, 1), (-1, 1), (-1, -1)]).curves[:2]), 1e-9)])


@pytest.mark.parametrize(
    "make",
    [quarter_disk, blob, gear, plate, vertical_inflection, lambda: wedge(1), lambda: wedge(359),
     lambda: Region(circle(0, 0, 1), (circle(1e-6, 0, 1 - 1e-5),)), lambda: random_polygon(1)],
)  # fmt: skip
def test_cells_agree_with_boundary_integrals(make):
    region = make()
    for direction in ("x", "y"):
        figures = check_cells(region, decompose(region, direction))
        # a ring of width 1e-5 has coordinates five digits larger than its area
        lost = region.diagonal**2 / region.area
        assert figures.area_error <= max(1e-14, 1e-16 * lost) * 10
        assert figures.centroid_error <= 1e-12 * lost
        assert figures.moment_error <= 1e-12 * lost


def test_a_missing_cell_shows():
    region = plate()
    figures = check_cells(region, decompose(region, "x")[1:])
    assert not figures.passed
    assert figures.area_error > 1e-3


def test_a_constant_may_be_given_as_a_number():
    assert integrate(quarter_disk(), lambda p: 2.0) == pytest.approx(math.pi / 2, rel=1e-14)
