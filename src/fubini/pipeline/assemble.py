"""One mesh from the meshes of the faces: shared nodes once, points in space, segments on CAD edges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini.model import Frame, Model
from fubini.pipeline.faces import FaceResult
from fubini.sampling.boundary import Outline
from fubini.tracks import evaluate

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


def assemble(model: Model, outlines: list[Outline], edge_ids: NDArray[np.int64], results: list[FaceResult]) -> Assembly:
    """Join the faces. ``edge_ids`` turns running edge numbers into CAD indices."""
    edge, t, owners, lifted = _boundary_nodes(model, outlines, edge_ids, results)
    first, index = _distinct(edge, t)
    total = len(first)
    inner = np.cumsum([total, *(r.mesh.inner_nodes for r in results)]).tolist()
    counts = np.cumsum([0, *(r.mesh.triangle_count for r in results)]).tolist()
    points, triangles = np.empty((inner[-1], 3)), np.empty((counts[-1], 3), np.int32)
    points[:total] = lifted[first]
    _reconcile(points[:total], lifted, index, owners, [face.frame for face in model.faces], model.diagonal)
    face_of, maps, at = np.empty(counts[-1], np.int32), [], 0
    for f, (face, result) in enumerate(zip(model.faces, results, strict=True)):
        numbers = index[at : at + len(result.mesh.boundary.points)]
        part = slice(counts[f], counts[f + 1])
        result.mesh.write(face.frame, numbers, inner[f], points[inner[f] : inner[f + 1]], triangles[part])
        face_of[part] = face.index
        maps.append(numbers)
        at += len(numbers)
    segments, edge_of, params = _segments(outlines, edge_ids, results, maps)
    return Assembly(points, triangles, face_of, segments, edge_of, params, tuple(maps), _lone(model, results, maps))


def _lone(model: Model, results: list[FaceResult], maps: list[NDArray[np.int64]]) -> dict[int, int]:
    """Mesh node at each vertex inside a face."""
    found: dict[int, int] = {}
    for face, result, numbers in zip(model.faces, results, maps, strict=True):
        if face.points:
            alone = np.setdiff1d(np.arange(len(numbers)), result.mesh.boundary.segments)
            found |= {v: int(numbers[i]) for (v, _), i in zip(face.points, alone, strict=True)}
    return found


def _boundary_nodes(
    model: Model, outlines: list[Outline], edge_ids: NDArray[np.int64], results: list[FaceResult]
) -> tuple[NDArray[np.int64], Float, NDArray[np.int64], Float]:
    """Edge number and t, or -1 - vertex and 0, owning face and point in space of every boundary node."""
    places, params, owners, lifted = [], [], [], []
    starts = np.array([model.edges[int(e)].start for e in edge_ids])
    ends = np.array([model.edges[int(e)].end for e in edge_ids])
    for f, (face, outline, result) in enumerate(zip(model.faces, outlines, results, strict=True)):
        boundary = result.mesh.boundary
        n = len(boundary.points)
        place, param, exact = np.empty(n, np.int64), np.empty(n), np.empty((n, 2))
        node = boundary.segments[:, 0]
        edge, t = outline.edges[boundary.track], boundary.t[:, 0]
        at_end = (t == 0.0) | (t == 1.0)
        vertex = np.where(t == 0.0, starts[edge], ends[edge])
        place[node] = np.where(at_end, -1 - vertex, edge)
        param[node] = np.where(at_end, 0.0, t)
        exact[node] = evaluate(outline.exact, boundary.track, t)
        if face.points:  # nodes that no segment starts at, in their order
            alone = np.setdiff1d(np.arange(n), node)
            place[alone], param[alone] = [-1 - v for v, _ in face.points], 0.0
            exact[alone] = [flat for _, flat in face.points]
        places.append(place)
        params.append(param)
        owners.append(np.full(n, f))
        lifted.append(face.frame.to_space(exact))
    return np.concatenate(places), np.concatenate(params), np.concatenate(owners), np.concatenate(lifted)


def _distinct(*columns: NDArray[Any]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first row of each kind, kinds sorted by column after column, and the kind of each row."""
    order = np.lexsort(columns[::-1])
    new = np.zeros(len(order), bool)
    new[:1] = True
    for column in columns:
        ranked = column[order]
        new[1:] |= ranked[1:] != ranked[:-1]
    kind = np.empty(len(order), np.intp)
    kind[order] = np.cumsum(new) - 1
    return order[new], kind


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
    least-squares solution of smallest norm.
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
        points[node] = middle + np.linalg.lstsq(normals, offset, rcond=1e-6)[0]


def _segments(
    outlines: list[Outline], edge_ids: NDArray[np.int64], results: list[FaceResult], maps: list[NDArray[np.int64]]
) -> tuple[Int, Int, Float]:
    """Mesh edges on CAD edges, each once, along its CAD edge, sorted by edge and parameter; and the parameters."""
    edges, params, pairs = [], [], []
    for outline, result, numbers in zip(outlines, results, maps, strict=True):
        boundary = result.mesh.boundary
        back = boundary.t[:, 0] > boundary.t[:, 1]
        ends = numbers[boundary.segments]
        pairs.append(np.where(back[:, None], ends[:, ::-1], ends))
        params.append(np.sort(boundary.t, axis=1))
        edges.append(edge_ids[outline.edges[boundary.track]])
    edge, t, nodes = np.concatenate(edges), np.concatenate(params), np.concatenate(pairs)
    rows, _ = _distinct(edge, *t.T, *nodes.T)
    return nodes[rows].astype(np.int32), edge[rows].astype(np.int32), t[rows]
