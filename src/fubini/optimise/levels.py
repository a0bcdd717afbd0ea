"""``levelled``: where moving nodes leaves neighbours too different in size, a few triangles around are meshed anew."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fubini.optimise.loop import optimise
from fubini.optimise.options import OptimiseOptions, OptimiseOutcome
from fubini.optimise.pocket import Pocket, slides
from fubini.optimise.smooth import even_out, evened, least_kept, smooth
from fubini.quality import areas, squared_lengths
from fubini.tracks import NO_TRACKS, Tracks
from fubini.triangulation.value import Triangulation

Float = NDArray[np.float64]
Index = NDArray[np.intp]

#: Pairs looked at in one face at most, worst first, one more for so many triangles, and how many in a row to no avail.
PAIRS, PAIR_EACH, PATIENCE = 20, 100, 4
#: Triangles up to so many edges away from a pair are meshed anew.
RINGS = 4
#: A trial must lessen the excess to this share of what it was; a pair over the limit counts so much by itself.
LESS, EACH = 0.8, 0.01
#: The worst shape of a trial may be that of before times this: its corners come in another order.
ROUNDING = 1.0 + 1e-12
#: Edges of a trial may be longer than those before by this factor.
LONGER = 1.1
#: Nodes on free curves slide by these shares of their segments.
SHARES = (0.15, -0.15, 0.3, -0.3, 0.5, -0.5)
#: Attempts of the optimiser in a pocket.
EFFORT = 200


@dataclass(frozen=True)
class Trial:
    """A pocket meshed in another way, with the node that slid for it, and what is left to be evened out."""

    mesh: Triangulation
    slid: tuple[int, int, int, float] | None
    excess: float


def level(
    outcome: OptimiseOutcome, tracks: Tracks, options: OptimiseOptions, even: tuple[int, float] | None = None
) -> tuple[OptimiseOutcome, float]:
    """``even_out``, then ``levelled`` where that leaves something to do and nothing is flawed; the longest edge.

    even : where the outcome is evened out already, the pairs left above the limit and the longest edge.
    """
    mesh = outcome.triangulation
    mesh, left, longest = evened(mesh, options) if even is None else (mesh, *even)
    if left and not outcome.excess:
        better = levelled(mesh, tracks, options)
        if better is not mesh:
            mesh, longest = better, float(figures_of(better.points, better.triangles)[2].max())
    return outcome if mesh is outcome.triangulation else outcome.on(mesh), longest


def levelled(triangulation: Triangulation, tracks: Tracks, options: OptimiseOptions) -> Triangulation:
    """Mesh around pairs of neighbours that differ in size by more than ``options.growth`` anew, worst first.

    A node more in the larger triangle, one less at the smaller, or a boundary node slid along its curve, each followed
    by smoothing and evening out: the first trial that leaves no pair in excess is taken, else the best that leaves
    distinctly less. No triangle becomes worse than the worst beside it was and than evening out allows. Flawed
    triangles stay as they are, and so does every shared edge.
    """
    tried: set[tuple[float, ...]] = set()
    failed, next_, uneven = 0, 0, Uneven.of(triangulation, options)
    most = PAIRS + len(triangulation.triangles) // PAIR_EACH
    while next_ < len(uneven.ratio) and failed < PATIENCE and len(tried) < most:
        pair = uneven.pair(next_)
        next_ += 1
        if (place := _place(triangulation, pair)) in tried:
            continue
        tried.add(place)
        pocket = Pocket.around(triangulation, list(pair), RINGS, set(np.flatnonzero(uneven.flawed).tolist()))
        best = _best_trial(pocket, tracks, pair, uneven, options)
        failed += 1
        if best is not None:
            triangulation, failed, next_ = pocket.put_back(best.mesh, best.slid), 0, 0
            uneven = uneven.after(triangulation, pocket, best, options)
    return triangulation


def _place(triangulation: Triangulation, pair: tuple[int, int]) -> tuple[float, ...]:
    """Where the pair is: its corners."""
    return tuple(triangulation.points[triangulation.triangles[list(pair)]].ravel().tolist())


def figures_of(points: Float, triangles: NDArray[np.int32]) -> tuple[Float, Float, Float]:
    """Mean edge length (m,), shape (Lmax^2 - Lmin^2) / 4 A (m,) and longest edge (m,) of triangles."""
    corners = points[triangles]
    square = squared_lengths(corners)
    most, area = square.max(axis=1), areas(corners)
    with np.errstate(divide="ignore", invalid="ignore"):
        shape = np.where(area > 0.0, (most - square.min(axis=1)) / (4.0 * area), np.inf)
    return np.sqrt(square).mean(axis=1), shape, np.sqrt(most)


def flawed_shape(options: OptimiseOptions) -> float:
    """Shape at the skewness bound."""
    return float(1.0 / np.tan(np.radians(options.min_skew)))


@dataclass(frozen=True)
class Uneven:
    """Pairs of neighbours, neither flawed, that differ in size by more than the limit; worst first.

    size, flawed : (m,) mean edge length of each triangle, and whether it is flawed.
    first, side : (p,) the earlier triangle of each pair, and its local edge.
    second : (p,) the later one.
    ratio : (p,) of their sizes, 1 or more.
    """

    size: Float
    flawed: NDArray[np.bool_]
    first: Index
    side: Index
    second: Index
    ratio: Float

    @classmethod
    def of(cls, mesh: Triangulation, options: OptimiseOptions) -> Uneven:
        """Those of a whole mesh."""
        size, shape, _ = figures_of(mesh.points, mesh.triangles)
        none = np.empty(0, np.intp)
        start = cls(size, shape >= flawed_shape(options), none, none, none, np.empty(0))
        first, side = np.nonzero(mesh.neighbours > np.arange(len(size))[:, None])
        return start._with(first, side, mesh, options)

    def _with(self, first: Index, side: Index, mesh: Triangulation, options: OptimiseOptions) -> Uneven:
        """The same with such of these pairs (q,) as count; ``side`` of ``first`` has a later triangle beyond."""
        second = mesh.neighbours[first, side].astype(np.intp)
        a, b = self.size[first], self.size[second]
        ratio = np.maximum(a, b) / np.minimum(a, b)
        over = np.flatnonzero((ratio > options.growth) & ~self.flawed[first] & ~self.flawed[second])
        own, new = (self.first, self.side, self.second, self.ratio), (first, side, second, ratio)
        first, side, second, ratio = (np.concatenate([x, y[over]]) for x, y in zip(own, new, strict=True))
        order = np.lexsort((side, first, -ratio))
        return replace(self, first=first[order], side=side[order], second=second[order], ratio=ratio[order])

    def pair(self, k: int) -> tuple[int, int]:
        """The smaller and the larger triangle of pair k."""
        a, b = int(self.first[k]), int(self.second[k])
        return (a, b) if self.size[a] < self.size[b] else (b, a)

    def after(self, mesh: Triangulation, pocket: Pocket, trial: Trial, options: OptimiseOptions) -> Uneven:
        """Those of the mesh into which a trial has been put back: its triangles come last, the others stay in order.

        Only what changed is looked at, for a large mesh is put together many times.
        """
        if trial.slid is not None:  # triangles beside the pocket may have changed too
            return Uneven.of(mesh, options)
        kept = np.ones(len(self.size), bool)
        kept[pocket.rows] = False
        number = np.cumsum(kept) - 1
        size, shape, _ = figures_of(trial.mesh.points, trial.mesh.triangles)
        fresh = np.arange(len(mesh.triangles) - len(size), len(mesh.triangles))
        stay = kept[self.first] & kept[self.second]
        same = Uneven(
            np.concatenate([self.size[kept], size]),
            np.concatenate([self.flawed[kept], shape >= flawed_shape(options)]),
            number[self.first[stay]], self.side[stay], number[self.second[stay]], self.ratio[stay],
        )  # fmt: skip
        beyond = mesh.neighbours[fresh]
        rows = np.concatenate([np.unique(beyond[(beyond >= 0) & (beyond < fresh[0])]), fresh]).astype(np.intp)
        at, side = np.nonzero(mesh.neighbours[rows] >= np.maximum(rows + 1, fresh[0])[:, None])
        return same._with(rows[at], side, mesh, options)


def excess_of(mesh: Triangulation, outside: Float, size: Float, limit: float) -> float:
    """Squared excesses over the limit of all pairs with a triangle of the mesh, and ``EACH`` for each of them.

    outside : (k,) sizes beyond each boundary segment, nan where they do not count.
    """
    u, own = mesh.neighbours, size[:, None]
    beyond = np.where(u >= 0, size[np.maximum(u, 0)], outside[np.maximum(-1 - u, 0)])
    over = np.maximum(own, beyond) / np.minimum(own, beyond) - limit
    share = np.where(u >= 0, 0.5, 1.0) * (over > 0.0)  # a pair inside is seen from both sides
    return float((share * np.where(over > 0.0, over**2 + EACH, 0.0)).sum())


def sizes_beyond(pocket: Pocket, size: Float, flawed: NDArray[np.bool_]) -> Float:
    """Sizes (k,) beyond the boundary segments of a pocket for ``excess_of``, by those of all triangles of the mesh."""
    beyond = np.maximum(pocket.outside, 0)
    return np.where((pocket.outside >= 0) & ~flawed[beyond], size[beyond], np.nan)


def _best_trial(
    pocket: Pocket, tracks: Tracks, pair: tuple[int, int], uneven: Uneven, options: OptimiseOptions
) -> Trial | None:
    """The pocket around a pair meshed anew; None where no trial is good enough."""
    size = uneven.size
    outside = sizes_beyond(pocket, size, uneven.flawed)
    _, shapes, lengths = figures_of(pocket.triangulation.points, pocket.triangulation.triangles)
    worst, longest = ROUNDING * max(float(shapes.max()), least_kept(options)), LONGER * float(lengths.max())
    least = LESS * excess_of(pocket.triangulation, outside, size[pocket.rows], options.growth)
    best: Trial | None = None
    for start, slid in _starts(pocket, tracks, pair):
        mesh = _finished(start, options)
        size_now, shape_now, length_now = figures_of(mesh.points, mesh.triangles)
        if shape_now.max() > worst or length_now.max() > longest:
            continue
        excess = excess_of(mesh, outside, size_now, options.growth)
        if excess < least:
            best, least = Trial(mesh, slid, excess), excess
        if excess == 0.0:
            break
    return best


def _finished(start: Triangulation, options: OptimiseOptions) -> Triangulation:
    """Smoothed, without what is flawed, evened out."""
    mesh = smooth(start)
    _, shape, _ = figures_of(mesh.points, mesh.triangles)
    if shape.max() > least_kept(options):
        mesh = optimise(
            mesh, NO_TRACKS, replace(options, allow_splits=False, budget=EFFORT, budget_each=0)
        ).triangulation
    return even_out(mesh, options)


def _starts(
    pocket: Pocket, tracks: Tracks, pair: tuple[int, int]
) -> Iterator[tuple[Triangulation, tuple[int, int, int, float] | None]]:
    """Other meshes of the pocket, likely ones first."""
    own, rim = pocket.triangulation, pocket.rim
    small, large = np.searchsorted(pocket.rows, pair).tolist()
    inner = own.points[rim:]
    corners = own.points[own.triangles[large]]
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    middles = middles[np.argsort(-squared_lengths(corners[None])[0][[2, 0, 1]], kind="stable")]
    near = [small, large, *(t for t in own.neighbours[small].tolist() if t >= 0)]
    leave = [v for v in dict.fromkeys(own.triangles[near].ravel().tolist()) if v >= rim]
    trials = [inner]
    trials += [np.concatenate([inner, [p]]) for p in (*middles, corners.mean(axis=0))]
    trials += [np.delete(inner, v - rim, axis=0) for v in leave]
    for points in trials:
        if (mesh := pocket.remeshed(points)) is not None:
            yield mesh, None
    at = set(own.triangles[[small, large]].ravel().tolist())
    for v, s, r in pocket.sliding():
        for share in SHARES if v in at else ():
            t, place = slides(pocket.whole.boundary, tracks, s, r, share)
            if (mesh := pocket.remeshed(inner, (v, place))) is not None:
                yield mesh, (v, s, r, t)
