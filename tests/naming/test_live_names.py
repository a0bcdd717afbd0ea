"""Names given by live sub-shapes of build123d, and those of the source."""

from __future__ import annotations

import pytest

import fubini
from fubini.errors import OptionError

bd = pytest.importorskip("build123d")


def two_materials():
    """Two rectangles that share an edge, as one compound of two faces."""
    left, right = bd.Pos(-1, 0) * bd.Rectangle(2, 2), bd.Pos(1, 0) * (bd.Rectangle(2, 2) - bd.Circle(0.5))
    return bd.Compound([*(left.faces() + right.faces())])


def conforming():
    """The same, joined so that the edge between is one."""
    from OCP.BOPAlgo import BOPAlgo_Builder

    builder = BOPAlgo_Builder()
    for face in two_materials().faces():
        builder.AddArgument(face.wrapped)
    builder.Perform()
    return bd.Compound(builder.Shape())


def test_sketch_of_two_materials():
    shape = conforming()
    steel, copper = shape.faces().sort_by(bd.Axis.X)
    names = {
        "steel": steel,
        "copper": copper,
        "bore": copper.inner_wires(),
        "clamp": shape.edges().sort_by(bd.Axis.X)[0],
        "corner": shape.vertices().sort_by(bd.Axis.X)[0],
    }
    mesh = fubini.mesh(shape, 0.4, names=names)
    assert mesh.certificate.certified
    assert list(mesh.regions) == ["steel", "copper"]
    assert list(mesh.boundaries) == ["bore", "clamp", "outer", "steel|copper"]
    between = mesh.points[mesh.segments[mesh.boundaries["steel|copper"]]]
    assert abs(between[..., 0]).max() == 0.0
    assert len(mesh.named_points["corner"]) == 1
    assert abs(mesh.points[mesh.named_points["corner"]][0, 0] + 2.0) < 1e-12


def test_every_edge_of_a_box_is_between_two_faces():
    mesh = fubini.mesh(bd.Box(1, 2, 3), 0.7)
    assert len(mesh.regions) == 6
    assert len(mesh.boundaries) == 12
    assert "outer" not in mesh.boundaries
    assert all("|" in name for name in mesh.boundaries)


def test_labels_arrive_as_regions():
    face = bd.Rectangle(2, 1).face()
    face.label = "lid"
    assert list(fubini.mesh(face, 0.5).regions) == ["lid"]


def test_cadquery_selection():
    cq = pytest.importorskip("cadquery")
    block = cq.Workplane().box(2, 2, 1)
    mesh = fubini.mesh(block, 0.5, names={"top": block.faces(">Z"), "posts": block.edges("|Z")})
    assert (mesh.points[mesh.triangles[mesh.regions["top"]]][..., 2] == 0.5).all()
    assert len(set(mesh.edge_of_segment[mesh.boundaries["posts"]].tolist())) == 4


def test_foreign_shapes_are_refused():
    with pytest.raises(OptionError, match=r"name 'x'.*no face, edge or vertex"):
        fubini.mesh(bd.Box(1, 1, 1), 0.5, names={"x": bd.Box(2, 2, 2).faces()})
    with pytest.raises(OptionError, match="cannot select by a float"):
        fubini.mesh(bd.Box(1, 1, 1), 0.5, names={"x": 3.0})
