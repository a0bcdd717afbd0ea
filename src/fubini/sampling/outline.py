"""One face as the boundary discretisation sees it: its curves as flat tracks."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fubini.curves import Curve, track
from fubini.errors import GeometryError
from fubini.region import Region
from fubini.region.corners import interior_angle
from fubini.region.region import GRID_BITS
from fubini.tracks import TrackBuilder, Tracks, joined, rounded
from fubini.triangulation.value import Boundary

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Outline:
    """One face as the boundary discretisation sees it: its curves as tracks, in loop order.

    ``exact`` holds the curves as they are, ``tracks`` the same rounded (``Region.rounded_tracks``): decisions are
    taken on rounded curves, so that models that differ by rounding alone (a live object and its STEP
    file) get the same mesh; positions come from the exact ones. Track j is curve j in the direction
    of its edge. ``edges`` (c,) numbers the model's edges, ``forward`` (c,) tells whether the loop runs
    along the edge, ``angles`` (c,) holds the interior angle in degrees at the start of curve j, to the left of
    it up to the curve ``before[j]`` that arrives there, and ``loop_first`` (l + 1,) delimits the loops. Edges inside
    the face follow the outline: each is a loop of two curves, there and back, from curve ``inner`` on; where they
    meet the outline or each other, the angle is that of the sector between neighbours. ``grain`` is the length that
    coordinates of ``tracks`` are rounded to.
    """

    tracks: Tracks
    exact: Tracks
    loop_first: NDArray[np.int64]
    edges: NDArray[np.int64]
    forward: NDArray[np.bool_]
    angles: Float
    before: NDArray[np.int64]
    inner: int
    grain: float

    @classmethod
    def of(cls, region: Region, edge_number: Callable[[int], int], inner: Iterable[tuple[Curve, int]] = ()) -> Outline:
        """Outline of a region; ``edge_number`` turns its edge ids, and those of ``inner`` edges, into numbers."""
        edges = np.array([edge_number(edge) for edge in region.edges], np.int64)
        layout = region.layout
        outline = cls(
            region.rounded_tracks, region.tracks, layout.loop_first, edges, layout.forward,
            np.round(region.corner_angles, 6), layout.before, len(edges), region.diagonal * 2.0**-GRID_BITS,
        )  # fmt: skip
        inside = [(curve, edge_number(edge)) for curve, edge in inner]
        outline = outline._with_edges(region, inside) if inside else outline
        _ = outline.tracks.words  # derived with all else that no size changes
        return outline

    @functools.cached_property
    def sharpest(self) -> float:
        """Least angle of the corners, degrees."""
        return float(np.minimum.reduce(self.angles))

    def _with_edges(self, region: Region, inside: list[tuple[Curve, int]]) -> Outline:
        """The same with edges inside the face: curves and numbers of edges."""
        builder = TrackBuilder()
        for curve, _ in inside:
            for _way in (0, 1):
                track(builder, curve)
        exact = joined([self.exact, builder.build()])
        edges = np.repeat([edge for _, edge in inside], 2)
        last = self.inner + len(edges)
        first = np.concatenate([self.loop_first, np.arange(self.inner + 2, last + 1, 2)])
        angles = np.concatenate([self.angles, np.full(len(edges), 180.0)])
        before = np.concatenate([self.before, self.inner + (np.arange(len(edges)) ^ 1)])
        curves = [*region.curves, *(way for curve, _ in inside for way in (curve, curve.reverse()))]
        for c, arriving, angle in sectors(curves, self.inner):
            before[c], angles[c] = arriving, round(angle, 6)
        return replace(
            self, tracks=rounded(exact, region.diagonal, GRID_BITS), exact=exact, loop_first=first,
            edges=np.concatenate([self.edges, edges]), angles=angles, before=before,
            forward=np.concatenate([self.forward, np.tile([True, False], len(inside))]),
        )  # fmt: skip

    def crossing(self, boundary: Boundary, segment: int) -> GeometryError:
        """The error that tells that this segment of a boundary of the face cannot be an edge of triangles."""
        track, at = int(boundary.track[segment]), boundary.points[boundary.segments[segment, 0]]
        edge = int(self.edges[track]) if track >= 0 else None
        return GeometryError("the boundary crosses or touches itself", edge=edge, at=at)

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
