"""One mesh from the meshes of the faces: shared nodes once, points in space, segments on CAD edges."""

from __future__ import annotations

from dataclasses import dataclass

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
    """Arrays of the whole mesh; ``nodes_of_face[f]`` maps local node numbers to mesh nodes."""

    points: Float
    triangles: Int
    face_of_triangle: Int
    segments: Int
    edge_of_segment: Int
    t_of_segment: Float
    nodes_of_face: tuple[NDArray[np.int64], ...]


def assemble(model: Model, outlines: list[Outline], edge_ids: NDArray[np.int64], results: list[FaceResult]) -> Assembly:
    """Join the faces. ``edge_ids`` turns running edge numbers into CAD indices."""
    keys, owners, lifted = _boundary_nodes(model, outlines, edge_ids, results)
    _, first, index = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    index = index.ravel()
    points = lifted[first].copy()
    _reconcile(points, lifted, index, owners, [face.frame for face in model.faces], model.diagonal)
    parts, triangles, face_of, maps = [points], [], [], []
    total, at = len(points), 0
    for face, result in zip(model.faces, results, strict=True):
        mesh = result.outcome.triangulation
        n = len(mesh.boundary.points)
        inner = mesh.points[n:]
        numbers = np.concatenate([index[at : at + n], np.arange(total, total + len(inner))])
        parts.append(face.frame.to_space(inner) if len(inner) else np.empty((0, 3)))
        triangles.append(numbers[mesh.triangles])
        face_of.append(np.full(len(mesh.triangles), face.index, np.int32))
        maps.append(numbers)
        at, total = at + n, total + len(inner)
    segments, edge_of, params = _segments(outlines, edge_ids, results, maps)
    return Assembly(
        np.concatenate(parts), np.concatenate(triangles).astype(np.int32), np.concatenate(face_of),
        segments, edge_of, params, tuple(maps),
    )  # fmt: skip


def _boundary_nodes(
    model: Model, outlines: list[Outline], edge_ids: NDArray[np.int64], results: list[FaceResult]
) -> tuple[Float, NDArray[np.int64], Float]:
    """Key (edge number, t) or (-1 - vertex, 0), owning face and point in space of every boundary node."""
    keys, owners, lifted = [], [], []
    starts = np.array([model.edges[int(e)].start for e in edge_ids])
    ends = np.array([model.edges[int(e)].end for e in edge_ids])
    for f, (face, outline, result) in enumerate(zip(model.faces, outlines, results, strict=True)):
        boundary = result.outcome.triangulation.boundary
        key = np.empty((len(boundary.points), 2))
        node = boundary.segments[:, 0]
        edge, t = outline.edges[boundary.track], boundary.t[:, 0]
        at_end = (t == 0.0) | (t == 1.0)
        vertex = np.where(t == 0.0, starts[edge], ends[edge])
        key[node, 0] = np.where(at_end, -1.0 - vertex, edge)
        key[node, 1] = np.where(at_end, 0.0, t)
        keys.append(key)
        owners.append(np.full(len(key), f))
        exact = np.empty((len(key), 2))
        exact[node] = evaluate(outline.exact, boundary.track, t)
        lifted.append(face.frame.to_space(exact))
    return np.concatenate(keys), np.concatenate(owners), np.concatenate(lifted)


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
    for node in np.unique(index[gap > SAME_POINT * diagonal]):
        copies = np.flatnonzero(index == node)
        middle = lifted[copies].mean(axis=0)
        normals = np.array([frames[f].normal for f in owners[copies]])
        offset = np.array([frames[f].normal @ (frames[f].origin - middle) for f in owners[copies]])
        points[node] = middle + np.linalg.lstsq(normals, offset, rcond=1e-6)[0]


def _segments(
    outlines: list[Outline], edge_ids: NDArray[np.int64], results: list[FaceResult], maps: list[NDArray[np.int64]]
) -> tuple[Int, Int, Float]:
    """Mesh edges on CAD edges, each once, along its CAD edge, sorted by edge and parameter; and the parameters."""
    rows = []
    for outline, result, numbers in zip(outlines, results, maps, strict=True):
        boundary = result.outcome.triangulation.boundary
        pairs = numbers[boundary.segments]
        back = boundary.t[:, 0] > boundary.t[:, 1]
        pairs[back] = pairs[back][:, ::-1]
        edge = edge_ids[outline.edges[boundary.track]]
        rows.append(np.column_stack([edge, np.sort(boundary.t, axis=1), pairs]))
    table = np.unique(np.concatenate(rows), axis=0)
    return table[:, 3:].astype(np.int32), table[:, 0].astype(np.int32), table[:, 1:3].copy()
