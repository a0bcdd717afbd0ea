"""One face as the boundary discretisation sees it: its curves as flat tracks."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.curves import Curve, track
from fubini.region import Region
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
    along the edge, ``angles`` (c,) holds the interior angle in degrees at the start of curve j, and
    ``loop_first`` (l + 1,) delimits the loops. Edges inside the face follow the outline: each is a loop of
    two curves, there and back, from curve ``inner`` on.
    """

    tracks: Tracks
    exact: Tracks
    loop_first: NDArray[np.int64]
    edges: NDArray[np.int64]
    forward: NDArray[np.bool_]
    angles: Float
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
        for curve, edge in inner:
            for along in (True, False):
                track(builder, curve)
                edges.append(edge_number(edge))
                forward.append(along)
            first.append(len(edges))
        angles = np.full(len(edges), 180.0)
        for corner in region.corners():
            angles[first[corner.loop] + corner.index] = corner.angle
        exact = builder.build()
        coarse = rounded(exact, region.diagonal, GRID_BITS)
        return cls(
            coarse, exact, np.array(first), np.array(edges, np.int64), np.array(forward), np.round(angles, 6), bounding
        )

    def pairs(self) -> list[tuple[int, int]]:
        """For every curve its number and that of the curve before it in its loop."""
        pairs = []
        for a, b in itertools.pairwise(self.loop_first.tolist()):
            pairs += [(c, c - 1 if c > a else b - 1) for c in range(a, b)]
        return pairs
