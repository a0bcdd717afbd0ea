"""A mesh written back onto the CAD shape it was made from.

The kernel keeps a triangulation on each face and, per edge of it, the nodes along that edge. With
ours in place and a deflection below any that is asked for, the kernel does not mesh these faces
again: exporters and viewers of every front end show our triangles, and faces that are not planar
start from our nodes on the shared edges.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Builder
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.gp import gp_Dir, gp_Pnt
from OCP.Poly import Poly_PolygonOnTriangulation, Poly_Triangle, Poly_Triangulation
from OCP.TopAbs import TopAbs_Orientation as Orientation

from fubini.cad import occ
from fubini.errors import InputError
from fubini.model import Face, Model

if TYPE_CHECKING:
    from fubini.result import Mesh

Float = NDArray[np.float64]
Int = NDArray[np.integer[Any]]

#: Stated deflection of our triangulations (model units): finer than any request.
DEFLECTION = 1e-9


def attach(mesh: Mesh) -> Any:
    """Put the triangles of a mesh onto the faces of its live CAD shape, and return the shape.

    The shape is changed in place, so every object that shares it sees the mesh. Faces of one part
    that is placed several times share one triangulation, that of the first.
    """
    model = mesh.model
    if model is None or model.native is None:
        raise InputError("no live CAD shape stands behind this mesh", fix="load the source in this process and mesh it")
    return _Writer(mesh, model).write()


class _Writer:
    def __init__(self, mesh: Mesh, model: Model) -> None:
        self.mesh = mesh
        self.model = model
        self.builder = BRep_Builder()
        self.faces = occ.ShapeMap(model.native, occ.FACE)
        self.edges = occ.ShapeMap(model.native, occ.EDGE)
        self.runs = _runs(mesh, model)

    def write(self) -> Any:
        by_index = {f.index: f for f in self.model.faces}
        order = np.argsort(self.mesh.face_of_triangle, kind="stable")
        numbers, first = np.unique(self.mesh.face_of_triangle[order], return_index=True)
        written = occ.ShapeSet()
        for index, rows in zip(numbers.tolist(), np.split(order, first[1:]), strict=True):
            shape = self.faces[index]
            if index in by_index and written.add(occ.unplaced(shape)):
                self._write_face(by_index[index], occ.as_face(shape), self.mesh.triangles[rows])
        return self.model.native

    def _write_face(self, face: Face, shape: Any, triangles: Int) -> None:
        nodes, corners = np.unique(triangles, return_inverse=True)
        corners = corners.reshape(-1, 3) + 1
        location = shape.Location()
        # the kernel keeps triangles as on the forward face, where it was before its placement
        if (shape.Orientation() == Orientation.TopAbs_REVERSED) != occ.mirrored(shape):
            corners = corners[:, [0, 2, 1]]
        local = _placed(location.Transformation().Inverted(), self.mesh.points[nodes])
        triangulation = Poly_Triangulation(len(nodes), len(corners), False)
        for i, p in enumerate(local.tolist(), start=1):
            triangulation.SetNode(i, gp_Pnt(*p))
        for i, c in enumerate(corners.tolist(), start=1):
            triangulation.SetTriangle(i, Poly_Triangle(*c))
        _set_normals(triangulation, local, corners)
        triangulation.Deflection(DEFLECTION)
        self.builder.UpdateFace(shape, triangulation)
        number = {int(n): i for i, n in enumerate(nodes, start=1)}
        for loop in face.region.loops:
            for curve, edge, forward in zip(loop.curves, loop.edges, loop.forward, strict=True):
                run = self.runs.get(edge)
                if run is not None and all(n in number for n in run):
                    along = curve if forward else curve.reverse()
                    share = along.closest(face.frame.to_plane(self.mesh.points[run]))[0]
                    self._write_edge(edge, [number[n] for n in run], share, triangulation, location)

    def _write_edge(self, index: int, nodes: list[int], share: Float, triangulation: Any, location: Any) -> None:
        edge = occ.as_edge(self.edges[index])
        first, last = _range(edge)
        share[0], share[-1] = 0.0, 1.0
        parameters = first + _natural(self.model.edges[index].kind, share, first, last) * (last - first)
        polygon = Poly_PolygonOnTriangulation(len(nodes), True)
        for i, (node, parameter) in enumerate(zip(nodes, parameters.tolist(), strict=True), start=1):
            polygon.SetNode(i, node)
            polygon.SetParameter(i, parameter)
        polygon.Deflection(DEFLECTION)
        self.builder.UpdateEdge(edge, polygon, triangulation, location)


def _range(edge: Any) -> tuple[float, float]:
    adaptor = BRepAdaptor_Curve(edge)
    return adaptor.FirstParameter(), adaptor.LastParameter()


def _natural(kind: str, share: Float, first: float, last: float) -> Float:
    """Share of the CAD parameter range; a hyperbola's rational form runs over tanh of the half parameter."""
    if kind != "hyperbola":
        return share
    half = (last - first) / 2.0
    inner = np.clip((2.0 * share - 1.0) * np.tanh(half / 2.0), -1.0 + 1e-16, 1.0 - 1e-16)
    return np.clip(0.5 + np.arctanh(inner) / half, 0.0, 1.0)


def _placed(transformation: Any, points: Float) -> Float:
    matrix = np.array([[transformation.Value(i, j) for j in range(1, 5)] for i in range(1, 4)])
    return points @ matrix[:, :3].T + matrix[:, 3]


def _set_normals(triangulation: Any, points: Float, corners: NDArray[np.signedinteger]) -> None:
    """One normal for all nodes: that of the plane, as the stored triangles run."""
    a, b, c = (points[corners[:, k] - 1] for k in range(3))
    total = np.cross(b - a, c - a).sum(axis=0)
    if not np.linalg.norm(total) > 0.0:
        return
    direction = gp_Dir(*total.tolist())
    triangulation.AddNormals()
    for i in range(1, len(points) + 1):
        triangulation.SetNormal(i, direction)


def _runs(mesh: Mesh, model: Model) -> dict[int, Int]:
    """Node numbers along every CAD edge, from its first parameter to its last."""
    order = np.argsort(mesh.edge_of_segment, kind="stable")
    numbers, first = np.unique(mesh.edge_of_segment[order], return_index=True)
    runs = {}
    for index, rows in zip(numbers.tolist(), np.split(order, first[1:]), strict=True):
        run = _chain(mesh.segments[rows], mesh, model.edges.get(index), model) if index in model.edges else None
        if run is not None:
            runs[index] = run
    return runs


def _chain(segments: Int, mesh: Mesh, edge: Any, model: Model) -> Int | None:
    """Segments put end to end; None when they are not one run."""
    following = dict(segments.tolist())
    starts = set(following) - set(following.values())
    if starts:
        node = min(starts)
    else:  # closed: begin at the CAD vertex
        candidates = np.array(sorted(following))
        corner = model.vertices.get(edge.start, mesh.points[candidates[0]])
        node = int(candidates[np.argmin(np.linalg.norm(mesh.points[candidates] - corner, axis=1))])
    run = [node]
    for _ in range(len(segments)):
        if run[-1] not in following:
            return None
        run.append(following[run[-1]])
    return np.array(run)
