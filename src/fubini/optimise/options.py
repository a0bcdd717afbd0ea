"""What the optimiser is asked, and what it answers."""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass, field

from fubini._values import value
from fubini.errors import OptionError
from fubini.tolerance import MAX_ASPECT_RATIO, MIN_SKEW
from fubini.triangulation.value import Triangulation

#: No edge is to be longer than this times the size asked there.
LONGEST = 1.7


@dataclass(frozen=True)
class OptimiseOptions:
    """Bounds and effort of the optimiser.

    Attributes
    ----------
    min_skew : degrees; every triangle is to have more. Below 90; beyond about 50 no promise is made.
    max_aspect_ratio : every triangle is to have less; only a bound below what ``min_skew`` implies costs time.
    budget : move attempts at most; None allows 50000 and 4000 for each flawed triangle.
    budget_each : as many more for each triangle, where ``budget`` is given.
    growth : no move makes an inner edge, or a merged boundary edge, longer than this times the size wanted at its ends,
        nor longer than ``LONGEST`` times.
    max_sag : boundary nodes are merged away only where the chord stays within this share of its length.
    allow_splits : whether boundary segments may be split at all.
    improve : share of the effort spent on raising the worst triangles once all are valid; 0 for none.
    seed : of the pseudo-random kicks; the same seed gives the same mesh, byte for byte.
    """

    min_skew: float = MIN_SKEW
    max_aspect_ratio: float = MAX_ASPECT_RATIO
    budget: int | None = None
    budget_each: int = 0
    growth: float = 1.5
    max_sag: float = 0.04
    allow_splits: bool = True
    improve: float = 0.05
    seed: int = 1

    def __post_init__(self) -> None:
        if not 0.0 < self.min_skew < 90.0:
            raise OptionError(f"min_skew is {self.min_skew}", fix="choose an angle between 0 and 90 degrees")
        if not self.max_aspect_ratio > 1.0:
            raise OptionError(f"max_aspect_ratio is {self.max_aspect_ratio}", fix="choose a number above 1")
        if not self.growth > 1.0:
            raise OptionError(f"growth is {self.growth}", fix="choose a number above 1")
        if self.budget is not None and self.budget < 0:
            raise OptionError(f"budget is {self.budget}", fix="choose 0 or more, or None")

    @functools.cached_property
    def _hash(self) -> int:
        return hash(dataclasses.astuple(self))

    def __hash__(self) -> int:
        """As ``dataclass``, once: what is derived from options is looked up by them in every mesh."""
        return self._hash

    def budget_of(self, triangles: int) -> int:
        """Move attempts allowed in a mesh of so many triangles; -1 where their number is left to the optimiser."""
        return -1 if self.budget is None else self.budget + self.budget_each * triangles


@value(frozen=True)
class OptimiseOutcome:
    """The optimised triangulation and how it came about.

    Attributes
    ----------
    triangulation : boundary nodes first, new segments with their tracks and parameters.
    moves : accepted moves by name.
    flawed_before, flawed_after : flawed triangles, unavoidable ones included.
    excess : flawed triangles beyond one in each unavoidable corner; 0 means certified.
    splits : (track, t) of the nodes put on SPLIT_ONLY segments, for the face on the other side.
    budget_exhausted : the effort ended before the bound was met.
    worst : (x, y) centroids of the triangles counted in ``excess``.
    effort : moves attempted.
    room : triangles of the one size wanted everywhere that there is room for; 0 where sizes differ or are not known.
    thinned : nodes were taken out before smoothing, as there is less room.
    poor : triangles that are not flawed and below skewness 50 degrees, as polishing left them.
    """

    triangulation: Triangulation
    moves: dict[str, int] = field(default_factory=dict)
    flawed_before: int = 0
    flawed_after: int = 0
    excess: int = 0
    splits: tuple[tuple[int, float], ...] = ()
    budget_exhausted: bool = False
    worst: tuple[tuple[float, float], ...] = ()
    effort: int = 0
    room: int = 0
    thinned: bool = False
    poor: int = 0

    def on(self, triangulation: Triangulation) -> OptimiseOutcome:
        """The same with its nodes moved (``dataclasses.replace`` takes several times as long)."""
        return OptimiseOutcome(
            triangulation, self.moves, self.flawed_before, self.flawed_after, self.excess, self.splits,
            self.budget_exhausted, self.worst, self.effort, self.room, self.thinned, self.poor,
        )  # fmt: skip


def implied_aspect_ratio(min_skew: float) -> float:
    """Largest aspect ratio of a triangle of skewness ``min_skew`` degrees; 1.861 at 45.

    It is the flat isosceles one: with base angle b, ``cot b - cot(180 - 2 b) = 2 / tan(min_skew)`` is a
    quadratic in ``cot b``, and the aspect ratio is ``1 / (8 sin^2(b/2) sin(90 - b))``.
    """
    k = 2.0 / math.tan(math.radians(min_skew))
    base = math.atan(3.0 / (k + math.sqrt(k * k + 3.0)))
    return 1.0 / (8.0 * math.sin(base / 2) ** 2 * math.cos(base))
