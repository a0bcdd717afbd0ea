"""Which edges, faces or vertices a user means: by index, name, text or predicate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini.errors import OptionError
from fubini.model import Model
from fubini.naming import Predicate, Selection, parse_selection

Float = NDArray[np.float64]

#: Where along an edge a predicate is asked.
ASKED_AT = np.linspace(0.0, 1.0, 5)
#: Attribute of ``Selection`` for each kind of part.
PLURAL = {"edge": "edges", "face": "faces", "vertex": "vertices"}


def by_part(
    model: Model, option: str, what: str, asked: Mapping[Any, float], wanted: Mapping[str, Selection | Predicate]
) -> dict[int, float]:
    """Values by CAD index; a key stands for all parts that it selects, what asks for finer elements wins.

    Parameters
    ----------
    option : name of the option; of ``edge_segments`` the largest value wins, of the others the least.
    what : "edge", "face" or "vertex".
    asked : value by index, by name, by text such as ``"edges 3,5-7"`` or ``"3,5-7"``, or by a predicate
        ``p(x, y, z) -> bool`` on arrays that selects the parts all of whose sampled points satisfy it.
    wanted : names of the user; these come before names of the source.

    Raises OptionError for a key that selects nothing that is meshed.
    """
    out: dict[int, float] = {}
    finer = max if option == "edge_segments" else min
    for key, value in asked.items():
        found = _select(model, what, key, wanted)
        if not found:
            raise OptionError(
                f"{option}: no {what} {key!r} on a planar face", file=model.source,
                fix="see fubini info for indices and names",
            )  # fmt: skip
        for index in found:
            out[index] = finer(out.get(index, value), value)
    return out


def _select(model: Model, what: str, key: Any, wanted: Mapping[str, Selection | Predicate]) -> set[int]:
    """Indices of the meshed parts that one key selects."""
    known = _known(model, what)
    if isinstance(key, str):
        meant = wanted.get(key)
        if meant is None:
            found = {index for index, name in known.items() if name is not None and name == key}
            return found or set(_parsed(what, key) & known.keys())
        key = meant
    if isinstance(key, Selection):
        return set(getattr(key, PLURAL[what])) & known.keys()
    if callable(key):
        return {i for i, places in _samples(model, what).items() if np.all(key(*np.ascontiguousarray(places.T)))}
    return {int(key)} & known.keys()


def _known(model: Model, what: str) -> dict[int, str | None]:
    """Names by index of the parts that are meshed."""
    if what == "face":
        return {face.index: face.name for face in model.faces}
    used = sorted({e for face in model.faces for e in (*face.region.edges, *(e for _, e in face.inner))})
    if what == "edge":
        return {e: model.edges[e].name for e in used}
    return dict.fromkeys(v for e in used for v in (model.edges[e].start, model.edges[e].end))


def _parsed(what: str, text: str) -> frozenset[int]:
    """Indices that a text names, with or without the kind in front; none where it is no such text."""
    for candidate in (text, f"{what} {text}"):
        try:
            return getattr(parse_selection(candidate), PLURAL[what])
        except OptionError:
            continue
    return frozenset()


def _samples(model: Model, what: str) -> dict[int, Float]:
    """Points in space (k, 3) on every part: along edges, along the outline of a face, the vertex itself."""
    found: dict[int, Float] = {}
    for face in model.faces:
        region = face.region
        curves = [*zip(region.curves, region.edges, strict=True), *face.inner]
        places = [face.frame.to_space(curve.point(ASKED_AT)) for curve, _ in curves]
        if what == "face":
            found[face.index] = np.concatenate(places)
        elif what == "edge":
            found |= {edge: p for (_, edge), p in zip(curves, places, strict=True)}
        else:
            ends = [v for _, e in curves for v in (model.edges[e].start, model.edges[e].end)]
            found |= {v: model.vertices[v][None] for v in ends}
    return found


def edge_points(model: Model, edge: int, spacing: float) -> Float:
    """Points in space (n, 3) along an edge, at most about ``spacing`` apart, both ends among them."""
    for face in model.faces:
        for curve, number in (*zip(face.region.curves, face.region.edges, strict=True), *face.inner):
            if number == edge:
                return face.frame.to_space(curve.point(np.linspace(0.0, 1.0, math.ceil(curve.length() / spacing) + 1)))
    raise OptionError(f"no edge {edge} on a planar face", file=model.source)
