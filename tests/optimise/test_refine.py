"""Frontal refinement: sizes are met, the boundary stays, triangles are good from the start."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fubini.errors import OptionError
from fubini.optimise import refine
from fubini.quality import areas, flawed, skewness, squared_lengths
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate
from optimise.outlines import arc, boundary, line, polygon

SQUARE = [polygon(np.array([(0, 0), (1, 0), (1, 1), (0, 1)]))]
QUARTER = [
    [line((0, 0), (1, 0)), arc((0, 0), 1.0, 0.0, math.pi / 2), line((0, 1), (0, 0))],
    [arc((0.4, 0.4), 0.2, 2 * math.pi, 0.0)],
]


@pytest.mark.parametrize("loops", [SQUARE, QUARTER])
@pytest.mark.parametrize("h", [0.2, 0.05, 0.02])
def test_without_interior_points_the_front_fills_the_region(loops, h):
    made, tracks = boundary(loops, h)
    start = constrained_delaunay(made.points, made)
    filled = refine(start, tracks, h)
    assert validate(filled, delaunay=True) == ()
    np.testing.assert_array_equal(filled.points[: len(made.points)], made.points)
    assert filled.boundary is made
    corners = filled.points[filled.triangles]
    np.testing.assert_allclose(areas(corners).sum(), areas(start.points[start.triangles]).sum(), rtol=1e-12)
    edge = np.sqrt(squared_lengths(corners))
    assert edge.max() < 1.7 * h and edge.mean() > 0.8 * h
    assert skewness(corners).mean() > 71.0
    assert flawed(corners).mean() < 0.03


def test_sizes_grow_from_a_fine_part_of_the_boundary_to_the_largest():
    loops = [SQUARE[0], [arc((0.5, 0.5), 0.02, 2 * math.pi, 0.0)]]
    coarse, tracks = boundary(loops, 0.12)
    assert coarse.size.min() < 0.05
    filled = refine(constrained_delaunay(coarse.points, coarse), tracks, 0.12, gradient=0.35)
    corners = filled.points[filled.triangles]
    edge = np.sqrt(squared_lengths(corners)).mean(1)
    distance = np.hypot(*(corners.mean(1) - 0.5).T) - 0.02
    near, far = edge[distance < 0.03], edge[distance > 0.3]
    assert near.max() < 0.06 < 0.09 < far.mean()
    wanted = np.minimum(0.12, coarse.size.min() + 0.35 * (distance + 0.05))
    assert (edge < 1.7 * wanted).all()


def test_a_mesh_that_is_fine_enough_comes_back_as_it_is():
    made, tracks = boundary(SQUARE, 0.1)
    filled = refine(constrained_delaunay(made.points, made), tracks, 0.1)
    assert refine(filled, tracks, 0.3) is filled


def test_the_wanted_sizes_may_be_given():
    made, tracks = boundary(SQUARE, 0.2)
    start = constrained_delaunay(made.points, made)
    few = refine(start, tracks, 0.2, size=np.full(len(start.points), 0.2))
    many = refine(start, tracks, 0.1, size=np.full(len(start.points), 0.1))
    assert len(many.points) > 1.8 * len(few.points)


@pytest.mark.parametrize(("h", "gradient"), [(0.0, 0.35), (-1.0, 0.35), (0.1, 0.0), (math.nan, 0.35)])
def test_sizes_that_make_no_sense_are_refused(h, gradient):
    made, tracks = boundary(SQUARE, 0.2)
    start = constrained_delaunay(made.points, made)
    with pytest.raises(OptionError, match="must be positive"):
        refine(start, tracks, h, gradient)
