"""Seeded slices of the generators of random regions: every one is certified."""

from __future__ import annotations

import numpy as np
import pytest

import fubini
import random_regions
import regions
from fubini.sampling.tangles import crossed

KEYS = [(s, (10, 25, 50, 15)[s % 4]) for s in [*range(40), 103]]


def certified(region, size, **options):
    mesh = fubini.mesh(regions.model_of(region), size, **options)
    c = mesh.certificate
    assert c.certified, [f.reasons for f in c.faces]
    assert c.flawed <= c.unavoidable
    ends = mesh.points[mesh.triangles]
    assert np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2).max() < 1.75 * size
    return mesh


@pytest.mark.parametrize(("seed", "share"), KEYS)
def test_random_outlines_of_lines_arcs_and_splines_are_certified(seed, share):
    region = random_regions.random_region(seed)
    certified(region, region.diagonal / share)


@pytest.mark.parametrize("seed", range(1000, 1030))
def test_more_random_polygons_are_certified(seed):
    region = regions.random_polygon(seed)
    certified(region, region.diagonal / (10, 30, 60)[seed % 3])


@pytest.mark.parametrize("seed", range(40))
def test_slender_parts_are_certified(seed):
    region = random_regions.slender_region(seed)
    certified(region, region.diagonal / (8, 40, 150)[seed // 4 % 3])


@pytest.mark.parametrize("region", [pytest.param(r, id=name) for name, r in random_regions.touching_regions()])
def test_what_all_but_touches_is_certified(region):
    certified(region, region.diagonal / 20.0)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("bound", [50.0, 55.0])
def test_higher_bounds_are_certified_on_random_polygons(seed, bound):
    region = regions.random_polygon(seed)
    certified(region, region.diagonal / 20.0, min_skew=bound)


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e6])
def test_random_outlines_of_any_scale_far_away_are_certified(scale):
    region = regions.random_polygon(2).transform(np.eye(2) * scale, (1e6 * scale, -7e5 * scale))
    certified(region, region.diagonal / 20.0)


@pytest.mark.parametrize("family", ["DejaVu Sans", "DejaVu Serif", "DejaVu Sans Mono"])
def test_letters_are_certified(family):
    pytest.importorskip("matplotlib")
    for character in "Agkmx468":
        for region in random_regions.glyph(character, family):
            certified(region, region.diagonal / 15.0)


def test_chords_of_a_hole_beside_a_coarse_arc_are_untangled():
    # a hole so near the outline that the coarse chord of the outline cuts through it
    arc = regions.CircularArc((0.0, 0.0), 1.0, -np.pi / 2, np.pi / 2)
    half = regions.Loop.closed((arc, regions.Line((0.0, 1.0), (0.0, -1.0))), 1e-9)
    region = regions.Region.from_loops([half, regions.circle(0.9 * np.cos(0.2), 0.9 * np.sin(0.2), 0.0995)])
    certified(region, 0.8)


def test_crossing_segments_are_found_but_not_joined_ones():
    rows = [[[0, 0], [2, 0]], [[2, 0], [3, 1]], [[1, -1], [1, 1]], [[5, -1], [5, 1]], [[0.5, 0], [0.5, 1]]]
    ends = np.array(rows, float)
    boxes = np.concatenate([ends.min(axis=1), -ends.max(axis=1)], axis=1).T
    assert crossed(ends, boxes, 0).tolist() == [2, 4]


@pytest.mark.parametrize("seed", [367, 432, 470, 547])
def test_corners_that_barely_fit_a_triangle_keep_its_legs_equal(seed):
    # corners of 24.4 degrees: only the isosceles triangle is valid, and the first attempt keeps it
    region = regions.random_polygon(seed)
    certified(region, region.diagonal / (20 if seed % 4 == 3 else 10), attempts=1, rounds=0)


@pytest.mark.parametrize("degrees", [2, 8, 15, 22])
def test_the_triangle_of_an_unavoidable_corner_is_near_the_best(degrees):
    a = np.radians(degrees)
    region = regions.polygon([(0, 0), (1, 0), (1.3 * np.cos(a), 1.3 * np.sin(a))])
    mesh = certified(region, 0.1)
    best = np.degrees(np.arctan2(2.0, 1 / np.tan(a) - np.tan(a / 2)))
    at_corner = (mesh.triangles == np.flatnonzero((mesh.points == 0).all(1))[0]).any(axis=1)
    assert at_corner.sum() == 1
    assert mesh.quality["skewness"][at_corner][0] > 0.95 * best


@pytest.mark.parametrize("degrees", [5, 20])
@pytest.mark.parametrize("size", [0.1, 0.25, 0.4])
def test_legs_at_curves_that_close_in_keep_the_angle_of_their_corner(degrees, size):
    # chords open by less than the tangents do, the less the longer they are
    a = np.radians(degrees)
    end = 2.0 * np.array([np.cos(0.5 * a), np.sin(0.5 * a)])
    sagitta = np.tan(a / 8.0)  # each arc leaves its chord by a quarter of the corner's angle
    below, above = (random_regions.arc(*ends, sagitta) for ends in (((0, 0), (2, 0)), (end, (0, 0))))
    region = regions.chain(below, regions.Line((2, 0), end), above)
    mesh = certified(region, size)
    (corner,) = (c for c in mesh.certificate.faces[0].corners if c.angle < 24.0)
    assert corner.angle == pytest.approx(degrees, abs=1e-6)
    at_corner = (mesh.triangles == np.linalg.norm(mesh.points, axis=1).argmin()).any(axis=1)
    best = np.degrees(np.arctan2(2.0, 1 / np.tan(a) - np.tan(a / 2)))
    assert mesh.quality["skewness"][at_corner].max() > 0.95 * best
