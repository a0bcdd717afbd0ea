"""Chords of a boundary that cross where its curves do not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fubini.tracks import Tracks, evaluate
from fubini.triangulation.value import Boundary

Float = NDArray[np.float64]

#: Crossing chords looked at in one round.
MOST_CROSSINGS = 200


def chords_to_halve(tracks: Tracks, boundary: Boundary, unrecovered: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Segments (k,) that leave their curves most among those that cross the ``unrecovered``; of all, where none is."""
    ends = boundary.points[boundary.segments]
    sag = chord_sags(tracks, boundary)
    halve = np.zeros(len(ends), bool)
    boxes = np.concatenate([ends.min(axis=1), -ends.max(axis=1)], axis=1).T.copy()
    for k in unrecovered[:MOST_CROSSINGS].tolist() if len(unrecovered) else range(len(ends)):
        pair = np.append(crossed(ends, boxes, k), k)
        halve[pair] |= sag[pair] >= 0.25 * sag[pair].max()
    return halve


def chord_sags(tracks: Tracks, boundary: Boundary) -> Float:
    """Distance (k,) of each segment's middle from the curve at the middle parameter."""
    middle = boundary.points[boundary.segments].mean(axis=1)
    for j in np.unique(boundary.track):
        of = boundary.track == j
        middle[of] -= evaluate(tracks, int(j), boundary.t[of].mean(axis=1))
    return np.hypot(*middle.T)


def crossed(ends: Float, boxes: Float, k: int) -> NDArray[np.intp]:
    """Segments with ``ends`` (n, 2, 2) that cross or touch segment k, apart from its neighbours' shared ends.

    ``boxes`` (4, n) holds their least x and y and their largest, negative: few are near each other.
    """
    low_x, low_y, high_x, high_y = (-boxes[[2, 3, 0, 1], k]).tolist()
    near = np.flatnonzero((boxes[0] <= low_x) & (boxes[1] <= low_y) & (boxes[2] <= high_x) & (boxes[3] <= high_y))
    (a, b), p, q = ends[k], ends[near, 0], ends[near, 1]

    def side(p: Float, q: Float, r: Float) -> Float:
        u, v = q - p, r - p
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    apart = (side(a, b, p) * side(a, b, q) > 0.0) | (side(p, q, a) * side(p, q, b) > 0.0)
    joined = (p == a).all(1) | (p == b).all(1) | (q == a).all(1) | (q == b).all(1)
    return near[~apart & ~joined]
