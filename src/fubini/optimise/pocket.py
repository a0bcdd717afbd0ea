"""A pocket: a few triangles taken out as a region of their own, to be meshed anew and put back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini.tracks import Tracks, evaluate
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.value import FREE, FROZEN, LOCKED, ON_CURVE, Boundary, Triangulation

Float = NDArray[np.float64]
Index = NDArray[np.intp]

#: A node slides no nearer to the ends of its segments than this share of them.
LEAST_SHARE = 0.1


@dataclass(frozen=True)
class Pocket:
    """Triangles of a larger triangulation with everything on their rim locked.

    Attributes
    ----------
    whole : what it was taken out of.
    rows : (m,) its triangles there, ascending.
    nodes : (n,) its nodes there, those on the rim first.
    triangulation : of the pocket alone, in its own numbers.
    outside : (k,) triangles of the whole beyond each segment of the rim; -1 - s where that is boundary segment s.
    """

    whole: Triangulation
    rows: Index
    nodes: Index
    triangulation: Triangulation
    outside: NDArray[np.int32]

    @classmethod
    def around(cls, whole: Triangulation, seeds: list[int], rings: int, blocked: set[int]) -> Pocket:
        """The triangles up to ``rings`` edges away from the ``seeds`` (which are not blocked), none of the blocked."""
        seen, front = set(seeds), seeds
        for _ in range(rings):
            beside = {u for t in front for u in whole.neighbours[t].tolist() if u >= 0}
            front = sorted(beside - seen - blocked)
            seen.update(front)
        return cls._of(whole, np.array(sorted(seen)))

    @classmethod
    def _of(cls, whole: Triangulation, rows: Index) -> Pocket:
        corners, beyond = whole.triangles[rows], whole.neighbours[rows]
        place = np.full(len(whole.triangles), -1, np.int32)
        place[rows] = np.arange(len(rows), dtype=np.int32)
        neighbours = np.where(beyond >= 0, place.take(beyond, mode="clip"), np.int32(-1))
        row, side = np.nonzero(neighbours < 0)
        ends = np.stack([corners[row, (side + 1) % 3], corners[row, (side + 2) % 3]], axis=1)
        here, on_rim = np.zeros((2, len(whole.points)), bool)
        here[corners] = on_rim[ends] = True
        first = len(whole.boundary.points)  # nodes of the boundary are on the rim even where on no segment
        on_rim[:first] = here[:first]
        rim = np.flatnonzero(on_rim)
        nodes = np.concatenate([rim, np.flatnonzero(here & ~on_rim)])
        number = np.empty(len(whole.points), np.int32)
        number[nodes] = np.arange(len(nodes), dtype=np.int32)
        segments = number[ends]
        neighbours[row, side] = -1 - np.arange(len(row), dtype=np.int32)
        points = whole.points[nodes]
        own = Triangulation(points, number[corners], neighbours, _locked(points[: len(rim)], segments))
        return cls(whole, rows, nodes, own, beyond[row, side])

    @property
    def rim(self) -> int:
        """Number of nodes on the rim."""
        return len(self.triangulation.boundary.points)

    def sliding(self) -> list[tuple[int, int, int]]:
        """Nodes of the rim that may slide along their curves: own number, boundary segment before, and after."""
        whole, own = self.whole.boundary, self.triangulation.boundary.segments
        before, after = {}, {}
        for k in np.flatnonzero(self.outside < 0).tolist():
            before[int(own[k, 1])] = after[int(own[k, 0])] = -1 - int(self.outside[k])
        found = []
        for v in sorted(before.keys() & after.keys()):
            s, r = before[v], after[v]
            same = whole.track[s] == whole.track[r] >= 0 and whole.t[s, 1] == whole.t[r, 0]
            if same and whole.kind[self.nodes[v]] == ON_CURVE and whole.mode[s] == whole.mode[r] == FREE:
                found.append((v, s, r))
        return found

    def remeshed(self, inner: Float, moved: tuple[int, Float] | None = None) -> Triangulation | None:
        """The pocket with other points inside; ``moved``: a node of the rim and its place. None where that fails."""
        boundary = self.triangulation.boundary
        if moved is not None:
            points = boundary.points.copy()
            points[moved[0]] = moved[1]
            boundary = replace(boundary, points=points)
        found = constrained_delaunay(np.concatenate([boundary.points, inner]), boundary)
        return None if len(found.unrecovered) or len(found.dropped) else found

    def put_back(self, new: Triangulation, slid: tuple[int, int, int, float] | None = None) -> Triangulation:
        """The whole with this triangulation in the place of the pocket's.

        slid : own number of a node that slid, the boundary segments before and after it, and its new parameter.
        """
        whole, rim = self.whole, self.rim
        stays, kept = np.ones(len(whole.points), bool), np.ones(len(whole.triangles), bool)
        stays[self.nodes[rim:]], kept[self.rows] = False, False
        number, row = (np.cumsum(mask, dtype=np.int32) - np.int32(1) for mask in (stays, kept))
        points = np.concatenate([without(whole.points, self.nodes[rim:]), new.points[rim:]])
        names = np.concatenate([number[self.nodes[:rim]], np.arange(number[-1] + 1, len(points), dtype=np.int32)])
        triangles = np.concatenate([number[without(whole.triangles, self.rows)], names[new.triangles]])
        first = int(row[-1]) + 1
        old, fresh = without(whole.neighbours, self.rows), new.neighbours.copy()
        old = np.where(old >= 0, row.take(old, mode="clip"), old)
        fresh[fresh >= 0] += first
        at, side = np.nonzero(new.neighbours < 0)
        beyond = self.outside[-1 - new.neighbours[at, side]]
        fresh[at, side] = np.where(beyond >= 0, row[np.maximum(beyond, 0)], beyond)
        ends = names[new.triangles[at, (side + 1) % 3]], names[new.triangles[at, (side + 2) % 3]]
        for t, u, a, b in zip(at + first, fresh[at, side], *ends, strict=True):
            if u >= 0:  # the edge runs from b to a there
                i = next(i for i in range(3) if triangles[u, (i + 1) % 3] == b and triangles[u, (i + 2) % 3] == a)
                old[u, i] = t
        boundary = whole.boundary
        if slid is not None:
            v, s, r, parameter = slid
            places, params = boundary.points.copy(), boundary.t.copy()
            places[self.nodes[v]] = points[self.nodes[v]] = new.points[v]
            params[s, 1] = params[r, 0] = parameter
            boundary = replace(boundary, points=places, t=params)
        neighbours = np.concatenate([old, fresh])
        return Triangulation(points, triangles, neighbours, boundary, whole.unrecovered)


def without(values: NDArray[Any], rows: Index) -> NDArray[Any]:
    """The array without these few rows, ascending: what lies between them is copied as it stands."""
    ends = np.append(rows, len(values)).tolist()
    return np.concatenate([values[a:b] for a, b in zip([0, *(r + 1 for r in ends[:-1])], ends, strict=True)])


def slides(whole: Boundary, tracks: Tracks, s: int, r: int, share: float) -> tuple[float, Float]:
    """Parameter and place of the node between segments s and r, moved by a share of the segment on that side."""
    a, t, b = whole.t[s, 0], whole.t[s, 1], whole.t[r, 1]
    share = max(LEAST_SHARE - 1.0, min(1.0 - LEAST_SHARE, share))
    new = float(t + share * ((b - t) if share > 0.0 else (t - a)))
    return new, evaluate(tracks, int(whole.track[s]), new)[0]


def _locked(points: Float, segments: NDArray[np.int32]) -> Boundary:
    """The boundary of a pocket: nothing on it may change."""
    n, k = len(points), len(segments)
    length = np.hypot(*(points[segments[:, 1]] - points[segments[:, 0]]).T)
    count = np.bincount(segments.ravel(), minlength=n)
    size = np.where(
        count > 0, np.bincount(segments.ravel(), np.repeat(length, 2), n) / np.maximum(count, 1), length.mean()
    )
    return Boundary(
        points, np.full(n, FROZEN, np.uint8), size, np.full(n, 180.0), segments,
        np.full(k, -1, np.int32), np.zeros((k, 2)), np.full(k, LOCKED, np.uint8),
    )  # fmt: skip
