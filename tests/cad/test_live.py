"""Live objects of build123d and CadQuery: shapes, names, and the same regions from both."""

from __future__ import annotations

import numpy as np
import pytest

from cad.test_load import figures
from fubini.cad import load
from fubini.errors import GeometryError, InputError


@pytest.fixture(scope="module")
def b():
    return pytest.importorskip("build123d", exc_type=ImportError)


@pytest.fixture(scope="module")
def cq():
    return pytest.importorskip("cadquery", exc_type=ImportError)


@pytest.fixture
def part(b):
    with b.BuildPart() as builder:
        b.Box(3, 2, 1)
        b.Hole(0.3)
    return builder


def test_build123d_objects_of_every_kind(b, part):
    whole = figures(load(part.part))
    assert len(whole) == 6
    assert figures(load(part)) == figures(load(part.part.solid())) == figures(load(part.part.wrapped)) == whole
    assert figures(load(part.part.faces())) == figures(load(list(part.part.faces()))) == whole
    assert len(load(part.part.faces()[0]).faces) == 1
    with b.BuildSketch(b.Plane.XZ) as sketch:
        b.Rectangle(3, 2)
        b.Circle(0.4, mode=b.Mode.SUBTRACT)
    model = load(sketch)
    assert model.faces[0].region.area == pytest.approx(6 - np.pi * 0.16, rel=1e-13)
    assert np.allclose(np.abs(model.faces[0].frame.normal), (0, 1, 0))
    assert load(sketch.sketch_local).faces[0].region.area == pytest.approx(model.faces[0].region.area)


def test_build123d_labels_name_faces_also_after_a_move(b):
    left, right = b.Pos(5, 0, 0) * b.Solid.make_box(1, 1, 1), b.Solid.make_box(1, 1, 1)
    left.label, right.label = "left", "right"
    whole = b.Compound(label="all", children=[left, right])
    for source in (whole, b.Pos(1, 2, 3) * whole):
        model = load(source)
        spans = {}
        for face in model.faces:
            spans.setdefault(face.name, []).append(face.frame.to_space(face.region.centroid)[0][0])
        assert sorted(spans) == ["left", "right"] and min(spans["left"]) > max(spans["right"])


def test_build123d_wires_and_empty_objects(b):
    assert load(b.Wire.make_circle(2)).faces[0].region.area == pytest.approx(4 * np.pi)
    with pytest.raises(GeometryError, match="open"):
        load(b.Wire.make_polygon([(5, 0), (6, 0), (6, 1)], close=False))
    with pytest.raises(InputError, match="no shape"):
        load(b.Part())


def test_groups_of_selectors(b, part):
    top = part.part.faces().sort_by(b.Axis.Z)[-1]
    model = load(part, groups={"top": top, "hole": top.inner_wires(), "rest": part.part})
    named = {f.name: f for f in model.faces if f.name != "rest"}
    assert list(named) == ["top"] and np.allclose(named["top"].frame.normal, (0, 0, 1))
    assert [e.kind for e in model.edges.values() if e.name == "hole"] == ["circle"]


def test_the_same_part_from_both_front_ends_and_a_file(b, cq, part, tmp_path):
    box = cq.Workplane().box(3, 2, 1).faces(">Z").workplane().hole(0.6)
    path = tmp_path / "part.step"
    b.export_step(part.part, path)
    first = figures(load(part))
    for other in (figures(load(box)), figures(load(str(path)))):
        assert np.allclose([f[:8] for f in first], [f[:8] for f in other], atol=1e-8)
        assert [f[8:] for f in first] == [f[8:] for f in other]


def test_cadquery_objects_of_every_kind(cq):
    box = cq.Workplane().box(3, 2, 1)
    assert len(load(box).faces) == len(load(box.val()).faces) == len(load(box.edges("|Z")).faces) == 6
    assert len(load(box.faces(">Z")).faces) == 1
    ring = cq.Workplane().rect(2, 1).pushPoints([(0, 0)]).circle(0.3)
    assert load(ring).faces[0].region.area == pytest.approx(2 - np.pi * 0.09)
    sketch = cq.Sketch().rect(2, 1).push([(0.3, 0.3)]).circle(0.1, mode="s")
    assert load(sketch).faces[0].region.area == pytest.approx(2 - np.pi * 0.01)
    with pytest.raises(GeometryError, match="open"):
        load(cq.Workplane().moveTo(0, 0).lineTo(1, 0).lineTo(1, 1))


def test_cadquery_tags_name_faces_and_edges(cq):
    work = cq.Workplane().box(3, 2, 1).faces(">Z").tag("top").end().edges("|Z").tag("posts").end()
    model = load(work)
    assert [f.frame.normal[2] for f in model.faces if f.name == "top"] == [1.0]
    assert sum(e.name == "posts" for e in model.edges.values()) == 4


def test_cadquery_assemblies_are_placed_and_named(cq):
    box = cq.Workplane().box(1, 1, 1)
    inner = cq.Assembly(name="arm", loc=cq.Location((0, 10, 0))).add(box, loc=cq.Location((5, 0, 0), (0, 0, 1), 30))
    inner.children[0].addSubshape(box.faces(">Z").val(), name="pad")
    whole = cq.Assembly().add(box, name="base").add(inner)
    model = load(whole)
    assert len(model.faces) == 12
    names = [f.name for f in model.faces]
    assert (names.count("base"), names.count("arm"), names.count("pad")) == (6, 5, 1)
    pad = next(f for f in model.faces if f.name == "pad")
    assert np.allclose(pad.frame.to_space(pad.region.centroid)[0], (5, 10, 0.5))


def test_cadquery_workplane_without_anything_is_refused(cq):
    with pytest.raises(InputError, match="no shape in it"):
        load(cq.Workplane())
