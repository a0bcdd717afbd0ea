"""DXF drawings, made here by ezdxf and taken from the corpus, to faces: areas, kinds of curves, names, errors."""

from __future__ import annotations

import math
import time

import pytest

pytest.importorskip("OCP", reason="no CAD kernel installed")
pytest.importorskip("ezdxf", reason="no ezdxf installed")

import ezdxf
from OCP.BRep import BRep_Builder
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepTools import BRepTools
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Shape

from fubini.cad.dxf import read_dxf
from fubini.cad.source import ReadOptions
from fubini.errors import GeometryError, InputError


def parts(shape, kind):
    """Sub-shapes of one kind, each once."""
    walk, found = TopExp_Explorer(shape, kind), []
    while walk.More():
        if not any(walk.Current().IsSame(s) for s in found):
            found.append(walk.Current())
        walk.Next()
    return found


def areas(shape):
    """Sorted areas of the faces, by the kernel."""
    out = []
    for face in parts(shape, TopAbs_ShapeEnum.TopAbs_FACE):
        measure = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, measure)
        out.append(measure.Mass())
    return sorted(out)


def kinds(shape):
    """Sorted kinds of the curves of all edges."""
    to_edge = getattr(TopoDS, "Edge", None) or TopoDS.Edge_s
    found = [BRepAdaptor_Curve(to_edge(e)).GetType() for e in parts(shape, TopAbs_ShapeEnum.TopAbs_EDGE)]
    return sorted(str(k).split("_")[-1] for k in found)


@pytest.fixture
def drawn(tmp_path):
    """A function that lets another one draw into a model space and reads the file back."""

    def go(draw, gap=None, units=4):
        document = ezdxf.new("R2010")
        document.header["$INSUNITS"] = units
        draw(document.modelspace())
        path = tmp_path / "drawing.dxf"
        document.saveas(path)
        return read_dxf(path, ReadOptions(gap=gap))

    return go


