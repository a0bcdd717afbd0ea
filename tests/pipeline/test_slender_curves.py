"""Ellipses of 1 : 10,000, near-cusps and heavy weights: curves that even parameters tell little of."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import fubini
from fubini.curves import Bezier, BSpline, EllipticalArc, Line
from fubini.region import Loop, Region
from random_regions import arc as low_arc
from random_regions import random_region
from regions import chain, model_of


def certified(region: Region, size: float, most: int):
    """The mesh of a region, which is certified and holds no more triangles than ``most``."""
    assert not region.validate()
    mesh = fubini.mesh(model_of(region), size)
    assert mesh.certificate.certified, mesh.certificate.faces[0].reasons
    assert len(mesh.triangles) < most
    return mesh


def ellipse(ratio: float, start: float = 0.0, end: float = 2.0 * math.pi, turn: float = 0.3) -> EllipticalArc:
    c, s = math.cos(turn), math.sin(turn)
    return EllipticalArc((0.0, 0.0), (c, s), (-s / ratio, c / ratio), start, end)


@pytest.mark.parametrize(("ratio", "size"), [(1000.0, 0.03), (1000.0, 0.5), (10_000.0, 0.03)])
def test_slender_ellipses(ratio, size):
    certified(Region(Loop((ellipse(ratio),))), size, most=int(4.0 * ratio))


@pytest.mark.parametrize(("ratio", "size"), [(1000.0, 0.03), (3000.0, 0.5)])
def test_segments_of_slender_ellipses_meet_their_chords_in_slender_corners(ratio, size):
    arc = ellipse(ratio, 0.5, 3.0)
    mesh = certified(chain(arc, Line(arc.end, arc.start)), size, most=int(20.0 * ratio))
    assert mesh.certificate.unavoidable == mesh.certificate.flawed == 2


@pytest.mark.parametrize("short", [1e-1, 1e-3, 1e-6])
def test_near_cusps(short):
    # a cubic that all but stands still in the middle, the nearer the shorter its control polygon crosses itself
    a, b, up = np.array([-1.0, 0.0]), np.array([1.0, 0.0]), np.array([0.0, -1.3])
    arc = Bezier([a, a + (b - a) * (1.0 - short) + up, b - (b - a) * (1.0 - short) + up, b])
    certified(chain(arc, Line(b, (1.0, 1.0)), Line((1.0, 1.0), (-1.0, 1.0)), Line((-1.0, 1.0), a)), 0.07, most=4000)


@pytest.mark.parametrize("power", [1, 2, 4])
def test_heavy_and_light_weights(power):
    poles = [(2, 0), (2, 2), (0, 2), (-2, 2), (-2, 0), (-2, -2), (0, -2), (2, -2), (2, 0)]
    weights = 10.0 ** (power * np.array([0, 1, -1, 1, 0, -1, 1, -1, 0]))
    spline = BSpline(3, [0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 6, 6, 6], poles, weights)
    certified(Region(Loop((spline,))), 0.3, most=4000)


def test_arcs_that_are_all_but_straight_keep_a_chord_tolerance():
    # radius 1e5: rounded, the arc misses its ends by far more than the grain, which is no bend
    region = random_region(23)
    mesh = fubini.mesh(model_of(region), region.diagonal / 8.0, chord_tolerance=1e-4 * region.diagonal)
    assert mesh.certificate.certified


@pytest.mark.parametrize(("rise", "other"), [(2e-5, 0.7), (1e-5, 0.0)])
def test_lenses_of_arcs_that_are_all_but_straight(rise, other):
    # radius 5,000 and more: angles rounded to 2^-32 would take points along the arc by many times the width
    above = low_arc(np.array([1.0, 0.0]), np.array([-1.0, 0.0]), rise)
    below = low_arc(np.array([-1.0, 0.0]), np.array([1.0, 0.0]), rise * other) if other else Line((-1, 0), (1, 0))
    mesh = certified(chain(above, below), 0.07, most=1_200_000)
    assert mesh.certificate.unavoidable == 2


@pytest.mark.parametrize(("corners", "handle", "share"), [(4, 0.01, 5), (4, 0.01, 120), (5, 0.005, 60)])
def test_legs_that_end_at_a_sample_of_their_curve(corners, handle, share):
    # cusps as short as the handles of the curves between them, which are all but straight
    turn = 2.0 * math.pi * np.arange(corners + 1) / corners
    tips = np.column_stack([np.cos(turn), np.sin(turn)])
    tips[-1] = tips[0]
    sides = [Bezier([p, (1.0 - handle) * p, (1.0 - handle) * q, q]) for p, q in pairwise(tips)]
    region = chain(*sides)
    mesh = certified(region, region.diagonal / share, most=60_000)
    assert mesh.certificate.unavoidable == corners


@pytest.mark.parametrize("share", [10, 120])
def test_splines_that_race_up_to_a_knot_and_all_but_stop_there(share):
    # lengths go with the square of the parameter before the knot: a table of straight lines asked for less and less
    poles = [
        (1, 0),
        (0.6633, 0.4841),
        (0.4513, 0.7289),
        (0.1252, 0.8727),
        (-0.2317, 0.7935),
        (-0.7005, 0.5669),
        (-1, 0),
    ]
    weights = [52.9, 0.00581, 0.0373, 0.0833, 123.06, 1.233, 4.719]
    spline = BSpline(2, [0, 0, 0, 0.0687947, 0.5971, 0.7315, 0.9841, 1, 1, 1], poles, weights)
    region = chain(spline, Line(spline.end, spline.start))
    certified(region, region.diagonal / share, most=10_000)
