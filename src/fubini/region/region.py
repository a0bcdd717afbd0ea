"""A planar region: one outer loop and any number of holes, bounded by exact curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves import Curve, track
from fubini.errors import GeometryError
from fubini.region.corners import Corner, interior_angle
from fubini.region.loop import Loop
from fubini.region.membership import Membership
from fubini.region.problems import Problem, find_problems
from fubini.tolerance import VERTEX_GAP
from fubini.tracks import TrackBuilder, Tracks, rounded

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]

#: ``Region.rounded_tracks`` are rounded to the diagonal over two to this.
GRID_BITS = 32


class Layout(NamedTuple):
    """Numbers of the curves of a region, loop by loop; not to be written to.

    ``loop_first`` (l + 1,) delimits the loops, ``before`` (c,) is the curve that arrives where curve c starts,
    ``forward`` (c,) whether the loop runs along its edge.
    """

    loop_first: NDArray[np.int64]
    before: NDArray[np.int64]
    forward: Bool


@dataclass(frozen=True)
class Region:
    """The set on the left of all its loops.

    Attributes
    ----------
    outer : the outer loop, counter-clockwise.
    holes : the inner loops, clockwise.
    name : a label for messages, or None.

    Loops given the other way round are turned; ``Region.from_loops`` also finds out which is the
    outer one. Whether the loops cross or touch is not looked at here: see ``check``.
    """

    outer: Loop
    holes: tuple[Loop, ...] = ()
    name: str | None = None

    def __post_init__(self) -> None:
        outer = self.outer if self.outer.signed_area >= 0.0 else self.outer.reverse()
        holes = tuple(h if h.signed_area <= 0.0 else h.reverse() for h in self.holes)
        object.__setattr__(self, "outer", outer)
        object.__setattr__(self, "holes", holes)

    @classmethod
    def from_loops(cls, loops: Sequence[Loop], name: str | None = None) -> Region:
        """Region of one outer loop and holes given in any order and orientation.

        The outer loop is the one of the largest area. Raises ``GeometryError`` when there is no
        loop or when a loop does not lie within the outer one.
        """
        if not loops:
            raise GeometryError("a region needs at least one loop")
        areas = [abs(loop.signed_area) for loop in loops]
        outer = int(np.argmax(areas))
        region = cls(loops[outer], tuple(h for i, h in enumerate(loops) if i != outer), name)
        inside = Membership((region.outer,))
        slack = VERTEX_GAP * region.diagonal
        for i, hole in enumerate(region.holes):
            samples = _samples(hole)
            outside = ~inside.contains(samples, slack)
            if outside.any():
                raise GeometryError(
                    f"loop {i + 1} lies outside the outer loop",
                    edge=hole.edges[0],
                    at=samples[np.argmax(outside)],
                    fix="give each outer outline its own region",
                )
        return region

    @classmethod
    def polygon(cls, outer: ArrayLike, holes: Sequence[ArrayLike] = (), name: str | None = None) -> Region:
        """Region between polygons given by their points (n, 2); edges are numbered through.

        >>> Region.polygon([(0, 0), (2, 0), (2, 1), (0, 1)]).area
        2.0
        """
        loops, count = [], 0
        for points in (outer, *holes):
            loop = Loop.polygon(points)
            loops.append(replace(loop, edges=tuple(range(count, count + len(loop)))))
            count += len(loop)
        return cls(loops[0], tuple(loops[1:]), name)

    def canonical(self) -> Region:
        """The same region, numbered by its shape alone and not by how a modeller came to it.

        Each loop starts at its leftmost (then lowest) vertex; holes stand by falling area, then by
        that vertex. Differences below 1e-9 of the diagonal do not count.
        """
        step = 1e-9 * self.diagonal

        def place(loop: Loop, k: int) -> tuple[float, ...]:
            return tuple(np.round(np.asarray(loop.curves[k].start) / step).tolist())

        def turned(loop: Loop) -> Loop:
            return loop.start_at(min(range(len(loop)), key=lambda k: place(loop, k)))

        holes = sorted(
            (turned(hole) for hole in self.holes),
            key=lambda hole: (round(hole.signed_area / (step * self.diagonal)), place(hole, 0)),
        )
        return Region(turned(self.outer), tuple(holes), self.name)

    @cached_property
    def loops(self) -> tuple[Loop, ...]:
        """The outer loop, then the holes."""
        return (self.outer, *self.holes)

    @cached_property
    def curves(self) -> tuple[Curve, ...]:
        """All curves, loop by loop."""
        return tuple(c for loop in self.loops for c in loop.curves)

    @cached_property
    def edges(self) -> tuple[int, ...]:
        """CAD edge index of each of ``curves``."""
        return tuple(e for loop in self.loops for e in loop.edges)

    @cached_property
    def layout(self) -> Layout:
        """How the curves follow each other."""
        first = np.cumsum([0, *(len(loop.curves) for loop in self.loops)])
        before = np.arange(-1, first[-1] - 1)
        before[first[:-1]] = first[1:] - 1
        return Layout(first, before, np.array([along for loop in self.loops for along in loop.forward]))

    @cached_property
    def bounding_box(self) -> Float:
        """Lowest and highest corner, (2, 2)."""
        boxes = np.array([loop.bounding_box for loop in self.loops])
        return np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    @cached_property
    def box_area(self) -> float:
        """Area of the bounding box."""
        return float((self.bounding_box[1] - self.bounding_box[0]).prod())

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of the bounding box: the length that relative tolerances refer to."""
        return float(np.hypot(*(self.bounding_box[1] - self.bounding_box[0])))

    @cached_property
    def perimeter(self) -> float:
        """Length of all loops together."""
        return float(sum(loop.length for loop in self.loops))

    @cached_property
    def _moments(self) -> Float:
        """Area, first and second moments (6,) about the centre of the bounding box."""
        origin = self.bounding_box.mean(axis=0)
        return np.sum([loop.moments(origin) for loop in self.loops], axis=0)

    @property
    def area(self) -> float:
        """Exact area (boundary integrals of the curves)."""
        return float(self._moments[0])

    @property
    def centroid(self) -> Float:
        """Centre of area (2,)."""
        return self.bounding_box.mean(axis=0) + self._moments[1:3] / self._moments[0]

    @property
    def second_moments(self) -> Float:
        """Integrals (3,) of dx^2, dx dy, dy^2 over the region, dx and dy taken from the centroid."""
        area, mx, my, xx, xy, yy = self._moments
        return np.array([xx - mx * mx / area, xy - mx * my / area, yy - my * my / area])

    @cached_property
    def _membership(self) -> Membership:
        return Membership(self.loops)

    def contains(self, points: ArrayLike, tolerance: float | None = None) -> Bool:
        """Which points (n, 2) lie in the region, by winding number about the exact curves.

        Points within ``tolerance`` (model units; 1e-9 of the diagonal when not given) of the
        boundary count as inside.
        """
        slack = 1e-9 * self.diagonal if tolerance is None else tolerance
        return self._membership.contains(np.asarray(points, float).reshape(-1, 2), slack)

    @cached_property
    def corner_angles(self) -> Float:
        """Interior angle (c,) in degrees at the joint before each of ``curves``: see ``Corner``."""
        around = [
            interior_angle(before, curve)
            for loop in self.loops
            for before, curve in zip(loop.curves[-1:] + loop.curves[:-1], loop.curves, strict=True)
        ]
        return np.array(around)

    @cached_property
    def _corners(self) -> tuple[Corner, ...]:
        joints = [
            (k, i, tuple(curve.start.tolist()))
            for k, loop in enumerate(self.loops)
            for i, curve in enumerate(loop.curves)
        ]
        angles = self.corner_angles.tolist()
        return tuple(Corner(*joint, angle) for joint, angle in zip(joints, angles, strict=True))

    def corners(self) -> tuple[Corner, ...]:
        """The joint before every curve, with its interior angle; smooth joints included."""
        return self._corners

    @cached_property
    def tracks(self) -> Tracks:
        """The curves as tracks, each in the direction of its edge; not to be written to."""
        builder = TrackBuilder()
        for loop in self.loops:
            for curve, along in zip(loop.curves, loop.forward, strict=True):
                track(builder, curve, backwards=not along)
        return builder.build()

    @cached_property
    def rounded_tracks(self) -> Tracks:
        """``tracks`` rounded to ``GRID_BITS``; not to be written to."""
        return rounded(self.tracks, self.diagonal, GRID_BITS)

    def validate(self, tolerance: float | None = None) -> tuple[Problem, ...]:
        """Everything that keeps the loops from bounding a region; empty when they do.

        ``tolerance`` (model units; 1e-9 of the diagonal when not given) is the distance below
        which two boundary parts touch.
        """
        return find_problems(self.loops, 1e-9 * self.diagonal if tolerance is None else tolerance)

    def check(self, tolerance: float | None = None) -> Region:
        """This region itself; raises ``GeometryError`` for the first of ``validate``'s problems."""
        problems = self.validate(tolerance)
        if problems:
            first = problems[0]
            more = f"; {len(problems) - 1} more such places" if len(problems) > 1 else ""
            raise GeometryError(first.message + more, edge=first.edges[0], at=first.place, fix=first.fix)
        return self

    def transform(self, matrix: ArrayLike, offset: ArrayLike = (0.0, 0.0)) -> Region:
        """Image under ``x -> matrix x + offset``."""
        return Region(
            self.outer.transform(matrix, offset),
            tuple(h.transform(matrix, offset) for h in self.holes),
            self.name,
        )


def _samples(loop: Loop) -> Float:
    """Three points on every curve of a loop."""
    return np.concatenate([np.asarray(c.point(np.array([0.0, 0.37, 0.71])), float) for c in loop.curves])
