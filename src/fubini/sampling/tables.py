"""Tables of the size wanted along the edges of a model."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini._values import value
from fubini.sampling import _kernels_samples as kernels
from fubini.sampling.network import Network
from fubini.sampling.outline import Outline
from fubini.tracks import Tracks, evaluate

Float = NDArray[np.float64]
Int = NDArray[np.int64]
#: Rows of the pool of tables that are free at first, and that it grows by at least.
SPARE = 1024
#: Curves turn by rounding alone over so many steps that their coordinates are rounded to.
BLUR = 64.0
#: t, s, h (n,) of one edge.
Table = tuple[Float, Float, Float]


@value(frozen=True)
class SizeOptions:
    """How large boundary segments may be.

    Attributes
    ----------
    size : asked edge length, model units.
    gradient : growth of the size with distance; 0.35 keeps neighbours within a factor of about 1.5.
    turn : largest turning of the tangent along one segment, radians.
    gap : size over the width of a gap; 2 / sqrt(3) makes one row of equilateral triangles.
    edge_size : asked size on single edges, by edge number.
    edge_segments : least number of segments on single edges, by edge number.
    vertex_size : asked size at single vertices, by vertex number.
    chord_tolerance : largest distance of a segment from its curve; None for no limit.
    keep_turn : never let rounding to whole segments exceed ``turn``.
    fields : for each face the size at plane coordinates (n, 2), or None.
    rounds : budget of gap detections.
    smallest : sizes below this (times the asked size) are not followed any further.
    most : budget of boundary nodes of the whole model.
    """

    size: float
    gradient: float = 0.35
    turn: float = 0.75
    gap: float = 1.15
    edge_size: Mapping[int, float] = field(default_factory=dict)
    edge_segments: Mapping[int, int] = field(default_factory=dict)
    vertex_size: Mapping[int, float] = field(default_factory=dict)
    chord_tolerance: float | None = None
    keep_turn: bool = False
    fields: list[Callable[[Float], Float]] | None = None
    rounds: int = 24
    smallest: float = 1e-7
    most: int = 4_000_000


class EdgeTables(Sequence[Table]):
    """Parameter, arc length and size along every edge of a model, and the least number of its segments.

    ``tables[e]`` is t, s, h (n,) of edge e. All lie in one pool, t, s, h (capacity,), of which ``fill`` rows are in
    use; edge e has rows ``span[e, 0]`` to ``span[e, 1]``. ``at_least`` (e,).
    """

    def __init__(self, network: Network, options: SizeOptions) -> None:
        self.options, edges = options, len(network.ends)
        most, self.at_least = np.empty(edges), np.empty(edges, np.int64)
        most.fill(options.size)
        self.at_least.fill(1)
        for e, size in options.edge_size.items():
            most[e] = min(size, options.size)
        for e, asked in options.edge_segments.items():
            self.at_least[e] = max(1, asked)
        bent = options.keep_turn or options.chord_tolerance is not None
        bound = np.full(edges, np.inf) if bent else most
        self.span, self.t, self.s, self.h = kernels.sample_tracks(
            *network.tracks, network.first, float(options.turn), BLUR * network.grain, bound,
            self.at_least, int(bent), SPARE,
        )  # fmt: skip
        self.fill = int(self.span[-1, 1])
        if bent:
            self._bound_by_bending(network.outlines, most)
        if options.fields is not None:
            for outline, field_ in zip(network.outlines, options.fields, strict=True):
                self._sample_field(outline, field_)
        np.maximum(self.at_least, network.least, out=self.at_least)

    def __len__(self) -> int:
        return len(self.span)

    def __getitem__(self, e: Any) -> Any:
        a, b = self.span[e].tolist()
        return self.t[a:b], self.s[a:b], self.h[a:b]

    @property
    def pool(self) -> tuple[Int, Float, Float, Float]:
        """``span``, t, s and h as compiled code takes them."""
        return self.span, self.t, self.s, self.h

    def grow(self, missing: int) -> None:
        """Make room for so many more rows, and for those of rounds to come."""
        more = np.empty(max(SPARE, len(self.t)) + missing)
        self.t, self.s, self.h = (np.concatenate([part, more]) for part in (self.t, self.s, self.h))

    def _replace(self, e: int, t: Float, s: Float, h: Float) -> None:
        """Give edge e another table."""
        if self.fill + len(t) > len(self.t):
            self.grow(len(t))
        rows = slice(self.fill, self.fill + len(t))
        self.t[rows], self.s[rows], self.h[rows] = t, s, h
        self.span[e], self.fill = (rows.start, rows.stop), rows.stop

    def _bound_by_bending(self, outlines: Sequence[Outline], most: Float) -> None:
        """Lower the tables to ``most`` (e,) and to the curvature bounds of ``keep_turn`` and ``chord_tolerance``."""
        options, seen = self.options, set()
        for outline in outlines:
            for j, e in enumerate(outline.edges.tolist()):
                if e in seen:
                    continue
                seen.add(e)
                t, s, h = self[e]
                bend = bending(outline.tracks, j, t, s)
                asked = options.edge_segments.get(e, 1)
                if options.keep_turn:
                    asked = max(asked, math.ceil(np.trapezoid(bend, s) / options.turn - 1e-3))
                if options.chord_tolerance is not None and bend.any():
                    h = np.minimum(h, np.sqrt(8.0 * options.chord_tolerance / np.maximum(bend, 1e-300)))
                    asked = max(asked, math.ceil(np.trapezoid(1.0 / h, s) - 1e-6))
                self._replace(e, t, s, np.minimum(h, min(most[e], s[-1] / asked)))
                self.at_least[e] = asked

    def _sample_field(self, outline: Outline, sizes: Callable[[Float], Float]) -> None:
        """Lower the tables of all edges of a face to its size field, at no less than 129 places of each."""
        for j, e in enumerate(outline.edges.tolist()):
            t, s, h = self[e]
            places = np.union1d(t, np.linspace(0.0, 1.0, 129))
            along = np.interp(places, t, s)
            asked = sizes(np.ascontiguousarray(evaluate(outline.tracks, j, places)))
            least = self.options.smallest * self.options.size
            self._replace(e, places, along, np.minimum(np.interp(along, s, h), np.maximum(asked, least)))


def sample_track(tracks: Tracks, j: int, turn: float, grain: float = 0.0) -> Table:
    """Parameters, arc lengths and curvature-bound sizes (n,) along track j; two samples for a line.

    ``grain`` is the length that its coordinates are rounded to.
    """
    free = np.full(1, np.inf), np.ones(1, np.int64)
    _, t, s, h = kernels.sample_tracks(*tracks, np.array([j], np.int32), turn, BLUR * grain, *free, 1, 0)
    return t, s, h


def bending(tracks: Tracks, j: int, t: Float, s: Float) -> Float:
    """Curvature (n,) of track j at the parameters t of arc lengths s, from the turning of its chords."""
    if len(t) < 3:
        return np.zeros(len(t))
    step = np.diff(evaluate(tracks, j, t), axis=0)
    turn = np.abs(np.diff(np.unwrap(np.arctan2(step[:, 1], step[:, 0]))))
    curvature = turn / (0.5 * (s[2:] - s[:-2]))
    return np.concatenate([curvature[:1], curvature, curvature[-1:]])
