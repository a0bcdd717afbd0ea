"""CAD faces in the XY plane from curves of a drawing: the same code on OCP 7 and OCP 8."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fubini.cad.drawing import Curve, Ellipse, Line, Spline
from fubini.cad.loops import Outline
from fubini.cad.nesting import PlaneFace
from fubini.errors import GeometryError

#: Tolerance of the shapes built here, in model units (that of the kernel itself).
CONFUSION = 1e-7


class FaceBuilder:
    """Builds planar faces; a curve used by two of them becomes one edge, a shared end one vertex.

    ``curves`` by index, ``ends``: numbers of the nodes at the start and end of each curve that is used.
    Afterwards ``compound`` holds the faces and ``edges`` the ``TopoDS_Edge`` of each curve that bounds one.
    """

    def __init__(self, curves: Sequence[Curve], ends: Mapping[int, tuple[int, int]]) -> None:
        from OCP.BRep import BRep_Builder
        from OCP.TopoDS import TopoDS_Compound

        self._curves, self._ends = curves, ends
        self._build = BRep_Builder()
        self._vertices: dict[int, Any] = {}
        self.edges: dict[int, Any] = {}
        self.compound = TopoDS_Compound()
        self._build.MakeCompound(self.compound)

    def add(self, face: PlaneFace) -> Any:
        """Add a face to the compound and return it (``TopoDS_Face``, normal along +z)."""
        from OCP.Geom import Geom_Plane
        from OCP.gp import gp_Dir, gp_Pnt
        from OCP.TopoDS import TopoDS_Face

        made = TopoDS_Face()
        self._build.MakeFace(made, Geom_Plane(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), CONFUSION)
        for outline, is_hole in [(face.outer, False), *((hole, True) for hole in face.holes)]:
            wire = self._wire(outline)
            self._build.Add(made, wire.Reversed() if (outline.area < 0) != is_hole else wire)
        self._build.Add(self.compound, made)
        return made

    def _wire(self, outline: Outline) -> Any:
        from OCP.TopoDS import TopoDS_Wire

        wire = TopoDS_Wire()
        self._build.MakeWire(wire)
        for use in outline.uses:
            edge = self._edge(use.curve)
            self._build.Add(wire, edge if use.forward else edge.Reversed())
        wire.Closed(True)
        return wire

    def _edge(self, index: int) -> Any:
        from OCP.TopAbs import TopAbs_Orientation
        from OCP.TopoDS import TopoDS_Edge

        if index not in self.edges:
            curve = self._curves[index]
            geometry, first, last = occ_curve(curve)
            edge = TopoDS_Edge()
            self._build.MakeEdge(edge, geometry, CONFUSION)
            start, end = self._ends[index]
            forward, reverse = TopAbs_Orientation.TopAbs_FORWARD, TopAbs_Orientation.TopAbs_REVERSED
            self._build.Add(edge, self._vertex(start, curve.start).Oriented(forward))
            self._build.Add(edge, self._vertex(end, curve.end).Oriented(reverse))
            self._build.Range(edge, first, last)
            self.edges[index] = edge
        return self.edges[index]

    def _vertex(self, node: int, z: complex) -> Any:
        from OCP.gp import gp_Pnt
        from OCP.TopoDS import TopoDS_Vertex

        if node not in self._vertices:
            vertex = TopoDS_Vertex()
            self._build.MakeVertex(vertex, gp_Pnt(z.real, z.imag, 0), CONFUSION)
            self._vertices[node] = vertex
        return self._vertices[node]


def occ_curve(curve: Curve) -> tuple[Any, float, float]:
    """The ``Geom_Curve`` of a curve and the parameters of its start and end."""
    from OCP.gp import gp_Dir, gp_Pnt

    if isinstance(curve, Line):
        from OCP.Geom import Geom_Line

        d = curve.end - curve.start
        start = gp_Pnt(curve.start.real, curve.start.imag, 0)
        return Geom_Line(start, gp_Dir(d.real, d.imag, 0)), 0.0, abs(d)
    if isinstance(curve, Ellipse):
        return _conic(curve), curve.first, curve.first + curve.sweep
    return _spline(curve), float(curve.knots[0]), float(curve.knots[-1])


def _conic(curve: Ellipse) -> Any:
    from OCP.Geom import Geom_Circle, Geom_Ellipse
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    side = 1.0 if curve.ratio > 0 else -1.0
    axes = gp_Ax2(
        gp_Pnt(curve.centre.real, curve.centre.imag, 0),
        gp_Dir(0, 0, side),
        gp_Dir(curve.axis.real, curve.axis.imag, 0),
    )
    radius = abs(curve.axis)
    if curve.kind == "circle":
        return Geom_Circle(axes, radius)
    return Geom_Ellipse(axes, radius, radius * abs(curve.ratio))


def _spline(curve: Spline) -> Any:
    from OCP.Geom import Geom_BezierCurve, Geom_BSplineCurve
    from OCP.gp import gp_Pnt

    points, reals, integers = _array_types()
    poles = _filled(points, [gp_Pnt(z.real, z.imag, 0) for z in curve.poles])
    weights = None if curve.weights is None else _filled(reals, [float(w) for w in curve.weights])
    try:
        if curve.kind == "bezier" and (curve.knots[0], curve.knots[-1]) == (0, 1):
            return Geom_BezierCurve(poles) if weights is None else Geom_BezierCurve(poles, weights)
        values, counts = np.unique(curve.knots, return_counts=True)
        knots, multiplicities = _filled(reals, values.tolist()), _filled(integers, counts.tolist())
        if weights is None:
            return Geom_BSplineCurve(poles, knots, multiplicities, curve.degree)
        return Geom_BSplineCurve(poles, weights, knots, multiplicities, curve.degree)
    except Exception as error:  # the kernel's own exception classes differ between its generations
        at = (curve.start.real, curve.start.imag)
        raise GeometryError(f"the CAD kernel refuses this spline of degree {curve.degree}: {error}", at=at) from error


def _array_types() -> tuple[Any, Any, Any]:
    """Array classes of points, reals and integers: named collections in OCP 7, templates in OCP 8."""
    try:
        from OCP.collections import Array1_double, Array1_gp_Pnt, Array1_int
    except ImportError:
        from OCP.TColgp import TColgp_Array1OfPnt
        from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal

        return TColgp_Array1OfPnt, TColStd_Array1OfReal, TColStd_Array1OfInteger
    return Array1_gp_Pnt, Array1_double, Array1_int


def _filled(kind: Any, values: Sequence[Any]) -> Any:
    array = kind(1, len(values))
    for i, value in enumerate(values, start=1):
        array.SetValue(i, value)
    return array
