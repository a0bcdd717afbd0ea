"""Corners that edges inside a face make: sized as corners of the outline are, and listed where they are too sharp."""

from __future__ import annotations

import math

import numpy as np
import pytest

import fubini
from materials import square
from meshes import apart, area


def ray(angle, length, at=(-1.0, -1.0)):
    """A line from a place under an angle in degrees."""
    turn = math.radians(angle)
    return at, (at[0] + length * math.cos(turn), at[1] + length * math.sin(turn))


@pytest.mark.parametrize("angle", [12, 20, 26, 40])
@pytest.mark.parametrize("size", [0.2, 0.05])
def test_an_edge_that_leaves_a_corner_of_the_outline(angle, size):
    mesh = fubini.mesh(square(ray(angle, 1.5)), size)
    (face,) = mesh.certificate.faces
    assert face.certified and area(mesh) == pytest.approx(4.0, rel=1e-13)
    assert face.flawed == face.unavoidable == (1 if angle < 24.29 else 0)
    assert [(c.point, round(c.angle, 6)) for c in face.corners] == [((-1.0, -1.0, 0.0), angle)] * face.unavoidable
    assert len(mesh.triangles) < 1.25 * len(fubini.mesh(square(), size).triangles) + 40
    assert apart(mesh) > 0.05 * size


def test_sharp_on_both_sides_and_several_in_one_node():
    """Three rays from the middle of the outline's left side: either narrow sector is a corner of its own."""
    rays = [ray(a, 0.9, (-1.0, 0.0)) for a in (-20, 0, 15)]
    mesh = fubini.mesh(square(*rays), 0.2)
    (face,) = mesh.certificate.faces
    assert face.certified and sorted(round(c.angle, 6) for c in face.corners) == [15.0, 20.0]
    assert face.flawed == 2


@pytest.mark.parametrize("crack", [False, True])
def test_two_edges_inside_that_meet_sharply(crack):
    model = square(((-0.5, 0), (0.5, 0)), ray(15, 1.0, (-0.5, 0.0)))
    mesh = fubini.mesh(model, 0.2, cracks="edges 5-6" if crack else None, order=2)
    (face,) = mesh.certificate.faces
    assert face.certified and face.unavoidable == face.flawed == 1
    assert face.corners[0].point == (-0.5, 0.0, 0.0) and face.corners[0].angle == pytest.approx(15.0)
    doubles = len(mesh.points) - len(np.unique(mesh.points, axis=0))
    assert doubles > 10 if crack else doubles == 0


def test_an_edge_that_grazes_the_outline():
    """No triangle is valid in a sector of 3 degrees, yet one alone is flawed."""
    mesh = fubini.mesh(square(ray(3, 1.0)), 0.3)
    (face,) = mesh.certificate.faces
    assert face.unavoidable == 1 and face.excess == 0 and face.certified


@pytest.mark.parametrize("size", [0.2, 0.05])
def test_a_sharp_corner_beside_a_sharper_one(size):
    """Both share a leg, and neither shortens it for the gap in the other, which shrinks with the leg."""
    mesh = fubini.mesh(square(*(ray(a, 0.5, (0.1, 0.03)) for a in (0, 15, 60))), size)
    (face,) = mesh.certificate.faces
    assert face.certified and face.flawed == face.unavoidable == 1
    assert len(mesh.triangles) < 1.25 * len(fubini.mesh(square(), size).triangles) + 200
    assert apart(mesh) > 0.02 * size
