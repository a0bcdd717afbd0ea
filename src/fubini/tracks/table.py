"""The table of tracks, its builder, and its evaluation from Python."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini._packed import words_of

LINE, CONIC, RATIONAL = 0, 1, 2


class _Table(NamedTuple):
    """The arrays of ``Tracks``."""

    kinds: NDArray[np.int32]
    offsets: NDArray[np.int32]
    data: NDArray[np.float64]


class Tracks(_Table):
    """All tracks of one region: ``kinds`` (k,) int32, ``offsets`` (k,) int32 into ``data`` (.,) float64.

    The data of a track starts with its exact ends ``x0 y0 x1 y1``, returned as stored at t = 0 and
    t = 1, and goes on by kind:

    - ``LINE``: nothing more; ``(1 - t) p0 + t p1``.
    - ``CONIC``: ``cx cy ax ay bx by u0 u1``; ``c + a cos u + b sin u``, ``u = u0 + t (u1 - u0)``.
    - ``RATIONAL``: ``pieces degree``, then ``pieces + 1`` breaks from 0 to 1, then for each piece
      ``degree + 1`` homogeneous control points ``w x, w y, w`` of a Bezier piece.
    """

    @functools.cached_property
    def words(self) -> NDArray[np.int64]:
        """See ``fubini._packed``."""
        return words_of(self, "i i d")


class TrackBuilder:
    """Collects tracks one by one; ``build`` freezes them."""

    def __init__(self) -> None:
        self._kinds: list[int] = []
        self._offsets: list[int] = []
        self._data: list[float] = []

    def __len__(self) -> int:
        return len(self._kinds)

    def add(self, kind: int, start: ArrayLike, end: ArrayLike, *rest: ArrayLike) -> int:
        """Append a track of this kind and return its number; ``rest`` is flattened in order."""
        numbers: list[float] = []
        for part in (start, end, *rest):
            numbers += np.asarray(part, float).ravel().tolist()
        return self.append(kind, numbers)

    def append(self, kind: int, numbers: list[float]) -> int:
        """As ``add``, with all numbers of the track in one list, its ends first."""
        self._kinds.append(kind)
        self._offsets.append(len(self._data))
        self._data += numbers
        return len(self._kinds) - 1

    def build(self) -> Tracks:
        """The finished table (left writable: compiled code takes one array type only)."""
        return Tracks(
            np.array(self._kinds, np.int32),
            np.array(self._offsets, np.int32),
            np.array(self._data, np.float64),
        )


#: For triangulations whose boundary lies on no curves, or is not to move along them.
NO_TRACKS = TrackBuilder().build()


def evaluate(tracks: Tracks, track: ArrayLike, t: ArrayLike) -> NDArray[np.float64]:
    """Points (n, 2) at parameters ``t`` (n,) of tracks ``track`` (n,)."""
    from fubini.tracks._kernels import evaluate_many

    which = np.atleast_1d(np.asarray(track, np.int32))
    params = np.atleast_1d(np.asarray(t, np.float64))
    if which.shape != params.shape:
        which, params = np.broadcast_arrays(which, params)
    out = np.empty((len(params), 2))
    evaluate_many(*tracks, np.ascontiguousarray(which), np.ascontiguousarray(params), out)
    return out


def joined(parts: list[Tracks]) -> Tracks:
    """Tables one behind the other; the only one as it is."""
    if len(parts) == 1:
        return parts[0]
    start = np.cumsum([0, *(len(part.data) for part in parts[:-1])]).tolist()
    return Tracks(
        np.concatenate([part.kinds for part in parts]),
        np.concatenate([part.offsets + np.int32(at) for part, at in zip(parts, start, strict=True)]),
        np.concatenate([part.data for part in parts]),
    )


def rounded(tracks: Tracks, length: float, bits: int) -> Tracks:
    """The same tracks with lengths rounded to ``length`` / 2^bits, angles to 1 / 2^bits and weights to as many bits.

    ``length`` is taken down to a power of two, so that scaling by powers of two commutes with it. Angles on arcs larger
    than that, and breaks of curves that run faster, are rounded to what moves a point by no more: on an arc all but
    straight, or between weights of very different size, they would take it far along. Of rational curves the control
    points are rounded, not what stands in the table: where only small weights count they would go astray.
    """
    unit = 2.0**-bits
    coordinate = unit * 2.0 ** math.floor(math.log2(length))
    near = np.rint(tracks.data / coordinate)
    near *= coordinate
    arcs = tracks.offsets[tracks.kinds == CONIC]
    if len(arcs):
        angles, rows = arcs[:, None] + [10, 11], arcs[:, None]
        radius = np.hypot(tracks.data[rows + [6, 8]], tracks.data[rows + [7, 9]]).max(axis=1, keepdims=True)
        step = np.minimum(unit, coordinate * np.exp2(-np.ceil(np.log2(radius))))
        near[angles] = np.rint(tracks.data[angles] / step) * step
    for o in tracks.offsets[tracks.kinds == RATIONAL].tolist():
        pieces, degree = int(tracks.data[o + 4]), int(tracks.data[o + 5])
        first = o + 7 + pieces
        poles = slice(first, first + 3 * pieces * (degree + 1))
        given = tracks.data[poles].reshape(-1, 3)
        breaks = tracks.data[o + 6 : first]
        step = min(unit, coordinate * 2.0 ** -math.ceil(math.log2(top_speed(breaks, given.reshape(pieces, -1, 3)))))
        near[o + 6 : first] = np.rint(breaks / step) * step
        mantissa, exponent = np.frexp(given[:, 2:])
        weights = np.ldexp(np.rint(mantissa / unit) * unit, exponent)
        placed = np.rint(given[:, :2] / given[:, 2:] / coordinate) * coordinate
        near[poles] = np.column_stack([placed * weights, weights]).ravel()
    return tracks._replace(data=near)


def top_speed(breaks: NDArray[np.float64], poles: NDArray[np.float64]) -> float:
    """How fast rational Bezier pieces may run: length over parameter, but for a factor of about two.

    ``breaks`` (p + 1,), homogeneous control points ``poles`` (p, degree + 1, 3). Between two control points a curve
    runs where their weights, times powers of the parameter, are equal: faster by their ratio.
    """
    weights, degree = poles[:, :, 2], poles.shape[1] - 1
    ratio = weights[:, 1:] / weights[:, :-1]
    steps = np.diff(poles[:, :, :2] / poles[:, :, 2:], axis=1)
    run = np.hypot(steps[:, :, 0], steps[:, :, 1]) * np.maximum(ratio, 1.0 / ratio)
    return float((degree * run.max(axis=1) / np.diff(breaks)).max()) or 1.0
