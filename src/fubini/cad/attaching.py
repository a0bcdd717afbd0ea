"""A mesh written back onto the CAD shape it was made from.

The kernel keeps a triangulation on each face and, per edge of it, the nodes along that edge. With
ours in place and a deflection below any that is asked for, the kernel does not mesh these faces
again: exporters and viewers of every front end show our triangles, and faces that are not planar
start from our nodes on the shared edges.

Of faces that are one but for their place, such as both ends of an extruded sketch, the kernel looks at one and lays
out the edges of the others anew. Curved faces beside them therefore get a triangulation without triangles: too
coarse to stay, but the nodes on its edges are ours, and edges are laid out before it is thrown away.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Dir, gp_Pnt
from OCP.Poly import Poly_PolygonOnTriangulation, Poly_Triangle, Poly_Triangulation
from OCP.TopAbs import TopAbs_Orientation as Orientation
from OCP.TopLoc import TopLoc_Location

from fubini.cad import occ
from fubini.errors import InputError
from fubini.model import Face, Model

if TYPE_CHECKING:
    from fubini.result import Mesh

Float = NDArray[np.float64]
Int = NDArray[np.integer[Any]]

#: Stated deflection of our triangulations (model units): finer than any request.
DEFLECTION = 1e-9
#: ... and that of what only holds nodes of edges: coarser than any request.
NEVER = 1e100


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
        occ.static(BRepTools, "Clean")(self.model.native)  # what the kernel made fits other nodes
        by_index = {f.index: f for f in self.model.faces}
        order = np.argsort(self.mesh.face_of_triangle, kind="stable")
        numbers, first = np.unique(self.mesh.face_of_triangle[order], return_index=True)
        written = occ.ShapeSet()
        for index, rows in zip(numbers.tolist(), np.split(order, first[1:]), strict=True):
            shape = self.faces[index]
            if index in by_index and written.add(occ.unplaced(shape)):
                self._write_face(by_index[index], occ.as_face(shape), self.mesh.triangles[rows])
        self._hold_nodes_of_repeated()
        return self.model.native

    def _hold_nodes_of_repeated(self) -> None:
        """Keep nodes on edges of repeated faces with the curved faces beside them."""
        single = occ.ShapeMap(occ.compound(occ.unplaced(face) for face in self.faces), occ.FACE)
        number = [single.index(occ.unplaced(face)) for face in self.faces]
        times = np.bincount(number, minlength=len(single))
        beside: dict[int, Any] = {}
        for k, face in zip(number, self.faces, strict=True):
            if times[k] > 1 and _triangulation(face, TopLoc_Location()) is not None:
                for edge in occ.explore(face, occ.EDGE):
                    beside.setdefault(self.edges.index(edge), occ.as_face(face))
        seen = occ.ShapeSet()
        for face in self.faces if beside else ():
            if _triangulation(face, TopLoc_Location()) is None and seen.add(occ.unplaced(face)):
                edges = {self.edges.index(edge) for edge in occ.explore(face, occ.EDGE)}
                self._hold_nodes(occ.as_face(face), [(e, beside[e]) for e in sorted(edges) if e in beside])

    def _hold_nodes(self, face: Any, edges: list[tuple[int, Any]]) -> None:
        """Give a curved face the nodes on some of its edges: for each the edge and a face of ours beside it."""
        found, places = [], [np.empty((0, 3))]
        for e, other in edges:
            edge, location = occ.as_edge(self.edges[e]), TopLoc_Location()
            triangulation = _triangulation(other, location)
            polygon = _polygon(edge, triangulation, location)
            if polygon is not None:
                rows = range(1, polygon.NbNodes() + 1)
                local = np.array([occ.xyz(triangulation.Node(polygon.Node(i))) for i in rows])
                found.append((edge, [polygon.Parameter(i) for i in rows]))
                places.append(_placed(location.Transformation(), local))
        if not found:
            return
        location = face.Location()
        points = _placed(location.Transformation().Inverted(), np.concatenate(places))
        holder = Poly_Triangulation(len(points), 0, False)
        for i, p in enumerate(points.tolist(), start=1):
            holder.SetNode(i, gp_Pnt(*p))
        holder.Deflection(NEVER)
        self.builder.UpdateFace(face, holder)
        first = 1
        for edge, parameters in found:
            self._set_polygon(edge, range(first, first + len(parameters)), parameters, holder, location)
            first += len(parameters)

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
        self._set_polygon(edge, nodes, parameters.tolist(), triangulation, location)

    def _set_polygon(
        self, edge: Any, nodes: Sequence[int], parameters: list[float], triangulation: Any, location: Any
    ) -> None:
        """Tell the kernel which nodes of a triangulation lie on an edge, and their parameters on it."""
        polygon = Poly_PolygonOnTriangulation(len(nodes), True)
        for i, (node, parameter) in enumerate(zip(nodes, parameters, strict=True), start=1):
            polygon.SetNode(i, node)
            polygon.SetParameter(i, parameter)
        polygon.Deflection(DEFLECTION)
        self.builder.UpdateEdge(edge, polygon, triangulation, location)


def _triangulation(face: Any, location: Any) -> Any:
    """The triangulation of a face, or None; ``location`` becomes its place."""
    return occ.static(BRep_Tool, "Triangulation")(occ.as_face(face), location)


def _polygon(edge: Any, triangulation: Any, location: Any) -> Any:
    """The nodes that a triangulation placed so has along an edge, or None."""
    return occ.static(BRep_Tool, "PolygonOnTriangulation")(edge, triangulation, location)


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
