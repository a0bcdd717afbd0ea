"""One mesh from the meshes of the faces: shared nodes once, points in space, segments on CAD edges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from fubini._values import value
from fubini.model import Frame, Model
from fubini.pipeline import _kernels_assemble as kernels
from fubini.pipeline.faces import FaceResult
from fubini.pipeline.strip import FaceMesh, stacked
from fubini.sampling.network import Network

Float = NDArray[np.float64]
Int = NDArray[np.int32]

#: Lifted positions of one node that differ by more than this (times the diagonal) are reconciled.
SAME_POINT = 1e-13
#: Spans of pieces of edges, and vertices inside faces, where there are none.
NO_SPANS = np.empty((0, 4))
NO_VERTICES = np.empty(0, np.int64), np.empty((0, 3))


@value(frozen=True)
class Assembly:
    """Arrays of the whole mesh; ``nodes_of_face[f]`` maps the boundary nodes of a face to mesh nodes.

    ``lone`` : node at each vertex inside a face. ``closed`` : where cracks have been opened, the triangles as they
    were before.
    """

    points: Float
    triangles: Int
    face_of_triangle: Int
    segments: Int
    edge_of_segment: Int
    t_of_segment: Float
    nodes_of_face: tuple[NDArray[np.int64], ...]
    lone: Mapping[int, int] = field(default_factory=dict)
    closed: Int | None = None


def assemble(model: Model, network: Network, results: list[FaceResult]) -> Assembly:
    """Join the faces."""
    meshes, boundaries = [r.mesh for r in results], [r.mesh.boundary for r in results]
    starts = _starts(network, meshes)
    rows, *_, inner, count = starts[-1]
    points, triangles = np.empty((rows + inner, 3)), np.empty((count, 3), np.int32)
    vertices, places = _lone_places(model)
    axes = np.array([(f.frame.origin, f.frame.x_axis, f.frame.y_axis) for f in model.faces], float)
    pieces = model.numbering.pieces
    total, index, segments, edge_of, t, far, lifted = kernels.assemble(
        *network.exact, stacked([b.segments for b in boundaries]), stacked([b.track for b in boundaries]),
        stacked([b.t for b in boundaries]), network.edges, model.numbering.vertices,
        NO_SPANS if pieces is None else pieces.spans, model.numbering.edges,
        axes, np.array(starts, np.int64), vertices, places,
        stacked([mesh.points for mesh in meshes]), stacked([mesh.triangles for mesh in meshes]),
        0.5 * SAME_POINT * model.diagonal, points, triangles,
    )  # fmt: skip
    points = points[: total + inner]
    if far:
        owners = np.repeat(np.arange(len(results)), np.diff([row[kernels.NODES] for row in starts]))
        _reconcile(points[:total], lifted, index, owners, [face.frame for face in model.faces], model.diagonal)
    face_of, maps = np.empty(count, np.int32), []
    for face, mesh, plane, start, stop in zip(model.faces, meshes, axes, starts, starts[1:]):
        face_of[start[kernels.TRIANGLES] : stop[kernels.TRIANGLES]] = face.index
        maps.append(index[start[kernels.NODES] : stop[kernels.NODES]])
        if mesh.core is not None:
            first = total + start[kernels.INNER]
            own = first + len(mesh.points) - len(mesh.boundary.points)
            part = slice(start[kernels.TRIANGLES] + len(mesh.triangles), stop[kernels.TRIANGLES])
            mesh.core.write(plane, first, own, points[own : total + stop[kernels.INNER]], triangles[part])
    lone = _lone(model, results, maps) if len(vertices) else {}
    return Assembly(points, triangles, face_of, segments, edge_of, t, tuple(maps), lone)


def _starts(network: Network, meshes: list[FaceMesh]) -> list[list[int]]:
    """Where the arrays of each face begin, and end, in those of all (f + 1, 7); see ``_kernels_assemble``."""
    starts = [[0] * 7]
    for outline, mesh in zip(network.outlines, meshes, strict=True):
        lengths = (
            len(mesh.boundary.points), len(mesh.boundary.segments), len(outline.edges), len(mesh.points),
            len(mesh.triangles), mesh.inner_nodes, mesh.triangle_count,
        )  # fmt: skip
        starts.append([a + b for a, b in zip(starts[-1], lengths)])
    return starts


def _lone_places(model: Model) -> tuple[NDArray[np.int64], Float]:
    """Vertices inside faces (p,), face by face, and where they are lifted to (p, 3)."""
    lone = [(vertex, face.frame.to_space(flat)) for face in model.faces for vertex, flat in face.points]
    if not lone:
        return NO_VERTICES
    return np.array([vertex for vertex, _ in lone], np.int64), np.concatenate([place for _, place in lone])


def _lone(model: Model, results: list[FaceResult], maps: list[NDArray[np.int64]]) -> dict[int, int]:
    """Mesh node at each vertex inside a face."""
    found: dict[int, int] = {}
    for face, result, numbers in zip(model.faces, results, maps, strict=True):
        if face.points:
            alone = np.setdiff1d(np.arange(len(numbers)), result.mesh.boundary.segments)
            found |= {v: int(numbers[i]) for (v, _), i in zip(face.points, alone, strict=True)}
    return found


def _reconcile(
    points: Float,
    lifted: Float,
    index: NDArray[np.int64],
    owners: NDArray[np.int64],
    frames: list[Frame],
    diagonal: float,
) -> None:
    """Move nodes whose faces lift them to different places onto the planes of all these faces, in place.

    CAD edges lie on their faces within a tolerance only. The nearest point on all planes is the
    least-squares solution of smallest norm. Where planes that are almost one meet it may be far off: no node moves
    further than its places lie apart.
    """
    gap = np.linalg.norm(lifted - points[index], axis=1)
    apart = np.unique(index[gap > SAME_POINT * diagonal])
    if not len(apart):
        return
    order = np.argsort(index, kind="stable")
    starts, stops = (np.searchsorted(index, apart, side, sorter=order) for side in ("left", "right"))
    for node, start, stop in zip(apart, starts, stops, strict=True):
        copies = order[start:stop]
        middle = lifted[copies].mean(axis=0)
        normals = np.array([frames[f].normal for f in owners[copies]])
        offset = np.array([frames[f].normal @ (frames[f].origin - middle) for f in owners[copies]])
        step = np.linalg.lstsq(normals, offset, rcond=1e-6)[0]
        length, most = np.linalg.norm(step), np.linalg.norm(lifted[copies] - middle, axis=1).max()
        points[node] = middle + (step if length <= 2.0 * most else step * (2.0 * most / length))
