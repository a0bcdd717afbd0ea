"""Faces from closed planar outlines that no face uses: wires and edges as sketches give them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Builder
from OCP.Geom import Geom_Plane
from OCP.gp import gp_Dir, gp_Pnt
from OCP.TopoDS import TopoDS_Face, TopoDS_Wire

from fubini.cad import occ
from fubini.cad.edges import CadEdge, EdgeTable
from fubini.cad.nesting import containment
from fubini.cad.planes import make_frame
from fubini.cad.spacecurve import height, project
from fubini.errors import GeometryError
from fubini.model import Frame
from fubini.tolerance import FLAT, VERTEX_GAP

Float = NDArray[np.float64]

#: Tolerance of the faces built here, in model units: that of the kernel itself.
_CONFUSION = 1e-7

#: Points a curve, to tell which outline lies in which.
_SAMPLES = 33

#: One outline: edge numbers with their directions, and points (n, 3) along it.
Ring = tuple[list[tuple[int, bool]], Float]


def faces_from_edges(shape: Any) -> Any:
    """A compound of planar faces bounded by the edges of a shape; outlines within outlines are holes.

    Raises ``GeometryError`` with the coordinates of loose ends, of branches, and of outlines that are
    not planar.
    """
    size = occ.diagonal(shape)
    table = EdgeTable(shape, size)
    edges = [table[i] for i in range(len(table.shapes)) if not table.degenerated(i)]
    rings = [_ring(walk, table) for walk in _closed_walks(edges, VERTEX_GAP * size)]
    faces = []
    while rings:
        frame = _plane(rings[0][1], FLAT * size)
        here = [r for r in rings if np.abs(height(frame, r[1])).max() <= FLAT * size]
        rings = [r for r in rings if not any(r is h for h in here)]
        faces += _faces(here, frame, table)
    return occ.compound(faces)


def _closed_walks(edges: list[CadEdge], reach: float) -> list[list[tuple[int, bool]]]:
    """Edges put end to end; every joint has exactly two edge ends."""
    ends = np.array([e.ends for e in edges]).reshape(-1, 3)
    joint = _joints(ends, edges, reach)
    at: dict[int, list[int]] = {}
    for i, j in enumerate(joint):
        at.setdefault(j, []).append(i)
    _refuse_open(at, ends)
    left, walks = set(range(len(edges))), []
    while left:
        k, forward = min(left), True
        walk: list[tuple[int, bool]] = []
        while k in left:
            left.discard(k)
            walk.append((edges[k].index, forward))
            out = 2 * k + int(forward)
            following = next((i for i in at[joint[out]] if i != out), out)
            k, forward = following // 2, following % 2 == 0
        walks.append(walk)
    return walks


def _joints(ends: Float, edges: list[CadEdge], reach: float) -> list[int]:
    """Number of the joint of every edge end: the same vertex, or places within ``reach``."""
    from scipy.spatial import cKDTree

    root = list(range(len(ends)))

    def find(i: int) -> int:
        while root[i] != i:
            root[i] = root[root[i]]
            i = root[i]
        return i

    owner: dict[int, int] = {}
    for i, vertex in enumerate(v for e in edges for v in e.vertices):
        if vertex >= 0:
            root[find(i)] = find(owner.setdefault(vertex, i))
    widest = max([reach, *(2.0 * e.tolerance for e in edges)])
    for i, j in sorted(cKDTree(ends).query_pairs(widest)):
        if np.linalg.norm(ends[i] - ends[j]) <= max(reach, edges[i // 2].tolerance + edges[j // 2].tolerance):
            root[find(j)] = find(i)
    return [find(i) for i in range(len(ends))]


def _refuse_open(at: dict[int, list[int]], ends: Float) -> None:
    loose = [i[0] for i in at.values() if len(i) == 1]
    if loose:
        here = ends[loose[0]]
        rest = loose[1:] or loose
        near = ends[min(rest, key=lambda i: float(np.linalg.norm(ends[i] - here)))]
        where = ", ".join(f"{x:.9g}" for x in near)
        raise GeometryError(
            f"the outline is open: {len(loose)} loose ends, the next one at ({where})",
            at=here,
            fix="close the outline",
        )
    for several in at.values():
        if len(several) > 2:
            raise GeometryError(
                f"{len(several)} edges of an outline meet in one point", at=ends[several[0]], fix="give faces instead"
            )


def _ring(walk: list[tuple[int, bool]], table: EdgeTable) -> Ring:
    points = []
    for index, forward in walk:
        run = table.sample(index, _SAMPLES)
        points.append((run if forward else run[::-1])[:-1])
    return walk, np.concatenate(points)


def _plane(points: Float, tolerance: float) -> Frame:
    """The plane through the points of an outline, its normal to the side of +z (else +y, +x)."""
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    largest = np.flatnonzero(np.abs(normal) > 1e-9)[-1]
    normal = normal if normal[largest] > 0.0 else -normal
    frame = make_frame(middle, normal, middle)
    off = np.abs(height(frame, points))
    if off.max() > tolerance:
        raise GeometryError(
            f"an outline without a face leaves its plane by {off.max():.3g}",
            at=points[int(np.argmax(off))],
            fix="only planar outlines can be filled",
        )
    return frame


def _faces(rings: list[Ring], frame: Frame, table: EdgeTable) -> list[Any]:
    """Faces of one plane: outlines at even depth, with those directly inside as holes."""
    flat = [project(frame, points) @ np.array([1.0, 1.0j]) for _, points in rings]
    parent = containment(flat)
    depth = [0] * len(rings)
    for i in range(len(rings)):
        k = i
        while parent[k] >= 0:
            k, depth[i] = parent[k], depth[i] + 1
    builder, faces = BRep_Builder(), []
    plane = Geom_Plane(gp_Pnt(*frame.origin.tolist()), gp_Dir(*frame.normal.tolist()))
    for i in range(len(rings)):
        if depth[i] % 2:
            continue
        face = TopoDS_Face()
        builder.MakeFace(face, plane, _CONFUSION)
        for k in [i, *(j for j in range(len(rings)) if parent[j] == i)]:
            wire = _wire(rings[k][0], table, builder)
            counter_clockwise = float((flat[k].conj() * np.roll(flat[k], -1)).imag.sum()) > 0.0
            builder.Add(face, wire if counter_clockwise == (k == i) else wire.Reversed())
        faces.append(face)
    return faces


def _wire(walk: list[tuple[int, bool]], table: EdgeTable, builder: Any) -> Any:
    wire = TopoDS_Wire()
    builder.MakeWire(wire)
    for index, forward in walk:
        edge = table.forward(index)
        builder.Add(wire, edge if forward else edge.Reversed())
    wire.Closed(True)
    return wire
