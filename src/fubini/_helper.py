"""The second process of a first run: compiles the optimiser and what comes after it (see ``fubini._turns``).

Kernels are compiled for the types that they are called with, so they are called, on a square of four triangles.
"""

from __future__ import annotations

import os

import numpy as np

from fubini import _turns
from fubini.measure import compare_with_curves, measure
from fubini.optimise import OptimiseOptions, even_out
from fubini.optimise._kernels_state import BUDGET, work
from fubini.optimise.loop import run
from fubini.optimise.state import build_state, read_state
from fubini.tracks import Tracks
from fubini.tracks.table import LINE, TrackBuilder, evaluate
from fubini.triangulation.value import CORNER, Boundary, Triangulation

SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.5, 0.5)])


def square() -> tuple[Triangulation, Tracks]:
    """A square around one node, its sides and its tracks."""
    builder = TrackBuilder()
    ends = np.array([(i, (i + 1) % 4) for i in range(4)], np.int32)
    for a, b in ends:
        builder.add(LINE, SQUARE[a], SQUARE[b])
    four = np.arange(4, dtype=np.int32)
    boundary = Boundary(
        SQUARE[:4], np.full(4, CORNER, np.uint8), np.ones(4), np.full(4, 90.0),
        ends, four, np.tile((0.0, 1.0), (4, 1)), np.zeros(4, np.uint8),
    )  # fmt: skip
    triangles = np.column_stack([ends, np.full(4, 4)]).astype(np.int32)
    neighbours = np.column_stack([(four + 1) % 4, (four - 1) % 4, -1 - four]).astype(np.int32)
    return Triangulation(SQUARE, triangles, neighbours, boundary), builder.build()


def compile_all() -> None:
    """Call, and by that compile, the kernels that take longest first."""
    start, tracks = square()
    options = OptimiseOptions()
    state = build_state(start, tracks, options, 200)
    state.counts[BUDGET] = 0
    run(state, work(), options)
    read_state(state, start)
    even_out(start, options)
    points = np.column_stack([SQUARE, np.zeros(5)])
    plane = np.zeros(3), np.array([0.0, 0.0, 1.0])
    segments = start.boundary.segments
    measure(points, start.triangles, segments, plane, (45.0, 2.0))
    evaluate(tracks, [0], 0.5)
    compare_with_curves(points, segments, np.repeat(points[segments[:, :1]], 3, 1))


def main(path: str) -> None:
    """Compile for the package whose file ``_turns`` this is; nothing where another one was found."""
    if os.path.samefile(path, _turns.__file__):
        compile_all()
