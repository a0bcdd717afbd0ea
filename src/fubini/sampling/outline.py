"""One face as the boundary discretisation sees it: its curves as flat tracks."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.curves import Curve, track
from fubini.region import Region
from fubini.region.corners import interior_angle
from fubini.tracks import TrackBuilder, Tracks, rounded

Float = NDArray[np.float64]

#: Decisions are taken on coordinates rounded to the diagonal over two to this.
GRID_BITS = 32


@dataclass(frozen=True)
class Outline:
    """One face as the boundary discretisation sees it: its curves as tracks, in loop order.

    ``exact`` holds the curves as they are, ``tracks`` the same rounded to ``GRID_BITS``: decisions are
    taken on rounded curves, so that models that differ by rounding alone (a live object and its STEP
    file) get the same mesh; positions come from the exact ones. Track j is curve j in the direction
    of its edge. ``edges`` (c,) numbers the model's edges, ``forward`` (c,) tells whether the loop runs
    along the edge, ``angles`` (c,) holds the interior angle in degrees at the start of curve j, to the left of
    it up to the curve ``before[j]`` that arrives there, and ``loop_first`` (l + 1,) delimits the loops. Edges inside
    the face follow the outline: each is a loop of two curves, there and back, from curve ``inner`` on; where they
    meet the outline or each other, the angle is that of the sector between neighbours.
    """

    tracks: Tracks
    exact: Tracks
    loop_first: NDArray[np.int64]
    edges: NDArray[np.int64]
    forward: NDArray[np.bool_]
    angles: Float
    before: NDArray[np.int64]
    inner: int

    @classmethod
    def of(cls, region: Region, edge_number: Callable[[int], int], inner: Iterable[tuple[Curve, int]] = ()) -> Outline:
        """Outline of a region; ``edge_number`` turns its edge ids, and those of ``inner`` edges, into numbers."""
        builder = TrackBuilder()
        edges, forward, first = [], [], [0]
        for loop in region.loops:
            for curve, edge, along in zip(loop.curves, loop.edges, loop.forward, strict=True):
                track(builder, curve, backwards=not along)
                edges.append(edge_number(edge))
                forward.append(along)
            first.append(len(edges))
        bounding = len(edges)
        curves = list(region.curves)
        for curve, edge in inner:
            curves += [curve, curve.reverse()]
            for along in (True, False):
                track(builder, curve)
                edges.append(edge_number(edge))
                forward.append(along)
            first.append(len(edges))
        angles = np.full(len(edges), 180.0)
        for corner in region.corners():
            angles[first[corner.loop] + corner.index] = corner.angle
        before = [c - 1 if c > a else b - 1 for a, b in itertools.pairwise(first) for c in range(a, b)]
        for c, arriving, angle in sectors(curves, bounding):
            before[c], angles[c] = arriving, angle
        exact = builder.build()
        coarse = rounded(exact, region.diagonal, GRID_BITS)
        return cls(
            coarse, exact, np.array(first), np.array(edges, np.int64), np.array(forward), np.round(angles, 6),
            np.array(before, np.int64), bounding,
        )  # fmt: skip

    def pairs(self) -> list[tuple[int, int]]:
        """For every curve its number and that of the curve on the other side of the corner at its start."""
        return list(enumerate(self.before.tolist()))


def sectors(curves: Sequence[Curve], bounding: int) -> list[tuple[int, int, float]]:
    """Corners that edges inside a face make: curve that leaves, curve that arrives, angle between them in degrees.

    The region lies on the left of all ``curves``; from number ``bounding`` on they come in pairs, there and back. Ends
    of an edge where nothing else is are left out.
    """
    ends = {tuple(c.start.tolist()) for c in curves[bounding:]}
    leaving: dict[tuple[float, ...], list[int]] = {}
    arriving: dict[tuple[float, ...], list[int]] = {}
    for c, curve in enumerate(curves if ends else ()):
        start, end = tuple(curve.start.tolist()), tuple(curve.end.tolist())
        if start in ends:
            leaving.setdefault(start, []).append(c)
        if end in ends:
            arriving.setdefault(end, []).append(c)
    found = []
    for place, out in leaving.items():
        for c in out if len(out) > 1 else ():
            twin = bounding + ((c - bounding) ^ 1) if c >= bounding else -1
            angle, b = min((interior_angle(curves[b], curves[c]), b) for b in arriving[place] if b != twin)
            found.append((c, b, angle))
    return found
