"""Plane regions as a model: two dimensions without a CAD kernel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fubini.curves import Curve
from fubini.errors import GeometryError, InputError
from fubini.model import Edge, Face, Frame, Model
from fubini.region import Loop, Region
from fubini.sampling.reference import distinct
from fubini.tolerance import VERTEX_GAP

Float = NDArray[np.float64]

#: Where two curves with the same ends are compared, to tell whether they are one edge.
COMPARED_AT = np.array([0.25, 0.5, 0.75])


def plane_model(source: Region | Sequence[Region], check: bool = True) -> Model:
    """Regions of the plane z = 0 as a model: region i is face i.

    Edges are numbered in the order of ``region.curves``, region after region. A curve that runs as a curve of an
    earlier region does, there or back, is the same edge, and the meshes fit together there; one that meets only a part
    of another is not. Ends within ``VERTEX_GAP`` of the diagonal are one vertex.

    Raises
    ------
    InputError : there is no region.
    GeometryError : a region crosses or touches itself, unless ``check`` is False.
    """
    regions = [source] if isinstance(source, Region) else list(source)
    if not regions:
        raise InputError("an empty list of regions", fix="give at least one region")
    label = regions[0].name or "region" if len(regions) == 1 else "regions"
    if check:
        _check(regions, label)
    low = np.min([r.bounding_box[0] for r in regions], axis=0)
    diagonal = float(np.hypot(*(np.max([r.bounding_box[1] for r in regions], axis=0) - low)))
    curves = [c for r in regions for c in r.curves]
    places, numbers = distinct(np.array([(c.start, c.end) for c in curves]).reshape(-1, 2), VERTEX_GAP * diagonal)
    ends = numbers.reshape(-1, 2)
    edges, which, along = _share(curves, ends, VERTEX_GAP * diagonal)
    frame = Frame(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    faces, at = [], 0
    for i, region in enumerate(regions):
        loops = []
        for loop in region.loops:
            rows = slice(at, at + len(loop))
            loops.append(Loop(loop.curves, tuple(which[rows]), tuple(along[rows])))
            at += len(loop)
        faces.append(Face(i, Region(loops[0], tuple(loops[1:]), region.name).canonical(), frame, name=region.name))
    vertices = {v: np.array([*place, 0.0]) for v, place in enumerate(places)}
    return Model(label, tuple(faces), dict(enumerate(edges)), vertices, diagonal=diagonal)


def _check(regions: list[Region], label: str) -> None:
    for i, region in enumerate(regions):
        try:
            region.check()
        except GeometryError as error:
            raise GeometryError(
                error.message, file=label, face=i, edge=error.edge, at=error.at, fix=error.fix
            ) from error


def _share(curves: list[Curve], ends: NDArray[np.int64], gap: float) -> tuple[list[Edge], list[int], list[bool]]:
    """The edges; for each curve its edge and whether it runs along it."""
    edges: list[Edge] = []
    which, along = [], []
    between: dict[tuple[int, int], list[tuple[int, Curve]]] = {}
    for curve, (a, b) in zip(curves, ends.tolist(), strict=True):
        known = between.setdefault((min(a, b), max(a, b)), [])
        found, forward = len(edges), True
        for number, other in known:
            there, back = (
                float(np.abs(curve.point(t) - other.point(COMPARED_AT)).max()) <= gap
                for t in (COMPARED_AT, 1.0 - COMPARED_AT)
            )
            if there or back:
                found, forward = number, there
        if found == len(edges):
            edges.append(Edge(found, curve.kind, a, b))
            known.append((found, curve))
        which.append(found)
        along.append(forward)
    return edges, which, along
