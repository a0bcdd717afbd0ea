"""Faces without shared edges, sewn: closed where they meet, and told where they do not."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("OCP")

import fubini
from cad.shapes import face_of, polygon_wire, sub
from fubini.cad import occ
from fubini.errors import OptionError
from meshes import apart, edge_uses, length, volume

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
QUADS = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def loose_box(gap=0.0):
    """Six squares of a unit cube, in mixed directions, each shifted by up to ``gap``."""
    shifts = np.random.default_rng(1).uniform(-gap / 2, gap / 2, (6, 3))
    return [face_of(polygon_wire([tuple(CORNERS[i] + s) for i in q])) for q, s in zip(QUADS, shifts, strict=True)]


@pytest.mark.parametrize("gap", [0.0, 5e-4])
def test_six_loose_squares_become_a_closed_box(gap):
    faces = loose_box(gap)
    assert set(edge_uses(fubini.mesh(faces, 0.3))[1].tolist()) == {1, 2}
    mesh = fubini.mesh(faces, 0.3, sew=2e-3)
    assert set(edge_uses(mesh)[1].tolist()) == {2}
    assert volume(mesh) == pytest.approx(1.0, abs=1e-12 + 6 * gap)  # positive: outwards
    assert mesh.certificate.certified and apart(mesh) > 0.05
    assert any("open edges were 24 and are 0" in note for note in mesh.certificate.notes)


def test_a_gap_wider_than_the_tolerance_stays_open_and_is_told():
    faces = loose_box()[:5]
    lid = face_of(polygon_wire([(-0.1, 0, 0), (-0.1, 1, 0), (-0.1, 1, 1), (-0.1, 0, 1)]))
    model = fubini.load([*faces, lid], sew=1e-3)
    told = [note for note in model.notes if note.startswith("stays open")]
    assert len(told) == 2
    assert any(note.endswith("between (0, 0, 0) and (0, 1, 1)") for note in told)
    assert any(note.endswith("between (-0.1, 0, 0) and (-0.1, 1, 1)") for note in told)


def test_three_faces_are_sewn_to_one_edge():
    spokes = [(1, 0), (-1, 0.2), (0, 1)]
    faces = [face_of(polygon_wire([(0, 0, 0), (x, y, 0), (x, y, 1), (0, 0, 1)])) for x, y in spokes]
    mesh = fubini.mesh(faces, 0.3, sew=1e-5)
    assert set(edge_uses(mesh)[1].tolist()) == {1, 2, 3}
    assert mesh.certificate.certified


def test_names_survive_sewing():
    faces = loose_box()
    mesh = fubini.mesh(faces, 0.3, sew=1e-5, names={"bottom": faces[0], "rim": sub(faces[1], occ.EDGE)})
    assert np.all(mesh.points[mesh.triangles[mesh.regions["bottom"]]][:, :, 2] == 0.0)
    assert np.all(mesh.points[mesh.segments[mesh.boundaries["rim"]]][:, :, 2] == 1.0)
    assert length(mesh, mesh.boundaries["rim"]) == pytest.approx(4.0)
    grouped = fubini.load(faces, sew=1e-5, groups={"bottom": faces[0]})
    assert [f.name for f in grouped.faces].count("bottom") == 1


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), "wide"])
def test_tolerances_that_make_no_sense(value):
    with pytest.raises(OptionError, match="sew is"):
        fubini.load(loose_box(), sew=value)
