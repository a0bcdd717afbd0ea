"""Corners of which both edges start with a segment that may not be split: their one triangle, an ear, is known.

It is cut off before the face is meshed, its base a locked segment of no track, and put back afterwards: what is left
has no sharp corner there, and no move can put a second triangle into it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fubini.optimise import OptimiseOutcome
from fubini.quality import corner_limit, flawed
from fubini.sampling.ratios import SHARP
from fubini.triangulation.value import CORNER, FROZEN, LOCKED, Boundary, Triangulation

Int = NDArray[np.intp]

#: Legs that differ by more than this are no pair.
EVEN = 3.5
#: No corner to be cut off.
NO_EARS: Int = np.empty((0, 2), np.intp)


def find_ears(boundary: Boundary, min_skew: float, max_aspect_ratio: float) -> Int:
    """Segments (e, 2) that reach and leave the corners of a face to be cut off.

    A leg of an ear is locked; its triangle is valid unless the corner is too sharp for that.
    """
    segments, n = boundary.segments, len(boundary.points)
    sharp = np.flatnonzero((boundary.kind == CORNER) & (boundary.angle < SHARP))
    locked = boundary.mode == LOCKED
    if not len(sharp) or not locked.any():
        return NO_EARS
    leaving, reaching = np.full((2, n), -1, np.intp)
    leaving[segments[:, 0]] = reaching[segments[:, 1]] = np.arange(len(segments))
    limit, out, used = corner_limit(min_skew, max_aspect_ratio), [], np.zeros(n, bool)
    for v in sharp.tolist():
        s, r = int(reaching[v]), int(leaving[v])
        p, q = int(segments[s, 0]), int(segments[r, 1])
        narrow = boundary.angle[v] < limit
        if not (locked[s] or locked[r]) or used[[p, v, q]].any() or segments[leaving[q], 1] == p:
            continue
        ear = boundary.points[[p, v, q]]
        (ux, uy), (vx, vy) = ear[2] - ear[1], ear[0] - ear[1]
        legs = sorted([np.hypot(ux, uy), np.hypot(vx, vy)])
        if ux * vy <= uy * vx or legs[1] > EVEN * legs[0]:
            continue
        if not narrow and flawed(ear[None], min_skew, max_aspect_ratio)[0]:
            continue
        out.append((s, r))
        used[[p, v, q]] = True
    return np.array(out, np.intp).reshape(-1, 2)


def without_ears(boundary: Boundary, ears: Int) -> Boundary:
    """The boundary with one locked segment of no track in place of both legs of every ear."""
    reach, leave = ears.T
    n, segments = len(boundary.points), boundary.segments.copy()
    segments[reach, 1] = segments[leave, 1]
    track, t, mode = boundary.track.copy(), boundary.t.copy(), boundary.mode.copy()
    track[reach], t[reach], mode[reach] = -1, 0.0, LOCKED
    kept = np.ones(len(segments), bool)
    kept[leave] = False
    nodes = np.ones(n, bool)
    nodes[boundary.segments[leave, 0]] = False
    kind, size = boundary.kind.copy(), boundary.size.copy()
    ends = segments[reach].ravel()
    kind[ends[kind[ends] != CORNER]] = FROZEN
    number = (np.cumsum(nodes) - 1).astype(np.int32)
    points = boundary.points
    _between(points, segments[kept], ends, size)
    return Boundary(
        points[nodes], kind[nodes], size[nodes], boundary.angle[nodes], number[segments[kept]], track[kept], t[kept],
        mode[kept],
    )  # fmt: skip


def _between(points: NDArray[np.float64], segments: NDArray[np.int32], ends: Int, size: NDArray[np.float64]) -> None:
    """Sizes of the ``ends`` of bases: between the lengths of the segments there, in place."""
    length = np.hypot(*(points[segments[:, 1]] - points[segments[:, 0]]).T)
    product = np.ones(len(points))
    for side in (0, 1):
        np.multiply.at(product, segments[:, side], length)
    size[ends] = np.sqrt(product[ends])


def with_ears(outcome: OptimiseOutcome, whole: Boundary, ears: Int) -> OptimiseOutcome:
    """The outcome of a face without its ears, with them: their corners come first."""
    found, (reach, leave) = outcome.triangulation, ears.T
    count, old = len(ears), outcome.triangulation.boundary
    number = {place: v for v, place in enumerate(map(tuple, old.points.tolist()))}
    ends = [[number[tuple(whole.points[v].tolist())] for v in row]
            for row in zip(whole.segments[reach, 0], whole.segments[leave, 1], strict=True)]  # fmt: skip
    row = {(int(a), int(b)): s for s, (a, b) in enumerate(old.segments.tolist())}
    bases = np.array([row[p, q] for p, q in ends], np.intp)
    k, apex = len(old.segments), np.arange(count, dtype=np.int32)
    p, q = (np.array(ends, np.int32) + count).T
    segments = np.concatenate([old.segments + np.int32(count), np.column_stack([apex, q])])
    segments[bases] = np.column_stack([p, apex])
    order = np.argsort(np.concatenate([np.arange(k), bases + 0.5]), kind="stable")
    place = np.empty(k + count, np.intp)
    place[order] = np.arange(k + count)
    corner = whole.segments[leave, 0]

    def rows(ours: NDArray, theirs: NDArray) -> NDArray:
        """Values of segments, in their new order."""
        joined = np.concatenate([ours, theirs[leave]])
        joined[bases] = theirs[reach]
        return joined[order]

    boundary = Boundary(
        np.concatenate([whole.points[corner], old.points]), np.concatenate([whole.kind[corner], old.kind]),
        np.concatenate([whole.size[corner], old.size]), np.concatenate([whole.angle[corner], old.angle]),
        segments[order], rows(old.track, whole.track), rows(old.t, whole.t), rows(old.mode, whole.mode),
    )  # fmt: skip
    m, neighbours = len(found.triangles), found.neighbours.copy()
    ears_there = np.full(k, -1, np.int32)
    ears_there[bases] = m + apex
    outside = neighbours < 0
    s = -1 - neighbours[outside]
    neighbours[outside] = np.where(ears_there[s] >= 0, ears_there[s], -1 - place[s])
    beside = np.array([np.flatnonzero((found.neighbours == -1 - b).any(axis=1))[0] for b in bases], np.int32)
    triangulation = Triangulation(
        np.concatenate([whole.points[corner], found.points]),
        np.concatenate([found.triangles + np.int32(count), np.column_stack([apex, q, p])]),
        np.concatenate([neighbours, np.column_stack([beside, -1 - place[bases], -1 - place[k:]])]).astype(np.int32),
        boundary,
    )
    return outcome.on(triangulation)


__all__ = ["NO_EARS", "find_ears", "with_ears", "without_ears"]
