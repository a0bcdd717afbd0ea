"""Faces that meet without sharing edges, sewn together within a tolerance."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.BRepLib import BRepLib
from OCP.TopoDS import TopoDS_Solid
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fubini.cad import occ
from fubini.cad.build import with_faces
from fubini.cad.mirrors import without_mirrors
from fubini.cad.source import Source
from fubini.cad.trace import Trace, rebuilt
from fubini.errors import GeometryError, OptionError

#: Open outlines that are told one by one.
MOST_TOLD = 20


def sew_faces(source: Source, tolerance: float) -> Source:
    """The source with edges of different faces joined where they lie within ``tolerance`` (model units).

    Closed shells become solids, their faces outwards. What was joined and what stays open goes into the
    notes, with coordinates. Raises ``OptionError`` unless the tolerance is positive, ``GeometryError`` where
    the kernel fails.
    """
    if not (isinstance(tolerance, int | float) and math.isfinite(tolerance) and tolerance > 0.0):
        raise OptionError(f"sew is {tolerance}", fix="give a positive distance in model units")
    shape, _ = with_faces(source)
    source = without_mirrors(dataclasses.replace(source, shape=shape))
    shape, faces = source.shape, occ.ShapeMap(source.shape, occ.FACE)
    sewing = BRepBuilderAPI_Sewing(float(tolerance), True, True, True, True)
    for face in faces:
        sewing.Add(face)
    try:
        with occ.quiet():
            sewing.Perform()
            sewn = sewing.SewedShape()
    except Exception as error:  # the kernel raises its own classes, which share no other base
        raise GeometryError(f"sewing fails ({type(error).__name__})", file=source.label) from error
    if sewn.IsNull() or not len(occ.ShapeMap(sewn, occ.FACE)):
        raise GeometryError(
            "sewing leaves no face", file=source.label, fix=f"use a tolerance smaller than {tolerance:g}"
        )
    result = occ.compound(_outwards(part) for part in _shells(sewn))

    def images(part: Any) -> list[Any]:
        return list(occ.ShapeMap(sewing.ModifiedSubShape(part), part.ShapeType()))

    notes = [_joined(shape, result, tolerance), *_open_outlines(result)]
    return rebuilt(source, Trace(shape, images), result, notes)


def _shells(shape: Any) -> list[Any]:
    """Shells, and the faces that belong to none."""
    shells = occ.ShapeMap(shape, occ.SHELL)
    taken = occ.ShapeMap(occ.compound(shells), occ.FACE)
    return [*shells, *(f for f in occ.ShapeMap(shape, occ.FACE) if taken.index(f) < 0)]


def _outwards(part: Any) -> Any:
    """A shell that closes as a solid with its faces outwards; anything else as it is."""
    if part.ShapeType() != occ.SHELL or set(_uses(part).values()) != {2}:
        return part
    solid, builder = TopoDS_Solid(), BRep_Builder()
    builder.MakeSolid(solid)
    builder.Add(solid, part)
    return solid if occ.static(BRepLib, "OrientClosedSolid")(solid) else part


def _uses(shape: Any) -> Counter[int]:
    """How often faces run through each edge of a shape, by edge number; edges of no extent left aside."""
    edges = occ.ShapeMap(shape, occ.EDGE)
    uses: Counter[int] = Counter()
    for face in occ.ShapeMap(shape, occ.FACE):
        uses.update(edges.index(e) for e in occ.explore(face, occ.EDGE) if not occ.degenerated(occ.as_edge(e)))
    return uses


def _joined(before: Any, after: Any, tolerance: float) -> str:
    old, new = (Counter(_uses(shape).values())[1] for shape in (before, after))
    widest = max(occ.tolerance(occ.as_edge(e)) for e in occ.ShapeMap(after, occ.EDGE))
    return f"sewn within {tolerance:g}: open edges were {old} and are {new}; largest gap {widest:.3g}"


def _open_outlines(shape: Any) -> list[str]:
    """A remark for every connected run of edges that one face alone has."""
    edges, vertices = occ.ShapeMap(shape, occ.EDGE), occ.ShapeMap(shape, occ.VERTEX)
    loose = sorted(e for e, n in _uses(shape).items() if n == 1)
    if not loose:
        return []
    ends = [[vertices.index(v) for v in occ.ShapeMap(edges[e], occ.VERTEX)] for e in loose]
    pairs = np.array([(p[0], p[-1]) if p else (-1, -1) for p in ends])
    size = len(vertices) + 1
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0] % size, pairs[:, 1] % size)), shape=(size, size))
    _, label = connected_components(links, directed=False)
    groups: dict[int, list[int]] = {}
    for row, vertex in enumerate(pairs[:, 0]):
        groups.setdefault(int(label[vertex]), []).append(row)
    notes = [_outline(edges, loose, rows) for rows in list(groups.values())[:MOST_TOLD]]
    if len(groups) > MOST_TOLD:
        notes.append(f"{len(groups) - MOST_TOLD} more outlines stay open")
    return notes


def _outline(edges: occ.ShapeMap, loose: list[int], rows: list[int]) -> str:
    numbers = ", ".join(str(loose[r]) for r in rows[:8]) + (", ..." if len(rows) > 8 else "")
    low, high = occ.box(occ.compound(edges[loose[r]] for r in rows))
    return f"stays open: edge{'s' if len(rows) > 1 else ''} {numbers} between {_words(low)} and {_words(high)}"


def _words(point: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{x:.6g}" for x in point.round(9) + 0.0) + ")"
