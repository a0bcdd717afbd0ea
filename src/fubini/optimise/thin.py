"""Fewer triangles on faces of one size that come out with more than their area and this size ask for."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fubini.optimise._kernels_refine import MANY, most_of
from fubini.optimise.levels import excess_of, figures_of, flawed_shape, sizes_beyond
from fubini.optimise.loop import improved, refine_and_optimise
from fubini.optimise.options import LONGEST, OptimiseOptions, OptimiseOutcome
from fubini.optimise.pocket import Pocket
from fubini.optimise.smooth import least_kept
from fubini.optimise.state import NO_ROOM
from fubini.quality import areas
from fubini.tracks import Tracks
from fubini.triangulation.value import Triangulation

Float = NDArray[np.float64]
#: See ``most_triangles``.
Room = tuple[int, float] | None

#: Degrees that the mean skewness may fall by.
FALL = 3.0
#: Triangles up to so many edges away from a node that goes are meshed anew.
RINGS = 6
#: Nodes tried in one face at most, and how many in a row to no avail.
TRIALS, PATIENCE = 150, 40
#: Skewness (degrees) to which taking out a node may bring a triangle: this one where the worst of the face lies below,
#: that worst one, and no more than the second.
FAIR_SKEW, GOOD_SKEW = 60.0, 66.0
#: Attempts of the optimiser in a pocket.
EFFORT = 2000


def most_triangles(outcome: OptimiseOutcome, core: Room) -> float:
    """Triangles that an outcome may have; infinite where more than one size is wanted, or few triangles.

    core : triangles of the face that are not in it, and how many of the wanted size there is room for in their place;
        None for a face of which more than its size is asked.
    """
    most: int = most_of.py_func(outcome.room, *(core or NO_ROOM))
    return most if most < MANY else math.inf


def refine_within(
    triangulation: Triangulation,
    tracks: Tracks,
    h: float,
    gradient: float,
    options: OptimiseOptions,
    core: Room = (0, 0.0),
) -> tuple[OptimiseOutcome, tuple[int, float]]:
    """``refine_and_optimise``, with nodes taken out before smoothing where there are more than ``most_triangles``.

    Where that leaves triangles flawed or poor, none is taken out.
    """
    outcome, even = refine_and_optimise(triangulation, tracks, h, gradient, options, core=core)
    if outcome.thinned and (outcome.excess or outcome.poor):
        return refine_and_optimise(triangulation, tracks, h, gradient, options)
    return outcome, even


def thinned(outcome: OptimiseOutcome, size: float, options: OptimiseOptions, core: Room = (0, 0.0)) -> OptimiseOutcome:
    """Take nodes out where triangles are smallest, one by one, until there are no more than ``most_triangles``.

    What lies around is meshed anew each time. A node goes only where that leaves no edge longer than is allowed, no
    neighbours that differ by more than the growth limit, and no triangle worse than the worst was there, nor worse than
    the worst of the face (``_worst_allowed``); the mean hardly falls. The boundary stays as it is.
    """
    most = most_triangles(outcome, core)
    if len(outcome.triangulation.triangles) <= most or outcome.excess:
        return outcome
    start = crowd = Crowd.of(outcome.triangulation, options)
    asked = replace(options, allow_splits=False, budget=EFFORT, budget_each=0, improve=1.0)
    tried: set[tuple[float, float]] = set()
    failed, queue = 0, crowd.nodes()
    while queue and failed < PATIENCE and len(tried) < TRIALS:
        v = queue.pop()
        place = (float(crowd.mesh.points[v, 0]), float(crowd.mesh.points[v, 1]))
        if place in tried:
            continue
        tried.add(place)
        failed += 1
        better = crowd.without(v, size, asked)
        if better is None or (found := Crowd.of(better, options)).mean < start.mean - FALL:
            continue
        if len(better.triangles) <= most:
            return outcome.on(better)
        crowd, failed, queue = found, 0, found.nodes()
    return outcome if crowd is start else outcome.on(crowd.mesh)


@dataclass(frozen=True)
class Crowd:
    """A mesh with too many triangles: their mean edge lengths, shapes (``figures_of``), which of them are flawed."""

    mesh: Triangulation
    sizes: Float
    shapes: Float
    flawed: NDArray[np.bool_]

    @classmethod
    def of(cls, mesh: Triangulation, options: OptimiseOptions) -> Crowd:
        """That of a mesh."""
        sizes, shapes, _ = figures_of(mesh.points, mesh.triangles)
        return cls(mesh, sizes, shapes, shapes >= flawed_shape(options))

    @functools.cached_property
    def worst(self) -> float:
        """Shape of the worst triangle that is not flawed."""
        return float(self.shapes[~self.flawed].max(initial=0.0))

    @functools.cached_property
    def mean(self) -> float:
        """Mean skewness, degrees."""
        return float(np.degrees(np.arctan2(1.0, self.shapes)).mean())

    def nodes(self) -> list[int]:
        """The interior nodes, those whose triangles have least area together last."""
        first, corners = len(self.mesh.boundary.points), self.mesh.triangles
        area = np.bincount(corners.ravel(), np.repeat(areas(self.mesh.points[corners]), 3), len(self.mesh.points))
        found: list[int] = (first + np.argsort(-area[first:], kind="stable")).tolist()
        return found

    def without(self, v: int, size: float, asked: OptimiseOptions) -> Triangulation | None:
        """The mesh without node v; None where what lies around it comes out too bad, or a triangle there is flawed."""
        star = (self.mesh.triangles == v).any(axis=1)
        if (star & self.flawed).any():
            return None
        pocket = Pocket.around(self.mesh, np.flatnonzero(star).tolist(), RINGS, self._blocked)
        own = int(np.searchsorted(pocket.nodes[pocket.rim :], v))
        start = pocket.remeshed(np.delete(pocket.triangulation.points[pocket.rim :], own, axis=0))
        if start is None:
            return None
        new = improved(start, asked)
        size_now, shape_now, length_now = figures_of(new.points, new.triangles)
        worst = _worst_allowed(float(self.shapes[pocket.rows].max()), self.worst, asked)
        fewer = len(new.triangles) < len(pocket.rows)
        if not fewer or shape_now.max() > worst or length_now.max() > size * min(asked.growth, LONGEST):
            return None
        outside = sizes_beyond(pocket, self.sizes, self.flawed)
        return None if excess_of(new, outside, size_now, asked.growth) > 0.0 else pocket.put_back(new)

    @functools.cached_property
    def _blocked(self) -> set[int]:
        return set(np.flatnonzero(self.flawed).tolist())


def _worst_allowed(here: float, least: float, options: OptimiseOptions) -> float:
    """Shape, (Lmax^2 - Lmin^2) / 4 A, of the worst triangle that taking out a node makes.

    here, least : of the worst triangles that are not flawed around the node and in the whole face.
    """
    return min(max(here, _shape(GOOD_SKEW), min(least, _shape(FAIR_SKEW))), least_kept(options))


def _shape(skew: float) -> float:
    """Shape of a triangle of this skewness in degrees."""
    return 1.0 / math.tan(math.radians(skew))
