"""Cusps and slender wedges beside flat walls: a long first segment, and one triangle left flawed in each corner."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("OCP")

from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.GC import GC_MakeArcOfCircle
from OCP.gp import gp_Pnt, gp_Vec

import fubini


def plate(*parts, height):
    """A flat face bounded by lines (two points) and arcs (three), extruded unless the height is 0."""
    wire = BRepBuilderAPI_MakeWire()
    for points in parts:
        p = [gp_Pnt(x, y, 0.0) for x, y in points]
        wire.Add(BRepBuilderAPI_MakeEdge(*p if len(p) == 2 else (GC_MakeArcOfCircle(*p).Value(),)).Edge())
    face = BRepBuilderAPI_MakeFace(wire.Wire()).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0.0, 0.0, height)).Shape() if height else face


def cut_plate(height=2.0):
    """A square less a half disk that touches two of its sides from inside: two cusps."""
    corners = [(0, -10), (20, -10), (20, 10), (0, 10)]
    return plate(*pairwise(corners), [(0, 10), (10, 0), (0, -10)], height=height)


def wedge(degrees, height=2.0):
    end = (20 * math.cos(math.radians(degrees)), 20 * math.sin(math.radians(degrees)))
    return plate([(0, 0), (20, 0)], [(20, 0), end], [end, (0, 0)], height=height)


@pytest.mark.parametrize("size", [0.5, 1.0, 2.2, 5.0])
def test_cusps_beside_walls_cost_one_triangle_each(size):
    c = fubini.mesh(cut_plate(), size).certificate
    assert c.certified
    assert c.flawed == c.unavoidable == 4
    assert c.triangles < 8000


@pytest.mark.parametrize(("height", "size"), [(5.0, 0.3), (0.5, 0.3), (2.0, 0.1)])
def test_legs_longer_than_asked_beside_walls(height, size):
    mesh = fubini.mesh(cut_plate(height), size)
    c = mesh.certificate
    assert c.certified
    assert c.flawed == c.unavoidable == 4
    sides = mesh.points[mesh.triangles] - mesh.points[np.roll(mesh.triangles, 1, axis=1)]
    longest = np.linalg.norm(sides, axis=2).max(axis=1)
    assert longest.max() > 1.7 * size  # no shorter leg will do: see docs/theory/corners.md
    assert (longest > 1.7 * size).mean() < 0.01


@pytest.mark.parametrize("size", [0.05, 0.5, 2.2])
def test_cusps_of_a_single_face_cost_one_triangle_each(size):
    c = fubini.mesh(cut_plate(height=0.0), size).certificate
    assert c.certified
    assert c.flawed == c.unavoidable == 2


@pytest.mark.parametrize("degrees", [2.3, 5, 9])
def test_slender_wedges_with_walls_do_not_shrink_their_own_legs(degrees):
    c = fubini.mesh(wedge(degrees), 2.2).certificate
    assert c.certified
    assert c.flawed == c.unavoidable == 2
    assert c.triangles < 1000
