"""Lattices laid along straight edges: equilateral triangles beside them, the same nodes and core otherwise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

import fubini
import regions
from fubini.sampling.interior import NO_CORE, best_lattice, lattice_points, lattice_with_core


def turned(points, degrees):
    a = math.radians(degrees)
    return np.asarray(points, float) @ np.array([(math.cos(a), math.sin(a)), (-math.sin(a), math.cos(a))])


@pytest.mark.parametrize("degrees", [0.0, 17.0, 90.0, 211.0])
def test_a_parallelogram_of_60_degrees_is_meshed_with_equilateral_triangles(degrees):
    corners = [(0, 0), (2, 0), (2.5, math.sqrt(3) / 2), (0.5, math.sqrt(3) / 2)]
    mesh = fubini.mesh(regions.polygon(turned(corners, degrees)), 0.1)
    assert len(mesh.triangles) == 2 * 20 * 10
    assert mesh.certificate.avoidable_skew > 89.99


@pytest.mark.parametrize("degrees", [0.0, 33.0])
def test_the_row_beside_the_longest_edge_is_equilateral(degrees):
    corners = turned([(0, 0), (3, 0), (3, 1), (0, 1.2)], degrees)
    boundary, sizing, _ = regions.discretise(regions.polygon(corners), 0.098)
    kinds = sizing.outlines[0].tracks.kinds
    lattice = best_lattice(boundary, kinds, 0.098, 0.35)
    inside = lattice.points
    assert lattice.core is None
    a, b = boundary.points[boundary.segments[boundary.track == 0]].transpose(1, 0, 2)
    middle, along = (a + b) / 2, b - a
    third = middle + math.sqrt(3) / 2 * np.column_stack([-along[:, 1], along[:, 0]])
    distance, _ = cKDTree(inside).query(third[1:-1])
    assert distance.max() < 1e-9
    assert lattice.spacing == pytest.approx(np.linalg.norm(along[0]), rel=1e-12)
    gaps, _ = cKDTree(inside).query(inside, k=2)
    np.testing.assert_allclose(gaps[:, 1], lattice.spacing, rtol=1e-9)
    to_boundary, _ = cKDTree(boundary.points).query(inside)
    assert to_boundary.min() > 0.6 * 0.098


def test_without_straight_edges_the_rows_run_along_x():
    boundary, sizing, _ = regions.discretise(regions.Region(regions.circle(0, 0, 1)), 0.1)
    lattice = best_lattice(boundary, sizing.outlines[0].tracks.kinds, 0.1, 0.35)
    assert lattice.direction == (1.0, 0.0)
    np.testing.assert_allclose(lattice.points, lattice_points(boundary, 0.1), atol=1e-12)


def test_a_node_lies_where_it_is_asked():
    boundary, _, _ = regions.discretise(regions.square(), 0.1)
    for node in ((0.5, 0.5), (0.43, 0.61), (-3.0, 7.2)):
        inside = lattice_with_core(boundary, 0.1, 0.35, (0.0, 0.0), NO_CORE, (0.6, 0.8), node).points
        steps = (inside - node) @ np.array([(0.6, -0.8), (0.8, 0.6)]) / (0.1 * np.array([0.5, math.sqrt(3) / 2]))
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
        assert (np.round(steps).sum(axis=1) % 2 == 0).all()


def test_the_core_of_a_turned_lattice_fits_into_the_mesh():
    corners = turned([(0, 0), (3, 0), (3, 1), (0, 1.2)], 33.0)
    mesh = fubini.mesh(regions.polygon(corners), 0.02)
    assert len(mesh.triangles) > 15_000
    assert mesh.certificate.certified
    skew = mesh.quality["skewness"]
    assert (skew > 89.999).mean() > 0.8
