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
    for k in unrecovered[:MOST_CROSSINGS].tolist() if len(unrecovered) else range(len(ends)):
        pair = np.append(np.flatnonzero(crossed(ends, k)), k)
        halve[pair] |= sag[pair] >= 0.25 * sag[pair].max()
    return halve


def chord_sags(tracks: Tracks, boundary: Boundary) -> Float:
    """Distance (k,) of each segment's middle from the curve at the middle parameter."""
    middle = boundary.points[boundary.segments].mean(axis=1)
    for j in np.unique(boundary.track):
        of = boundary.track == j
        middle[of] -= evaluate(tracks, int(j), boundary.t[of].mean(axis=1))
    return np.hypot(*middle.T)


def crossed(ends: Float, k: int) -> NDArray[np.bool_]:
    """Which segments with ``ends`` (n, 2, 2) cross or touch segment k, apart from its neighbours' shared ends."""
    a, b = ends[k]

    def side(p: Float, q: Float, r: Float) -> Float:
        u, v = q - p, r - p
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    p, q = ends[:, 0], ends[:, 1]
    apart = (side(a, b, p) * side(a, b, q) > 0.0) | (side(p, q, a) * side(p, q, b) > 0.0)
    apart |= (np.maximum(p, q) < np.minimum(a, b)).any(axis=1) | (np.minimum(p, q) > np.maximum(a, b)).any(axis=1)
    joined = (p == a).all(1) | (p == b).all(1) | (q == a).all(1) | (q == b).all(1)
    return ~apart & ~joined
