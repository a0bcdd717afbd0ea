"""Edges with kinks from CAD files: polylines and splines with knots of full multiplicity, open, closed, periodic."""

from __future__ import annotations

import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
from OCP.Geom import Geom_BSplineCurve

import fubini
from cad import shapes as S
from cad.test_load import write_brep, write_step
from meshes import apart

STAR = [(10, 0), (1.5, 1.5), (0, 10), (-1.5, 1.5), (-10, 0), (-1.5, -1.5), (0, -10), (1.5, -1.5)]
HEART = [(0, 0), (20, -10), (30, 10), (30, 30), (10, 20), (-10, 20)]
ZIGZAG = [(-20, 0), (-5, 4), (0, -6), (6, 5), (20, 1)]


def spline(points, degree, periodic=False):
    """Edge of Bezier pieces that share their ends, as one B-spline."""
    pieces = len(points) // degree if periodic else (len(points) - 1) // degree
    counts = [degree] * (pieces + 1)
    if not periodic:
        counts[0] = counts[-1] = degree + 1
    space = S.points_array([(x, y, 0.0) for x, y in points])
    curve = Geom_BSplineCurve(space, S.reals(range(pieces + 1)), S.integers(counts), degree, periodic)
    return BRepBuilderAPI_MakeEdge(curve).Edge()


def sheet(points, degree, periodic=False):
    """Face inside one closed edge."""
    return S.face_of(S.wire_of(spline(points if periodic else [*points, points[0]], degree, periodic)))


def distance(mesh, points):
    return max(float(np.hypot(*(mesh.points[:, :2] - p).T).min()) for p in points)


@pytest.mark.parametrize("way", ["live", "step", "brep"])
@pytest.mark.parametrize(
    ("points", "degree", "periodic", "kinks"),
    [
        (STAR, 1, False, STAR),
        (STAR, 1, True, STAR),
        (HEART, 3, False, [HEART[0], HEART[3]]),
        (HEART, 3, True, [HEART[0], HEART[3]]),
        (HEART, 2, True, HEART[::2]),
    ],
    ids=["polyline", "periodic polyline", "cubic", "periodic cubic", "periodic quadratic"],
)
def test_kinks_inside_an_edge_are_nodes(points, degree, periodic, kinks, way, tmp_path):
    shape = sheet(points, degree, periodic)
    source = {"live": lambda: shape, "step": lambda: write_step(shape, tmp_path / "a.step")}.get(
        way, lambda: write_brep(shape, tmp_path / "a.brep")
    )()
    for size in (100.0, 10.0, 2.0):
        mesh = fubini.mesh(source, size)
        assert mesh.certificate.certified
        assert set(mesh.edge_of_segment.tolist()) == {0}
        assert distance(mesh, kinks) < 1e-11  # the writer of STEP files rounds to about that
        assert mesh.certificate.boundary_distance < 1e-12
        if degree == 1:
            assert mesh.certificate.area_error < 1e-14


@pytest.mark.parametrize("size", [100.0, 5.0, 1.0])
def test_an_edge_with_kinks_cuts_a_face_or_lies_inside_it(size):
    plate = S.face_of(S.polygon_wire([(-20, -15, 0), (20, -15, 0), (20, 15, 0), (-20, 15, 0)]))
    for points, count in ((ZIGZAG, 2), ([(0.5 * x, y) for x, y in ZIGZAG], 1)):
        edge = spline(points, 1)
        mesh = fubini.mesh([plate, edge], size, imprint=True, names={"zigzag": edge})
        assert mesh.certificate.certified
        assert len(mesh.certificate.faces) == count
        assert distance(mesh, points) < 1e-13
        assert apart(mesh) > 0.01
        ends = mesh.points[mesh.segments[mesh.boundaries["zigzag"]]]
        lengths = np.linalg.norm(np.diff(np.array(points), axis=0), axis=1)
        assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(lengths.sum(), rel=1e-13)


def test_meshes_of_edges_with_kinks_are_written_back():
    shape = sheet(STAR, 1)
    mesh = fubini.mesh(shape, 2.0)
    assert mesh.attach() is not None
    again = fubini.mesh(shape, 2.0)
    assert (again.points == mesh.points).all()
