"""Solids with planar faces only: closed, outwards, manifold, with the right volume."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("OCP")

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform

import fubini
from cad.shapes import box, mirrored, turned
from fubini.cad import occ
from meshes import apart, edge_uses, volume


def cut(a, b):
    return BRepAlgoAPI_Cut(a, b).Shape()


def stepped():
    """A block with a slot across and a square window through it."""
    block = cut(box(6, 4, 3), box(2, 5, 1, at=(2, -0.5, 2.5)))
    return cut(block, box(1, 1, 4, at=(0.5, 1.5, -0.5))), 72 - 4 - 3


def hollow():
    """A block with a block-shaped cavity inside: two shells."""
    return cut(box(3, 3, 3), box(1, 1, 1, at=(1, 1, 1))), 26


def checked(shape, expected, size=0.6):
    """The mesh of a solid, found closed, oriented, manifold and of this volume without any merging of nodes."""
    trimesh = pytest.importorskip("trimesh")
    mesh = fubini.mesh(shape, size)
    solid = trimesh.Trimesh(mesh.points, mesh.triangles, process=False)
    assert mesh.certificate.certified and not mesh.certificate.skipped_faces
    assert solid.is_watertight and solid.is_winding_consistent
    assert set(edge_uses(mesh)[1].tolist()) == {2}
    assert volume(mesh) == pytest.approx(expected, rel=1e-12)
    assert apart(mesh) > 1e-3
    return mesh


@pytest.mark.parametrize("make", [stepped, hollow])
def test_cut_blocks(make):
    checked(*make())


def test_turned_and_mirrored():
    shape, expected = stepped()
    place = turned(40.0, (1, 2, 3), (3, -7, 2))
    checked(shape.Moved(place), expected)
    checked(BRepBuilderAPI_Transform(shape, mirrored().Transformation(), True).Shape(), expected)


def test_mirrored_by_placement_alone():
    shape, expected = stepped()
    there = shape.Moved(mirrored(), False)
    checked(there, expected)
    checked(there.Moved(turned(40.0, (1, 2, 3), (3, -7, 2))), expected)
    checked(there.Moved(mirrored(), False), expected)
    checked(occ.compound([shape.Moved(turned(shift=(0, 9, 0))), there]), 2 * expected)
    checked(occ.compound([shape]).Moved(mirrored(), False), expected)


@pytest.mark.parametrize("options", [{"imprint": True}, {"imprint": True, "sew": 1e-5}])
def test_mirrored_parts_that_touch(options):
    """A block and its mirror image, which meet in a plane; names follow."""
    part = box(3, 2, 1)
    image = part.Moved(mirrored(), False)
    mesh = fubini.mesh(occ.compound([part, image]), 0.6, names={"right": part, "left": image}, **options)
    _, uses = edge_uses(mesh)
    assert mesh.certificate.certified and apart(mesh) > 1e-3
    inner = np.all(mesh.points[mesh.triangles][:, :, 0] == 0.0, axis=1)
    assert inner.any() and set(uses.tolist()) == {2, 3}
    p, q, r = (mesh.points[mesh.triangles[~inner, k]] for k in range(3))
    assert np.einsum("ij,ij->i", p, np.cross(q, r)).sum() / 6 == pytest.approx(12.0, rel=1e-12)
    assert mesh.points[mesh.triangles[mesh.regions["left"]]][..., 0].max() == 0.0
    assert mesh.points[mesh.triangles[mesh.regions["right"]]][..., 0].min() == 0.0
    assert np.intersect1d(mesh.regions["left"], mesh.regions["right"]).tolist() == np.flatnonzero(inner).tolist()


def test_mirrored_parts_sewn():
    part = box(3, 2, 1)
    image = part.Moved(turned(shift=(-9, 0, 0))).Moved(mirrored(), False)
    checked(fubini.load(occ.compound([part, image]), sew=1e-5), 12)


def test_reversed_solid_faces_inwards_as_it_says():
    assert volume(fubini.mesh(box().Reversed(), 0.5)) == pytest.approx(-6.0, rel=1e-12)


def test_several_solids_apart():
    solids = occ.compound([box(1, 1, 1), box(2, 1, 1, at=(3, 0, 0)), box(1, 2, 1, at=(0, 4, 0))])
    mesh = checked(solids, 1 + 2 + 2, 0.4)
    assert len(np.unique(mesh.face_of_triangle)) == 18


def test_solids_that_touch_in_an_edge_are_not_manifold_there():
    """Two boxes fused along one edge: four faces meet in it, with one set of nodes."""
    fused = BRepAlgoAPI_Fuse(box(1, 1, 1), box(1, 1, 1, at=(1, 1, 0))).Shape()
    mesh = fubini.mesh(fused, 0.3)
    edges, uses = edge_uses(mesh)
    assert set(uses.tolist()) == {2, 4}
    ends = mesh.points[edges[uses == 4]]
    assert np.all(ends[:, :, :2] == 1.0)
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(1.0, rel=1e-13)
    assert volume(mesh) == pytest.approx(2.0, rel=1e-12)
    assert mesh.certificate.certified and apart(mesh) > 0.05


def test_a_prism_of_build123d_with_slanted_cuts():
    b3d = pytest.importorskip("build123d")
    prism = b3d.extrude(b3d.RegularPolygon(3.0, 7), 2.0)
    cutter = b3d.Pos(0, 0, 2) * b3d.Rot(20, 0, 0) * b3d.Box(3, 9, 1)
    part = prism - cutter
    assert all(f.geom_type == b3d.GeomType.PLANE for f in part.faces())
    mesh = checked(part, part.volume)
    assert mesh.certificate.avoidable_skew > 45.0


@pytest.mark.parametrize("angle", [30.0, 61.0, 90.0])
def test_three_plates_on_one_edge(angle):
    """A frame of sheets: the joint is one chain of nodes with three triangles on each piece."""
    from cad.shapes import face_of, polygon_wire

    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    ends = [(1, 0), (-1, 0), (c, s)]
    sheets = [face_of(polygon_wire([(0, 0, 0), (2 * x, 2 * y, 0), (2 * x, 2 * y, 3), (0, 0, 3)])) for x, y in ends]
    mesh = fubini.mesh(sheets, 0.4, imprint=True)
    edges, uses = edge_uses(mesh)
    joint = mesh.points[edges[uses == 3]]
    assert np.all(joint[:, :, :2] == 0.0)
    assert np.linalg.norm(joint[:, 1] - joint[:, 0], axis=1).sum() == pytest.approx(3.0, rel=1e-13)
    assert set(uses.tolist()) == {1, 2, 3} and mesh.certificate.certified


def test_faces_fit_together_when_the_budget_of_splits_is_spent(monkeypatch):
    from fubini.pipeline import faces

    tried = []
    attempt = faces.attempt
    monkeypatch.setattr(faces, "MOST_SPLITS", -1_000_000)
    monkeypatch.setattr(faces, "attempt", lambda *a, **k: tried.append(a[4]) or attempt(*a, **k))
    checked(*stepped())
    assert max(tried) < faces.SPLIT_SHARED_FROM
