"""SVG drawings to faces: areas, exact curves under transforms, fill rules, names, errors."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("OCP", reason="no CAD kernel installed")
pytest.importorskip("svgelements", reason="no svgelements installed")

from OCP.BRep import BRep_Builder
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepTools import BRepTools
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Shape

from fubini.cad.svg import read_svg
from fubini.errors import GeometryError, InputError


def parts(shape, kind):
    """Sub-shapes of one kind, each once."""
    walk, found = TopExp_Explorer(shape, kind), []
    while walk.More():
        if not any(walk.Current().IsSame(s) for s in found):
            found.append(walk.Current())
        walk.Next()
    return found


def measured(shape):
    """Area and centroid (x, y) of every face, in order."""
    out = []
    for face in parts(shape, TopAbs_ShapeEnum.TopAbs_FACE):
        measure = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, measure)
        centre = measure.CentreOfMass()
        out.append((measure.Mass(), centre.X(), centre.Y()))
    return out


def areas(shape):
    """Areas of the faces in order."""
    return [a for a, *_ in measured(shape)]


def kinds(shape):
    """Sorted kinds of the curves of all edges."""
    to_edge = getattr(TopoDS, "Edge", None) or TopoDS.Edge_s
    found = [BRepAdaptor_Curve(to_edge(e)).GetType() for e in parts(shape, TopAbs_ShapeEnum.TopAbs_EDGE)]
    return sorted(str(k).split("_")[-1] for k in found)


@pytest.fixture
def drawn(tmp_path):
    """A function that reads the drawing with the given elements on a page of 100 by 50."""

    def go(body, page='width="100" height="50" viewBox="0 0 100 50"'):
        path = tmp_path / "drawing.svg"
        path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {page}>{body}</svg>')
        return read_svg(path)

    return go


def test_page_stands_upright_with_its_lower_left_corner_at_the_origin(drawn):
    source = drawn('<rect id="card" x="10" y="5" width="20" height="10"/>')
    assert measured(source.shape) == [pytest.approx((200, 20, 40), rel=1e-13)]
    assert [name for _, name in source.face_names] == ["card"]
    assert [name for _, name in source.edge_names] == ["card"] * 4
    assert BRepCheck_Analyzer(source.shape).IsValid()


def test_view_box_and_lengths_in_millimetres(drawn):
    body = '<rect x="0" y="0" width="1" height="2"/>'
    source = drawn(body, 'width="20mm" height="40mm" viewBox="0 0 2 4"')
    assert measured(source.shape) == [pytest.approx((200, 5, 30), rel=1e-12)]


def test_a_skewed_arc_is_an_exact_ellipse(drawn):
    source = drawn(
        '<g transform="rotate(30) translate(40 3)">'
        '<circle id="c" cx="3" cy="4" r="2" transform="skewX(40) scale(1 -3)"/></g>'
    )
    assert areas(source.shape) == pytest.approx([3 * math.pi * 4], rel=1e-13)
    assert set(kinds(source.shape)) == {"Ellipse"}
    assert [name for _, name in source.face_names] == ["c"]


def test_kinds_of_segments_are_kept(drawn):
    source = drawn('<path d="M0 0 h10 A5 5 0 0 1 20 0 C 25 5 25 10 20 15 Q 10 30 0 15 z"/>')
    assert kinds(source.shape) == ["BezierCurve", "BezierCurve", "Circle", "Line", "Line"]
    # y points down in the file: the arc bulges upwards out of the outline and adds its half disc
    half_disc = math.pi * 12.5
    cubic = 15 * 15 / 6  # depth 15 t (1 - t) times dy/dt = 15
    quadratic = 2 / 3 * (0.5 * 20 * 15)
    assert areas(source.shape) == pytest.approx([20 * 15 + half_disc + cubic + quadratic], rel=1e-12)


def test_fill_rules(drawn):
    ring = "M0 0 h10 v10 h-10 z M3 3 h4 v4 h-4 z"
    hollow = "M0 0 h10 v10 h-10 z M3 3 v4 h4 v-4 z"
    assert areas(drawn(f'<path d="{ring}"/>').shape) == pytest.approx([100])
    assert areas(drawn(f'<path d="{hollow}"/>').shape) == pytest.approx([84])
    assert areas(drawn(f'<path fill-rule="evenodd" d="{ring}"/>').shape) == pytest.approx([84])
    assert areas(drawn(f'<g style="fill-rule:evenodd"><path d="{ring}"/></g>').shape) == pytest.approx([84])
    island = " M4 4 h1 v1 h-1 z"
    assert areas(drawn(f'<path fill-rule="evenodd" d="{ring + island}"/>').shape) == pytest.approx([84, 1])


def test_names_come_from_the_nearest_group_with_an_id(drawn):
    source = drawn(
        '<defs><path id="shape" d="M0 0h2v2z"/></defs>'
        '<g id="outer"><g><rect width="2" height="2"/></g><rect id="own" x="5" width="1" height="1"/></g>'
        '<use id="copy" href="#shape" x="50"/>'
    )
    assert [name for _, name in source.face_names] == ["outer", "own", "shape"]
    assert areas(source.shape) == pytest.approx([4, 1, 2])


def test_open_paths_are_closed_and_rounding_is_no_edge(drawn):
    source = drawn('<path d="M0 0 h10 v10 l1e-9 0 h-10 l0 -1e-9"/>')
    assert areas(source.shape) == pytest.approx([100], rel=1e-8)
    assert kinds(source.shape) == ["Line"] * 4
    assert any("shorter" in note for note in source.notes)


def test_strokes_hidden_shapes_and_text_are_left_out_with_a_note(drawn):
    source = drawn(
        '<rect width="2" height="2"/><path fill="none" stroke="red" d="M0 0h9v9z"/>'
        '<rect visibility="hidden" width="7" height="7"/><text x="1" y="1">word</text>'
        '<rect width="5" height="5" style="display:none"/>'
    )
    assert areas(source.shape) == pytest.approx([4])
    for word in ("without fill", "hidden", "text"):
        assert any(word in note for note in source.notes), word


def test_trouble_is_an_error_with_its_file(drawn, tmp_path):
    with pytest.raises(GeometryError, match="cross") as caught:
        drawn('<path d="M0 0h10v10h-10z M5 5 h20v10h-20z"/>')
    assert "drawing.svg" in str(caught.value)
    assert caught.value.at is not None
    with pytest.raises(InputError, match="no filled shape"):
        drawn('<path fill="none" d="M0 0h9v9z"/>')
    with pytest.raises(GeometryError, match="encloses an area"):
        drawn('<path d="M0 0 h9 h-9 z"/>')
    for name, content in (("empty.svg", ""), ("text.svg", "no drawing"), ("cut.svg", '<svg><path d="M0 0')):
        path = tmp_path / name
        path.write_text(content)
        with pytest.raises(InputError) as caught:
            read_svg(path)
        assert caught.value.file == str(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_svg(tmp_path / "absent.svg")


@pytest.mark.parametrize(
    ("name", "valid"),
    [
        ("build123d/docs/assets/build123d_logo/logo.svg", True),
        ("bootstrap-icons/icons/snow3.svg", True),
        ("bootstrap-icons/icons/fingerprint.svg", False),  # an outline that crosses itself
    ],
)
def test_corpus_faces_agree_with_another_reader(corpus, name, valid):
    derived = TopoDS_Shape()
    BRepTools.Read_s(derived, str(corpus / "_faces_of_2d" / (name.replace("/", "__") + ".brep")), BRep_Builder())
    source = read_svg(corpus / name)
    assert sorted(areas(source.shape)) == pytest.approx(sorted(areas(derived)), rel=1e-6)
    assert sorted(measured(source.shape)) == [pytest.approx(m, rel=1e-6) for m in sorted(measured(derived))]
    assert BRepCheck_Analyzer(source.shape).IsValid() == valid
