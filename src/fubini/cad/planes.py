"""The plane of a face: recognised also behind other kinds of surface, with deterministic axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_SurfaceType as SurfaceType
from OCP.GeomLib import GeomLib_IsPlanarSurface
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopAbs import TopAbs_Orientation as Orientation

from fubini.cad import occ
from fubini.model import Frame

Float = NDArray[np.float64]

#: Surfaces that are never flat.
_CURVED = {
    SurfaceType.GeomAbs_Cylinder,
    SurfaceType.GeomAbs_Cone,
    SurfaceType.GeomAbs_Sphere,
    SurfaceType.GeomAbs_Torus,
}

#: A normal this near to a coordinate axis (sine) is that axis.
_ALIGNED = 1e-12

_PROBES = (0.5, 0.25, 0.75, 0.1, 0.9)

#: Points in each direction at which a surface is compared with a plane.
_GRID = 7


def face_plane(face: Any, tolerance: float) -> tuple[Float, Float] | None:
    """A point (3,) of the plane of a ``TopoDS_Face`` and the unit normal (3,), or None when it is not flat.

    The normal is that of the placed surface, turned over when the face is reversed, and once more when its
    placement mirrors: what was outside of a solid stays outside. A surface that is not stored as a plane counts as
    flat when it stays within ``tolerance`` (model units) of one.
    """
    adaptor = BRepAdaptor_Surface(face, False)
    kind = adaptor.GetType()
    if kind in _CURVED:
        return None
    if kind == SurfaceType.GeomAbs_Plane:
        plane = adaptor.Plane()
        # not Axis(): a mirrored placement makes the axes left-handed
        x, y = occ.xyz(plane.XAxis().Direction()), occ.xyz(plane.YAxis().Direction())
        normal = Frame(x, x, y).normal
    else:
        test = GeomLib_IsPlanarSurface(occ.static(BRep_Tool, "Surface")(face), tolerance)
        if not test.IsPlanar():
            return None
        plane = test.Plan()
        normal = occ.xyz(plane.Axis().Direction())
        if _leaves(face, occ.xyz(plane.Location()), normal) > tolerance:  # the kernel allows itself several times that
            return None
        if np.dot(normal, _surface_normal(face)) < 0.0:
            normal = -normal
    if (face.Orientation() == Orientation.TopAbs_REVERSED) != occ.mirrored(face):
        normal = -normal
    return occ.xyz(plane.Location()), normal / np.linalg.norm(normal)


def surface_name(face: Any) -> str:
    """Kind of surface in words, such as "cylinder" or "bspline"."""
    name = str(BRepAdaptor_Surface(face, False).GetType()).rpartition("GeomAbs_")[2]
    return name.replace("SurfaceOf", "").replace("Surface", "").lower()


def make_frame(point: Float, normal: Float, middle: Float) -> Frame:
    """Axes of the plane through ``point`` that depend on the plane alone.

    In a plane normal to a coordinate axis the plane coordinates are space coordinates, so nothing
    is rounded; elsewhere x is horizontal and the origin is the foot of ``middle`` (3,), a point amid
    the face, so that little is lost.
    """
    foot = middle - np.dot(middle - point, normal) * normal
    k = int(np.argmax(np.abs(normal)))
    rest = np.delete(normal, k)
    if np.hypot(*rest) < _ALIGNED:
        axes = np.eye(3)
        x, y = axes[(k + 1) % 3], axes[(k + 2) % 3]
        if normal[k] < 0.0:
            x, y = y, x
        level = point[k] if not rest.any() else foot[k]
        return Frame(axes[k] * level, x, y)
    x = np.array([-normal[1], normal[0], 0.0])
    if np.hypot(x[0], x[1]) < _ALIGNED:
        x = np.cross(normal, (1.0, 0.0, 0.0))
    x = x / np.linalg.norm(x)
    return Frame(foot, x, np.cross(normal, x))


def _leaves(face: Any, point: Float, normal: Float) -> float:
    """Largest distance from a plane of a grid of points on the surface, over the range that the face uses."""
    adaptor = BRepAdaptor_Surface(face)
    us = np.linspace(adaptor.FirstUParameter(), adaptor.LastUParameter(), _GRID).tolist()
    vs = np.linspace(adaptor.FirstVParameter(), adaptor.LastVParameter(), _GRID).tolist()
    grid = np.array([occ.xyz(adaptor.Value(u, v)) for u in us for v in vs])
    return float(np.abs((grid - point) @ (normal / np.linalg.norm(normal))).max())


def _surface_normal(face: Any) -> Float:
    """Normal of the parametrisation inside the face, from the first place where it has one."""
    adaptor = BRepAdaptor_Surface(face)
    p, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
    u0, u1 = adaptor.FirstUParameter(), adaptor.LastUParameter()
    v0, v1 = adaptor.FirstVParameter(), adaptor.LastVParameter()
    for s in _PROBES:
        adaptor.D1(u0 + s * (u1 - u0), v0 + s * (v1 - v0), p, du, dv)
        normal = np.cross(occ.xyz(du), occ.xyz(dv))
        if np.linalg.norm(normal) > 0.0:
            return normal
    return np.zeros(3)
