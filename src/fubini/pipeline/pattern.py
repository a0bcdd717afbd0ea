"""The paper's own sampling: a reference set laid into every Fubini cell by Eq. (1).

Mapped points that lie on the boundary become boundary nodes at their place on the curve; mapped
points that a chord would cut off are hull nodes off the boundary, which the paper moves to the
nearest boundary point, and so become boundary nodes too. The others are interior points.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.cells import decompose
from fubini.region import Region
from fubini.sampling.boundary import EdgeNodes, Outline, sample_track
from fubini.sampling.mapping import map_points
from fubini.sampling.reference import distinct, reference_points, turn

Float = NDArray[np.float64]

#: Mapped points within this (times the diagonal) of a curve lie on it.
ON_BOUNDARY = 1e-9
#: A point this near to a chord, over the chord's length, would make a sliver with it.
TOO_NEAR = 0.2
#: Largest turning of the tangent along one boundary segment, radians.
TURN = math.pi / 3
#: Nodes on an edge nearer than this (times the edge's parameter range) are one.
SAME_NODE = 1e-9


@dataclass(frozen=True)
class PatternPoints:
    """Mapped points of one face: parameters on each of its curves (in edge direction) and the rest."""

    on_curve: tuple[Float, ...]
    inside: Float


def pattern_points(
    region: Region, outline: Outline, pattern: str, direction: str = "auto", turns: int = 0
) -> PatternPoints:
    """Map the reference set of this name into the cells of a region and sort out the boundary nodes.

    The region is sliced at every vertex, as the paper draws it, so that each limit is one smooth curve: along x, y, or
    in the ``direction`` of fewer and rounder cells ("auto"). The set is turned by so many quarter turns before, so
    that its dense side lies at the upper (0), left (1), lower (2) or right (3) limit of every cell.
    """
    reference = turn(reference_points(pattern), turns)
    cells = decompose(region, direction, at_vertices=True)
    return settle_points(np.concatenate([map_points(cell, reference) for cell in cells]), region, outline)


def settle_points(mapped: Float, region: Region, outline: Outline) -> PatternPoints:
    """Sort mapped points (n, 2) of all cells into boundary nodes and interior points."""
    points, _ = distinct(mapped, ON_BOUNDARY * region.diagonal)
    curves = [curve for loop in region.loops for curve in loop.curves]
    on_curve, inside = _sort_out(points, curves, outline, ON_BOUNDARY * region.diagonal)
    while True:
        near = _cut_off(inside, curves, outline, on_curve)
        if not near.any():
            return PatternPoints(tuple(on_curve), inside)
        moved, _ = _sort_out(inside[near], curves, outline, np.inf)
        on_curve = [np.union1d(a, b) for a, b in zip(on_curve, moved, strict=True)]
        inside = inside[~near]


def pattern_nodes(edges: int, outlines: Sequence[Outline], points: list[PatternPoints]) -> EdgeNodes:
    """Nodes of all edges: what the faces beside each edge put on it, and its ends.

    A straight edge takes the nodes of the face that puts most on it: graded sets of two faces do not
    match, and their union would hold nodes next to each other. A curved one takes the union, since no
    face's points may be cut off by longer chords than its own.
    """
    on_edge = [np.array([0.0, 1.0]) for _ in range(edges)]
    for outline, of_face in zip(outlines, points, strict=True):
        for e, kind, t in zip(outline.edges, outline.tracks.kinds, of_face.on_curve, strict=True):
            own = np.union1d([0.0, 1.0], t)
            if kind != 0:
                on_edge[e] = np.union1d(on_edge[e], own)
            elif len(own) > len(on_edge[e]):
                on_edge[e] = own
    for outline in outlines:
        for a, b in itertools.pairwise(outline.loop_first.tolist()):
            for j in range(a, b):
                least = max(_least_segments(outline, j), 3 if b - a == 1 else 1)
                e = outline.edges[j]
                if len(on_edge[e]) <= least:
                    on_edge[e] = np.union1d(on_edge[e], np.linspace(0.0, 1.0, least + 1))
    on_edge = [_spaced(t) for t in on_edge]
    first = np.zeros(edges + 1, np.int64)
    np.cumsum([len(t) for t in on_edge], out=first[1:])
    return EdgeNodes(first, np.concatenate(on_edge))


def _least_segments(outline: Outline, j: int) -> int:
    """Segments that curve j needs so that none turns by more than ``TURN``; two on any curved one."""
    if outline.tracks.kinds[j] == 0:
        return 1
    _, s, h = sample_track(outline.tracks, j, TURN, outline.grain)
    return max(2, math.ceil(float(np.sum(np.diff(s) / h[1:])) - 1e-6))


def _spaced(t: Float) -> Float:
    """Drop parameters that repeat the one before; the ends stay 0 and 1."""
    keep = np.concatenate([[True], np.diff(t) > SAME_NODE])
    t = t[keep & (t > SAME_NODE) & (t < 1.0 - SAME_NODE)]
    return np.concatenate([[0.0], t, [1.0]])


def _sort_out(points: Float, curves: list, outline: Outline, reach: float) -> tuple[list[Float], Float]:
    """Parameters (edge direction) of the points nearest to each curve within reach, and the other points."""
    best = np.full(len(points), np.inf)
    owner = np.full(len(points), -1)
    params = np.zeros(len(points))
    for j, curve in enumerate(curves):
        t, distance = curve.closest(points)
        better = distance < best
        best[better], owner[better], params[better] = distance[better], j, t[better]
    on = best <= reach
    found = []
    for j in range(len(curves)):
        t = params[on & (owner == j)]
        found.append(np.sort(t if outline.forward[j] else 1.0 - t))
    return found, points[~on]


def _cut_off(inside: Float, curves: list, outline: Outline, on_curve: list[Float]) -> NDArray[np.bool_]:
    """Which interior points lie beyond a chord of the boundary, or so near that they would make a sliver."""
    near = np.zeros(len(inside), bool)
    for curve, along, t in zip(curves, outline.forward, on_curve, strict=True):
        params = np.union1d(t if along else 1.0 - t, [0.0, 1.0])
        nodes = curve.point(params)
        for a, b in itertools.pairwise(nodes):
            d = b - a
            length = float(np.hypot(*d))
            if length == 0.0:
                continue
            along_chord = (inside - a) @ d / length**2
            height = ((inside - a) @ np.array([-d[1], d[0]])) / length
            bulge = np.abs((curve.point(np.linspace(0.0, 1.0, 9)) - a) @ np.array([-d[1], d[0]])).max() / length
            near |= (along_chord > 0) & (along_chord < 1) & (height < TOO_NEAR * length) & (height > -1.01 * bulge)
    return near
