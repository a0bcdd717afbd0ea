"""``shortened``: no edge much longer than the size asked there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fubini.optimise.levels import level
from fubini.optimise.loop import optimise
from fubini.optimise.options import LONGEST, OptimiseOptions, OptimiseOutcome
from fubini.optimise.smooth import smooth
from fubini.tracks import Tracks, evaluate
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.value import FREE, FROZEN, LOCKED, ON_CURVE, Boundary, Triangulation

Float = NDArray[np.float64]
#: Track and parameter of nodes put on shared segments.
Splits = tuple[tuple[int, float], ...]

#: Budget of rounds of cuts.
CUTS = 6
#: The score of a mesh without edges that are too long.
DONE = (0, 1.0)


def shortened(
    outcome: OptimiseOutcome,
    tracks: Tracks,
    size: float,
    options: OptimiseOptions,
    field: Callable[[Float], Float] | None = None,
    along: Float | None = None,
    longest: float = math.inf,
) -> OptimiseOutcome:
    """Cut edges longer than ``LONGEST`` times the size asked, then optimise again, until there are none.

    An inner edge gets a node in its middle, a boundary segment one on its curve. No cut is kept that adds a flaw, and
    locked segments stay: what is still too long then shows in the certificate's ``longest_edge``.

    Parameters
    ----------
    size : asked edge length. Where a boundary node is larger on purpose, beside a cusp, that size stands for all.
    field : sizes (n,) asked at points (n, 2), where they differ; the mean at both ends of an edge counts.
    along : (c,) sizes asked of segments on each track, where they differ.
    longest : length of the longest edge, where it is known.
    """
    if field is None and along is None and longest <= LONGEST * size:
        return outcome
    best, least = outcome, _score(excess := long_edges(outcome.triangulation, size, field, along))
    for _ in range(CUTS if least > DONE else 0):
        cut, splits = _cut(outcome.triangulation, tracks, excess)
        if cut is None or len(cut.unrecovered):
            break
        again, _ = level(optimise(smooth(cut), tracks, options), tracks, options)
        outcome = _following(outcome, again, splits)
        score = _score(excess := long_edges(outcome.triangulation, size, field, along))
        if outcome.excess <= best.excess and score < least:
            best, least = outcome, score
        if score == DONE:
            break
    return best


def long_edges(
    triangulation: Triangulation,
    size: float,
    field: Callable[[Float], Float] | None = None,
    along: Float | None = None,
) -> Float:
    """Length (m, 3) of the edges opposite to each corner over the longest that is allowed; see ``shortened``."""
    points, corners = triangulation.points, triangulation.triangles
    ends = np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)
    wanted = np.full(len(points), max(size, float(triangulation.boundary.size.max())))
    if field is not None:
        np.minimum(field(np.array(points)), wanted, out=wanted)
    length = np.linalg.norm(points[ends[0]] - points[ends[1]], axis=2)
    most: Float = 0.5 * LONGEST * (wanted[ends[0]] + wanted[ends[1]])
    if along is not None:
        rows, side = np.nonzero(triangulation.neighbours < 0)
        track = triangulation.boundary.track[-1 - triangulation.neighbours[rows, side]]
        asked = np.append(along, np.inf)[track]  # the rim of a core is on no track: -1
        most[rows, side] = np.minimum(most[rows, side], LONGEST * asked)
    ratio: Float = length / most
    return ratio


def _score(excess: Float) -> tuple[int, float]:
    """How many edges are too long, and the longest of them over what is allowed; ``DONE`` where none is."""
    return int((excess > 1.0).sum()), float(excess.max(initial=1.0))


def _following(first: OptimiseOutcome, second: OptimiseOutcome, splits: Splits) -> OptimiseOutcome:
    """The second outcome, which starts from a mesh cut from that of the first."""
    moves = {name: first.moves.get(name, 0) + number for name, number in second.moves.items()}
    return replace(
        second, moves=moves, flawed_before=first.flawed_before, splits=first.splits + splits + second.splits,
        budget_exhausted=second.budget_exhausted, room=first.room,
    )  # fmt: skip


def _cut(tri: Triangulation, tracks: Tracks, excess: Float) -> tuple[Triangulation | None, Splits]:
    """Delaunay with nodes in the middle of edges over 1 that are the longest of a triangle; the splits of shared ones.

    None where every such edge is locked.
    """
    rows = np.flatnonzero((excess > 1.0).any(axis=1))
    at = excess[rows].argmax(axis=1)
    across = tri.neighbours[rows, at]
    a, b = tri.triangles[rows, (at + 1) % 3], tri.triangles[rows, (at + 2) % 3]
    pairs = np.unique(np.sort(np.stack([a, b], 1)[across >= 0], axis=1), axis=0)
    segments = np.unique(-1 - across[across < 0])
    segments = segments[tri.boundary.mode[segments] != LOCKED]
    if not len(pairs) and not len(segments):
        return None, ()
    boundary = split_in_middle(tri.boundary, tracks, segments)
    shared = segments[tri.boundary.mode[segments] != FREE]
    splits = tuple((int(tri.boundary.track[s]), float(tri.boundary.t[s].mean())) for s in shared.tolist())
    inner = tri.points[len(tri.boundary.points) :]
    points = np.concatenate([boundary.points, inner, tri.points[pairs].mean(axis=1)])
    return constrained_delaunay(points, boundary), splits


def split_in_middle(boundary: Boundary, tracks: Tracks, segments: NDArray[np.intp]) -> Boundary:
    """The boundary with a node more on each of these segments; new nodes and second halves come last."""
    if not len(segments):
        return boundary
    n, (a, b) = len(boundary.points), boundary.segments[segments].T
    track, middle = boundary.track[segments], boundary.t[segments].mean(axis=1)
    points = 0.5 * (boundary.points[a] + boundary.points[b])
    on_curve = track >= 0
    points[on_curve] = evaluate(tracks, track[on_curve], middle[on_curve])
    new = np.arange(n, n + len(segments), dtype=np.int32)
    ends, t = boundary.segments.copy(), boundary.t.copy()
    ends[segments, 1], t[segments, 1] = new, middle
    mode = boundary.mode[segments]
    half = 0.5 * np.linalg.norm(boundary.points[a] - boundary.points[b], axis=1)
    size = np.minimum(half, np.maximum(boundary.size[a], boundary.size[b]))
    return Boundary(
        points=np.concatenate([boundary.points, points]),
        kind=np.concatenate([boundary.kind, np.where(mode == FREE, ON_CURVE, FROZEN).astype(np.uint8)]),
        size=np.concatenate([boundary.size, size]),
        angle=np.concatenate([boundary.angle, np.full(len(new), 180.0)]),
        segments=np.concatenate([ends, np.stack([new, b], 1).astype(np.int32)]),
        track=np.concatenate([boundary.track, track]),
        t=np.concatenate([t, np.stack([middle, boundary.t[segments, 1]], 1)]),
        mode=np.concatenate([boundary.mode, mode]),
    )
