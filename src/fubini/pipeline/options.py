"""Options of a run, checked once at the door."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fubini.errors import OptionError
from fubini.model import Model
from fubini.tolerance import MAX_ASPECT_RATIO, MAX_TRIANGLES, MIN_SKEW

#: A size that is picked makes no more triangles than about this.
PICKED_TRIANGLES = 100_000

PATTERNS = ("auto", "SP13", "SP41", "ASP20", "ASP48")
DIRECTIONS = ("auto", "x", "y")
QUARTERS = (0, 90, 180, 270)
#: Skewness bounds above this are out of reach for a mesh of triangles.
HIGHEST_SKEW = 60.0

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class MeshOptions:
    """Everything that steers a run.

    Attributes
    ----------
    size : asked edge length in model units; None picks one from the model.
    pattern : "auto" for the lattice, or a reference set of the paper laid into every cell.
    pattern_direction : "x" slices a face into cells whose limits are functions of x, "y" of y; "auto" decides.
    pattern_turn : quarter turns of the set in degrees: 0, 90, 180 or 270. The dense side of a graded set then lies at
        the upper, left, lower or right limit of every cell.
    min_skew, max_aspect_ratio : bounds of a valid triangle (degrees; ratio).
    growth : largest ratio of the sizes (mean edge lengths) of triangles with a common edge.
    turn : largest turning of the tangent along one boundary segment, degrees.
    segments_per_turn : least number of segments that a full turn of a curve is given; None leaves it to ``turn``.
    chord_tolerance : largest distance of a boundary segment from its curve, model units; None for no limit.
    edge_size, face_size, vertex_size : smaller sizes on single parts, by CAD index, name (of the source or of
        ``names=``), text such as ``"edges 3,5-7"``, or a predicate ``p(x, y, z)`` on points of the part.
    edge_segments : least number of segments on single edges, likewise.
    size_field : ``f(points (n, 3)) -> (n,)``, edge lengths in space; sizes are the least of all that is asked.
    attempts : lattices tried on a face before its boundary is made finer.
    rounds : how many times the boundary of a face may be made finer.
    """

    size: float | None = None
    pattern: str = "auto"
    pattern_direction: str = "auto"
    pattern_turn: int = 0
    min_skew: float = MIN_SKEW
    max_aspect_ratio: float = MAX_ASPECT_RATIO
    growth: float = 1.5
    turn: float = 43.0
    segments_per_turn: int | None = None
    chord_tolerance: float | None = None
    edge_size: Mapping[Any, float] = field(default_factory=dict)
    face_size: Mapping[Any, float] = field(default_factory=dict)
    vertex_size: Mapping[Any, float] = field(default_factory=dict)
    edge_segments: Mapping[Any, float] = field(default_factory=dict)
    size_field: Callable[[Any], Any] | None = None
    attempts: int = 6
    rounds: int = 5

    def __post_init__(self) -> None:
        if self.size is not None and not (_is_number(self.size) and self.size > 0.0):
            raise OptionError(f"size is {self.size}", fix="give a positive edge length in model units")
        if self.pattern not in PATTERNS:
            raise OptionError(f"pattern is {self.pattern!r}", fix="use one of " + ", ".join(PATTERNS))
        if self.pattern_direction not in DIRECTIONS:
            fix = "use one of " + ", ".join(DIRECTIONS)
            raise OptionError(f"pattern_direction is {self.pattern_direction!r}", fix=fix)
        if self.pattern_turn not in QUARTERS:
            raise OptionError(f"pattern_turn is {self.pattern_turn!r}", fix="use 0, 90, 180 or 270 degrees")
        if not (_is_number(self.min_skew) and 0.0 < self.min_skew <= HIGHEST_SKEW):
            raise OptionError(f"min_skew is {self.min_skew}", fix=f"use 0 < min_skew <= {HIGHEST_SKEW:g} degrees")
        if not (_is_number(self.max_aspect_ratio) and self.max_aspect_ratio > 1.2):
            raise OptionError(f"max_aspect_ratio is {self.max_aspect_ratio}", fix="use a ratio above 1.2")
        if not (_is_number(self.growth) and 1.1 <= self.growth <= 3.0):
            raise OptionError(f"growth is {self.growth}", fix="use a ratio from 1.1 to 3")
        if not (_is_number(self.turn) and 1.0 <= self.turn <= 60.0):
            raise OptionError(f"turn is {self.turn}", fix="use 1 to 60 degrees")

        self._check_parts()

    def _check_parts(self) -> None:
        """Refuse senseless sizes of parts and of curves."""
        if self.segments_per_turn is not None and not (
            _is_number(self.segments_per_turn) and 6 <= self.segments_per_turn <= 100_000
        ):
            raise OptionError(f"segments_per_turn is {self.segments_per_turn}", fix="use 6 to 100,000")
        if self.chord_tolerance is not None and not (_is_number(self.chord_tolerance) and self.chord_tolerance > 0.0):
            raise OptionError(f"chord_tolerance is {self.chord_tolerance}", fix="give a positive distance")
        for name in ("edge_size", "face_size", "vertex_size", "edge_segments"):
            for key, value in getattr(self, name).items():
                if not (_is_number(value) and value > 0.0):
                    raise OptionError(f"{name} of {key!r} is {value}", fix="give a positive number")
        if self.size_field is not None and not callable(self.size_field):
            raise OptionError(f"size_field is {self.size_field!r}", fix="give a function of points (n, 3)")

    @property
    def largest_turn(self) -> float:
        """Largest turning of a curve along one segment, radians."""
        turn = math.radians(self.turn)
        return turn if self.segments_per_turn is None else min(turn, 2.0 * math.pi / self.segments_per_turn)

    @property
    def max_sag(self) -> float:
        """Share of its length that a merged boundary segment may be away from its curve."""
        if self.chord_tolerance is not None:
            return 1e-9
        return 0.04 if self.segments_per_turn is None else min(0.04, self.largest_turn / 8.0)

    @property
    def gradient(self) -> float:
        """Growth of the size per unit of distance along the boundary that keeps neighbours within ``growth``."""
        return 0.7 * (self.growth - 1.0)

    @property
    def inner_gradient(self) -> float:
        """The same away from the boundary, where triangles are evened out at the end.

        Limits below 1.5 leave little for what differs by chance.
        """
        return 1.6 * (1.0 - 1.0 / self.growth) if self.growth >= 1.5 else 16.0 / 15.0 * (self.growth - 1.0)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def pick_size(model: Model) -> float:
    """Edge length for a model of which nothing is known: a fortieth of the diagonal of its largest face.

    Longer where many faces would make more than ``PICKED_TRIANGLES`` of that size.
    """
    size = max(face.region.diagonal for face in model.faces) / 40.0
    triangle = math.sqrt(3.0) / 4.0 * size * size
    if sum(face.region.box_area for face in model.faces) <= PICKED_TRIANGLES * triangle:
        return size  # the areas are within their boxes, and cost more
    area = sum(face.region.area for face in model.faces)
    return size * max(1.0, math.sqrt(area / (PICKED_TRIANGLES * triangle)))


def check_count(model: Model, size: float) -> None:
    """Refuse sizes that would make more triangles than ``MAX_TRIANGLES``.

    Raises OptionError with the smallest size that is allowed.
    """
    triangle = math.sqrt(3.0) / 4.0 * size * size
    if sum(face.region.diagonal**2 for face in model.faces) <= 2.0 * MAX_TRIANGLES * triangle:
        return  # no area is more than half the square of the diagonal of its box, and areas cost more
    area = sum(face.region.area for face in model.faces)
    if triangle == 0.0 or area / triangle > MAX_TRIANGLES:
        least = math.sqrt(area / MAX_TRIANGLES / (math.sqrt(3.0) / 4.0))
        raise OptionError(
            f"size {size:g} would make more than {MAX_TRIANGLES:,} triangles",
            file=model.source, fix=f"use a size above {least:.3g}",
        )  # fmt: skip
