"""Lattice nodes: inside, clear of the boundary, equilateral neighbours."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import regions
from fubini.sampling.interior import CLEARANCE, lattice_points
from regions import discretise


@pytest.mark.parametrize("make", [regions.quarter_disk, regions.plate, regions.gear, regions.blob])
def test_lattice_nodes_are_inside_and_clear_of_the_boundary(make):
    region = make()
    size = region.diagonal / 30
    boundary, _, _ = discretise(region, size)
    points = lattice_points(boundary, size)
    assert region.contains(points).all()
    p, q = (boundary.points[boundary.segments[:, i]] for i in (0, 1))
    d = q - p
    s = np.clip(((points[:, None] - p) * d).sum(2) / (d * d).sum(1), 0, 1)
    gap = np.linalg.norm(points[:, None] - p - s[..., None] * d, axis=2).min(axis=1)
    assert gap.min() >= CLEARANCE * size * (1 - 1e-9)


def test_lattice_is_hexagonal_and_complete():
    boundary, _, _ = discretise(regions.square(), 0.05)
    points = lattice_points(boundary, 0.05)
    distance, _ = cKDTree(points).query(points, k=2)
    assert np.allclose(distance[:, 1], 0.05)
    core = np.abs(points - 0.5).max(axis=1) < 0.38
    six, _ = cKDTree(points).query(points[core], k=7)
    assert np.allclose(six[:, 1:], 0.05)


def test_lattice_keeps_away_from_fine_boundary():
    boundary, _, _ = discretise(regions.slot(0.02), 0.5)
    points = lattice_points(boundary, 0.5)
    ends = np.array([[3.0, 3.0], [7.0, 3.0]])
    assert cKDTree(points).query(ends)[0].min() > (0.9 * 0.5 - 0.02) / 0.35 - 0.02


def test_shift_moves_the_lattice():
    boundary, _, _ = discretise(regions.square(), 0.05)
    a = lattice_points(boundary, 0.05)
    b = lattice_points(boundary, 0.05, shift=(0.5, 0.0))
    assert cKDTree(a).query(b)[0].max() > 0.02
