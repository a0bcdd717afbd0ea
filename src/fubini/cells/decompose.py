"""From a region to Fubini cells by a sweep over its boundary.

The boundary is split into pieces that are functions of the outer variable. Between two consecutive
vertices the pieces, sorted, bound intervals in turn from below (pieces that run forward, the material
on their left) and from above. An interval goes on through a vertex when its limits are continuous
there; else a slice ends some cells and begins others.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.cells.cell import Cell
from fubini.cells.chain import Chain
from fubini.curves import LimitFunction
from fubini.errors import GeometryError, OptionError
from fubini.region import Region

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: Coordinates this close, times their size, are the same level of the sweep: rounding noise.
_NOISE = 16.0 * float(np.finfo(float).eps)


def decompose(region: Region, direction: str = "auto", at_vertices: bool = False) -> tuple[Cell, ...]:
    """Cells that cover ``region`` once.

    Parameters
    ----------
    direction : "x" gives cells of kind I1 (limits are functions of x), "y" of kind I2, "auto" the
        one of the two with fewer and rounder cells.
    at_vertices : slice at every vertex of r and s, too, so that each limit is one edge; by default
        only where the set of intervals changes or a limit jumps.

    The region is taken to be valid (``region.check``); ``GeometryError`` where the order of its edges
    shows that it is not. ``OptionError`` for another direction. Cells are ordered by the start of
    their outer range, then from below.
    """
    if direction not in ("x", "y", "auto"):
        raise OptionError(f"direction {direction!r} is none of 'x', 'y', 'auto'")
    if direction != "auto":
        return _sweep(region, 0 if direction == "x" else 1, at_vertices)
    both = [_sweep(region, axis, at_vertices) for axis in (0, 1)]
    return min(both, key=_cost)


def _cost(cells: Sequence[Cell]) -> float:
    """Number of cells, a long one counting for more: one more for every doubling of its slenderness."""
    cost = 0.0
    for cell in cells:
        x = cell.a + (cell.b - cell.a) * (np.arange(8) + 0.5) / 8.0
        height = float(np.mean(cell.s(x) - cell.r(x)))
        width = cell.b - cell.a
        slenderness = max(width, height) / max(min(width, height), np.finfo(float).tiny)
        cost += 1.0 + float(np.log2(slenderness))
    return cost


@dataclass(frozen=True)
class _Piece:
    """A boundary piece as a function over the levels ``first`` to ``last`` of the sweep.

    ``middles`` holds its values amid the slabs first, first + 1, ..., ``values`` those at the levels.
    """

    limit: LimitFunction
    edge: int
    lower: bool
    first: int
    last: int
    middles: Float
    values: Float

    def at(self, level: int) -> float:
        return float(self.values[level - self.first])


class _Open:
    """A cell under construction: the level where it begins and the pieces of its limits so far."""

    def __init__(self, start: int, lower: int, upper: int) -> None:
        self.start = start
        self.lower, self.upper = [lower], [upper]

    def extend(self, lower: int, upper: int) -> None:
        """Let the limits go on with these pieces, which may be the present ones."""
        if self.lower[-1] != lower:
            self.lower.append(lower)
        if self.upper[-1] != upper:
            self.upper.append(upper)


def _sweep(region: Region, axis: int, at_vertices: bool) -> tuple[Cell, ...]:
    levels, pieces = _prepare(region, axis)
    noise = _NOISE * float(np.abs(region.bounding_box).max())
    slabs = _slabs(pieces, levels, axis)
    finished: list[tuple[_Open, int]] = []
    touching: list[tuple[_Open, _Open]] = []
    current: list[tuple[tuple[int, int], _Open]] = []
    for level in range(len(levels)):
        intervals = slabs[level] if level < len(slabs) else []
        passing = dict(current)
        following = [(pair, passing.pop(pair, None)) for pair in intervals]
        linked = [
            (pair, cell or _linked(pair, passing, pieces, level, noise, at_vertices) or _Open(level, *pair))
            for pair, cell in following
        ]
        before, after = {id(cell) for _, cell in current}, {id(cell) for _, cell in linked}
        ended = [(pair, cell) for pair, cell in current if id(cell) not in after]
        begun = [(pair, cell) for pair, cell in linked if id(cell) not in before]
        touching += _touching(ended, begun, pieces, level, noise)
        finished += [(cell, level) for _, cell in ended]
        current = linked
    return _cells(finished, touching, pieces, levels, axis)


def _prepare(region: Region, axis: int) -> tuple[Float, list[_Piece]]:
    """Levels of the sweep and the boundary pieces that are functions between them."""
    graph = [
        (piece, edge)
        for curve, edge in zip(region.curves, region.edges, strict=True)
        for piece in curve.graph_pieces(axis)
    ]
    ends = np.array([[piece.start[axis], piece.end[axis]] for piece, _ in graph])
    levels, index = _levels(ends, _NOISE * float(np.abs(region.bounding_box).max()))
    middles = 0.5 * (levels[:-1] + levels[1:])
    pieces = []
    for (curve, edge), (i, j) in zip(graph, index, strict=True):
        if i == j:
            continue
        first, last = int(min(i, j)), int(max(i, j))
        limit = curve.limit(axis)
        low, high = (curve.start, curve.end) if i < j else (curve.end, curve.start)
        y = limit(np.concatenate([middles[first:last], levels[first + 1 : last]]))
        values = np.concatenate([[low[1 - axis]], y[last - first :], [high[1 - axis]]])
        # the material lies to the left: above a piece that runs in x, below one that runs in y
        lower = (i < j) == (axis == 0)
        pieces.append(_Piece(limit, edge, bool(lower), first, last, y[: last - first], values))
    return levels, pieces


def _levels(ends: Float, noise: float) -> tuple[Float, Int]:
    """Distinct coordinates, those within rounding noise merged, and the level of each end."""
    flat = ends.ravel()
    order = np.argsort(flat, kind="stable")
    new = np.concatenate([[True], np.diff(flat[order]) > noise])
    index = np.empty(len(flat), dtype=np.int64)
    index[order] = np.cumsum(new) - 1
    return flat[order][new], index.reshape(ends.shape)


def _slabs(pieces: list[_Piece], levels: Float, axis: int) -> list[list[tuple[int, int]]]:
    """For every slab the intervals (lower piece, upper piece) from below."""
    count = [p.last - p.first for p in pieces]
    owner = np.repeat(np.arange(len(pieces)), count)
    slab = np.concatenate([np.arange(p.first, p.last) for p in pieces])
    y = np.concatenate([p.middles for p in pieces])
    order = np.lexsort((y, slab))
    stops = np.searchsorted(slab[order], np.arange(len(levels)))
    size = float(np.abs(y).max())
    result = []
    for k in range(len(levels) - 1):
        rows = order[stops[k] : stops[k + 1]]
        stack = owner[rows].tolist()
        if len(rows) > 1 and np.diff(y[rows]).min() <= 64.0 * _NOISE * size:
            stack.sort(key=functools.cmp_to_key(functools.partial(_compare, pieces)))
        result.append(_paired(stack, pieces, float(0.5 * (levels[k] + levels[k + 1])), axis))
    return result


def _compare(pieces: list[_Piece], a: int, b: int) -> int:
    """Order of two pieces too close to tell apart here: taken where they differ most."""
    p, q = pieces[a], pieces[b]
    first, last = max(p.first, q.first), min(p.last, q.last)
    middles = p.middles[first - p.first : last - p.first] - q.middles[first - q.first : last - q.first]
    ends = [p.at(level) - q.at(level) for level in (first, last)]
    gap = np.concatenate([middles, ends])
    widest = float(gap[np.argmax(np.abs(gap))])
    if widest == 0.0:
        return int(q.lower) - int(p.lower)
    return -1 if widest < 0.0 else 1


def _paired(stack: list[int], pieces: list[_Piece], middle: float, axis: int) -> list[tuple[int, int]]:
    """Lower and upper pieces in turn; an error where they do not alternate."""
    pairs = list(zip(stack[::2], stack[1::2], strict=False))
    if len(stack) % 2 or any(not pieces[i].lower or pieces[j].lower for i, j in pairs):
        wrong = next((i for n, i in enumerate(stack) if pieces[i].lower != (n % 2 == 0)), stack[-1])
        place = (middle, float(pieces[wrong].limit(middle)))
        raise GeometryError(
            "the boundary crosses itself here, or a loop runs the wrong way",
            edge=pieces[wrong].edge,
            at=place if axis == 0 else place[::-1],
            fix="region.check() tells where",
        )
    return pairs


def _linked(
    pair: tuple[int, int],
    passing: dict[tuple[int, int], _Open],
    pieces: list[_Piece],
    level: int,
    noise: float,
    at_vertices: bool,
) -> _Open | None:
    """The open cell whose limits go on continuously as this pair, extended by it."""
    if at_vertices:
        return None
    low, high = pieces[pair[0]].at(level), pieces[pair[1]].at(level)
    for (below, above), cell in passing.items():
        r, s = pieces[below].at(level), pieces[above].at(level)
        if abs(r - low) <= noise and abs(s - high) <= noise and s - r > noise:
            cell.extend(*pair)
            del passing[below, above]
            return cell
    return None


def _touching(
    ended: list[tuple[tuple[int, int], _Open]],
    begun: list[tuple[tuple[int, int], _Open]],
    pieces: list[_Piece],
    level: int,
    noise: float,
) -> list[tuple[_Open, _Open]]:
    """Pairs of cells on the two sides of a slice that share a part of it."""
    found = []
    for (i, j), left in ended:
        r, s = pieces[i].at(level), pieces[j].at(level)
        for (k, m), right in begun:
            if min(s, pieces[m].at(level)) - max(r, pieces[k].at(level)) > noise:
                found.append((left, right))
    return found


def _cells(
    finished: list[tuple[_Open, int]],
    touching: list[tuple[_Open, _Open]],
    pieces: list[_Piece],
    levels: Float,
    axis: int,
) -> tuple[Cell, ...]:
    def height(item: tuple[_Open, int]) -> float:
        cell = item[0]
        return float(pieces[cell.lower[0]].middles[cell.start - pieces[cell.lower[0]].first])

    finished = sorted(finished, key=lambda item: (item[0].start, height(item)))
    number = {id(cell): k for k, (cell, _) in enumerate(finished)}
    neighbours: list[set[int]] = [set() for _ in finished]
    for left, right in touching:
        i, j = number[id(left)], number[id(right)]
        neighbours[i].add(j)
        neighbours[j].add(i)
    kind = "I1" if axis == 0 else "I2"
    result = []
    for k, (cell, end) in enumerate(finished):
        a, b = float(levels[cell.start]), float(levels[end])
        r, s = (_chain([pieces[i] for i in side], a, b) for side in (cell.lower, cell.upper))
        result.append(Cell(kind, a, b, r, s, tuple(sorted(neighbours[k]))))
    return tuple(result)


def _chain(run: list[_Piece], a: float, b: float) -> Chain:
    joints = [piece.limit.domain[0] for piece in run[1:]]
    breaks = np.array([a, *joints, b])
    breaks.setflags(write=False)
    return Chain(tuple(p.limit for p in run), breaks, tuple(p.edge for p in run))
