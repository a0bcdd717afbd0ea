"""CAD edges: their curves, end vertices and tolerances, each read once for all faces that share it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.Geom import Geom_BSplineCurve, Geom_TrimmedCurve
from OCP.GeomAbs import GeomAbs_CurveType as CurveType
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopAbs import TopAbs_Orientation as Orientation
from OCP.TopExp import TopExp

from fubini.cad import occ
from fubini.cad.conversion import hermite_spline, hyperbola, parabola
from fubini.cad.spacecurve import SpaceConic, SpaceCurve, SpaceLine, SpaceSpline
from fubini.errors import GeometryError
from fubini.tolerance import CONVERSION

Float = NDArray[np.float64]

_FAR = 1e99  # the kernel's parameters of unbounded curves are 2e100
_first_vertex = occ.static(TopExp, "FirstVertex")
_last_vertex = occ.static(TopExp, "LastVertex")


@dataclass(frozen=True)
class CadEdge:
    """One edge of the CAD shape.

    ``vertices``: numbers of the vertices at the first and last parameter, -1 where there is none.
    ``ends``: first and last point (2, 3) of the curve itself. ``tolerance``: of edge and vertices.
    """

    index: int
    curve: SpaceCurve
    vertices: tuple[int, int]
    ends: Float
    tolerance: float


class EdgeTable:
    """Edges and vertices of a shape by ``MapShapes`` number, read on demand."""

    def __init__(self, shape: Any, diagonal: float) -> None:
        self.shapes = occ.ShapeMap(shape, occ.EDGE)
        self._vertex_shapes = occ.ShapeMap(shape, occ.VERTEX)
        self._tolerance = CONVERSION * diagonal
        self._edges: dict[int, CadEdge] = {}
        self.points: dict[int, Float] = {}

    def index(self, edge: Any) -> int:
        """Number of an edge."""
        return self.shapes.index(edge)

    def vertex(self, shape: Any) -> tuple[int, Float]:
        """Number and place (3,) of a vertex."""
        return self._vertex_shapes.index(shape), occ.vertex_point(occ.as_vertex(shape))

    def degenerated(self, index: int) -> bool:
        """Whether the edge is a mere point of its surface."""
        return bool(occ.degenerated(occ.as_edge(self.shapes[index])))

    def forward(self, index: int) -> Any:
        """The ``TopoDS_Edge``, run along its curve."""
        return occ.as_edge(self.shapes[index].Oriented(Orientation.TopAbs_FORWARD))

    def length(self, index: int) -> float:
        """Length of the chord through a few points of the edge: an estimate from below."""
        return float(np.linalg.norm(np.diff(self.sample(index, 5), axis=0), axis=1).sum())

    def sample(self, index: int, count: int) -> Float:
        """Points (count, 3) along the edge, equally spaced in its parameter, ends included."""
        adaptor = BRepAdaptor_Curve(self.forward(index))
        return np.array(
            [
                occ.xyz(adaptor.Value(float(t)))
                for t in np.linspace(adaptor.FirstParameter(), adaptor.LastParameter(), count)
            ]
        )

    def __getitem__(self, index: int) -> CadEdge:
        if index not in self._edges:
            self._edges[index] = self._read(index)
        return self._edges[index]

    def _read(self, index: int) -> CadEdge:
        edge = self.forward(index)
        tolerance = occ.tolerance(edge)
        numbers = []
        for vertex in (_first_vertex(edge), _last_vertex(edge)):
            number = -1 if vertex.IsNull() else self._vertex_shapes.index(vertex)
            numbers.append(number)
            if number >= 0:
                tolerance = max(tolerance, occ.tolerance(vertex))
                if number not in self.points:
                    self.points[number] = occ.vertex_point(vertex)
        try:
            curve, ends = read_curve(edge, self._tolerance)
        except GeometryError as error:
            raise GeometryError(error.message, edge=index, fix=error.fix) from None
        return CadEdge(index, curve, (numbers[0], numbers[1]), ends, float(tolerance))


def read_curve(edge: Any, tolerance: float) -> tuple[SpaceCurve, Float]:
    """The curve of a ``TopoDS_Edge`` over its range, placed in space, and its ends (2, 3).

    Curves without an exact counterpart are approximated within ``tolerance`` (model units).
    """
    try:
        adaptor = BRepAdaptor_Curve(edge)
        first, last = adaptor.FirstParameter(), adaptor.LastParameter()
    except Exception as error:
        raise GeometryError(f"an edge without a curve ({type(error).__name__})", fix="heal the model") from None
    if not (-_FAR < first < last < _FAR):
        raise GeometryError(f"an edge over the parameters {first:.3g} to {last:.3g}", fix="trim it at both ends")
    ends = np.array([occ.xyz(adaptor.Value(first)), occ.xyz(adaptor.Value(last))])
    return _convert(adaptor, first, last, ends, tolerance), ends


def _convert(adaptor: Any, first: float, last: float, ends: Float, tolerance: float) -> SpaceCurve:
    kind = adaptor.GetType()
    if kind == CurveType.GeomAbs_Line:
        return SpaceLine("line", ends)
    if kind == CurveType.GeomAbs_Circle:
        c = adaptor.Circle()
        return SpaceConic("circle", *_axes(c, c.Radius(), c.Radius()), first, last)
    if kind == CurveType.GeomAbs_Ellipse:
        c = adaptor.Ellipse()
        return SpaceConic("ellipse", *_axes(c, c.MajorRadius(), c.MinorRadius()), first, last)
    if kind == CurveType.GeomAbs_Parabola:
        c = adaptor.Parabola()
        return parabola(*_axes(c, 1.0, 1.0), c.Focal(), first, last)
    if kind == CurveType.GeomAbs_Hyperbola:
        c = adaptor.Hyperbola()
        return hyperbola(*_axes(c, c.MajorRadius(), c.MinorRadius()), first, last)
    if kind == CurveType.GeomAbs_BezierCurve:
        return _bezier(adaptor.Bezier(), first, last)
    if kind == CurveType.GeomAbs_BSplineCurve:
        return _bspline(adaptor.BSpline(), first, last)
    name = "offset" if kind == CurveType.GeomAbs_OffsetCurve else "other"
    return hermite_spline(name, _evaluator(adaptor), first, last, tolerance)


def _axes(conic: Any, x: float, y: float) -> tuple[Float, Float, Float]:
    """Location and scaled axes (3,) each of a ``gp`` conic."""
    return (
        occ.xyz(conic.Location()),
        x * occ.xyz(conic.XAxis().Direction()),
        y * occ.xyz(conic.YAxis().Direction()),
    )


def _poles(curve: Any) -> tuple[Float, Float | None]:
    n = curve.NbPoles()
    poles = np.array([occ.xyz(curve.Pole(i)) for i in range(1, n + 1)])
    weights = np.array([curve.Weight(i) for i in range(1, n + 1)]) if curve.IsRational() else None
    return poles, weights


def _bezier(curve: Any, first: float, last: float) -> SpaceCurve:
    poles, weights = _poles(curve)
    degree = curve.Degree()
    if (first, last) == (0.0, 1.0):
        return SpaceSpline("bezier", degree, None, poles, weights)
    knots = np.repeat([0.0, 1.0], degree + 1)
    return SpaceSpline("bezier", degree, knots, poles, weights, max(first, 0.0), min(last, 1.0))


def _bspline(curve: Any, first: float, last: float) -> SpaceCurve:
    if curve.IsPeriodic():
        # the range may run over the seam of the period: cut out one plain piece, exactly
        curve = occ.static(GeomConvert, "CurveToBSplineCurve")(Geom_TrimmedCurve(curve, first, last))
        if curve.IsPeriodic():
            whole: Geom_BSplineCurve = curve.Copy()
            whole.SetNotPeriodic()
            curve = whole
        first, last = curve.FirstParameter(), curve.LastParameter()
    poles, weights = _poles(curve)
    count = [(curve.Knot(i), curve.Multiplicity(i)) for i in range(1, curve.NbKnots() + 1)]
    knots = np.repeat([k for k, _ in count], [m for _, m in count])
    low, high = curve.FirstParameter(), curve.LastParameter()
    return SpaceSpline("bspline", curve.Degree(), knots, poles, weights, max(first, low), min(last, high))


def _evaluator(adaptor: Any) -> Any:
    p, d1, d2 = gp_Pnt(), gp_Vec(), gp_Vec()

    def evaluate(t: float) -> Float:
        adaptor.D2(t, p, d1, d2)
        return np.array([occ.xyz(p), occ.xyz(d1), occ.xyz(d2)])

    return evaluate
