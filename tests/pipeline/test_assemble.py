"""Faces whose planes do not quite meet at the edge that they share."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import fubini
from fubini.curves import Line
from fubini.model import Edge, Face, Frame, Model
from fubini.region import Loop, Region

SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


def face(index: int, edges: tuple[int, ...], forward: tuple[bool, ...], frame: Frame) -> Face:
    lines = [Line(p, q) for p, q in zip(SQUARE, SQUARE[1:] + SQUARE[:1], strict=True)]
    return Face(index, Region(Loop(tuple(lines), edges, forward)), frame)


def bent(gap: float, angle: float = 90.0) -> Model:
    """A floor and a wall that stands on its edge x = 0, the wall ``gap`` too high and too far left.

    Under another ``angle`` (degrees) it leans back over x < 0.
    """
    x, y, z = np.eye(3)
    turn = np.radians(angle)
    floor = face(0, (0, 1, 2, 3), (True,) * 4, Frame(np.zeros(3), x, y))
    up = z if angle == 90.0 else np.array([-np.cos(turn), 0.0, np.sin(turn)])
    wall = face(1, (3, 4, 5, 6), (False, True, True, True), Frame(np.array([-gap, 0.0, gap]), y, up))
    ends = [(0, 1), (1, 2), (2, 3), (3, 0), (3, 4), (4, 5), (5, 0)]
    edges = {i: Edge(i, "line", a, b, tolerance=2.0 * gap) for i, (a, b) in enumerate(ends)}
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)]
    return Model("bent", (floor, wall), edges, {i: np.array(p, float) for i, p in enumerate(corners)}, diagonal=3**0.5)


@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_shared_nodes_lie_on_all_their_planes(gap):
    mesh = fubini.mesh(bent(gap), 0.15)
    assert mesh.certificate.certified
    common = np.unique(mesh.segments[mesh.edge_of_segment == 3])
    shared = mesh.points[common]
    assert len(shared) > 5
    assert np.abs(shared[:, 2]).max() < 1e-15  # the floor
    assert np.abs(shared[:, 0] + gap).max() < 1e-15  # the wall
    assert shared[:, 1].min() == pytest.approx(0.0, abs=1e-15)
    others = np.setdiff1d(mesh.segments[mesh.edge_of_segment < 3], common)
    assert np.abs(mesh.points[others][:, 2]).max() == 0.0


def test_nodes_between_planes_that_are_almost_one_stay_at_their_edge():
    """Where the planes meet is thirty times as far off the edge as they are from each other."""
    gap = 1e-7
    mesh = fubini.mesh(bent(gap, angle=2.0), 0.15)
    assert mesh.certificate.certified
    shared = mesh.points[np.unique(mesh.segments[mesh.edge_of_segment == 3])]
    assert np.abs(shared[:, [0, 2]]).max() < 3.0 * gap


@pytest.mark.parametrize("tolerance", [0.0, 2e-6])
def test_a_node_at_a_vertex_may_be_as_far_off_as_any_edge_there_is_loose(tolerance):
    """What another edge at its vertex may be off its plane by moves the node."""
    model = bent(1e-6)
    loose = {i: dataclasses.replace(e, tolerance=0.0) for i, e in model.edges.items()}
    # beside the floor alone, but at a vertex of the wall
    loose[0] = dataclasses.replace(loose[0], tolerance=tolerance)
    loose[2] = dataclasses.replace(loose[2], tolerance=tolerance)
    certificate = fubini.mesh(dataclasses.replace(model, edges=loose), 0.15).certificate
    assert certificate.certified == (tolerance > 0.0)
    if not tolerance:
        assert any("boundary node" in reason for f in certificate.faces for reason in f.reasons)
