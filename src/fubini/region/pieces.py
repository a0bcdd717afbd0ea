"""Regions whose curves are cut at kinks: every piece turns smoothly, and a corner lies between two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fubini.curves import BSpline, Curve, Line
from fubini.curves.kinks import WHOLE, Stretch
from fubini.region.loop import Loop, with_ends
from fubini.region.region import Region

Stretches = tuple[Stretch, ...]

#: Stretches of two curves that stand for one edge are the same within this, in the parameter.
_SAME = 1e-9


def along_edge(stretches: Stretches, forward: bool) -> Stretches:
    """Stretches of an edge from those of a curve that runs along or against it, or the other way about."""
    return stretches if forward else tuple(Stretch(1.0 - s.stop, 1.0 - s.begin) for s in reversed(stretches))


def cut_region(region: Region, stretches: Mapping[int, Stretches], numbers: Mapping[int, Sequence[int]]) -> Region:
    """The region with its edges cut into these stretches of theirs; number k of edge e is called ``numbers[e][k]``.

    Edges that have none are whole. The region itself where all are.
    """
    if not stretches.keys() & set(region.edges):
        return region
    outer, *holes = (_cut_loop(loop, stretches, numbers) for loop in region.loops)
    return Region(outer, tuple(holes), region.name)


def _cut_loop(loop: Loop, stretches: Mapping[int, Stretches], numbers: Mapping[int, Sequence[int]]) -> Loop:
    curves: list[Curve] = []
    edges: list[int] = []
    ways: list[bool] = []
    for curve, edge, forward in zip(loop.curves, loop.edges, loop.forward, strict=True):
        pieces = cut_curve(curve, along_edge(stretches.get(edge, WHOLE), forward))
        curves += pieces
        edges += numbers[edge] if forward else reversed(numbers[edge])
        ways += [forward] * len(pieces)
    return Loop(tuple(curves), tuple(edges), tuple(ways))


def cut_curve(curve: Curve, stretches: Stretches) -> tuple[Curve, ...]:
    """A curve cut into stretches, which meet bit for bit; straight spans of polylines become lines."""
    if stretches == WHOLE:
        return (curve,)
    own = [next((s for s in curve.stretches if _same(s, stretch)), stretch) for stretch in stretches]
    points = [curve.start, *(curve.point(stretch.stop) for stretch in own[:-1]), curve.end]
    pieces = []
    for stretch, start, end in zip(own, points, points[1:]):
        piece = curve.trim(*stretch)
        if isinstance(piece, BSpline) and piece.degree == 1 and len(piece.poles) == 2 and piece.weights is None:
            piece = Line(start, end)
        elif (piece.start != start).any() or (piece.end != end).any():
            piece = with_ends(piece, start, end)
        pieces.append(piece)
    return tuple(pieces)


def _same(a: Stretch, b: Stretch) -> bool:
    return abs(a.begin - b.begin) <= _SAME and abs(a.stop - b.stop) <= _SAME
