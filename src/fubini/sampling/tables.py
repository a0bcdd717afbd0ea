"""Tables of the size wanted along the edges of a model."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fubini.sampling import _kernels_sizes as kernels
from fubini.sampling.outline import Outline
from fubini.tracks import Tracks, evaluate
from fubini.tracks.table import LINE, RATIONAL
from fubini.triangulation.value import Boundary

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: Curves are sampled more densely where segments are to turn by less than this (radians), up to so many samples.
FINE_TURN, MOST_SAMPLES = 0.75, 16385


@dataclass(frozen=True)
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


class EdgeTables:
    """Parameter, arc length and size along every edge of a model, and the least number of its segments.

    ``of[e]`` holds t, s, h (n,) of edge e; ``at_least`` (e,).
    """

    def __init__(self, outlines: list[Outline], edges: int, options: SizeOptions) -> None:
        self.options = options
        most, self.at_least = np.full(edges, float(options.size)), np.ones(edges, np.int64)
        for e, size in options.edge_size.items():
            most[e] = min(size, options.size)
        for e, asked in options.edge_segments.items():
            self.at_least[e] = max(1, asked)
        bent = options.keep_turn or options.chord_tolerance is not None
        self._flat: tuple[Int, Float, Float, Float] | None = _sampled(
            outlines, options.turn, np.full(edges, np.inf) if bent else most, self.at_least
        )
        first, t, s, h = self._flat
        self.of = [(t[a:b], s[a:b], h[a:b]) for a, b in itertools.pairwise(first.tolist())]
        if bent:
            self._bound_by_bending(outlines, most)
        for f, outline in enumerate(outlines):
            if options.fields is not None:
                self._sample_field(outline, options.fields[f])
            self._count_closed_loops(outline)

    def flat(self) -> tuple[Int, Float, Float, Float]:
        """All tables in one: ``first`` (e + 1,), t, s, h."""
        if self._flat is None:
            self._flat = _joined(self.of)
        return self._flat

    def lower(self, outline: Outline, boundary: Boundary, asked: tuple[Float, ...], tracks: Int) -> list[int]:
        """Lower the tables of some ``tracks`` of a face to asked sizes; the edges where a size fell.

        asked : for each segment of the boundary (k,) the sizes at its start, at its end, the share of its length
        where its foot lies, and the size there; infinite where nothing is asked.
        """
        low, high = np.searchsorted(boundary.track, tracks), np.searchsorted(boundary.track, tracks, side="right")
        numbers = np.zeros(len(tracks) + 1, np.int64)
        np.cumsum(high - low, out=numbers[1:])
        rows = np.repeat(low - numbers[:-1], high - low) + np.arange(numbers[-1])
        edges = outline.edges[tracks].tolist()
        first, t, s, h, changed = kernels.lower_tables(
            *_joined([self.of[e] for e in edges]), numbers, boundary.t[rows], *(part[rows] for part in asked)
        )
        fell = np.flatnonzero(changed).tolist()
        for k in fell:
            part = slice(first[k], first[k + 1])
            self.of[edges[k]] = t[part], s[part], h[part]
        if fell:
            self._flat = None
        return [edges[k] for k in fell]

    def _bound_by_bending(self, outlines: list[Outline], most: Float) -> None:
        """Lower the tables to ``most`` (e,) and to the curvature bounds of ``keep_turn`` and ``chord_tolerance``."""
        options, seen, self._flat = self.options, set(), None
        for outline in outlines:
            for j, e in enumerate(outline.edges.tolist()):
                if e in seen:
                    continue
                seen.add(e)
                t, s, h = self.of[e]
                bend = bending(outline.tracks, j, t, s)
                asked = options.edge_segments.get(e, 1)
                if options.keep_turn:
                    asked = max(asked, math.ceil(np.trapezoid(bend, s) / options.turn - 1e-3))
                if options.chord_tolerance is not None and bend.any():
                    h = np.minimum(h, np.sqrt(8.0 * options.chord_tolerance / np.maximum(bend, 1e-300)))
                    asked = max(asked, math.ceil(np.trapezoid(1.0 / h, s) - 1e-6))
                self.of[e] = t, s, np.minimum(h, min(most[e], s[-1] / asked))
                self.at_least[e] = asked

    def _sample_field(self, outline: Outline, sizes: Callable[[Float], Float]) -> None:
        """Lower the tables of all edges of a face to its size field, at no less than 129 places of each."""
        self._flat = None
        for j, e in enumerate(outline.edges.tolist()):
            t, s, h = self.of[e]
            places = np.union1d(t, np.linspace(0.0, 1.0, 129))
            along = np.interp(places, t, s)
            asked = sizes(np.ascontiguousarray(evaluate(outline.tracks, j, places)))
            least = self.options.smallest * self.options.size
            self.of[e] = (places, along, np.minimum(np.interp(along, s, h), np.maximum(asked, least)))

    def _count_closed_loops(self, outline: Outline) -> None:
        """A loop of one curve needs three segments, one of two curves two on a curved one."""
        for a, b in itertools.pairwise(outline.loop_first.tolist()):
            if b - a <= 2:
                for j in range(a, b):
                    least = 3 if b - a == 1 else (2 if outline.tracks.kinds[j] != LINE else 1)
                    e = outline.edges[j]
                    self.at_least[e] = max(self.at_least[e], least)


def _joined(tables: list[tuple[Float, Float, Float]]) -> tuple[Int, Float, Float, Float]:
    """Tables one behind the other: ``first``, t, s, h."""
    first = np.zeros(len(tables) + 1, np.int64)
    np.cumsum([len(table[0]) for table in tables], out=first[1:])
    t, s, h = (np.concatenate(parts) for parts in zip(*tables, strict=True))
    return first, t, s, h


def _sampled(outlines: list[Outline], turn: float, most: Float, pieces: Int) -> tuple[Int, Float, Float, Float]:
    """Tables of all edges, each from the first track that runs along it."""
    tracks, which = _every_track(outlines, len(most))
    return kernels.sample_tracks(*tracks, which, _sample_counts(tracks, which, turn), turn, most, pieces)


def _every_track(outlines: list[Outline], edges: int) -> tuple[Tracks, NDArray[np.int32]]:
    """The tracks of all faces in one table, and the first track (e,) of every edge."""
    parts = [outline.tracks for outline in outlines]
    start = np.concatenate([[0], np.cumsum([len(part.data) for part in parts[:-1]])])
    offsets = [part.offsets + np.int32(at) for part, at in zip(parts, start, strict=True)]
    tracks = Tracks(
        np.concatenate([part.kinds for part in parts]),
        np.concatenate(offsets),
        np.concatenate([part.data for part in parts]),
    )
    along = np.concatenate([outline.edges for outline in outlines])
    which = np.empty(edges, np.int32)
    which[along[::-1]] = np.arange(len(along), dtype=np.int32)[::-1]
    return tracks, which


def _sample_counts(tracks: Tracks, which: NDArray[np.int32], turn: float) -> Int:
    """Samples (e,) to take of the tracks ``which``: two of a line, more of a curve with many pieces."""
    kinds = tracks.kinds[which]
    count = np.full(len(which), 129)
    pieces = tracks.data[tracks.offsets[which] + 4 * (kinds == RATIONAL)]
    count[kinds == RATIONAL] = np.clip(16 * pieces[kinds == RATIONAL] + 1, 65, 4097)
    count = np.minimum(MOST_SAMPLES, (count - 1) * max(1, math.ceil(FINE_TURN / turn)) + 1)
    count[kinds == LINE] = 2
    return count


def sample_track(tracks: Tracks, j: int, turn: float) -> tuple[Float, Float, Float]:
    """Parameters, arc lengths and curvature-bound sizes (n,) along track j; two samples for a line."""
    which = np.array([j], np.int32)
    free = np.full(1, np.inf), np.ones(1, np.int64)
    _, t, s, h = kernels.sample_tracks(*tracks, which, _sample_counts(tracks, which, turn), turn, *free)
    return t, s, h


def bending(tracks: Tracks, j: int, t: Float, s: Float) -> Float:
    """Curvature (n,) of track j at the parameters t of arc lengths s, from the turning of its chords."""
    if len(t) < 3:
        return np.zeros(len(t))
    step = np.diff(evaluate(tracks, j, t), axis=0)
    turn = np.abs(np.diff(np.unwrap(np.arctan2(step[:, 1], step[:, 0]))))
    curvature = turn / (0.5 * (s[2:] - s[:-2]))
    return np.concatenate([curvature[:1], curvature, curvature[-1:]])
