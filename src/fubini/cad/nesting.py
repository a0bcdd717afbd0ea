"""Which outline lies in which, and what is filled: from outlines to faces with holes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fubini.cad.drawing import Complex
from fubini.cad.loops import Group, Outline
from fubini.errors import GeometryError


@dataclass(frozen=True)
class PlaneFace:
    """An outline and the outlines of its holes."""

    outer: Outline
    holes: tuple[Outline, ...]


def faces_even_odd(groups: Sequence[Group]) -> tuple[PlaneFace, ...]:
    """Faces of groups of outlines: a group in a cell is a hole of it, a group in that hole is filled again.

    Raises GeometryError where two rims cross.
    """
    parent = containment([g.rim.polygon for g in groups])
    depth = _depths(parent)
    faces = []
    for i, group in enumerate(groups):
        if depth[i] % 2:
            continue
        inside = [g.rim for j, g in enumerate(groups) if parent[j] == i]
        cells = [c.polygon for c in group.cells]
        home = [0 if len(cells) == 1 else _home(rim.polygon, cells) for rim in inside]
        for k, cell in enumerate(group.cells):
            faces.append(PlaneFace(cell, tuple(r for r, h in zip(inside, home, strict=True) if h == k)))
    return tuple(faces)


def faces_by_winding(outlines: Sequence[Outline], rule: str) -> tuple[PlaneFace, ...]:
    """Faces that a fill rule ("nonzero" or "evenodd") gives to directed outlines that do not cross.

    An outline with the same filling on both sides bounds nothing and is left out.
    Raises GeometryError where two outlines cross.
    """
    parent = containment([o.polygon for o in outlines])
    turns = [0] * len(outlines)
    for i in np.argsort(_depths(parent), kind="stable"):
        above = turns[parent[i]] if parent[i] >= 0 else 0
        turns[i] = above + (1 if outlines[i].area > 0 else -1)
    filled = [bool(t % 2 if rule == "evenodd" else t) for t in turns]

    def filled_around(i: int) -> bool:
        return parent[i] >= 0 and filled[parent[i]]

    holes: dict[int, list[Outline]] = {i: [] for i in range(len(outlines)) if filled[i] and not filled_around(i)}
    for i, outline in enumerate(outlines):
        if filled_around(i) and not filled[i]:
            home = parent[i]
            while home not in holes:
                home = parent[home]
            holes[home].append(outline)
    return tuple(PlaneFace(outlines[i], tuple(inner)) for i, inner in holes.items())


def containment(polygons: Sequence[Complex]) -> list[int]:
    """For every polygon the smallest one around it, or -1.

    The polygons stand for curves, so points nearer to a polygon than its sampling is fine are no evidence;
    the point farthest from it decides, and clear evidence on both sides means that the two cross.
    """
    area = np.array([abs(_area(p)) for p in polygons])
    boxes = np.array([[p.real.min(), p.imag.min(), p.real.max(), p.imag.max()] for p in polygons]).reshape(-1, 4)
    order = np.lexsort((np.arange(len(polygons)), area))
    sorted_boxes = boxes[order]
    parent = [-1] * len(polygons)
    for rank, i in enumerate(order):
        larger = sorted_boxes[rank + 1 :]
        meets = np.all(larger[:, :2] <= boxes[i, 2:], axis=1) & np.all(boxes[i, :2] <= larger[:, 2:], axis=1)
        for j in order[rank + 1 :][meets]:
            if _inside(polygons[i], polygons[j]):
                parent[i] = int(j)
                break
    return parent


def _area(z: Complex) -> float:
    d = z - z.mean()
    return 0.5 * float((d.conj() * np.roll(d, -1)).imag.sum())


def _depths(parent: Sequence[int]) -> list[int]:
    def depth(i: int) -> int:
        count = 0
        while parent[i] >= 0:
            i, count = parent[i], count + 1
        return count

    return [depth(i) for i in range(len(parent))]


def _home(inner: Complex, cells: Sequence[Complex]) -> int:
    """The cell that a rim lies in, of several cells of one group."""
    for k, cell in enumerate(cells):
        if _inside(inner, cell):
            return k
    return 0


def _inside(inner: Complex, outer: Complex) -> bool:
    winding, distance = _locate(inner, outer)
    # twice the sagitta of a five-degree arc step: closer than this the chords do not tell
    doubt = 2e-3 * float(abs(np.roll(outer, -1) - outer).max())
    clear = distance > doubt
    sides = winding[clear] != 0
    if sides.any() and not sides.all():
        at = inner[clear][np.flatnonzero(~sides if sides[0] else sides)[0]]
        raise GeometryError(
            "two outlines cross each other near here",
            at=(at.real, at.imag),
            fix="cut them at their crossings, or join them into one outline",
        )
    return bool(winding[int(np.argmax(distance))] != 0)


def _locate(points: Complex, polygon: Complex) -> tuple[np.ndarray, np.ndarray]:
    """Winding number of a polygon about each point, and the distance of the point from it."""
    winding, distance = np.empty(len(points)), np.empty(len(points))
    side = np.roll(polygon, -1) - polygon
    square = np.maximum(abs(side) ** 2, 1e-300)
    rows = max(1, 200_000 // len(polygon))
    for begin in range(0, len(points), rows):
        d = points[begin : begin + rows, None] - polygon
        share = np.clip((d * side.conj()).real / square, 0, 1)
        distance[begin : begin + rows] = abs(d - share * side).min(axis=1)
        cross = (side.conj() * d).imag
        up = (d.imag >= 0) & (np.roll(d.imag, -1, axis=1) < 0) & (cross > 0)
        down = (d.imag < 0) & (np.roll(d.imag, -1, axis=1) >= 0) & (cross < 0)
        winding[begin : begin + rows] = up.sum(axis=1) - down.sum(axis=1)
    return winding, distance
