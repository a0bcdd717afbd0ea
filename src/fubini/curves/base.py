"""The curve contract: what every plane curve of this package can do."""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.curves.kinks import WHOLE, Stretch
from fubini.errors import GeometryError, OptionError

if TYPE_CHECKING:
    from fubini.curves.limit import LimitFunction

Float = NDArray[np.float64]

#: Coordinates closer than this, times their largest size, cannot be told apart.
NOISE = 16 * np.finfo(float).eps


def frozen(values: ArrayLike, shape: tuple[int | None, ...], what: str) -> Float:
    """A read-only float64 copy of ``values``; the error names ``what`` unless finite and of this shape."""
    try:
        array = np.array(values, np.float64)
    except (TypeError, ValueError) as error:
        raise GeometryError(f"{what} is not made of numbers: {error}") from None
    if array.ndim != len(shape) or any(n not in (None, m) for n, m in zip(shape, array.shape)):
        raise GeometryError(f"{what} has shape {array.shape} where {shape} is needed")
    if not math.isfinite(array.sum()) and not np.isfinite(array).all():
        raise GeometryError(f"{what} holds a coordinate that is not finite")
    array.setflags(write=False)
    return array


def affine(matrix: Float, offset: Float, points: Float) -> Float:
    """``matrix @ p + offset`` for points (..., 2), in arithmetic that gives equal points equal images."""
    x, y = points[..., 0], points[..., 1]
    return np.stack(
        [
            matrix[0, 0] * x + matrix[0, 1] * y + offset[0],
            matrix[1, 0] * x + matrix[1, 1] * y + offset[1],
        ],
        axis=-1,
    )


def other(axis: int) -> int:
    """The axis that is not ``axis``."""
    if axis not in (0, 1):
        raise OptionError(f"axis {axis!r} is neither 0 (x) nor 1 (y)")
    return 1 - axis


