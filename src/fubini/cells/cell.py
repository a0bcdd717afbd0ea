"""The Fubini cell: a part of the plane between two limit functions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.cells.chain import Chain

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Cell:
    """``{a <= x <= b, r(x) <= y <= s(x)}`` for kind "I1"; x and y change places for kind "I2".

    Attributes
    ----------
    kind : "I1" or "I2".
    a, b : ends of the range of the outer variable (x for I1, y for I2).
    r, s : lower and upper limit of the inner variable, functions of the outer one; they may meet
        at a and at b, not in between.
    neighbours : numbers of the cells (in the tuple that ``decompose`` returned) that share a part
        of a slice line with this one.
    """

    kind: str
    a: float
    b: float
    r: Chain
    s: Chain
    neighbours: tuple[int, ...] = ()

    @property
    def axis(self) -> int:
        """Column of the outer variable in a point (x, y): 0 for I1, 1 for I2."""
        return 0 if self.kind == "I1" else 1

    @property
    def edges(self) -> tuple[int, ...]:
        """CAD edge indices on r and s, each once, in ascending order."""
        return tuple(sorted({*self.r.edges, *self.s.edges}))

    def place(self, outer: Float, inner: Float) -> Float:
        """Points (n, 2) in (x, y) of outer and inner coordinates (n,)."""
        columns = (outer, inner) if self.axis == 0 else (inner, outer)
        return np.stack(columns, axis=-1)

    def contains(self, points: ArrayLike, tolerance: float = 0.0) -> Bool:
        """Which points (n, 2) satisfy the inequalities to within ``tolerance`` (model units)."""
        p = np.asarray(points, np.float64).reshape(-1, 2)
        outer, inner = p[:, self.axis], p[:, 1 - self.axis]
        within = (outer >= self.a - tolerance) & (outer <= self.b + tolerance)
        x, y = outer[within], inner[within]
        within[within] = (y >= self.r(x) - tolerance) & (y <= self.s(x) + tolerance)
        return within

    def area(self) -> float:
        """Area by Gauss quadrature through the mapping."""
        from fubini.cells.integrate import integrate

        return float(integrate((self,), lambda p: np.ones(len(p))))
