"""Meshing all faces so that shared edges keep one set of nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fubini._values import value
from fubini.errors import GeometryError, OptionError
from fubini.optimise import OptimiseOutcome
from fubini.pipeline.across import evened_across
from fubini.pipeline.attempts import NO_POINTS, SPLIT_SHARED_FROM, attempt, optimiser_options
from fubini.pipeline.options import MeshOptions, Progress
from fubini.pipeline.pattern import PatternPoints, pattern_nodes
from fubini.pipeline.points import crowded
from fubini.pipeline.strip import FaceMesh, with_core
from fubini.sampling.boundary import BoundarySizing, EdgeNodes
from fubini.sampling.fans import long_segments
from fubini.sampling.interior import Core
from fubini.triangulation.value import Boundary

Float = NDArray[np.float64]

#: Splits of shared edges are followed until the edges hold this many times the nodes that they started with.
MOST_SPLITS = 4
#: Moves on all attempts on one face that leave a flaw, however often it is meshed: twice what the worst face of
#: thousands needed that came out without one.
EFFORT = 200_000
#: Finer boundaries in a row that leave no fewer flaws, before a face is given up: beside a cusp they only shift them.
PATIENCE = 2
#: Flaws no further from a leg than this many times its length are there because of it.
HOPELESS_REACH = 1.5
#: Budget of rounds that shorten the boundary beside points inside a face.
POINT_ROUNDS = 20


@value(frozen=True)
class FaceResult:
    """Mesh of one face, the optimiser's outcome, and the version of the nodes on edges that it was made for."""

    mesh: FaceMesh
    outcome: OptimiseOutcome
    version: int