class Curve(ABC):
    """A smooth or piecewise smooth plane curve over t in [0, 1].

    The parameter is affine in the natural one (angle, knot span). ``start`` and ``end`` are stored
    points (2,) that come back bit for bit at t = 0 and t = 1; parameters outside are clipped.
    A scalar t gives (2,), an array (n,) gives (n, 2). Curves are immutable and compare by identity.
    """

    start: Float
    end: Float
    kind: str = ""

    # -- what a kind supplies -------------------------------------------------------------------

    @abstractmethod
    def _point(self, t: Float) -> Float:
        """Points t.shape + (2,) of the formula, stored ends apart."""

    @abstractmethod
    def _derivative(self, t: Float) -> Float:
        """First derivative by t."""

    @abstractmethod
    def _second_derivative(self, t: Float) -> Float:
        """Second derivative by t."""

    @abstractmethod
    def length(self, t0: float = 0.0, t1: float = 1.0) -> float:
        """Arc length between two parameters (negative when t1 < t0), to 1e-12 relative."""

    @abstractmethod
    def closest(self, points: ArrayLike) -> tuple[Float, Float]:
        """Parameters (n,) and distances (n,) of the points of the curve nearest to ``points`` (n, 2)."""

    @abstractmethod
    def trim(self, t0: float, t1: float) -> Self:
        """The piece between two parameters t0 < t1; its ends are ``point(t0)`` and ``point(t1)``."""

    @abstractmethod
    def reverse(self) -> Self:
        """The same curve run from end to start."""

    @abstractmethod
    def transform(self, matrix: ArrayLike, offset: ArrayLike = (0.0, 0.0)) -> Curve:
        """The image under p -> matrix @ p + offset, of the same parameter."""

    @abstractmethod
    def turning_points(self, axis: int) -> Float:
        """Sorted parameters inside (0, 1) where the coordinate along ``axis`` turns.

        A stretch of constant coordinate inside a spline gives both its ends, so that between
        consecutive parameters the coordinate is strictly monotone or constant. Turns whose swing is
        below the rounding error of the coordinates are left out.
        """

    @abstractmethod
    def _invert(self, axis: int, values: Float, t0: float | Float, t1: float | Float) -> Float:
        """Parameters (n,) where the coordinate takes ``values`` (n,), in the monotone stretches [t0, t1].

        One stretch for all values, or one (n,) for each.
        """

    @abstractmethod
    def area_moments(self, origin: ArrayLike = (0.0, 0.0)) -> tuple[float, float, float, float, float, float]:
        """This curve's share in the boundary integrals of a region on its left.

        ``(A, Mx, My, Ixx, Ixy, Iyy)``: the integrals of 1, x, y, x^2, xy, y^2 over the region, with x and
        y counted from ``origin``, by Green's theorem for a homogeneous f of degree k:
        ``(k + 2) int f dA = oint f (x dy - y dx)``. Straight joints from stored ends to computed ones are
        included, so the shares of a loop that closes bit for bit belong to a closed loop.
        """

    # -- evaluation -----------------------------------------------------------------------------

    def point(self, t: ArrayLike) -> Float:
        """Points at ``t``; the stored ends at (and beyond) 0 and 1."""
        u = np.asarray(t, np.float64)
        if u.ndim == 0:
            if u <= 0.0:
                return self.start.copy()
            return self.end.copy() if u >= 1.0 else self._point(u)
        p = self._point(np.clip(u, 0.0, 1.0))
        p[u <= 0.0] = self.start
        p[u >= 1.0] = self.end
        return p

    def derivative(self, t: ArrayLike) -> Float:
        """First derivative by t."""
        return self._derivative(np.clip(np.asarray(t, np.float64), 0.0, 1.0))

    def second_derivative(self, t: ArrayLike) -> Float:
        """Second derivative by t."""
        return self._second_derivative(np.clip(np.asarray(t, np.float64), 0.0, 1.0))

    def curvature(self, t: ArrayLike) -> Any:
        """Signed curvature, positive where the curve bends to its left; not finite at a cusp."""
        d, dd = self.derivative(t), self.second_derivative(t)
        with np.errstate(divide="ignore", invalid="ignore"):
            cross = d[..., 0] * dd[..., 1] - d[..., 1] * dd[..., 0]
            result = cross / np.hypot(d[..., 0], d[..., 1]) ** 3
        return result if result.ndim else float(result)

    # -- shape ----------------------------------------------------------------------------------

    @property
    def is_closed(self) -> bool:
        """Whether the curve ends where it starts, bit for bit."""
        return bool((self.start == self.end).all())

    def bounding_box(self) -> tuple[Float, Float]:
        """Exact lowest and highest coordinates, each (2,)."""
        t = np.concatenate([self.turning_points(0), self.turning_points(1), [0.0, 1.0]])
        p = self.point(t)
        return p.min(axis=0), p.max(axis=0)

    def is_constant(self, axis: int, tolerance: float) -> bool:
        """Whether the coordinate along ``axis`` varies by at most ``tolerance`` (in model units)."""
        x = self.point(np.concatenate([[0.0], self.turning_points(axis), [1.0]]))[:, axis]
        return bool(x.max() - x.min() <= tolerance)

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """What kinks inside the curve part it into, in rising order; ``WHOLE`` where there is none."""
        return WHOLE

    # -- pieces ---------------------------------------------------------------------------------

    def split(self, t: float) -> tuple[Self, Self]:
        """The two pieces before and after a parameter inside (0, 1); they meet bit for bit."""
        return self.trim(0.0, t), self.trim(t, 1.0)

    def graph_pieces(self, axis: int) -> tuple[Self, ...]:
        """The curve cut at its turning points: each piece is a function of that coordinate, or constant."""
        t = self.turning_points(axis)
        if len(t) == 0:
            return (self,)
        cuts = [0.0, *t.tolist(), 1.0]
        return tuple(self.trim(a, b) for a, b in itertools.pairwise(cuts))

    def limit(self, axis: int) -> LimitFunction:
        """The other coordinate as a function of this one; for a graph piece, see ``graph_pieces``."""
        from fubini.curves.limit import LimitFunction

        return LimitFunction(self, axis)

    # -- shared by the kinds --------------------------------------------------------------------

    def _check_trim(self, t0: float, t1: float) -> None:
        if not 0.0 <= t0 < t1 <= 1.0:
            raise OptionError(f"trim needs 0 <= t0 < t1 <= 1, not {t0!r} and {t1!r}")

    def _store(self, **fields: Any) -> None:
        """Fill the fields of a frozen value."""
        self.__dict__.update(fields)
