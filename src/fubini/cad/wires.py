"""Wires of a face as closed chains of edges, put in order where the CAD model is careless."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRepTools import BRepTools_WireExplorer
from OCP.TopAbs import TopAbs_Orientation as Orientation

from fubini.cad import occ
from fubini.cad.edges import EdgeTable
from fubini.errors import GeometryError


@dataclass(frozen=True)
class Coedge:
    """An edge as a wire runs through it: numbers of the edge and of the vertices it leaves and reaches."""

    edge: int
    forward: bool
    start: int
    end: int


@dataclass(frozen=True)
class Outline:
    """Closed chains of a face, and the edges left out of them.

    ``embedded``: edges marked INTERNAL. ``outside``: edges marked EXTERNAL. ``doubled``: edges that the
    face runs through once each way (slits, and bridges from a hole to the outline), which bound nothing.
    """

    chains: tuple[tuple[Coedge, ...], ...]
    embedded: tuple[int, ...]
    doubled: tuple[int, ...]
    outside: tuple[int, ...] = ()


def face_outline(face: Any, table: EdgeTable, reach: float) -> Outline:
    """The outline of a ``TopoDS_Face``.

    Consecutive edges meet in a vertex, or come within ``reach`` (model units) or the tolerance of
    the edges. Raises ``GeometryError`` with both loose ends where a chain stays open.
    """
    wires, embedded, outside = [], [], []
    for wire in occ.explore(face, occ.WIRE):
        coedges, inner, outer = _coedges(wire, table)
        wires.append((wire, coedges))
        embedded += inner
        outside += outer
    doubled = _doubled(c for _, coedges in wires for c in coedges)
    chains: list[tuple[Coedge, ...]] = []
    for wire, coedges in wires:
        kept = [c for c in coedges if c.edge not in doubled]
        chains += _in_order(kept, wire, face, table, reach)
    return Outline(tuple(chains), tuple(dict.fromkeys(embedded)), tuple(sorted(doubled)), tuple(outside))


def chain_up(coedges: list[Coedge], table: EdgeTable, reach: float) -> list[tuple[Coedge, ...]]:
    """Closed chains of directed edges in any order: by vertex first, else by the nearest loose end."""
    left = dict.fromkeys(coedges)
    chains = []
    while left:
        chain = [next(iter(left))]
        del left[chain[0]]
        while not (_joined(chain[-1], chain[0]) and chain[0].start >= 0):
            following = _following(chain[-1], left, table, reach)
            if following is None:
                break
            chain.append(following)
            del left[following]
        if not _joined(chain[-1], chain[0]):
            _require_near(chain[-1], chain[0], table, reach)
        chains.append(tuple(chain))
    return chains


def _coedges(wire: Any, table: EdgeTable) -> tuple[list[Coedge], list[int], list[int]]:
    """Edges of a wire as stored, those of no extent dropped; and the numbers of internal and external ones."""
    found: list[Coedge] = []
    embedded: list[int] = []
    outside: list[int] = []
    for edge in occ.children(wire):
        index = table.index(edge)
        if table.degenerated(index):
            continue
        if edge.Orientation() in (Orientation.TopAbs_INTERNAL, Orientation.TopAbs_EXTERNAL):
            (embedded if edge.Orientation() == Orientation.TopAbs_INTERNAL else outside).append(index)
            continue
        forward = edge.Orientation() != Orientation.TopAbs_REVERSED
        first, last = table[index].vertices
        found.append(Coedge(index, forward, *((first, last) if forward else (last, first))))
    return found, embedded, outside


def _doubled(coedges: Any) -> set[int]:
    runs = Counter((c.edge, c.forward) for c in coedges)
    return {edge for edge, forward in runs if forward and runs[edge, True] == runs[edge, False]}


def _in_order(coedges: list[Coedge], wire: Any, face: Any, table: EdgeTable, reach: float) -> list[tuple[Coedge, ...]]:
    """The stored order when it already closes, else the kernel's, else our own."""
    if not coedges:
        return []
    simple = len({c.start for c in coedges}) == len(coedges)
    if simple and _closes(coedges):
        return [tuple(coedges)]
    explored = _explored(coedges, wire, face, table)
    if len(explored) == len(coedges) and _closes(explored):
        return [tuple(explored)]
    return chain_up(coedges, table, reach)


def _explored(coedges: list[Coedge], wire: Any, face: Any, table: EdgeTable) -> list[Coedge]:
    """The edges in the order of ``BRepTools_WireExplorer``, which may skip some."""
    known = {(c.edge, c.forward): c for c in coedges}
    walk, order = BRepTools_WireExplorer(occ.as_wire(wire), occ.as_face(face)), []
    while walk.More():
        edge = walk.Current()
        found = known.pop((table.index(edge), edge.Orientation() != Orientation.TopAbs_REVERSED), None)
        if found is not None:
            order.append(found)
        walk.Next()
    return order


def _joined(a: Coedge, b: Coedge) -> bool:
    return a.end == b.start


def _closes(chain: list[Coedge]) -> bool:
    """Whether the chain closes through vertices; an edge without vertices closes by itself."""
    if len(chain) > 1 and any(c.start < 0 or c.end < 0 for c in chain):
        return False
    return all(_joined(a, b) for a, b in zip(chain, [*chain[1:], chain[0]], strict=True))


def _place(coedge: Coedge, table: EdgeTable, at_end: bool) -> np.ndarray:
    """Vertex (3,) where the coedge ends or starts; the end of the curve where there is no vertex."""
    vertex = coedge.end if at_end else coedge.start
    if vertex >= 0:
        return table.points[vertex]
    return table[coedge.edge].ends[1 if at_end == coedge.forward else 0]


def _following(last: Coedge, left: Any, table: EdgeTable, reach: float) -> Coedge | None:
    """The edge that goes on from ``last``."""
    for coedge in left:
        if last.end >= 0 and _joined(last, coedge):
            return coedge
    here = _place(last, table, True)
    near = min(left, key=lambda c: float(np.linalg.norm(_place(c, table, False) - here)), default=None)
    if near is None or not _near(last, near, table, reach):
        return None
    return near


def _near(a: Coedge, b: Coedge, table: EdgeTable, reach: float) -> bool:
    gap = float(np.linalg.norm(_place(a, table, True) - _place(b, table, False)))
    return gap <= max(reach, table[a.edge].tolerance + table[b.edge].tolerance)


def _require_near(a: Coedge, b: Coedge, table: EdgeTable, reach: float) -> None:
    if _near(a, b, table, reach):
        return
    end, start = _place(a, table, True), _place(b, table, False)
    where = ", ".join(f"{x:.9g}" for x in start)
    raise GeometryError(
        f"the outline is open: the edge reached here does not meet the next loose end at ({where})",
        edge=a.edge,
        at=end,
        fix="close the outline in the CAD model",
    )
