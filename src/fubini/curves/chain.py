"""Chains of rational Bezier pieces: the inner form of Bezier and B-spline curves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fubini.curves import bernstein
from fubini.curves.base import NOISE
from fubini.curves.nearest import Table, sample
from fubini.errors import GeometryError

Float = NDArray[np.float64]

#: Parameters closer than this to a break are taken to be the break.
_SNAP = 4 * np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class Chain:
    """Consecutive Bezier pieces of one degree.

    Attributes
    ----------
    breaks : (p + 1,) from 0 to 1.
    poles : (p, d + 1, 3) homogeneous control points ``w x, w y, w`` with x, y counted from ``origin``.
    origin : (2,) a point amid the control points, so that far-off curves keep their accuracy.
    rational : whether the weights differ; else they are all one.
    """

    breaks: Float
    poles: Float
    origin: Float
    rational: bool

    @property
    def degree(self) -> int:
        """Degree of the pieces."""
        return self.poles.shape[1] - 1

    def homogeneous(self) -> Float:
        """Control points (p, d + 1, 3) counted from the true origin."""
        h = self.poles.copy()
        h[..., :2] += self.origin * h[..., 2:]
        return h

    def evaluate(self, t: Float, order: int) -> list[Float]:
        """Position and derivatives up to ``order`` (at most 2) at t (...,): each (..., 2)."""
        flat = t.reshape(-1)
        piece, u, width = self._locate(flat)
        c = self.poles[piece]
        if not self.rational:
            values = bernstein.jet(c[..., :2], u, order)
        else:
            h = bernstein.jet(c, u, order)
            w = h[0][:, 2:]
            values = [h[0][:, :2] / w]
            if order >= 1:
                values.append((h[1][:, :2] - h[1][:, 2:] * values[0]) / w)
            if order >= 2:
                values.append((h[2][:, :2] - h[2][:, 2:] * values[0] - 2.0 * h[1][:, 2:] * values[1]) / w)
        values[0] = values[0] + self.origin
        scaled = [v / width**k if k else v for k, v in enumerate(values)]
        return [v.reshape(*t.shape, 2) for v in scaled]

    def _locate(self, t: Float) -> tuple[NDArray[np.intp], Float, Float]:
        """Piece, local parameter (n,) and width (n, 1) of its interval."""
        if len(self.poles) == 1:
            return np.zeros(len(t), np.intp), t, np.ones((1, 1))
        piece = np.clip(np.searchsorted(self.breaks, t, side="right") - 1, 0, len(self.poles) - 1)
        width = self.breaks[piece + 1] - self.breaks[piece]
        return piece, (t - self.breaks[piece]) / width, width[:, None]

    def trim(self, t0: float, t1: float) -> Chain:
        """The pieces between two parameters, breaks mapped to [0, 1]."""
        first = int(np.searchsorted(self.breaks, t0 + _SNAP, side="right")) - 1
        last = int(np.searchsorted(self.breaks, t1 - _SNAP, side="left")) - 1
        first = min(max(first, 0), len(self.poles) - 1)
        last = min(max(last, first), len(self.poles) - 1)
        poles = self.poles[first : last + 1].copy()
        ends = []
        for k, t in ((first, t0), (last, t1)):
            u = float((t - self.breaks[k]) / (self.breaks[k + 1] - self.breaks[k]))
            ends.append(min(max(u, 0.0), 1.0))
        if first == last:
            poles[0] = bernstein.restrict(poles[0], ends[0], ends[1])
        else:
            poles[0] = bernstein.restrict(poles[0], ends[0], 1.0)
            poles[-1] = bernstein.restrict(poles[-1], 0.0, ends[1])
        breaks = (np.concatenate([[t0], self.breaks[first + 1 : last + 1], [t1]]) - t0) / (t1 - t0)
        breaks[-1] = 1.0
        return Chain(breaks, poles, self.origin, self.rational)

    def reverse(self) -> Chain:
        """The chain run backwards."""
        return Chain(1.0 - self.breaks[::-1], self.poles[::-1, ::-1].copy(), self.origin, self.rational)

    @cached_property
    def table(self) -> Table:
        """Samples to start searches from, all breaks included."""
        per = 3 * self.degree
        inner = self.breaks[:-1, None] + np.diff(self.breaks)[:, None] * (np.arange(per) / per)
        return sample(lambda t: self.evaluate(t, 0)[0], np.concatenate([inner.ravel(), [1.0]]))

    @cached_property
    def flat_poles(self) -> Float:
        """Control points (p, d + 1, 2) counted from ``origin``."""
        return self.poles[..., :2] / self.poles[..., 2:]

    def noise(self, axis: int) -> float:
        """Differences of the coordinate below this are rounding errors, also of a curve that this was trimmed from."""
        x, size = self.flat_poles[..., axis], float(np.ptp(self.flat_poles.reshape(-1, 2), axis=0).max())
        trimmed = max(float(np.abs(x).max()), abs(float(self.origin[axis])))
        return NOISE * max(float(np.abs(x + self.origin[axis]).max()), size, trimmed)

    def flats(self, axis: int) -> NDArray[np.bool_]:
        """Pieces (p,) of constant coordinate: within rounding, and too long for a mere vertical tangent."""
        extent = np.ptp(self.flat_poles, axis=1)
        size = float(np.ptp(self.flat_poles.reshape(-1, 2), axis=0).max())
        noise = self.noise(axis)
        return (extent[:, axis] <= noise) & (extent[:, 1 - axis] > 4.0 * np.sqrt(noise * size))

    def extremes(self, axis: int) -> Float:
        """Sorted parameters (m,) from 0 to 1, among them all breaks and all extremes of the coordinate."""
        x, w = self.poles[..., axis], self.poles[..., 2]
        rate = bernstein.derivative(x)
        if self.rational:  # the numerator of (x / w)'
            rate = bernstein.product(rate, w) - bernstein.product(x, bernstein.derivative(w))
        found = [self.breaks]
        for k in np.nonzero((rate.min(axis=1) <= 0.0) & (rate.max(axis=1) >= 0.0))[0]:
            u = np.array(bernstein.sign_changes(rate[k]))
            found.append(self.breaks[k] + u * (self.breaks[k + 1] - self.breaks[k]))
        return np.unique(np.concatenate(found))


def make_chain(breaks: Float, poles: Float) -> Chain:
    """A chain from homogeneous control points (p, d + 1, 3) counted from the true origin."""
    w = poles[..., 2]
    if not (w > 0.0).all():
        raise GeometryError("a spline has a weight that is not positive")
    xy = poles[..., :2] / w[..., None]
    origin = (xy.min(axis=(0, 1)) + xy.max(axis=(0, 1))) / 2.0
    rational = bool((w != w[0, 0]).any())
    if rational:
        poles = np.concatenate([(xy - origin) * w[..., None], w[..., None]], axis=-1)
    else:
        poles = np.concatenate([xy - origin, np.ones((*w.shape, 1))], axis=-1)
    return Chain(breaks, poles, origin, rational)


def bezier_pieces(degree: int, knots: Float, poles: Float) -> tuple[Float, Float]:
    """Break knots (p + 1,) and Bezier control points (p, d + 1, m) of a B-spline with poles (n, m).

    The control points of the piece over [a, b] are the blossom at ``a, .., a, b, .., b`` (Ramshaw 1989),
    computed by de Boor's scheme for all pieces at once; clamped or not.
    """
    d, n = degree, len(poles)
    spans = np.nonzero(knots[d:n] < knots[d + 1 : n + 1])[0] + d
    near = knots[spans[:, None] + np.arange(1 - d, d + 1)]  # (p, 2 d) knots that carry each span
    c = np.repeat(poles[spans[:, None] + np.arange(-d, 1)][:, None], d + 1, axis=1)  # (p, i, j, m)
    a, b = knots[spans], knots[spans + 1]
    for r in range(1, d + 1):
        low, high = near[:, r - 1 : d], near[:, d : 2 * d - r + 1]  # ends of the supports, (p, d - r + 1)
        argument = np.where(np.arange(d + 1) >= r, b[:, None], a[:, None])  # r-th argument of blossom i
        alpha = (argument[:, :, None] - low[:, None]) / (high - low)[:, None]
        c = (1.0 - alpha)[..., None] * c[:, :, :-1] + alpha[..., None] * c[:, :, 1:]
    return np.concatenate([a, b[-1:]]), c[:, :, 0]
