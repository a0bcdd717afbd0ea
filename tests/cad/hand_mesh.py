"""A mesh by hand for tests of the way back to CAD: equal steps along every edge, Delaunay, centroid test.

Good enough for plates with round holes; no quality is asked for.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from fubini.model import Model
from fubini.result import Certificate, Mesh


def hand_mesh(model: Model, steps: int = 24) -> Mesh:
    """Mesh whose faces share the nodes of their common edges."""
    points: list[np.ndarray] = []
    vertex_node: dict[int, int] = {}
    runs: dict[int, list[int]] = {}

    def node(point: np.ndarray) -> int:
        points.append(point)
        return len(points) - 1

    def run_of(face, curve, index) -> list[int]:
        if index not in runs:
            edge = model.edges[index]
            inner = face.frame.to_space(curve.point(np.linspace(0, 1, steps + 1)[1:-1]))
            ends = [vertex_node.setdefault(v, len(points)) for v in (edge.start,)]
            if ends[0] == len(points):
                node(model.vertices[edge.start])
            last = vertex_node.setdefault(edge.end, len(points))
            if last == len(points):
                node(model.vertices[edge.end])
            runs[index] = [ends[0], *(node(p) for p in inner), last]
        return runs[index]

    triangles, owner = [], []
    for face in model.faces:
        nodes: list[int] = []
        for loop in face.region.loops:
            for curve, index, forward in zip(loop.curves, loop.edges, loop.forward, strict=True):
                run = run_of(face, curve if forward else curve.reverse(), index)
                nodes += run if forward else run[::-1]
        nodes = list(dict.fromkeys(nodes))
        flat = face.frame.to_plane(np.array(points)[nodes])
        cells = Delaunay(flat).simplices
        a, b, c = (flat[cells[:, k]] for k in range(3))
        area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        cells[area < 0] = cells[area < 0][:, ::-1]
        kept = face.region.contains((a + b + c) / 3) & (np.abs(area) > 1e-12)
        triangles.append(np.array(nodes)[cells[kept]])
        owner += [face.index] * int(kept.sum())
    segments = [(a, b) for run in runs.values() for a, b in zip(run, run[1:])]
    of_edge = [index for index, run in runs.items() for _ in run[1:]]
    return Mesh(
        points=np.array(points),
        triangles=np.concatenate(triangles).astype(np.int32),
        face_of_triangle=np.array(owner, np.int32),
        segments=np.array(segments, np.int32),
        edge_of_segment=np.array(of_edge, np.int32),
        face_names={},
        edge_names={},
        certificate=Certificate((), 0.0, np.inf),
        size=1.0,
        model=model,
    )
