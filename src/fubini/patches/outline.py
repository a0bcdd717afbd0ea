"""Borders of the patches: straight edges between corners, and the loops that they form about each patch."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.patches.grow import Facets

Int = NDArray[np.int64]

#: A border that bends by more than this (degrees) has a corner there, however small the pieces are.
BEND = 5.0

Run = tuple[int, bool]


@dataclass(frozen=True)
class Borders:
    """``edges``: point numbers (start, end) of every straight edge. ``loops``: for each patch its loops, each a
    tuple of (edge, whether it runs along the edge). ``inner``: for each patch the edges with it on both sides."""

    edges: tuple[tuple[int, int], ...]
    loops: tuple[tuple[tuple[Run, ...], ...], ...]
    inner: tuple[tuple[int, ...], ...]


def find_borders(facets: Facets, patch: Int, tolerance: float) -> Borders:
    """The borders of all patches; pieces between the same patches that lie within ``tolerance`` of a line are one."""
    sides = np.argwhere((facets.across < 0) | (patch[facets.across] != patch[:, None]))
    triangle, side = sides.T
    start = facets.triangles[triangle, side]
    end = facets.triangles[triangle, (side + 1) % 3]
    beside: dict[tuple[int, int], list[int]] = {}
    for a, b, p in zip(start.tolist(), end.tolist(), patch[triangle].tolist(), strict=True):
        beside.setdefault((min(a, b), max(a, b)), []).append(p)
    edges, edge_of = _straight_edges(facets, {pair: tuple(sorted(p)) for pair, p in beside.items()}, tolerance)
    directed: list[set[tuple[int, int]]] = [set() for _ in range(int(patch.max()) + 1)]
    for a, b, p in zip(start.tolist(), end.tolist(), patch[triangle].tolist(), strict=True):
        directed[p].add((a, b))
    corner = _corner_sides(facets, triangle, side)
    loops, inner = [], []
    for p, pairs in enumerate(directed):
        both = {pair for pair in pairs if pair[::-1] in pairs}
        loops.append(_loops(facets, patch, p, pairs - both, corner, edge_of, edges))
        inner.append(tuple(sorted({edge_of[min(pair), max(pair)] for pair in both})))
    return Borders(tuple(edges), tuple(loops), tuple(inner))


def _straight_edges(
    facets: Facets, beside: dict[tuple[int, int], tuple[int, ...]], tolerance: float
) -> tuple[list[tuple[int, int]], dict[tuple[int, int], int]]:
    """Edges (start, end), and the edge that each piece (lower, higher point) lies on."""
    at: dict[int, list[int]] = {}
    for a, b in beside:
        at.setdefault(a, []).append(b)
        at.setdefault(b, []).append(a)
    fixed = {v for v, ends in at.items() if len(ends) != 2 or _turns(facets, beside, v, ends)}
    edges: list[tuple[int, int]] = []
    edge_of: dict[tuple[int, int], int] = {}
    for v in (*sorted(fixed), *sorted(set(at) - fixed)):
        for following in sorted(at[v]):
            if (min(v, following), max(v, following)) in edge_of:
                continue
            chain = _chain(at, fixed, v, following)
            for part in _pieces(facets, chain, tolerance):
                for a, b in zip(part, part[1:], strict=False):
                    edge_of[min(a, b), max(a, b)] = len(edges)
                edges.append((part[0], part[-1]))
    return edges, edge_of


def _turns(facets: Facets, beside: dict[tuple[int, int], tuple[int, ...]], v: int, ends: list[int]) -> bool:
    """Whether the border has a corner at v, or other patches beside it from there on."""
    a, b = ends
    if beside[min(a, v), max(a, v)] != beside[min(b, v), max(b, v)]:
        return True
    p, q = facets.points[v] - facets.points[a], facets.points[b] - facets.points[v]
    return math.atan2(float(np.linalg.norm(np.cross(p, q))), float(p @ q)) > math.radians(BEND)


def _chain(at: dict[int, list[int]], fixed: set[int], v: int, following: int) -> list[int]:
    """Points from v on to the next corner, or once around."""
    chain = [v, following]
    while chain[-1] not in fixed and chain[-1] != v:
        a, b = at[chain[-1]]
        chain.append(b if a == chain[-2] else a)
    return chain


def _pieces(facets: Facets, chain: list[int], tolerance: float) -> list[list[int]]:
    """Cut a chain where it leaves the line between its ends (Douglas and Peucker); a closed one in three first."""
    if chain[0] == chain[-1]:
        third = max(1, len(chain) // 3)
        cuts = [0, third, min(2 * third, len(chain) - 2), len(chain) - 1]
        parts = [chain[a : b + 1] for a, b in zip(cuts, cuts[1:], strict=False) if b > a]
        return [piece for part in parts for piece in _pieces(facets, part, tolerance)]
    done: list[list[int]] = []
    waiting = [chain]
    while waiting:
        part = waiting.pop()
        x = facets.points[part]
        along = x[-1] - x[0]
        off = np.linalg.norm(np.cross(x[1:-1] - x[0], along), axis=1) / max(float(np.linalg.norm(along)), 1e-300)
        if len(off) and off.max() > tolerance:
            cut = 1 + int(off.argmax())
            waiting += [part[cut:], part[: cut + 1]]
        else:
            done.append(part)
    return done


def _corner_sides(facets: Facets, triangle: Int, side: Int) -> dict[tuple[int, int], tuple[int, int]]:
    """Triangle and side of every directed border piece."""
    start = facets.triangles[triangle, side].tolist()
    end = facets.triangles[triangle, (side + 1) % 3].tolist()
    return dict(zip(zip(start, end, strict=True), zip(triangle.tolist(), side.tolist(), strict=True), strict=True))


def _loops(
    facets: Facets,
    patch: Int,
    p: int,
    pairs: set[tuple[int, int]],
    corner: dict[tuple[int, int], tuple[int, int]],
    edge_of: dict[tuple[int, int], int],
    edges: list[tuple[int, int]],
) -> tuple[tuple[Run, ...], ...]:
    """Closed loops of edges about patch p. Where loops meet in a point they go on inside the patch."""
    left = dict.fromkeys(sorted(pairs))
    loops = []
    while left:
        piece = next(iter(left))
        walk: list[Run] = []
        while piece in left:
            del left[piece]
            number = edge_of[min(piece), max(piece)]
            forward = _runs_along(facets, edges[number], piece)
            if not walk or walk[-1] != (number, forward):
                walk.append((number, forward))
            piece = _next_piece(facets, patch, p, corner[piece], pairs)
        if len(walk) > 1 and walk[0] == walk[-1]:
            walk.pop()
        loops.append(tuple(walk))
    return tuple(loops)


def _next_piece(
    facets: Facets, patch: Int, p: int, at: tuple[int, int], pairs: set[tuple[int, int]]
) -> tuple[int, int]:
    """The border piece after the one on this side of a triangle: turn about its end, through the patch."""
    t, i = at
    while True:
        i = (i + 1) % 3
        a, b = int(facets.triangles[t, i]), int(facets.triangles[t, (i + 1) % 3])
        u = int(facets.across[t, i])
        if (a, b) in pairs or u < 0:
            return a, b
        t, i = u, int(np.flatnonzero(facets.triangles[u] == b)[0])


def _runs_along(facets: Facets, edge: tuple[int, int], piece: tuple[int, int]) -> bool:
    along = facets.points[edge[1]] - facets.points[edge[0]]
    return bool((facets.points[piece[1]] - facets.points[piece[0]]) @ along > 0.0)
