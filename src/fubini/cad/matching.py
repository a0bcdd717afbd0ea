"""Live sub-shapes found again in a model: what a user's name means, as CAD indices."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from fubini.cad import occ
from fubini.cad.names import resolve
from fubini.errors import OptionError
from fubini.model import Model
from fubini.naming import Selection


def match(model: Model, value: Any) -> Selection:
    """Faces, edges and vertices of the model that these live shapes are, or hold.

    Parameters
    ----------
    model : with the live shape it was read from.
    value : a face, edge, wire, vertex, solid, compound or ``TopoDS_Shape``, a build123d ``ShapeList``,
        a CadQuery ``Workplane`` (what lies on its stack), or a list of these.

    The same sub-shape is taken (``IsSame``), else all of the same geometry in another place
    (``IsPartner``); where the source was sewn or imprinted, all that became of it. Raises
    ``OptionError`` when nothing is found, or this is no shape.
    """
    if model.native is None:
        raise OptionError("no live CAD shape stands behind the model", fix='select by index, as "edges 3", or by place')
    found: dict[Any, set[int]] = {occ.FACE: set(), occ.EDGE: set(), occ.VERTEX: set()}
    maps: dict[Any, occ.ShapeMap] = {}
    for shape in _shapes(value):
        kind = next((k for k in found if len(occ.ShapeMap(shape, k))), None)
        if kind is None:
            continue
        if kind not in maps:
            maps[kind] = occ.ShapeMap(model.native, kind)
        parts = [shape]
        for trace in model.traces:
            parts = [new for old in parts for new in trace.after(old, kind)]
        found[kind].update(resolve(maps[kind], [(part, "wanted") for part in parts]))
    if not any(found.values()):
        raise OptionError("no face, edge or vertex of the model is selected", fix="select from what is meshed")
    return Selection(*(frozenset(found[k]) for k in (occ.FACE, occ.EDGE, occ.VERTEX)))


def _shapes(value: Any) -> Iterator[Any]:
    """The kernel shapes in a live object or a list of them."""
    wrapped = value if occ.is_shape(value) else getattr(value, "wrapped", None)
    if occ.is_shape(wrapped):
        yield wrapped
    elif callable(getattr(value, "vals", None)):
        for item in value.vals():
            yield from _shapes(item)
    elif isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping):
        for item in value:
            yield from _shapes(item)
    else:
        raise OptionError(f"cannot select by a {type(value).__name__}", fix="give live shapes, text or a function")
