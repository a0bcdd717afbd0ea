"""Sizes asked for parts of a model: by edge, face, vertex, curvature, and as a field in space."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini.errors import OptionError
from fubini.model import Face, Model
from fubini.pipeline.names import Wanted
from fubini.pipeline.options import MeshOptions
from fubini.pipeline.parts import by_part
from fubini.sampling.boundary import Outline, SizeOptions

Float = NDArray[np.float64]


def size_options(
    model: Model,
    outlines: list[Outline],
    size: float,
    of_faces: list[float],
    options: MeshOptions,
    wanted: Wanted | None = None,
) -> SizeOptions:
    """What the boundary discretisation is asked, in running numbers of edges and vertices.

    ``of_faces`` : what ``face_sizes`` gives. ``wanted`` : names of the user. Raises OptionError for an edge or vertex
    that the model does not have.
    """
    parts = model.numbering.parts
    wanted = wanted or {}
    edges = by_part(model, "edge_size", "edge", options.edge_size, wanted) if options.edge_size else {}
    segments = by_part(model, "edge_segments", "edge", options.edge_segments, wanted) if options.edge_segments else {}
    vertices = by_part(model, "vertex_size", "vertex", options.vertex_size, wanted) if options.vertex_size else {}
    by_edge = {part: h for e, h in edges.items() for part in parts(e)} if edges else {}
    for outline, h in zip(outlines, of_faces, strict=True):
        for e in outline.edges.tolist() if h < size else ():
            by_edge[e] = min(by_edge.get(e, size), h)
    by_vertex: dict[int, float] = {}
    if vertices:
        indices, numbers = model.numbering.vertices, model.numbering.ends
        vertex = dict(zip(indices.ravel().tolist(), numbers.ravel().tolist()))
        by_vertex = {vertex[v]: h for v, h in vertices.items()}
    least = {part: k for e, n in segments.items() for part, k in shared_out(math.ceil(n), parts(e)).items()}
    return SizeOptions(
        size,
        gradient=options.gradient,
        turn=options.largest_turn,
        edge_size=by_edge,
        edge_segments=least,
        vertex_size=by_vertex,
        chord_tolerance=options.chord_tolerance,
        keep_turn=options.segments_per_turn is not None,
        fields=face_fields(model, options),
    )


def shared_out(count: int, shares: dict[int, float]) -> dict[int, int]:
    """So many segments for the pieces of an edge by their shares of its length, at least one for each."""
    found = {part: max(1, math.floor(count * share)) for part, share in shares.items()}
    for _ in range(count - sum(found.values())):
        most = max(found, key=lambda part: shares[part] / found[part])
        found[most] += 1
    return found


def face_sizes(model: Model, size: float, options: MeshOptions, wanted: Wanted | None = None) -> list[float]:
    """Asked size of every face: its own where one is given, never above ``size``."""
    if not options.face_size:
        return [size] * len(model.faces)
    asked = by_part(model, "face_size", "face", options.face_size, wanted or {})
    return [min(size, asked.get(face.index, size)) for face in model.faces]


def face_fields(model: Model, options: MeshOptions) -> list[Callable[[Float], Float]] | None:
    """The size field on plane coordinates (n, 2) of every face; None without one."""
    if options.size_field is None:
        return None
    return [partial(_sizes_at, options.size_field, face) for face in model.faces]


def _sizes_at(function: Callable[[Float], Any], face: Face, points: Float) -> Float:
    """Sizes (n,) of a user's field at plane coordinates; OptionError for what is no positive size."""
    sizes = np.asarray(function(face.frame.to_space(points)), float)
    if sizes.shape != (len(points),):
        raise OptionError(
            f"size_field gives shape {sizes.shape} for {len(points)} points", fix="return one size for each row"
        )
    if not (sizes > 0.0).all():
        raise OptionError("size_field gives a size that is not positive", fix="return edge lengths above 0")
    return sizes
