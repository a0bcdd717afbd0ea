"""The names of a mesh: what the user wants, brought to CAD indices, then to triangles and segments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fubini.errors import OptionError
from fubini.model import Model
from fubini.naming import Names, Parts, Predicate, Selection, name_parts, parse_selection
from fubini.pipeline.assemble import Assembly

Wanted = dict[str, Selection | Predicate]


def resolve_names(model: Model, names: Mapping[str, Any] | None) -> Wanted:
    """What each name of the user means: CAD indices, or a predicate on coordinates.

    Raises ``OptionError`` with the name where a selection is no face, edge or vertex that is meshed.
    """
    wanted: Wanted = {}
    for name, value in (names or {}).items():
        try:
            wanted[name] = _resolve(model, value)
        except OptionError as error:
            raise OptionError(f"name {name!r}: {error.message}", file=model.source, fix=error.fix) from error
    return wanted


def name_mesh(model: Model, whole: Assembly, wanted: Wanted) -> Names:
    """Names of the triangles, segments and points of an assembled mesh."""
    return name_parts(
        Parts(
            whole.points,
            whole.triangles,
            whole.face_of_triangle,
            whole.segments,
            whole.edge_of_segment,
            {f.index: f.name for f in model.faces if f.name},
            {i: e.name for i, e in model.edges.items() if e.name},
            _nodes_of_vertices(model, whole),
        ),
        wanted,
    )


def _resolve(model: Model, value: Any) -> Selection | Predicate:
    if isinstance(value, Selection):
        selection = value
    elif isinstance(value, str):
        selection = parse_selection(value)
    elif callable(value) and not hasattr(value, "wrapped"):
        return value
    else:
        from fubini.cad import match

        selection = match(model, value)
    faces = selection.faces & {f.index for f in model.faces}
    if not (faces or selection.edges & model.edges.keys() or selection.vertices & model.vertices.keys()):
        raise OptionError("none of what it selects is meshed", fix="select planar faces, or edges and vertices of them")
    return selection


def _nodes_of_vertices(model: Model, whole: Assembly) -> dict[int, int]:
    """Mesh node at every CAD vertex that ends an edge or lies inside a face."""
    found: dict[int, int] = dict(whole.lone)
    for end, t in enumerate((0.0, 1.0)):
        rows = np.flatnonzero(whole.t_of_segment[:, end] == t)
        for edge, node in zip(whole.edge_of_segment[rows].tolist(), whole.segments[rows, end].tolist(), strict=True):
            found[model.edges[edge].end if end else model.edges[edge].start] = node
    return found
