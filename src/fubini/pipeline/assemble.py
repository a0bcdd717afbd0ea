"""One mesh from the meshes of the faces: shared nodes once, points in space, segments on CAD edges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from fubini.model import Frame, Model
from fubini.pipeline import _kernels_assemble as kernels
from fubini.pipeline.faces import FaceResult
from fubini.sampling.boundary import Outline

Float = NDArray[np.float64]
Int = NDArray[np.int32]

#: Lifted positions of one node that differ by more than this (times the diagonal) are reconciled.
SAME_POINT = 1e-13


@dataclass(frozen=True)
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


def assemble(model: Model, outlines: list[Outline], results: list[FaceResult]) -> Assembly:
    """Join the faces."""
    first, index, lifted, far, segments = _joined(model, outlines, results)
    total = len(first)
    starts = [0, *accumulate(len(r.mesh.boundary.points) for r in results)]
    inner = list(accumulate((r.mesh.inner_nodes for r in results), initial=total))
    counts = [0, *accumulate(r.mesh.triangle_count for r in results)]
    points, triangles = np.empty((inner[-1], 3)), np.empty((counts[-1], 3), np.int32)
    points[:total] = lifted[first]
    if far:
        owners = np.repeat(np.arange(len(results)), np.diff(starts))
        _reconcile(points[:total], lifted, index, owners, [face.frame for face in model.faces], model.diagonal)
    face_of, maps = np.empty(counts[-1], np.int32), []
    for f, (face, result) in enumerate(zip(model.faces, results, strict=True)):
        numbers = index[starts[f] : starts[f + 1]]
        part = slice(counts[f], counts[f + 1])
        result.mesh.write(face.frame, numbers, inner[f], points[inner[f] : inner[f + 1]], triangles[part])
        face_of[part] = face.index
        maps.append(numbers)
    return Assembly(points, triangles, face_of, *segments, tuple(maps), _lone(model, results, maps))


def _joined(
    model: Model, outlines: list[Outline], results: list[FaceResult]
) -> tuple[NDArray[np.int64], NDArray[np.int64], Float, bool, tuple[Int, Int, Float]]:
    """Boundary nodes of all faces, each once, and segments.

    Returns a row of each node, the node of every row, the rows' points in space, whether those of one node differ; then
    nodes, CAD edges and parameters of the segments, sorted by edge and parameter, each once and along its edge.
    """
    n = sum(len(r.mesh.boundary.points) for r in results)
    k = sum(len(r.mesh.boundary.segments) for r in results)
    place, param, lifted = np.empty(n, np.int64), np.empty(n), np.empty((n, 3))
    edge, t, nodes = np.empty(k, np.int64), np.empty((k, 2)), np.empty((k, 2), np.int64)
    ends = model.numbering.vertices
    lowest = -1 - int(np.maximum.reduce(ends, axis=None))
    at = since = 0
    for face, outline, result in zip(model.faces, outlines, results, strict=True):
        boundary = result.mesh.boundary
        part = slice(since, since + len(boundary.segments))
        kernels.enter(
            *outline.exact, boundary.segments, boundary.track, boundary.t, outline.edges, ends, face.frame.axes, at,
            place, param, lifted, edge[part], t[part], nodes[part],
        )  # fmt: skip
        if face.points:  # nodes that no segment starts at, in their order
            alone = at + np.setdiff1d(np.arange(len(boundary.points)), boundary.segments[:, 0])
            place[alone], param[alone] = [-1 - v for v, _ in face.points], 0.0
            lifted[alone] = face.frame.to_space([flat for _, flat in face.points])
            lowest = min(lowest, *(-1 - v for v, _ in face.points))
        at, since = at + len(boundary.points), part.stop
    apart = 0.5 * SAME_POINT * model.diagonal
    t, edges = model.numbering.on_edges(edge, t), model.numbering.edges
    first, index, *segments, far = kernels.join(place, param, lifted, lowest, apart, edge, t, nodes, edges)
    return first, index, lifted, far, tuple(segments)


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
