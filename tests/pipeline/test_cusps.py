"""Cusps and slender wedges beside flat walls: a long first segment, and one triangle left flawed in each corner."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("OCP")

from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.GC import GC_MakeArcOfCircle
from OCP.gp import gp_Pnt, gp_Vec

import fubini
from fubini.quality import skewness
from random_regions import crescent
from regions import model_of


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


@pytest.mark.parametrize(
    ("degrees", "height", "size"), [(1.5, 2.0, 2.2), (1.6, 2.0, 0.3), (1.7, 5.0, 5.0), (1.9, 0.5, 0.6)]
)
def test_the_slenderest_wedges_with_walls_have_legs_of_two_lengths(degrees, height, size):
    mesh = fubini.mesh(wedge(degrees, height), size)
    c = mesh.certificate
    assert c.certified
    assert c.flawed == c.unavoidable == 2
    assert c.triangles < 5000
    p = mesh.points[mesh.triangles]
    worst = p[np.argmin(skewness(p))]
    legs = np.sort(np.linalg.norm(worst - np.roll(worst, 1, axis=0), axis=1))
    assert 1.0001 < legs[2] / legs[1] < 1.05
    best = math.degrees(math.atan2(2.0, 1.0 / math.tan(math.radians(degrees)) - math.tan(math.radians(degrees / 2.0))))
    assert skewness(p).min() > 0.95 * best


def flat(*points):
    wire = BRepBuilderAPI_MakePolygon()
    for point in points:
        wire.Add(gp_Pnt(*map(float, point)))
    wire.Close()
    return BRepBuilderAPI_MakeFace(wire.Wire()).Face()


def corner(degrees, upright):
    """A triangle with this angle at the origin and one side on the x axis, in the plane of x and y or of x and z."""
    rise = 10.0 * math.tan(math.radians(degrees))
    return flat((0, 0, 0), (10, 0, 0), (10, 0, rise) if upright else (10, rise, 0))


@pytest.mark.parametrize("wide", [25.0, 26.6, 30.0])
def test_a_slender_corner_leaves_room_for_a_wider_one_on_its_leg(wide):
    """The wider corner has one triangle as well, beside which the next segment must not be too short."""
    mesh = fubini.mesh([corner(wide, upright=False), corner(4.1, upright=True)], 3.0, imprint=True)
    c = mesh.certificate
    assert c.certified and c.flawed == c.unavoidable == 1
    shared = (mesh.points[:, 1:] == 0.0).all(axis=1)
    first, second = np.diff(np.sort(mesh.points[shared, 0]))[:2]
    assert first < 10.0 * second


@pytest.mark.parametrize(("width", "size"), [(0.5, 10.0), (0.5, 3.0), (0.1, 10.0)])
def test_a_leg_across_a_narrow_part_of_another_face_is_shortened(width, size):
    strip = flat((-3, 0, 0), (10, 0, 0), (10, width, 0), (-3, width, 0))
    mesh = fubini.mesh([strip, corner(10.0, upright=True)], size, imprint=True)
    c = mesh.certificate
    assert c.certified and c.flawed == c.unavoidable == 1
    x = np.sort(mesh.points[(mesh.points[:, 1:] == 0.0).all(axis=1), 0])
    assert x[x > 0.0][0] < 1.5 * width


@pytest.mark.parametrize("turn", [5.0, 7.8, 12.0])
@pytest.mark.parametrize("size", [5.0, 1.0])
def test_a_cusp_with_walls_on_a_short_arc(turn, size):
    """Two thirds of the arc may be needed for a leg that both walls can stand."""
    a, radius = math.radians(turn), 2.0
    middle, end = ((radius * math.sin(b), radius * (1.0 - math.cos(b))) for b in (0.5 * a, a))
    top = (20.0, end[1] + (20.0 - end[0]) * math.tan(a))
    part = plate([(0, 0), (20, 0)], [(20, 0), top], [top, end], [end, middle, (0, 0)], height=10.0)
    c = fubini.mesh(part, size).certificate
    assert c.certified
    assert c.flawed == c.unavoidable == 2


@pytest.mark.parametrize(("size", "alike"), [(20.0, True), (0.5, False)])
def test_attempts_that_start_alike_are_made_once(size, alike, monkeypatch):
    """Where the size leaves no room for a lattice, another origin of it changes nothing."""
    from fubini.pipeline import faces

    calls, attempt = [], faces.attempt
    monkeypatch.setattr(faces, "attempt", lambda *a: calls.append(a) or attempt(*a))
    fubini.mesh(corner(40.0, upright=False), size)
    face, tried = calls[0][:4], []
    assert attempt(*face, 2, None, tried=tried) is not None and len(tried) == 1
    assert (attempt(*face, 4, None, tried=tried) is None) == alike
    assert len(tried) == (1 if alike else 2)


@pytest.mark.parametrize("effort", [5_000, 20_000])
def test_a_face_that_cannot_be_had_is_given_up_when_its_effort_is_spent(effort, monkeypatch):
    """A wedge of 1.2 degrees with walls is had with luck alone."""
    from fubini.pipeline import faces

    outcomes, attempt = [], faces.attempt

    def noted(*args):
        outcomes.append(attempt(*args))
        return outcomes[-1]

    monkeypatch.setattr(faces, "attempt", noted)
    monkeypatch.setattr(faces, "EFFORT", effort)
    c = fubini.mesh(wedge(1.2, 0.3), 2.2).certificate
    reported = [f for f in c.faces if f.excess]
    assert reported and all(f.budget_exhausted for f in reported)
    assert all("budget of moves was spent" in reason for f in reported for reason in f.reasons)
    efforts = [found[0].effort for found in outcomes if found is not None and found[0].excess]
    assert sum(efforts) < len(reported) * effort + 12 * max(efforts)


def test_a_face_beside_too_sharp_a_wedge_is_given_up_at_once(monkeypatch):
    """A wedge below 1.1 degrees with walls leaves flaws in any mesh, so that neither lattices nor sizes help."""
    from fubini.pipeline import faces

    calls, attempt = [], faces.attempt
    monkeypatch.setattr(faces, "attempt", lambda *a: calls.append(a) or attempt(*a))
    c = fubini.mesh(wedge(0.9, 2.0), 2.2).certificate
    reported = [f for f in c.faces if f.excess]
    assert len(reported) == 2 and not any(f.budget_exhausted for f in reported)
    assert len(calls) <= 2 * 3 + 3 * 1 + 2


@pytest.mark.parametrize("gap", [1e-2, 1e-3])
def test_legs_of_a_cusp_between_nearly_equal_circles_stay_as_long_as_asked(gap):
    """A cusp opens in proportion to its leg: a shorter one does not come nearer to the angle of the tangents."""
    model = model_of(crescent(1.0 - gap))
    size = model.diagonal / 60.0
    mesh = fubini.mesh(model, size)
    c = mesh.certificate
    assert c.certified and c.unavoidable == 1
    p = mesh.points[mesh.triangles]
    legs = np.sort(np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2), axis=1)[np.argmin(skewness(p))]
    assert legs[1] > 0.5 * size
    assert c.triangles < 100.0 / gap
