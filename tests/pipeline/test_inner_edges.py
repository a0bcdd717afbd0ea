"""Edges inside a face are edges of the mesh, on one set of nodes."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("OCP")

from OCP.Geom import Geom_Circle
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.TopAbs import TopAbs_Orientation as Orientation

import fubini
from cad.shapes import edge_of, face_of, line, polygon_wire, raw_wire, sub
from fubini.cad import occ
from meshes import apart, area, edge_uses, length

PLATE = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]


def sheet(*points):
    return face_of(polygon_wire(points))


def rib(a, b):
    """A sheet of height 1 that stands on the plate from a to b."""
    return sheet((*a, 0), (*b, 0), (*b, 1), (*a, 1))


@pytest.mark.parametrize("size", [0.1, 0.3, 5.0])
@pytest.mark.parametrize("ends", [((0.5, 1), (1.5, 1)), ((0, 1), (1.5, 1)), ((0.3, 0.2), (1.6, 1.1))])
def test_a_rib_in_the_middle_of_a_plate(ends, size):
    plate, stiffener = sheet(*PLATE), rib(*ends)
    mesh = fubini.mesh([plate, stiffener], size, imprint=True, names={"plate": plate, "rib": stiffener})
    foot = float(np.hypot(*np.subtract(*ends)))
    assert mesh.certificate.certified
    assert area(mesh, mesh.regions["plate"]) == pytest.approx(4.0, rel=1e-13)
    assert length(mesh, mesh.boundaries["plate|rib"]) == pytest.approx(foot, rel=1e-13)
    assert set(edge_uses(mesh)[1].tolist()) == {1, 2, 3} and apart(mesh) > 0.01
    sides = np.sort(mesh.segments[mesh.boundaries["plate|rib"]], axis=1).tolist()
    edges, uses = edge_uses(mesh)
    assert sorted(sides) == edges[uses == 3].tolist()


def test_ribs_that_cross():
    ribs = [rib((0.4, 1), (1.6, 1)), rib((1, 0.4), (1, 1.6))]
    mesh = fubini.mesh([sheet(*PLATE), *ribs], 0.3, imprint=True)
    _, uses = edge_uses(mesh)
    assert mesh.certificate.certified and apart(mesh) > 0.05
    assert (uses == 3).any() and (uses == 4).any()  # feet; the line where the ribs cross


def embedded(edge, *more):
    outline = sub(polygon_wire(PLATE), occ.EDGE)
    return face_of(raw_wire([*outline, edge.Oriented(Orientation.TopAbs_INTERNAL), *more]))


def nodes_along(mesh, index):
    """Number of mesh edges on a CAD edge that are sides of two triangles."""
    rows = np.flatnonzero(mesh.edge_of_segment == index)
    edges, uses = edge_uses(mesh)
    pairs = {tuple(e): n for e, n in zip(edges.tolist(), uses.tolist(), strict=True)}
    counts = [pairs.get(tuple(sorted(s)), 0) for s in mesh.segments[rows].tolist()]
    assert counts and set(counts) == {2}
    return rows


def test_an_embedded_line_and_an_embedded_arc():
    circle = Geom_Circle(gp_Ax2(gp_Pnt(1, 1, 0), gp_Dir(0, 0, 1)), 0.5)
    face = embedded(line((0.3, 0.3, 0), (1.7, 0.3, 0)), edge_of(circle, 0.3, 2.5).Oriented(Orientation.TopAbs_INTERNAL))
    mesh = fubini.mesh(face, 0.2)
    assert mesh.certificate.certified and area(mesh) == pytest.approx(4.0, rel=1e-13)
    straight, curved = sorted(i for _, i in mesh.model.faces[0].inner)
    assert length(mesh, nodes_along(mesh, straight)) == pytest.approx(1.4, rel=1e-13)
    rows = nodes_along(mesh, curved)
    assert length(mesh, rows) == pytest.approx(0.5 * 2.2, rel=0.01)
    radii = np.linalg.norm(mesh.points[mesh.segments[rows]][..., :2] - 1.0, axis=2)
    assert radii == pytest.approx(0.5, rel=1e-12)


def test_the_papers_sets_leave_inner_edges_out_and_say_so():
    face = embedded(line((0.3, 0.3, 0), (1.7, 0.3, 0)))
    mesh = fubini.mesh(face, pattern="SP13")
    assert any("1 edges and 0 points inside faces are not followed" in note for note in mesh.certificate.notes)
    assert len(set(mesh.edge_of_segment.tolist())) == 4


@pytest.mark.parametrize("end", [(3, 1, 0), (2, 1, 0)])
def test_an_edge_that_leaves_the_face_or_ends_beside_its_vertices_is_left_out(end):
    model = fubini.load(embedded(line((1, 1, 0), end)))
    assert not model.faces[0].inner and len(model.edges) == 4
    assert any("is left out" in note for note in model.notes)


def ring(radius=0.4, at=(1, 1, 0)):
    circle = Geom_Circle(gp_Ax2(gp_Pnt(*at), gp_Dir(0, 0, 1)), radius)
    return edge_of(circle, 0.0, 2 * np.pi)


def test_loose_edges_are_imprinted_where_they_cross_touch_and_close():
    along, across, circle = line((0.2, 1, 0), (1.8, 1, 0)), line((1, 0, 0), (1, 1.5, 0)), ring()
    names = {"along": along, "across": across, "ring": circle}
    mesh = fubini.mesh([sheet(*PLATE), along, across, circle], 0.2, imprint=True, names=names)
    assert mesh.certificate.certified and area(mesh) == pytest.approx(4.0, rel=1e-13)
    assert length(mesh, mesh.boundaries["along"]) == pytest.approx(1.6, rel=1e-13)
    assert length(mesh, mesh.boundaries["across"]) == pytest.approx(1.5, rel=1e-13)
    assert length(mesh, mesh.boundaries["ring"]) == pytest.approx(0.8 * np.pi, rel=0.02)
    assert len(mesh.certificate.faces) == 5  # outside the ring, and its quarters
    edges, uses = edge_uses(mesh)
    pairs = {tuple(e): n for e, n in zip(edges.tolist(), uses.tolist(), strict=True)}
    for name in names:
        sides = mesh.segments[mesh.boundaries[name]]
        assert {pairs.get(tuple(sorted(s))) for s in sides.tolist()} == {2}
    crossing = np.flatnonzero((mesh.points == [1, 1, 0]).all(axis=1))
    assert len(crossing) == 1 and apart(mesh) > 0.02


def test_internal_edges_that_cross_or_close_follow_after_imprinting():
    more = line((1, 0.4, 0), (1, 1.6, 0)), ring(0.2, (0.4, 0.4, 0))
    internal = [e.Oriented(Orientation.TopAbs_INTERNAL) for e in more]
    face = embedded(line((0.5, 1, 0), (1.5, 1, 0)), *internal)
    mesh = fubini.mesh(face, 0.2, imprint=True)
    assert mesh.certificate.certified and apart(mesh) > 0.02
    inside = np.setdiff1d(mesh.edge_of_segment, [e for f in mesh.model.faces for e in f.region.edges])
    assert len(inside) == 4 and len(mesh.certificate.faces) == 2
    rows = np.isin(mesh.edge_of_segment, inside)
    assert length(mesh, rows) == pytest.approx(1.0 + 1.2, rel=1e-13)


def test_a_loose_edge_may_be_a_crack():
    slit = line((0.5, 1, 0), (1.5, 1, 0))
    mesh = fubini.mesh([sheet(*PLATE), slit], 0.3, imprint=True, names={"slit": slit}, cracks="slit", order=2)
    assert mesh.certificate.certified and {"slit+", "slit-"} < set(mesh.boundaries)