class FaceMesher:
    """Meshes the faces of a model one by one and follows splits of shared edges through all of them.

    ``pattern`` gives mapped points of every face in place of sized edges and lattices, ``points`` those (p, 2) inside
    faces that are to be nodes, by face.
    """

    def __init__(
        self,
        sizing: BoundarySizing,
        sizes: list[float],
        options: MeshOptions,
        pattern: list[PatternPoints] | None = None,
        points: Mapping[int, Float] | None = None,
    ) -> None:
        self.sizing = sizing
        self.sizes = sizes
        self.options = options
        self.pattern = pattern
        self.base = sizing.resolve() if pattern is None else pattern_nodes(len(sizing.ends), sizing.outlines, pattern)
        self.extra: dict[int, list[float]] = {}
        self.points = points or {}
        self._approach_points()
        self.nodes = self.base
        self.version = 0
        self.renewed = np.zeros(len(sizing.ends), np.int64)  # version that came with the present nodes of an edge
        self.results: dict[int, FaceResult] = {}
        self.finer: dict[int, int] = {}
        self.effort: dict[int, int] = {}
        self.settled = False

    def run(self, progress: Progress | None = None) -> list[FaceResult]:
        """Mesh until every face matches the nodes of its edges.

        When the budget is spent, or the splits of shared edges go on and on, the nodes are settled: the faces that
        wait are meshed once more without splits, so that all fit together, flawed where they must be.
        """
        count = len(self.sizing.outlines)
        budget = 6 * count + 20
        most = MOST_SPLITS * len(self.base.t) + 1000
        pending = list(range(count))
        while pending:
            self.settled = budget <= 0 or len(self.nodes.t) > most
            for f in pending:
                budget -= 1
                self._mesh_face(f)
                if progress:
                    progress("faces", min(len(self.results), count), count)
            pending = [f for f in range(count) if self._is_stale(f)]
        return self._evened([self.results[f] for f in range(count)])

    def _evened(self, results: list[FaceResult]) -> list[FaceResult]:
        """The faces, evened out across the edges that they share."""
        first, o = self.sizing.outlines[0], self.options
        if self.pattern is not None or (len(results) == 1 and first.inner == len(first.edges)):
            return results
        asked = optimiser_options(o.min_skew, o.max_aspect_ratio, o.growth, o.max_sag)
        return evened_across(self.sizing.network, self.nodes, results, asked)

    def _approach_points(self) -> None:
        """Shorten boundary segments that a point inside their face lies close to."""
        for f, points in self.points.items():
            for _ in range(POINT_ROUNDS):
                close = crowded(self.sizing.boundary(f, self.base), points)
                if not close.any() or not self.sizing.lower_near(f, points[close], self.base, 0.7):
                    break
                self.base = self.sizing.resolve()

    def _is_stale(self, f: int) -> bool:
        """Whether an edge of a face has got other nodes since it was meshed."""
        version = self.results[f].version
        return version < self.version and bool((self.renewed[self.sizing.outlines[f].edges] > version).any())

    def _renew(self, nodes: EdgeNodes) -> None:
        """Take other nodes, as a new version."""
        self.version += 1
        self.renewed[nodes.differs(self.nodes)] = self.version
        self.nodes = nodes

    def _mesh_face(self, f: int) -> None:
        """Try lattices, then finer boundaries, until no flawed triangle is left that could be avoided."""
        left: list[int] = []
        while True:
            best, core = self._best_attempt(f)
            left.append(best.excess)
            done = self.finer.get(f, 0)
            if not best.excess or self.settled or self.pattern is not None or done >= self.options.rounds:
                break
            if self._is_hopeless(f, best):
                break
            if self._spent(f):
                best = replace(best, budget_exhausted=True)
                break
            if len(left) > PATIENCE and min(left[-PATIENCE:]) >= min(left[:-PATIENCE]):
                break
            self.finer[f] = done + 1
            if not self._refine_boundary(f, best):
                break
        if core is None and not len(best.triangulation.triangles):
            at = self.sizing.boundary(f, self.nodes).points[0]
            raise GeometryError("nothing lies inside the outline: it crosses itself or runs backwards", face=f, at=at)
        self._follow_splits(f, best)
        self.results[f] = FaceResult(with_core(best.triangulation, core), best, self.version)

    def _best_attempt(self, f: int) -> tuple[OptimiseOutcome, Core | None]:
        """The attempt that leaves fewest avoidable flaws, the first of those that leave none."""
        best: tuple[OptimiseOutcome, Core | None] | None = None
        tried: list[tuple[Float, Boundary]] = []
        outline = self.sizing.outlines[f]
        inside = self.pattern[f].inside if self.pattern is not None else None
        field = self.sizing.options.fields[f] if self.sizing.options.fields is not None else None
        along = self._asked_along(f)
        for number in self._attempts(f):
            boundary, size = self._boundary(f), self.sizes[f]
            lone = self.points.get(f, NO_POINTS)
            try:
                found = attempt(boundary, outline, size, self.options, number, inside, field, lone, along, tried)
            except GeometryError as error:
                error.face = f
                raise
            if found is not None and (best is None or found[0].excess < best[0].excess):
                best = found
            if found is not None and found[0].excess:
                self.effort[f] = self.effort.get(f, 0) + found[0].effort
            if best is not None and (best[0].excess == 0 or self._spent(f)):
                break
            if best is not None and number >= SPLIT_SHARED_FROM and self._is_hopeless(f, best[0]):
                break
        if best is None:
            raise OptionError(f"attempts is {self.options.attempts}", fix="allow at least one")
        return best

    def _boundary(self, f: int) -> Boundary:
        """The boundary of a face with its nodes, none larger than the size of the face but where segments are long."""
        boundary, size = self.sizing.boundary(f, self.nodes), self.sizes[f]
        if size >= self.sizing.options.size or len(long_segments(boundary, size)):
            return boundary
        return replace(boundary, size=np.minimum(boundary.size, size))

    def _asked_along(self, f: int) -> Float | None:
        """Sizes (c,) asked of the edges of a face; None where none is smaller than that of the face."""
        asked, edges = self.sizing.options.edge_size, self.sizing.outlines[f].edges.tolist()
        if not asked or min(asked.get(e, np.inf) for e in edges) >= self.sizes[f]:
            return None
        return np.array([asked.get(e, np.inf) for e in edges])

    def _spent(self, f: int) -> bool:
        """Whether the effort that a face may cost is spent."""
        return self.effort.get(f, 0) > EFFORT

    def _is_hopeless(self, f: int, outcome: OptimiseOutcome) -> bool:
        """Whether all flaws of a face lie at legs beside which there are no valid triangles at any size.

        A finer boundary may help once at other legs that faces share, by chance: sizes there are in proportion to it.
        """
        legs = self.sizing.legs
        if not legs.radius.any():
            return False
        known = legs.hopeless if f not in self.finer else legs.hopeless | (legs.held & legs.shared[:, None])
        return self._lie_at(f, outcome, known)

    def _lie_at(self, f: int, outcome: OptimiseOutcome, legs: NDArray[np.bool_]) -> bool:
        """Whether all flaws of a face lie at some of these ``legs`` (e, 2)."""
        edges = self.sizing.outlines[f].edges
        if not legs[edges].any():
            return False
        boundary = self.sizing.boundary(f, self.nodes)
        at_end = legs[edges[boundary.track], :, None] & (boundary.t[:, None] == np.array([[0.0], [1.0]]))
        ends = boundary.points[boundary.segments[at_end.any(axis=(1, 2))]]
        reach = HOPELESS_REACH * np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        away = np.linalg.norm(np.array(outcome.worst)[:, None, None] - ends, axis=3).min(axis=2)
        return bool((away <= reach).any(axis=1).all())

    def _attempts(self, f: int) -> Sequence[int]:
        """Numbers of the attempts to make; none that splits shared edges once their nodes are settled."""
        if self.settled or self._spent(f):
            return range(SPLIT_SHARED_FROM)
        return range(self.options.attempts) if self.pattern is None else (0, SPLIT_SHARED_FROM)

    def _refine_boundary(self, f: int, outcome: OptimiseOutcome) -> bool:
        """Ask for a finer boundary where flawed triangles are left."""
        if not self.sizing.lower_near(f, np.array(outcome.worst), self.nodes, 0.7):
            return False
        base = self.sizing.resolve()
        for e in list(self.extra):
            if not np.array_equal(base.of(e), self.base.of(e)):
                del self.extra[e]
        self.base = base
        self._renew(base.with_nodes(self.extra) if self.extra else base)
        return True

    def _follow_splits(self, f: int, outcome: OptimiseOutcome) -> None:
        """Put the nodes that the optimiser added on shared edges into the discretisation."""
        if not outcome.splits:
            return
        edges = self.sizing.outlines[f].edges
        for j, t in outcome.splits:
            self.extra.setdefault(int(edges[j]), []).append(float(t))
        self._renew(self.base.with_nodes(self.extra))


__all__ = ["EdgeNodes", "FaceMesher", "FaceResult"]
