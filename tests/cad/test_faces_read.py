"""Planes, loops and curves of CAD faces, measured against the kernel's own evaluation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_NurbsConvert, BRepBuilderAPI_Transform
from OCP.BRepFill import BRepFill
from OCP.Geom import (
    Geom_BezierCurve,
    Geom_BSplineCurve,
    Geom_Circle,
    Geom_CylindricalSurface,
    Geom_Ellipse,
    Geom_Hyperbola,
    Geom_OffsetCurve,
    Geom_Parabola,
    Geom_Plane,
)
from OCP.gp import gp_Ax2, gp_Ax3, gp_Dir, gp_Pnt
from OCP.TopAbs import TopAbs_Orientation as Orientation

import fubini
from cad import shapes as S
from fubini.cad import load, occ
from fubini.cad.edges import read_curve
from fubini.cad.spacecurve import SpaceSpline, project
from fubini.curves import BSpline, CircularArc, EllipticalArc
from fubini.errors import GeometryError, InputError
from fubini.model import Frame

FLAT = Frame(np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
AXES = gp_Ax2(gp_Pnt(1, 2, 0), gp_Dir(0, 0, 1), gp_Dir(math.cos(0.3), math.sin(0.3), 0))


def closes(region):
    for loop in region.loops:
        for a, b in zip(loop.curves, [*loop.curves[1:], loop.curves[0]], strict=True):
            assert np.array_equal(a.point(1.0), b.point(0.0))


def middle_in_space(face):
    return face.frame.to_space(face.region.centroid)[0]


def test_splines_that_miss_their_vertices_are_bent_to_them():
    """No jump at the ends, where the vertices lie off the curve by the tolerance of the file."""
    poles = np.array([(0.0, 0, 0), (1, 2, 0), (3, 2, 0), (4, 0, 0), (5, 1, 0)])
    knots = np.array([0.0, 0, 0, 0, 2, 3, 3, 3, 3])
    start, end = np.array([0.1, -0.2]), np.array([5.0, 1.3])
    for weights in (None, np.array([1.0, 2, 1, 0.5, 1])):
        for curve in (
            SpaceSpline("bspline", 3, knots, poles, weights, 0.0, 3.0).to_plane(FLAT, start, end),
            SpaceSpline("bezier", 4, None, poles, weights).to_plane(FLAT, start, end),
        ):
            near = curve.point(np.array([0.0, 1e-9, 1.0 - 1e-9, 1.0]))
            assert np.array_equal(near[0], start) and np.array_equal(near[3], end)
            assert np.abs(np.diff(near, axis=0)[[0, 2]]).max() < 1e-7
            same = type(curve)(*((3, knots) if curve.kind == "bspline" else ()), poles[:, :2], weights)
            t = np.linspace(0.0, 1.0, 9)
            assert np.abs(curve.point(t) - same.point(t)).max() <= 0.3 + 1e-12


# -- frames --------------------------------------------------------------------------------------


PLACES = {"as built": S.turned(0), "tilted": S.turned(), "moved": S.turned(180, (0, 1, 0), (5, 6, 7))}


@pytest.mark.parametrize("place", PLACES)
def test_normals_of_a_solid_point_outward(place):
    model = load(S.box().Moved(PLACES[place]))
    centre = np.mean([middle_in_space(f) for f in model.faces], axis=0)
    for face in model.faces:
        assert np.dot(face.frame.normal, middle_in_space(face) - centre) > 0
        assert face.region.area > 0
        assert face.region.area == pytest.approx(face.area, rel=1e-13)
        closes(face.region)
    assert sum(f.area for f in model.faces) == pytest.approx(22)
    assert len(model.edges) == 12 and len(model.vertices) == 8
    corners = np.array(list(model.vertices.values()))
    assert model.diagonal == pytest.approx(np.linalg.norm(np.ptp(corners, axis=0)), rel=1e-12)


def test_a_mirrored_copy_points_outward_too():
    trsf = S.mirrored().Transformation()
    model = load(BRepBuilderAPI_Transform(S.plate(), trsf, True).Shape())
    for face in model.faces:
        outward = middle_in_space(face) - np.array([-3.0, 2, 0.5])
        assert np.dot(face.frame.normal, outward) > 0 or abs(face.area - (24 - math.pi)) > 1e-9
    assert {round(f.frame.normal[2]) for f in model.faces if len(f.region.holes)} == {-1, 1}


def test_a_mirroring_placement_leaves_the_outside_outside():
    box = S.box()
    model = load(box.Located(S.mirrored(), False))
    assert [f.area for f in model.faces] == pytest.approx([f.area for f in load(box).faces])
    for face in model.faces:
        corners = face.frame.to_space(face.region.outer.vertices)
        assert corners[:, 0].min() >= -3 and corners[:, 0].max() <= 0
        assert face.region.area > 0
        assert np.dot(face.frame.normal, corners.mean(axis=0) - [-1.5, 1, 0.5]) > 0


def test_planes_normal_to_an_axis_use_space_coordinates_exactly():
    model = load(S.box(0.1, 0.7, 0.3, at=(0.1, 1e3, -1 / 3)))
    for face in model.faces:
        for loop in face.region.loops:
            for curve, edge, forward in zip(loop.curves, loop.edges, loop.forward, strict=True):
                vertex = model.edges[edge].start if forward else model.edges[edge].end
                assert np.array_equal(face.frame.to_space(curve.start)[0], model.vertices[vertex])


def test_frames_do_not_depend_on_the_axes_of_the_cad_plane():
    points = [(0.0, 0, 0), (2, 0, 1), (2, 1, 1), (0, 1, 0)]
    frames = []
    for turn in (0.0, 0.7):
        direction = gp_Dir(2 * math.cos(turn), math.sin(turn) * math.sqrt(5), math.cos(turn))
        plane = Geom_Plane(gp_Ax3(gp_Pnt(0, 0, 0), gp_Dir(-1, 0, 2), direction))
        frames.append(load(S.raw_face(plane, S.polygon_wire(points))).faces[0].frame)
    assert np.allclose(frames[0].x_axis, frames[1].x_axis, atol=1e-15)
    assert np.allclose(frames[0].normal, frames[1].normal, atol=1e-15)


def test_a_reversed_face_turns_its_normal_and_keeps_its_area():
    face = S.face_of(S.polygon_wire([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]))
    up, down = load(face).faces[0], load(face.Reversed()).faces[0]
    assert np.allclose(up.frame.normal, -down.frame.normal)
    assert up.region.area == down.region.area == 2.0


def test_flat_splines_count_as_planes():
    model = load(BRepBuilderAPI_NurbsConvert(S.plate(), True).Shape())
    plain = load(S.plate())
    assert len(model.faces) == len(plain.faces) == 6
    for a, b in zip(model.faces, plain.faces, strict=True):
        assert a.region.area == pytest.approx(b.region.area, rel=1e-12)
        assert np.allclose(a.frame.normal, b.frame.normal, atol=1e-12)
    assert [s.surface for s in model.skipped] == ["bspline"] and [s.surface for s in plain.skipped] == ["cylinder"]


# -- curves --------------------------------------------------------------------------------------


def bspline(periodic=False, weights=None):
    points = [(math.cos(a) * (2 + (i % 2)), math.sin(a) * 2, 0) for i, a in enumerate(np.arange(6) * math.pi / 3)]
    if periodic:
        knots, counts = range(7), [1] * 7
        return Geom_BSplineCurve(S.points_array(points), S.reals(knots), S.integers(counts), 3, True)
    arrays = [S.points_array(points)] + ([S.reals(weights)] if weights else [])
    return Geom_BSplineCurve(*arrays, S.reals([0, 1, 3, 4]), S.integers([4, 1, 1, 4]), 3)


POLES = [(0, 0, 0), (1, 2, 0), (3, -1, 0), (4, 1, 0)]
CURVES = {
    "circle": (Geom_Circle(AXES, 2.0), 0.4, 5.0),
    "circle, mirrored axis": (Geom_Circle(AXES.Mirrored(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0))), 2.0), 0.4, 5.0),
    "circle seen from below": (Geom_Circle(gp_Ax2(gp_Pnt(1, 2, 0), gp_Dir(0, 0, -1)), 2.0), 1.0, 2.0),
    "ellipse": (Geom_Ellipse(AXES, 3.0, 1.0), -1.0, 3.0),
    "bezier": (Geom_BezierCurve(S.points_array(POLES)), 0.0, 1.0),
    "part of a rational bezier": (Geom_BezierCurve(S.points_array(POLES), S.reals([1, 2, 0.5, 1])), 0.2, 0.9),
    "bspline": (bspline(), 0.0, 4.0),
    "part of a rational bspline": (bspline(weights=[1, 2, 3, 1, 0.5, 1]), 0.7, 3.3),
    "periodic bspline": (bspline(True), 0.0, 6.0),
    "periodic bspline over its seam": (bspline(True), 4.5, 8.25),
    "parabola": (Geom_Parabola(AXES, 0.7), -1.0, 3.0),
}


@pytest.mark.parametrize("name", CURVES)
def test_the_curve_is_the_cad_curve_at_equal_parameters(name):
    curve, first, last = CURVES[name]
    edge = S.edge_of(curve, first, last)
    read, ends = read_curve(edge, 1e-8)
    flat = read.to_plane(FLAT, *project(FLAT, ends))
    adaptor = BRepAdaptor_Curve(edge)
    t = np.linspace(0, 1, 41)
    exact = np.array([occ.xyz(adaptor.Value(first + s * (last - first)))[:2] for s in t])
    assert np.abs(flat.point(t) - exact).max() < 2e-14 * 10
    assert np.array_equal(flat.point(0.0), ends[0][:2]) and np.array_equal(flat.point(1.0), ends[1][:2])
    assert read.conversion == 0.0
    backward = flat.reverse()
    assert np.array_equal(backward.point(0.0), ends[1][:2])


def test_a_hyperbola_is_exact_in_shape():
    axes = gp_Ax2(gp_Pnt(1, 2, 0), gp_Dir(0, 0, 1))
    read, ends = read_curve(S.edge_of(Geom_Hyperbola(axes, 2.0, 0.5), -1.2, 2.5), 1e-8)
    flat = read.to_plane(FLAT, *project(FLAT, ends))
    x, y = (flat.point(np.linspace(0, 1, 101)) - (1, 2)).T
    assert np.abs((x / 2) ** 2 - (y / 0.5) ** 2 - 1).max() < 1e-12
    assert read.conversion == 0.0 and read.kind == "hyperbola"


@pytest.mark.parametrize("tolerance", [1e-4, 1e-9])
def test_an_offset_curve_stays_within_the_stated_tolerance(tolerance):
    curve = Geom_OffsetCurve(Geom_Ellipse(AXES, 3.0, 1.0), 0.4, gp_Dir(0, 0, 1))
    edge = S.edge_of(curve, 0.0, 5.0)
    read, ends = read_curve(edge, tolerance)
    flat = read.to_plane(FLAT, *project(FLAT, ends))
    adaptor = BRepAdaptor_Curve(edge)
    t = np.linspace(0, 1, 1001)
    exact = np.array([occ.xyz(adaptor.Value(5.0 * s))[:2] for s in t])
    off = np.abs(flat.point(t) - exact).max()
    assert 0 < off <= 1.05 * tolerance and 0 < read.conversion <= tolerance
    assert read.kind == "offset"


def test_a_tilted_circle_projects_to_an_ellipse():
    tilt = 0.5
    edge = S.edge_of(Geom_Circle(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(math.sin(tilt), 0, math.cos(tilt))), 2.0), 0.3, 4.0)
    read, ends = read_curve(edge, 1e-8)
    flat = read.to_plane(FLAT, *project(FLAT, ends))
    assert isinstance(flat, EllipticalArc)
    adaptor = BRepAdaptor_Curve(edge)
    exact = np.array([occ.xyz(adaptor.Value(0.3 + 3.7 * s))[:2] for s in (0, 0.25, 0.6, 1)])
    assert np.allclose(flat.point(np.array([0, 0.25, 0.6, 1])), exact, atol=1e-14)
    assert read.leaves(FLAT) == pytest.approx(2 * math.sin(tilt))


def test_round_holes_stay_circles_and_run_clockwise():
    model = load(S.plate().Moved(S.turned()))
    top = next(f for f in model.faces if f.region.holes)
    (hole,) = top.region.holes
    assert all(isinstance(c, CircularArc) for c in hole.curves)
    assert hole.signed_area == pytest.approx(-math.pi, rel=1e-13)
    assert top.region.area == pytest.approx(24 - math.pi, rel=1e-13)
    assert {model.edges[e].kind for e in hole.edges} == {"circle"}
    assert sum(e in hole.edges for f in model.faces for e in f.region.edges) == 1


# -- wires ---------------------------------------------------------------------------------------

SQUARE = [(0.0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)]
INNER = [(1.0, 1, 0), (2, 1, 0), (2, 2, 0), (1, 2, 0)]
PLANE = Geom_Plane(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))


@pytest.mark.parametrize("outer_back", [False, True])
@pytest.mark.parametrize("inner_back", [False, True])
def test_holes_in_either_orientation(outer_back, inner_back):
    outer, inner = S.polygon_wire(SQUARE), S.polygon_wire(INNER)
    outer = outer.Reversed() if outer_back else outer
    inner = inner.Reversed() if inner_back else inner
    face = load(S.raw_face(PLANE, inner, outer)).faces[0]
    assert face.region.area == 15.0 and len(face.region.holes) == 1
    assert np.allclose(face.frame.normal, (0, 0, 1))


@pytest.mark.parametrize("backwards", [False, True])
def test_a_hole_that_runs_the_wrong_way_is_reported_and_certified(backwards):
    outer, inner = S.polygon_wire(SQUARE), S.polygon_wire(INNER)
    mesh = fubini.mesh(S.raw_face(PLANE, outer, inner.Reversed() if backwards else inner), 1.0)
    assert mesh.certificate.certified, mesh.certificate.faces[0].reasons
    assert any("ran the wrong way" in note for note in mesh.certificate.notes) is not backwards


def test_edges_in_any_order_are_chained():
    edges = S.sub(S.polygon_wire(SQUARE), occ.EDGE)
    face = load(S.raw_face(PLANE, S.raw_wire([edges[i] for i in (2, 0, 3, 1)]))).faces[0]
    assert face.region.area == 16.0
    closes(face.region)


def test_unshared_vertices_within_the_gap_are_joined():
    corners = [*SQUARE, SQUARE[0]]
    edges = [S.line(a, np.add(b, (1e-9, 0, 0)).tolist()) for a, b in zip(corners, corners[1:], strict=False)]
    face = load(S.raw_face(PLANE, S.raw_wire(edges))).faces[0]
    closes(face.region)
    assert face.region.area == pytest.approx(16.0, rel=1e-8)


def test_an_open_wire_is_refused_with_both_ends():
    edges = S.sub(S.polygon_wire(SQUARE), occ.EDGE)[:3]
    with pytest.raises(GeometryError, match="open") as caught:
        load(S.raw_face(PLANE, S.raw_wire(edges)))
    assert caught.value.face == 0 and caught.value.at == (0, 4, 0)
    assert "(0, 0, 0)" in str(caught.value)


def test_slits_and_embedded_edges_are_kept_inside_the_face():
    outer = S.sub(S.polygon_wire(SQUARE), occ.EDGE)
    slit = S.line((0, 0, 0), (1, 1, 0))
    embedded = S.line((2, 2, 0), (3, 3, 0)).Oriented(Orientation.TopAbs_INTERNAL)
    beyond = S.line((5, 5, 0), (6, 6, 0)).Oriented(Orientation.TopAbs_INTERNAL)
    wire = S.raw_wire([*outer, slit, slit.Reversed(), embedded, beyond])
    model = load(S.raw_face(PLANE, wire))
    assert model.faces[0].region.area == 16.0
    assert len(model.edges) == 6 and len(model.faces[0].region.edges) == 4
    ends = sorted(curve.point([0.0, 1.0]).tolist() for curve, _ in model.faces[0].inner)
    assert ends == [[[0.0, 0.0], [1.0, 1.0]], [[2.0, 2.0], [3.0, 3.0]]]
    assert any("(5.5, 5.5, 0)" in n and "left out" in n for n in model.notes)


def test_a_bridge_from_outline_to_hole_is_taken_out():
    outer = S.sub(S.polygon_wire(SQUARE), occ.EDGE)
    inner = S.sub(S.polygon_wire(INNER).Reversed(), occ.EDGE)
    bridge = S.line((0, 0, 0), (1, 1, 0))
    model = load(S.raw_face(PLANE, S.raw_wire([*outer, bridge, *inner, bridge.Reversed()])))
    assert model.faces[0].region.area == 15.0 and len(model.faces[0].region.holes) == 1


def test_a_closed_edge_without_neighbours_is_a_loop():
    circle = S.wire_of(S.edge_of(Geom_Circle(AXES, 2.0), 0.0, 2 * math.pi))
    model = load(S.face_of(circle))
    (curve,) = model.faces[0].region.curves
    (edge,) = model.edges.values()
    assert np.array_equal(curve.start, curve.end) and edge.start == edge.end == 0
    assert model.faces[0].region.area == pytest.approx(4 * math.pi, rel=1e-14)


def test_shared_edges_are_one_edge_with_the_same_parameter():
    model = load(S.box())
    uses: dict[int, list] = {}
    for face in model.faces:
        for curve, edge, forward in zip(
            face.region.curves, face.region.edges, [f for lp in face.region.loops for f in lp.forward], strict=True
        ):
            along = curve if forward else curve.reverse()
            uses.setdefault(edge, []).append(face.frame.to_space(along.point(np.array([0.0, 0.25, 1.0]))))
    assert len(uses) == 12
    for a, b in uses.values():
        assert np.allclose(a, b, atol=1e-14)


def test_names_of_skipped_faces_and_sources_without_planes():
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

    with pytest.raises(InputError, match=r"none of the 1 faces is planar \(sphere\)"):
        load(BRepPrimAPI_MakeSphere(1.0).Shape())


def test_a_face_of_no_area_is_named():
    flat = S.raw_face(PLANE, S.raw_wire([S.line((0, 0, 0), (3, 0, 0)), S.line((3, 0, 0), (0, 0, 0))]))
    with pytest.raises(GeometryError, match="no area") as caught:
        load(occ.compound([S.box(), flat]), check=False)
    assert caught.value.face == 6


def test_a_self_crossing_outline_is_refused_with_its_place():
    bow = S.raw_face(PLANE, S.polygon_wire([(0, 0, 0), (2, 2, 0), (2, 0, 0), (0, 3, 0)]))
    with pytest.raises(GeometryError, match="cross") as caught:
        load(bow)
    assert caught.value.at == pytest.approx((1.2, 1.2, 0))
    assert load(bow, check=False).faces


def test_a_curve_off_its_vertex_is_noted():
    from OCP.BRep import BRep_Builder
    from OCP.Geom import Geom_Line
    from OCP.TopoDS import TopoDS_Edge, TopoDS_Vertex

    builder = BRep_Builder()
    vertices = []
    for p in SQUARE:
        vertex = TopoDS_Vertex()
        builder.MakeVertex(vertex, gp_Pnt(*p), 1e-2)
        vertices.append(vertex)
    edges = []
    for i in range(4):
        a, b = np.array(SQUARE[i]), np.array(SQUARE[(i + 1) % 4])
        lift = np.array([0, 1e-3, 0]) if i == 0 else np.zeros(3)
        d = (b - a) / 4
        edge = TopoDS_Edge()
        builder.MakeEdge(edge, Geom_Line(gp_Pnt(*(a + lift).tolist()), gp_Dir(*d.tolist())), 1e-7)
        builder.Add(edge, vertices[i].Oriented(Orientation.TopAbs_FORWARD))
        builder.Add(edge, vertices[(i + 1) % 4].Oriented(Orientation.TopAbs_REVERSED))
        builder.Range(edge, 0.0, 4.0)
        edges.append(edge)
    model = load(S.raw_face(PLANE, S.raw_wire(edges)))
    assert model.faces[0].region.area == 16.0
    assert sum("off its vertex" in n for n in model.notes) == 2
    assert model.edges[0].tolerance == pytest.approx(1e-2)


def test_knots_of_a_converted_curve_join_smoothly():
    curve = Geom_OffsetCurve(Geom_Ellipse(AXES, 3.0, 1.0), 0.4, gp_Dir(0, 0, 1))
    read, ends = read_curve(S.edge_of(curve, 0.0, 5.0), 1e-8)
    flat = read.to_plane(FLAT, *project(FLAT, ends))
    assert isinstance(flat, BSpline)
    for k in np.unique(read.knots)[1:-1]:
        t = k / 5.0
        assert np.allclose(flat.derivative(t - 1e-9), flat.derivative(t + 1e-9), atol=1e-5)


@pytest.mark.parametrize(("rise", "flat"), [(4e-7, True), (6e-7, False), (1e-6, False), (1e-5, False)])
def test_a_ruled_surface_is_flat_only_within_the_tolerance(rise, flat):
    """Between two edges that are not quite parallel it stays a quarter of the rise off a plane; the kernel allows twice
    the tolerance."""
    pairs = [[(0, 0, 0), (1, 0, 0)], [(0, 1, 0), (1, 1, rise)]]
    edges = [BRepBuilderAPI_MakeEdge(*(gp_Pnt(*map(float, p)) for p in pair)).Edge() for pair in pairs]
    face = occ.static(BRepFill, "Face")(*edges)
    if flat:
        assert fubini.mesh(face, 0.3).certificate.certified
    else:
        with pytest.raises(InputError, match=r"planar \(bspline\)"):
            load(face)


@pytest.mark.parametrize(
    "surface", [Geom_Plane(AXES.Location(), AXES.Direction()), Geom_CylindricalSurface(gp_Ax3(AXES), 2.0)]
)
def test_a_face_without_an_end_is_refused_and_named(surface):
    """All sizes and tolerances would follow from the extent that the kernel gives it, 1e100."""
    with pytest.raises(GeometryError, match="face 6: a face without an end"):
        load(occ.compound([S.box(), S.raw_face(surface)]))
