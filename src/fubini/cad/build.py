"""From a CAD shape to the model: every planar face as a region of exact curves in its own plane."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps

from fubini.cad import occ
from fubini.cad.edges import EdgeTable
from fubini.cad.free import faces_from_edges
from fubini.cad.names import resolve
from fubini.cad.planes import face_plane, make_frame, surface_name
from fubini.cad.source import Source
from fubini.cad.spacecurve import project
from fubini.cad.wires import Coedge, Outline, face_outline
from fubini.curves import Curve
from fubini.errors import GeometryError, InputError
from fubini.model import Edge, Face, Frame, Model, SkippedFace
from fubini.region import Loop, Region
from fubini.tolerance import FLAT, VERTEX_GAP

Float = NDArray[np.float64]

#: Relative accuracy asked of the kernel's adaptive quadrature.
_AREA_ACCURACY = 1e-10

#: The kernel gives what has no end, such as faces without an outline, this size.
BOUNDLESS = 1e99

#: A gap between a curve and its vertex of more than this, times the length of the curve, is worth a remark.
_SHORT = 1e-2

#: A face of less area than this, times the square of its perimeter, has none.
_NO_AREA = 1e-12


def build_model(source: Source, check: bool = True) -> Model:
    """The planar faces of a source; ``check`` looks for crossing and touching outlines.

    Raises ``InputError`` when there is no planar face and ``GeometryError`` with face, edge and
    coordinates where an outline bounds no region.
    """
    shape, faces = with_faces(source)
    size = occ.diagonal(shape)
    if not size > 0.0:
        raise GeometryError("a model of no extent", file=source.label)
    if size > BOUNDLESS:
        endless = next((k for k, face in enumerate(faces) if occ.diagonal(face) > BOUNDLESS), None)
        fix = "mend the model in the program that it comes from"
        raise GeometryError("a face without an end", file=source.label, face=endless, fix=fix)
    builder = _Builder(shape, size, check)
    names = resolve(faces, source.face_names)
    planar: list[Face] = []
    skipped: list[SkippedFace] = []
    for index, face in enumerate(faces):
        try:
            found = builder.face(index, face, names.get(index))
        except GeometryError as error:
            raise GeometryError(
                error.message, file=source.label, face=index, edge=error.edge, at=error.at, fix=error.fix
            ) from error
        if isinstance(found, Face):
            planar.append(found)
        else:
            skipped.append(found)
    if not planar:
        kinds = ", ".join(sorted({s.surface for s in skipped}))
        raise InputError(
            f"none of the {len(faces)} faces is planar ({kinds})",
            file=source.label,
            fix="only planar faces can be meshed",
        )
    edge_names = resolve(builder.table.shapes, source.edge_names)
    return Model(
        source=source.label,
        faces=tuple(planar),
        edges={i: dataclasses.replace(e, name=edge_names.get(i)) for i, e in sorted(builder.edges.items())},
        vertices=dict(sorted(builder.vertices.items())),
        skipped=tuple(skipped),
        diagonal=size,
        notes=(*source.notes, *builder.notes),
        native=shape,
        traces=source.traces,
    )


def with_faces(source: Source) -> tuple[Any, occ.ShapeMap]:
    """The shape and its faces; where it has none, those that its closed outlines bound."""
    shape = source.shape
    faces = occ.ShapeMap(shape, occ.FACE)
    if not len(faces):
        if not len(occ.ShapeMap(shape, occ.EDGE)):
            raise InputError("no face in it", file=source.label, fix="give faces, solids or closed outlines")
        try:
            shape = faces_from_edges(shape)
        except GeometryError as error:
            raise GeometryError(
                error.message, file=source.label, edge=error.edge, at=error.at, fix=error.fix
            ) from error
        faces = occ.ShapeMap(shape, occ.FACE)
    return shape, faces


class _Builder:
    """What the faces of one shape share: its edges, vertices and remarks."""

    def __init__(self, shape: Any, diagonal: float, check: bool) -> None:
        self.table = EdgeTable(shape, diagonal)
        self.diagonal = diagonal
        self.check = check
        self.edges: dict[int, Edge] = {}
        self.vertices: dict[int, Float] = {}
        self.notes: list[str] = []

    def face(self, index: int, shape: Any, name: str | None) -> Face | SkippedFace:
        face = occ.as_face(shape)
        plane = face_plane(face, FLAT * self.diagonal)
        if plane is None:
            return SkippedFace(index, surface_name(face), "not planar", name)
        outline = face_outline(face, self.table, VERTEX_GAP * self.diagonal)
        if not outline.chains:
            raise GeometryError("a face without an outline")
        used = [self.table[c.edge] for chain in outline.chains for c in chain]
        frame = make_frame(*plane, sum(e.ends[0] for e in used) / len(used))
        self._note_off_plane(index, used, frame)
        region, turned = self._region(outline, frame, name or f"face {index}")
        for edge, at in turned:
            self.notes.append(f"face {index}: a hole ran the wrong way and was turned (edge {edge} at {_words(at)})")
        tolerance = float(occ.tolerance(face))
        simple = all(e.curve.kind in ("line", "circle") for e in used)
        area = None if turned else _area(face, simple)  # the kernel adds holes that run the wrong way
        inner = self._inner(index, outline, frame, region)
        return Face(index, region, frame, name, area, tolerance, inner, self._points(face, frame, region, inner))

    def _points(
        self, face: Any, frame: Frame, region: Region, inner: tuple[tuple[Curve, int], ...]
    ) -> tuple[tuple[int, Float], ...]:
        """Vertices that the face has inside, off its outline and off edges within it."""
        found: dict[int, Float] = {}
        curves = (*region.curves, *(curve for curve, _ in inner))
        for part in occ.children(face):
            if part.ShapeType() != occ.VERTEX:
                continue
            vertex, place = self.table.vertex(part)
            flat = project(frame, place)
            off = min(float(curve.closest(flat[None])[1][0]) for curve in curves)
            if off > VERTEX_GAP * self.diagonal and region.contains(flat[None]).all():
                self.vertices.setdefault(vertex, place)
                found[vertex] = flat
        return tuple(found.items())

    def _inner(self, face: int, outline: Outline, frame: Frame, region: Region) -> tuple[tuple[Curve, int], ...]:
        """Edges within the face that bound nothing, as the mesh follows them; others are told in a remark."""
        bounding = {c.edge for chain in outline.chains for c in chain}
        left_out = set(outline.outside)
        found: dict[int, Curve] = {}
        corners: dict[int, Float] = {}
        for index in (*outline.embedded, *outline.doubled):
            edge = self.table[index]
            within = index not in bounding and edge.vertices[0] != edge.vertices[1]
            if within and edge.curve.leaves(frame) <= FLAT * self.diagonal + edge.tolerance:
                curve = self._flattened(index, frame, corners)
                if _lies_within(curve, region, VERTEX_GAP * self.diagonal):
                    self._register(index)
                    found[index] = curve
                    continue
            left_out.add(index)
        self._note_left_out(face, sorted(left_out))
        return tuple((curve, index) for index, curve in found.items())

    def _region(self, outline: Outline, frame: Frame, label: str) -> tuple[Region, list[tuple[int, Float]]]:
        """The region, and an edge and a point of each hole that turned the same way as the outer loop."""
        corners: dict[int, Float] = {}
        loops = [self._loop(chain, frame, corners) for chain in outline.chains]
        loops.sort(key=lambda loop: -abs(loop.signed_area))
        region = Region(loops[0], tuple(loops[1:]), label)
        turned = [
            (loop.edges[0], frame.to_space(loop.curves[0].start)[0])
            for loop in loops[1:]
            if loop.signed_area * loops[0].signed_area > 0.0
        ]
        if not abs(region.area) > _NO_AREA * region.perimeter * region.perimeter:
            raise GeometryError(
                f"a face of no area ({region.area:.3g})", at=frame.to_space(region.outer.curves[0].start)[0]
            )
        if self.check:
            try:
                region.check()
            except GeometryError as error:
                at = None if error.at is None else frame.to_space(error.at)[0]
                raise GeometryError(error.message, edge=error.edge, at=at, fix=error.fix) from error
        return region.canonical(), turned

    def _loop(self, chain: tuple[Coedge, ...], frame: Frame, corners: dict[int, Float]) -> Loop:
        curves = []
        reach = VERTEX_GAP * self.diagonal
        for coedge in chain:
            curve = self._curve(coedge.edge, frame, corners)
            curves.append(curve if coedge.forward else curve.reverse())
            reach = max(reach, 2.0 * self.table[coedge.edge].tolerance)
        return Loop.closed(curves, reach, [c.edge for c in chain], [c.forward for c in chain])

    def _curve(self, index: int, frame: Frame, corners: dict[int, Float]) -> Curve:
        """The edge in the plane, from vertex to vertex, and entered into the model."""
        self._register(index)
        return self._flattened(index, frame, corners)

    def _flattened(self, index: int, frame: Frame, corners: dict[int, Float]) -> Curve:
        edge = self.table[index]
        places = []
        for vertex, end in zip(edge.vertices, edge.ends, strict=True):
            if vertex >= 0 and vertex not in corners:
                corners[vertex] = project(frame, self.table.points[vertex])
            places.append(corners[vertex] if vertex >= 0 else project(frame, end))
        if edge.vertices == (-1, -1) and np.linalg.norm(edge.ends[1] - edge.ends[0]) <= VERTEX_GAP * self.diagonal:
            places[1] = places[0]
        return edge.curve.to_plane(frame, places[0], places[1])

    def _register(self, index: int) -> None:
        """Put an edge and its vertices into the model, with remarks about it."""
        if index in self.edges:
            return
        edge = self.table[index]
        self.edges[index] = Edge(
            index, edge.curve.kind, *edge.vertices, tolerance=edge.tolerance, conversion=edge.curve.conversion
        )
        chord = float(np.linalg.norm(edge.ends[1] - edge.ends[0]))
        for vertex, end in zip(edge.vertices, edge.ends, strict=True):
            if vertex < 0:
                continue
            point = self.vertices.setdefault(vertex, self.table.points[vertex])
            gap = float(np.linalg.norm(point - end))
            if gap > VERTEX_GAP * self.diagonal or (gap > _SHORT * chord and gap > _SHORT * self.table.length(index)):
                self.notes.append(
                    f"edge {index} ends {gap:.3g} off its vertex at {_words(point)}; its end was moved there"
                )
        if edge.curve.conversion > 0.0:
            self.notes.append(
                f"edge {index} ({edge.curve.kind} curve) is approximated within {edge.curve.conversion:.3g}"
            )

    def _note_left_out(self, face: int, edges: list[int]) -> None:
        for index in edges:
            at = _words(self.table[index].ends.mean(axis=0))
            self.notes.append(f"face {face}: edge {index} at {at} lies in the face and bounds nothing; it is left out")

    def _note_off_plane(self, face: int, used: list[Any], frame: Frame) -> None:
        distances = [e.curve.leaves(frame) for e in used]
        distance = max(distances)
        if distance > FLAT * self.diagonal:
            edge = used[distances.index(distance)].index
            self.notes.append(
                f"face {face}: edge {edge} leaves the plane by up to {distance:.3g}; it is projected into it"
            )


def _lies_within(curve: Curve, region: Region, reach: float) -> bool:
    """Whether the curve runs inside the region and meets its outline in vertices alone, if at all."""
    if not region.contains(curve.point(np.linspace(0.05, 0.95, 7))).all():
        return False
    corners = {tuple(c.start.tolist()) for c in region.curves}
    loose = [end for end in (curve.start, curve.end) if tuple(end.tolist()) not in corners]
    return not loose or all((c.closest(loose)[1] > reach).all() for c in region.curves)


def _area(face: Any, simple: bool) -> float:
    """The kernel's own figure; its fixed quadrature is exact on lines and circles only."""
    properties = GProp_GProps()
    measure = occ.static(BRepGProp, "SurfaceProperties")
    try:
        measure(face, properties, *(() if simple else (_AREA_ACCURACY,)))
    except Exception as error:  # the kernel raises its own classes, which share no other base
        raise GeometryError(
            f"the CAD kernel cannot measure this face ({type(error).__name__})", fix="heal the model"
        ) from None
    return abs(float(properties.Mass()))


def _words(point: Float) -> str:
    return "(" + ", ".join(f"{x:.9g}" for x in point) + ")"
