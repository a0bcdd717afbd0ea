"""A loop: a closed chain of curves that meet bit for bit."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves import Curve, Line
from fubini.errors import GeometryError

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Loop:
    """A closed chain of curves; the end of each is the start of the next, bit for bit.

    Attributes
    ----------
    curves : the curves in the order and direction of the loop.
    edges : CAD edge index of each curve; running numbers when not given.
    forward : whether each curve runs along its CAD edge; all true when not given.

    Raises ``GeometryError`` when there is no curve, when two consecutive ends differ, or when the
    lengths of the tuples differ. ``Loop.closed`` accepts small gaps.
    """

    curves: tuple[Curve, ...]
    edges: tuple[int, ...] = ()
    forward: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        curves = tuple(self.curves)
        n = len(curves)
        if not n:
            raise GeometryError("a loop without curves", fix="give at least one closed curve")
        edges = tuple(int(e) for e in self.edges) if self.edges else tuple(range(n))
        forward = tuple(bool(f) for f in self.forward) if self.forward else (True,) * n
        if len(edges) != n or len(forward) != n:
            raise GeometryError(f"{n} curves, but {len(edges)} edge indices and {len(forward)} directions")
        object.__setattr__(self, "curves", curves)
        object.__setattr__(self, "edges", edges)
        object.__setattr__(self, "forward", forward)
        for i, curve in enumerate(curves):
            following = curves[(i + 1) % n]
            if not np.array_equal(curve.end, following.start):
                raise GeometryError(
                    f"the loop is open by {_distance(curve.end, following.start):.3g} after curve {i}",
                    edge=edges[i],
                    at=curve.end.tolist(),
                    fix="use Loop.closed with a tolerance, or close the outline",
                )

    @classmethod
    def closed(
        cls,
        curves: Sequence[Curve],
        tolerance: float,
        edges: Sequence[int] | None = None,
        forward: Sequence[bool] | None = None,
    ) -> Loop:
        """Loop of curves whose consecutive ends differ by at most ``tolerance`` (model units).

        A gap is closed by moving the stored end of one curve: of a straight one if there is
        one, else of the curve that follows. Raises ``GeometryError`` with the coordinates of a
        gap that is wider.
        """
        chain = list(curves)
        n = len(chain)
        numbers = list(edges) if edges is not None else list(range(n))
        for i in range(n):
            j = (i + 1) % n
            gap = _distance(chain[i].end, chain[j].start)
            if gap > tolerance:
                raise GeometryError(
                    f"the outline is open: gap of {gap:.6g} between two edges, wider than {tolerance:.3g}",
                    edge=numbers[i],
                    at=chain[i].end.tolist(),
                    fix="close the gap, or load with a larger gap tolerance",
                )
            if not np.array_equal(chain[i].end, chain[j].start):
                if isinstance(chain[i], Line) and not isinstance(chain[j], Line):
                    chain[i] = with_ends(chain[i], chain[i].start, chain[j].start)
                elif i == j:
                    chain[i] = with_ends(chain[i], chain[i].start, chain[i].start)
                else:
                    chain[j] = with_ends(chain[j], chain[i].end, chain[j].end)
        return cls(tuple(chain), tuple(numbers), tuple(forward) if forward is not None else ())

    @classmethod
    def polygon(cls, points: ArrayLike, edges: Sequence[int] = ()) -> Loop:
        """Loop of straight lines through points (n, 2); a repeated last point is dropped."""
        p = np.ascontiguousarray(points, dtype=float)
        if len(p) > 1 and np.array_equal(p[0], p[-1]):
            p = p[:-1]
        n = len(p)
        return cls(tuple(Line(p[i], p[(i + 1) % n]) for i in range(n)), tuple(edges))

    def __len__(self) -> int:
        return len(self.curves)

    def reverse(self) -> Loop:
        """The same loop run the other way."""
        return Loop(
            tuple(c.reverse() for c in reversed(self.curves)),
            tuple(reversed(self.edges)),
            tuple(not f for f in reversed(self.forward)),
        )

    def start_at(self, k: int) -> Loop:
        """The same loop, numbered from its k-th curve."""
        return Loop(
            self.curves[k:] + self.curves[:k], self.edges[k:] + self.edges[:k], self.forward[k:] + self.forward[:k]
        )

    def transform(self, matrix: ArrayLike, offset: ArrayLike = (0.0, 0.0)) -> Loop:
        """Image under ``x -> matrix x + offset``; a mirror image runs the other way round."""
        curves = [c.transform(matrix, offset) for c in self.curves]
        size = float(np.ptp(np.array([c.bounding_box() for c in curves]).reshape(-1, 2), axis=0).max())
        return Loop.closed(curves, 1e-9 * size, self.edges, self.forward)

    @property
    def vertices(self) -> Float:
        """Starts of the curves, (n, 2)."""
        return np.array([c.start for c in self.curves], dtype=float)

    def point(self, curve: int, t: ArrayLike) -> Float:
        """Points (n, 2) of the curve with this number at parameters t (n,)."""
        return self.curves[curve].point(t)

    @cached_property
    def bounding_box(self) -> Float:
        """Lowest and highest corner, (2, 2)."""
        boxes = np.array([c.bounding_box() for c in self.curves], dtype=float)
        return np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    @cached_property
    def length(self) -> float:
        """Sum of the lengths of the curves."""
        return float(sum(c.length() for c in self.curves))

    @cached_property
    def signed_area(self) -> float:
        """Exact enclosed area, positive when counter-clockwise."""
        return float(self.moments(self.bounding_box.mean(axis=0))[0])

    def moments(self, origin: ArrayLike) -> Float:
        """Sums (6,) over the curves of ``Curve.area_moments`` about ``origin``."""
        return np.sum([np.asarray(c.area_moments(origin), float) for c in self.curves], axis=0)


def with_ends(curve: Curve, start: ArrayLike, end: ArrayLike) -> Curve:
    """The same curve with its stored ends replaced by points a rounding or a CAD gap away."""
    ends = {"start": np.asarray(start, float), "end": np.asarray(end, float)}
    return cast(Curve, dataclasses.replace(cast(Any, curve), **ends))


def _distance(a: ArrayLike, b: ArrayLike) -> float:
    return float(np.hypot(*(np.asarray(a, float) - np.asarray(b, float))))