def square(space, side, at=(0, 0), shift=0.0, **attributes):
    """Four loose lines, in mixed directions, each end off by up to ``shift``."""
    x, y = at
    p = [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
    space.add_line(p[0], p[1], dxfattribs=attributes)
    space.add_line(p[2], (p[1][0] + shift, p[1][1]), dxfattribs=attributes)
    space.add_line(p[2], p[3], dxfattribs=attributes)
    space.add_line(p[0], (p[3][0], p[3][1] - shift), dxfattribs=attributes)


def test_loose_lines_become_a_face_named_by_its_layer(drawn):
    source = drawn(lambda s: square(s, 3, layer="PLATE"))
    assert areas(source.shape) == pytest.approx([9], rel=1e-14)
    assert [name for _, name in source.face_names] == ["PLATE"]
    assert [name for _, name in source.edge_names] == ["PLATE"] * 4
    assert "drawing unit: mm" in source.notes
    assert BRepCheck_Analyzer(source.shape).IsValid()


def test_nesting_is_even_odd(drawn):
    def draw(space):
        square(space, 10, layer="plate")
        space.add_circle((5, 5), 3, dxfattribs={"layer": "bore"})
        square(space, 2, at=(4, 4), layer="island")
        space.add_circle((5, 5), 0.5)
        square(space, 1, at=(20, 0), layer="apart")

    source = drawn(draw)
    hole, pin = math.pi * 9, math.pi / 4
    assert areas(source.shape) == pytest.approx([1, 4 - pin, 100 - hole], rel=1e-13)
    assert sorted(name for _, name in source.face_names) == ["apart", "island", "plate"]
    assert BRepCheck_Analyzer(source.shape).IsValid()


def test_arcs_bulges_ellipses_and_splines_keep_their_kind(drawn):
    def slot(space):
        space.add_lwpolyline([(0, 0, 0), (4, 0, 1), (4, 2, 0), (0, 2, 1)], format="xyb", close=True)

    source = drawn(slot)
    assert areas(source.shape) == pytest.approx([8 + math.pi], rel=1e-14)
    assert kinds(source.shape) == ["Circle", "Circle", "Line", "Line"]

    def egg(space):
        space.add_ellipse((1, 2), (3, 0), 0.5, 0, math.pi)
        space.add_open_spline([(-2, 2), (-1, 0), (3, 0), (4, 2)], degree=3)

    source = drawn(egg)
    # half an ellipse, and under it a bowl of depth 6 t (1 - t): its area is the integral of depth times dx/dt
    bowl = 18 * (1 / 20 + 8 / 30 + 1 / 20)
    assert kinds(source.shape) == ["BezierCurve", "Ellipse"]
    assert areas(source.shape) == pytest.approx([math.pi * 3 * 1.5 / 2 + bowl], rel=1e-12)


def test_rational_spline_is_exact(drawn):
    w = math.sqrt(0.5)

    def quarter(space):
        space.add_rational_spline([(1, 0), (1, 1), (0, 1)], weights=[1, w, 1], degree=2)
        space.add_line((0, 0), (1, 0))
        space.add_line((0, 0), (0, 1))

    source = drawn(quarter)
    assert areas(source.shape) == pytest.approx([math.pi / 4], rel=1e-10)  # the kernel's own quadrature
    assert kinds(source.shape) == ["BezierCurve", "Line", "Line"]


def test_extrusion_downwards_mirrors(drawn):
    def draw(space):
        down = {"extrusion": (0, 0, -1)}
        # in their own coordinates a half disc about (-5, 0); in the world its mirror image about (5, 0)
        space.add_arc((-5, 0), 2, 90, 270, dxfattribs=down)
        space.add_lwpolyline([(-5, 2), (-5, -2)], dxfattribs=down)

    source = drawn(draw)
    assert areas(source.shape) == pytest.approx([2 * math.pi], rel=1e-13)
    measure = GProp_GProps()
    BRepGProp.SurfaceProperties_s(source.shape, measure)
    assert measure.CentreOfMass().X() == pytest.approx(5 + 4 * 2 / (3 * math.pi), rel=1e-12)


def test_blocks_are_placed_scaled_and_layered(drawn):
    def draw(space):
        inner = space.doc.blocks.new("PIN")
        inner.add_circle((0, 0), 1)
        outer = space.doc.blocks.new("PLATE")
        square(outer, 10, layer="0")
        outer.add_blockref("PIN", (5, 5), dxfattribs={"xscale": 2, "yscale": 1})
        reference = {"layer": "part", "xscale": -1, "rotation": 30}
        space.add_blockref("PLATE", (100, 50), dxfattribs=reference)

    source = drawn(draw)
    assert areas(source.shape) == pytest.approx([100 - 2 * math.pi], rel=1e-12)
    assert kinds(source.shape) == ["Ellipse", "Line", "Line", "Line", "Line"]
    assert [name for _, name in source.face_names] == ["part"]


def test_closed_polyline_of_the_old_kind(drawn):
    def draw(space):
        space.add_polyline2d([(0, 0, 0), (4, 0, 1), (4, 2, 0), (0, 2, 1)], format="xyb", close=True)

    assert areas(drawn(draw).shape) == pytest.approx([8 + math.pi], rel=1e-13)


def test_hatch_boundaries_count_only_where_there_is_nothing_else(drawn):
    def hatch(space):
        edges = space.add_hatch().paths.add_edge_path()
        edges.add_arc((20, 0), 2, 0, 180)
        edges.add_line((18, 0), (22, 0))
        space.add_hatch().paths.add_polyline_path([(0, 0, 1), (4, 0, 1)], is_closed=True)

    assert areas(drawn(hatch).shape) == pytest.approx([2 * math.pi, 4 * math.pi], rel=1e-13)

    def both(space):
        hatch(space)
        square(space, 5)

    source = drawn(both)
    assert areas(source.shape) == pytest.approx([25])
    assert any("of a HATCH left out" in note for note in source.notes)


def test_many_holes_are_nested_at_once(drawn):
    def draw(space):
        square(space, 100)
        for k in range(1600):
            space.add_circle((2 + 2.4 * (k % 40), 2 + 2.4 * (k // 40)), 1)

    begin = time.perf_counter()
    (area,) = areas(drawn(draw).shape)
    assert area == pytest.approx(1e4 - 1600 * math.pi, rel=1e-12)
    assert time.perf_counter() - begin < 20


def test_duplicates_are_dropped_with_a_note(drawn):
    def draw(space):
        square(space, 3)
        square(space, 3)
        space.add_line((3, 0), (0, 0))
        space.add_circle((1.5, 1.5), 1)
        space.add_circle((1.5, 1.5), 1)

    source = drawn(draw)
    assert areas(source.shape) == pytest.approx([9 - math.pi], rel=1e-13)
    assert any(note.startswith("6 duplicate curves") for note in source.notes)


def test_small_gaps_close_and_wide_ones_are_named(drawn):
    source = drawn(lambda s: square(s, 100, shift=1e-4))
    assert areas(source.shape) == pytest.approx([1e4], rel=1e-5)
    assert BRepCheck_Analyzer(source.shape).IsValid()
    assert any("gaps between ends closed" in note for note in source.notes)
    with pytest.raises(GeometryError, match=r"0\.5 away") as caught:
        drawn(lambda s: square(s, 100, shift=0.5))
    assert "drawing.dxf" in str(caught.value)
    ends = {caught.value.at, tuple(float(x) for x in str(caught.value).split("at (")[2].split(")")[0].split(","))}
    assert ends in ({(100.0, 0.0), (100.5, 0.0)}, {(0.0, 100.0), (0.0, 99.5)})
    assert areas(drawn(lambda s: square(s, 100, shift=0.5), gap=0.6).shape) == pytest.approx([1e4], rel=0.01)


def test_lines_give_way_to_arcs_when_a_gap_closes(drawn):
    def draw(space):
        space.add_arc((0, 0), 1, 0, 180)
        space.add_line((-1.000004, 0), (1.000004, 0))

    assert areas(drawn(draw).shape) == pytest.approx([math.pi / 2], rel=1e-13)


def test_a_dividing_line_makes_two_faces_that_share_it(drawn):
    def draw(space):
        square(space, 2)
        space.add_line((2, 0), (0, 2), dxfattribs={"layer": "cut"})

    source = drawn(draw)
    assert areas(source.shape) == pytest.approx([2, 2], rel=1e-14)
    assert len(parts(source.shape, TopAbs_ShapeEnum.TopAbs_EDGE)) == 5
    assert len(parts(source.shape, TopAbs_ShapeEnum.TopAbs_VERTEX)) == 4


def test_a_line_between_outlines_is_left_out(drawn):
    def draw(space):
        square(space, 10)
        square(space, 2, at=(4, 4))
        space.add_line((0, 0), (4, 4))

    source = drawn(draw)
    assert areas(source.shape) == pytest.approx([96], rel=1e-14)
    assert any("bound no area on either side" in note for note in source.notes)


def test_what_bounds_nothing_is_left_out_with_a_note(drawn):
    def draw(space):
        square(space, 3)
        space.add_text("3 x 3")
        space.add_point((1, 1))
        space.doc.layers.add("OFF").off()
        space.add_line((0, 0), (9, 9), dxfattribs={"layer": "OFF"})
        space.doc.linetypes.add("CENTER", [1.0, 0.5, -0.25])
        space.add_line((-1, 1.5), (4, 1.5), dxfattribs={"linetype": "CENTER"})

    source = drawn(draw)
    assert areas(source.shape) == pytest.approx([9], rel=1e-14)
    for kind in ("TEXT", "POINT", "LINE on layer OFF", "LINE on layer 0"):
        assert any(note.startswith(kind) for note in source.notes), kind


def test_trouble_is_an_error_with_its_place(drawn, tmp_path):
    def crossing(space):
        square(space, 4)
        space.add_circle((4, 2), 1)

    with pytest.raises(GeometryError, match="cross") as caught:
        drawn(crossing)
    assert abs(caught.value.at[0] - 4) <= 1
    with pytest.raises(InputError, match="not flat"):
        drawn(lambda s: s.add_line((0, 0, 0), (1, 0, 1)))
    with pytest.raises(InputError, match="no curve"):
        drawn(lambda s: s.add_text("nothing"))
    for name, content in (("empty.dxf", ""), ("text.dxf", "this is no drawing\n"), ("cut.dxf", "0\nSECTION\n2\n")):
        path = tmp_path / name
        path.write_text(content)
        with pytest.raises(InputError) as caught:
            read_dxf(path)
        assert caught.value.file == str(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_dxf(tmp_path / "absent.dxf")


GOOD = [
    "cadquery/tests/testdata/1001.dxf",
    "trimesh/models/2D/wrench.dxf",
    "trimesh/models/2D/1002_tray_bottom.DXF",
    "trimesh/models/2D/250_cycloidal.DXF",
]


def derived(corpus, name):
    """The faces of a drawing as the corpus keeps them."""
    shape = TopoDS_Shape()
    BRepTools.Read_s(shape, str(corpus / "_faces_of_2d" / (name.replace("/", "__") + ".brep")), BRep_Builder())
    return shape


@pytest.mark.parametrize("name", GOOD)
def test_corpus_faces_agree_with_another_reader(corpus, name):
    source = read_dxf(corpus / name)
    assert areas(source.shape) == pytest.approx(areas(derived(corpus, name)), rel=1e-6)
    assert kinds(source.shape) == kinds(derived(corpus, name))
    assert BRepCheck_Analyzer(source.shape).IsValid()


def test_gear_keeps_its_bore_whose_ends_gape(corpus):
    """The ends of its bore (two arcs, two lines) are 1.3e-4 apart; the reader of the corpus dropped the bore."""
    name = "cadquery/tests/testdata/gear.dxf"
    half, radius = 1.8, 2.6
    bore = math.pi * radius**2 - 2 * (radius**2 * math.acos(half / radius) - half * math.sqrt(radius**2 - half**2))
    (with_bore,) = areas(read_dxf(corpus / name).shape)
    (without,) = areas(derived(corpus, name))
    assert without - with_bore == pytest.approx(bore, rel=1e-6)
    with pytest.raises(GeometryError, match="open"):
        read_dxf(corpus / name, ReadOptions(gap=4.5e-5))


def test_closed_rational_spline_of_one_period(corpus):
    source = read_dxf(corpus / "cadquery/tests/testdata/rational_spline.dxf")
    assert kinds(source.shape) == ["BSplineCurve"]
    assert len(areas(source.shape)) == 1


@pytest.mark.parametrize("share", [0.6, 0.9, 0.999])
def test_a_drawing_cut_short_is_refused(tmp_path, share):
    document = ezdxf.new()
    document.modelspace().add_circle((0, 0), 1)
    path = tmp_path / "cut.dxf"
    document.saveas(path)
    text = path.read_text()
    path.write_text(text[: int(share * len(text))])
    with pytest.raises(InputError, match=r"cut\.dxf: the DXF file is cut short"):
        read_dxf(path)
