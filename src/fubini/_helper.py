"""The second process of a first run: compiles the optimiser and what comes after it (see ``fubini._turns``).

Kernels are compiled for the types that they are called with, so most are called, on a square of four triangles.
"""

from __future__ import annotations

import gc
import os
from typing import Any

import numpy as np
from numba.core import types

from fubini import _kernels_shipped as shipped
from fubini import _turns
from fubini._reference import KINDS
from fubini.measure import compare_with_curves, measure
from fubini.optimise import OptimiseOptions
from fubini.optimise._kernels_rescue import rescue
from fubini.optimise._kernels_state import BUDGET, State, work
from fubini.optimise.loop import run
from fubini.optimise.state import build_state, read_state
from fubini.pipeline import _kernels_assemble as assembly
from fubini.sampling._kernels_interior import write_core
from fubini.tracks import Tracks
from fubini.tracks.table import LINE, TrackBuilder, evaluate
from fubini.triangulation.value import CORNER, Boundary, Triangulation

#: What the first process comes to last: kernels and their argument types. A letter of ``KINDS``, then the dimensions of
#: an array, r: read-only.
LATER: tuple[tuple[Any, str], ...] = (
    (shipped.number_chains, "u2 u2 i1"),
    (shipped.meet, "u2r u1 u1 u1 i2"),
    (write_core, "b2 d1 d2 i2 l l d2 i2"),
    (assembly.assemble, "i1 i1 d1 i2 i1 d2 l1 l2 d2 l1 d3 l2 l1 d2 d2 i2 d d2 i2"),
    (assembly.with_rim, "d2 b1 d1 d1 i2 i1 d2 b1 d2 i2 d"),
    (assembly.without_rim, "d2 i2 b1 d1 d1 i2 i1 d2 b1"),
)

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


def _kind(text: str) -> Any:
    """The type that an entry of ``LATER`` stands for."""
    kind = KINDS[text[0]]
    return types.Array(kind, int(text[1]), "C", readonly=text.endswith("r")) if len(text) > 1 else kind


def by_hand(start: Triangulation, tracks: Tracks, options: OptimiseOptions) -> State:
    """A state without effort to spend."""
    state = build_state(start, tracks, options, 200)
    state.counts[BUDGET] = 0
    return state


def compile_all() -> None:
    """Call, and by that compile, the kernels that take longest first."""
    start, tracks = square()
    options = OptimiseOptions()
    state = by_hand(start, tracks, options)
    run(state, work(), options)
    read_state(state, start)
    points = np.column_stack([SQUARE, np.zeros(5)])
    plane = np.zeros(3), np.array([0.0, 0.0, 1.0])
    segments = start.boundary.segments
    measure(points, start.triangles, segments, plane, (45.0, 2.0))
    evaluate(tracks, [0], 0.5)
    compare_with_curves(points, segments, np.repeat(points[segments[:, :1]], 3, 1))
    for kernel, kinds in LATER:
        kernel.compile(tuple(_kind(text) for text in kinds.split()))
    rescue(by_hand(start, tracks, options).words, work().words, 0)


def main(path: str) -> None:
    """Compile for the package whose file ``_turns`` this is; nothing where another one was found."""
    if os.path.samefile(path, _turns.__file__):
        gc.disable()  # this process ends before its garbage matters
        compile_all()
