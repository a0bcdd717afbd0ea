"""Points inside faces that become nodes: given by the user, or vertices that the CAD model has there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini.errors import OptionError
from fubini.model import Face, Model
from fubini.naming import Selection
from fubini.tolerance import FLAT, VERTEX_GAP
from fubini.triangulation.value import FROZEN, Boundary

Float = NDArray[np.float64]

#: The size at a point is at most this many times its distance from the next node or segment.
REACH = 1.15
#: A point nearer to a segment than this share of its length asks for shorter ones.
NEAR = 0.8
#: Lattice nodes keep this distance (times the size there) from points.
CLEARANCE = 0.62


def with_points(model: Model, points: Mapping[str, Any] | None) -> tuple[Model, dict[str, Selection]]:
    """The model with more vertices inside its faces, and what their names mean.

    points : name to place (3,), or (2,) for z = 0. A place of a vertex names that vertex.

    Raises ``OptionError`` for a place that is in no face, or on an edge beside its vertices.
    """
    named: dict[str, Selection] = {}
    for name, value in (points or {}).items():
        place = np.zeros(3)
        given = np.asarray(value, float).ravel()
        if given.shape not in ((2,), (3,)) or not np.isfinite(given).all():
            raise OptionError(f"points: {name!r} is {value!r}", fix="give x, y, z in model units")
        place[: len(given)] = given
        reach = VERTEX_GAP * model.diagonal
        vertex = next((v for v, p in model.vertices.items() if np.linalg.norm(p - place) <= reach), None)
        if vertex is None:
            model, vertex = _added(model, name, place)
        named[name] = Selection(vertices=frozenset([vertex]))
    return model, named


def _added(model: Model, name: str, place: Float) -> tuple[Model, int]:
    """The model with one vertex more, and its number."""
    vertex = max(model.vertices, default=-1) + 1
    faces, inside = [], False
    for face in model.faces:
        flat = face.frame.to_plane(place)[0]
        height = abs(float((place - face.frame.origin) @ face.frame.normal))
        if height <= FLAT * model.diagonal + face.tolerance and bool(face.region.contains(flat[None])[0]):
            refuse_on_edges(face, flat, VERTEX_GAP * model.diagonal, name, model.source)
            face, inside = replace(face, points=(*face.points, (vertex, flat))), True
        faces.append(face)
    if not inside:
        at = ", ".join(f"{x:.6g}" for x in place)
        raise OptionError(
            f"points: {name!r} at ({at}) lies in no planar face", file=model.source, fix="move it into one"
        )
    return replace(model, faces=tuple(faces), vertices=model.vertices | {vertex: place}), vertex


def refuse_on_edges(face: Face, flat: Float, reach: float, name: str, source: str) -> None:
    """Raise ``OptionError`` where a point of the plane lies on an edge of the face."""
    curves = [(c, e) for loop in face.region.loops for c, e in zip(loop.curves, loop.edges, strict=True)]
    for curve, edge in (*curves, *face.inner):
        if float(curve.closest(flat[None])[1][0]) <= reach:
            raise OptionError(
                f"points: {name!r} lies on an edge, between its ends", file=source, face=face.index, edge=edge,
                fix="split the edge there in the CAD model (imprint a vertex), or move the point",
            )  # fmt: skip


def with_lone(boundary: Boundary, lone: Float, size: float) -> Boundary:
    """The boundary with nodes (p, 2) that no segment ends at: fixed, and last."""
    p = len(lone)
    if not p:
        return boundary
    near = np.minimum(_distances(boundary, lone)[0].min(axis=1), _apart(lone))
    return replace(
        boundary,
        points=np.concatenate([boundary.points, lone]),
        kind=np.concatenate([boundary.kind, np.full(p, FROZEN, np.uint8)]),
        size=np.concatenate([boundary.size, np.minimum(size, REACH * near)]),
        angle=np.concatenate([boundary.angle, np.full(p, 180.0)]),
    )


def clear_of(inner: Float, boundary: Boundary, count: int, size: float, gradient: float) -> Float:
    """The lattice nodes (n, 2) that keep clear of the last ``count`` boundary nodes, which no segment ends at.

    Where the size there is less than ``size``, the zone in which it grows is left for the refinement to fill.
    """
    for place, there in zip(boundary.points[-count:], boundary.size[-count:].tolist(), strict=True):
        reach = max(CLEARANCE * size, (size - there) / gradient)
        inner = inner[np.einsum("ij,ij->i", inner - place, inner - place) >= reach * reach]
    return inner


def crowded(boundary: Boundary, places: Float) -> NDArray[np.bool_]:
    """Which places (k, 2) lie closer to a boundary segment than its length allows."""
    distance, length = _distances(boundary, places)
    return np.asarray((distance < NEAR * length).any(axis=1))


def _distances(boundary: Boundary, places: Float) -> tuple[Float, Float]:
    """Distance (k, s) of places (k, 2) from every boundary segment, and the lengths (s,) of these."""
    a, b = (boundary.points[boundary.segments[:, i]] for i in range(2))
    along = b - a
    square = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    found = np.empty((len(places), len(a)))
    for i, p in enumerate(places):
        share = np.clip(np.einsum("ij,ij->i", p - a, along) / square, 0.0, 1.0)
        found[i] = np.sqrt(((a + share[:, None] * along - p) ** 2).sum(axis=1))
    return found, np.sqrt(square)


def _apart(points: Float) -> Float:
    """Distance (p,) of every point from the nearest other one; infinite for one alone."""
    squares = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    np.fill_diagonal(squares, np.inf)
    return np.asarray(np.sqrt(squares.min(axis=1)))
