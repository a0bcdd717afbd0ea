"""Parts that touch or overlap share nodes after imprinting, and keep their names."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("OCP")

import fubini
from cad.shapes import box, face_of, plate, polygon_wire, sub, turned
from fubini.cad import occ
from fubini.errors import OptionError
from meshes import apart, area, edge_uses, length


def square(x, y, side=2.0, z=0.0):
    return face_of(polygon_wire([(x, y, z), (x + side, y, z), (x + side, y + side, z), (x, y + side, z)]))


def test_faces_that_touch_share_nodes_on_a_part_of_their_edges():
    a, b = square(0, 0), square(2, 0.5, side=1.0)
    for imprint in (False, True):
        mesh = fubini.mesh([a, b], 0.3, imprint=imprint, names={"steel": a, "foam": b})
        shared = np.intersect1d(mesh.triangles[mesh.regions["steel"]], mesh.triangles[mesh.regions["foam"]])
        assert area(mesh) == pytest.approx(5.0, rel=1e-13)
        assert mesh.certificate.certified
        if not imprint:
            assert len(shared) == 0 and "steel|foam" not in mesh.boundaries
    interface = mesh.segments[mesh.boundaries["steel|foam"]]
    assert set(interface.ravel().tolist()) == set(shared.tolist())
    assert np.all(mesh.points[interface][:, :, 0] == 2.0)
    assert length(mesh, mesh.boundaries["steel|foam"]) == pytest.approx(1.0, rel=1e-13)
    assert apart(mesh) > 0.05


def test_overlap_of_sketch_faces_is_meshed_once_and_named_after_both():
    a, b = square(0, 0), square(1, 1)
    model = fubini.load([a, b], imprint=True, groups={"a": a, "b": b})
    assert {f.name: f.region.area for f in model.faces} == pytest.approx({"a": 3.0, "a|b": 1.0, "b": 3.0})
    mesh = fubini.mesh(model, 0.25)
    assert area(mesh) == pytest.approx(7.0, rel=1e-13)
    assert set(mesh.regions) == {"a", "a|b", "b"} and set(mesh.boundaries) == {"outer", "a|b"}
    assert mesh.certificate.certified and apart(mesh) > 0.05
    assert any(note.startswith("imprinted: 2 faces became 3, 1 ") for note in model.notes)


def test_solids_that_touch_share_one_interface():
    a, b = box(2, 2, 1), box(1, 1, 1, at=(0.5, 0.5, 1))
    mesh = fubini.mesh([a, b], 0.3, imprint=True, names={"A": a, "B": b})
    edges, uses = edge_uses(mesh)
    assert set(uses.tolist()) == {2, 3}  # three only around the interface
    joint = mesh.points[edges[uses == 3]]
    assert np.all(joint[:, :, 2] == 1.0)
    assert np.linalg.norm(joint[:, 1] - joint[:, 0], axis=1).sum() == pytest.approx(4.0, rel=1e-13)
    both = np.intersect1d(mesh.regions["A"], mesh.regions["B"])
    assert area(mesh, both) == pytest.approx(1.0, rel=1e-13)
    assert area(mesh) == pytest.approx(16 + 6 - 1, rel=1e-13)
    assert mesh.certificate.certified and apart(mesh) > 0.05


def test_overlapping_solids_are_cut_at_each_other():
    a, b = box(2, 2, 2), box(2, 2, 2, at=(1, 1, 1))
    mesh = fubini.mesh([a, b], 0.4, imprint=True)
    _, uses = edge_uses(mesh)
    assert uses.min() == 2
    assert area(mesh) == pytest.approx(2 * 24.0, rel=1e-12)
    assert mesh.certificate.certified and apart(mesh) > 0.05


def test_a_turned_plate_on_a_plate_with_a_hole():
    place = turned(30.0, (1, 2, 3), (4, -5, 6))
    a, b = plate(6, 4, 1, 1.0).Moved(place), box(6, 4, 1, at=(0, 0, 1)).Moved(place)
    mesh = fubini.mesh([a, b], 0.7, imprint=True)
    _, uses = edge_uses(mesh)
    assert mesh.certificate.certified and set(uses.tolist()) <= {1, 2, 3}
    assert apart(mesh) > 0.05


def test_names_of_edges_and_vertices_follow_the_cut():
    a, b = square(0, 0), square(2, 0.5, side=1.0)
    right = next(
        e for e in sub(a, occ.EDGE) if all(occ.vertex_point(occ.as_vertex(v))[0] == 2.0 for v in sub(e, occ.VERTEX))
    )
    mesh = fubini.mesh([a, b], 0.3, imprint=True, names={"right": right, "corner": sub(a, occ.VERTEX)[0]})
    assert length(mesh, mesh.boundaries["right"]) == pytest.approx(2.0, rel=1e-13)
    assert len(mesh.named_points["corner"]) == 1
    grouped = fubini.mesh(fubini.load([a, b], imprint=True, groups={"right": right}), 0.3)
    assert len(grouped.boundaries["right"]) == len(mesh.boundaries["right"])


def test_the_sources_are_left_as_they_were():
    a, b = square(0, 0), square(1, 1)
    fubini.load([a, b], imprint=True)
    model = fubini.load([a, b])
    assert [f.region.area for f in model.faces] == pytest.approx([4.0, 4.0])


def test_a_model_is_not_imprinted_after_the_fact():
    model = fubini.load([square(0, 0), square(1, 1)])
    with pytest.raises(OptionError, match="sewn or imprinted"):
        fubini.mesh(model, 0.5, imprint=True)


def test_labels_of_build123d_meet_in_the_interface():
    b3d = pytest.importorskip("build123d")
    left, right = b3d.Rectangle(2, 2).face(), b3d.Pos(2, 0) * b3d.Rectangle(2, 1)
    right = right.face()
    left.label, right.label = "left", "right"
    mesh = fubini.mesh([left, right], 0.3, imprint=True)
    assert set(mesh.regions) == {"left", "right"} and "left|right" in mesh.boundaries
    mesh.attach()
