"""CAD shapes made with the kernel alone, so that the tests run on every OCP."""

from __future__ import annotations

import pytest

pytest.importorskip("OCP")

from OCP.BRep import BRep_Builder
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Face, TopoDS_Wire

from fubini.cad import occ
from fubini.cad.faces import _array_types, _filled


def box(x=3.0, y=2.0, z=1.0, at=(0.0, 0.0, 0.0)):
    """A box solid with one corner at ``at``."""
    return BRepPrimAPI_MakeBox(gp_Pnt(*at), x, y, z).Shape()


def plate(x=6.0, y=4.0, z=1.0, radius=1.0):
    """A plate with a round hole through it, about the middle."""
    tool = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x / 2, y / 2, -z), gp_Dir(0, 0, 1)), radius, 3 * z).Shape()
    return BRepAlgoAPI_Cut(box(x, y, z), tool).Shape()


def turned(degrees=30.0, axis=(1.0, 2.0, 3.0), shift=(0.0, 0.0, 0.0)):
    """A location: turn about an axis through the origin, then shift."""
    import math

    turn, move = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(*axis)), math.radians(degrees))
    move.SetTranslation(gp_Vec(*shift))
    return TopLoc_Location(move) * TopLoc_Location(turn)


def mirrored():
    """A location that mirrors at x = 0."""
    trsf = gp_Trsf()
    trsf.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)))
    return TopLoc_Location(trsf)


def line(a, b):
    """Straight edge between two points."""
    return BRepBuilderAPI_MakeEdge(gp_Pnt(*a), gp_Pnt(*b)).Edge()


def edge_of(curve, first, last):
    """Edge of a ``Geom_Curve`` over a range."""
    return BRepBuilderAPI_MakeEdge(curve, first, last).Edge()


def wire_of(*edges):
    """Wire of edges whose ends meet; their vertices become shared."""
    maker = BRepBuilderAPI_MakeWire()
    for edge in edges:
        maker.Add(edge)
    return maker.Wire()


def polygon_wire(points):
    """Closed wire through points."""
    return wire_of(*(line(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)))


def face_of(outer, *holes):
    """Planar face of wires, orientations left as they are."""
    maker = BRepBuilderAPI_MakeFace(outer, True)
    for hole in holes:
        maker.Add(hole)
    return maker.Face()


def raw_wire(edges):
    """Wire of edges in just this order and orientation."""
    builder, wire = BRep_Builder(), TopoDS_Wire()
    builder.MakeWire(wire)
    for edge in edges:
        builder.Add(wire, edge)
    return wire


def raw_face(surface, *wires):
    """Face of a ``Geom_Surface`` and wires, added as they are."""
    builder, face = BRep_Builder(), TopoDS_Face()
    builder.MakeFace(face, surface, 1e-7)
    for wire in wires:
        builder.Add(face, wire)
    return face


def points_array(points):
    """Array of ``gp_Pnt`` for the constructors of splines."""
    return _filled(_array_types()[0], [gp_Pnt(*p) for p in points])


def reals(values):
    return _filled(_array_types()[1], [float(v) for v in values])


def integers(values):
    return _filled(_array_types()[2], list(values))


def sub(shape, kind):
    """Sub-shapes of a kind in ``MapShapes`` order."""
    return list(occ.ShapeMap(shape, kind))
