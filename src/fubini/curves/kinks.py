"""Kinks of splines: places inside a curve where its tangent turns at once. What lies between them is a stretch."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fubini.curves import bernstein

if TYPE_CHECKING:
    from fubini.curves.chain import Chain

Float = NDArray[np.float64]

#: A tangent that turns by fewer degrees at a knot counts as smooth. A segment as long as it is asked to be cuts off
#: 0.4 % of its length there, a twentieth of what it may lie off an arc; exporters write arcs with such turns.
SMOOTH = 1.0

#: A piece of a spline shorter than this times the extent of the spline is a point: the kinks at its ends are one. Loops
#: below 1e-9 of the diagonal of a region count as points too.
_POINT = 1.5e-9

#: Control points nearer to an end than this times the extent of the curve tell no direction there, and a derivative
#: shorter than this none either.
_NO_DIRECTION = 1e-7


class Stretch(NamedTuple):
    """Parameters between which a curve has no kink.

    The next stretch begins where this one stops, but where the parameter runs on in one place: then later.
    """

    begin: float
    stop: float


#: The stretches of a curve without kinks.
WHOLE = (Stretch(0.0, 1.0),)


def find_stretches(chain: Chain, turns: Float) -> tuple[Stretch, ...]:
    """What kinks part a chain into: those at its breaks, and cusps inside its pieces.

    ``turns`` (n,) : parameters where a coordinate of the curve turns. At a cusp the derivative vanishes and the tangent
    comes back as it went; some coordinate turns there then. Stretches as short as a point are left out.
    """
    if len(chain.poles) == 1 and not len(turns):
        return WHOLE
    size = float(np.ptp(chain.flat_poles.reshape(-1, 2), axis=0).max())
    long = np.flatnonzero(np.ptp(chain.flat_poles, axis=1).max(axis=1) > _POINT * size)
    stop, begin = _at_breaks(chain, long, size)
    cusps = _cusps(chain, long, turns, size) if chain.degree > 1 else []
    if cusps:
        stop, begin = np.sort(np.concatenate([stop, cusps])), np.sort(np.concatenate([begin, cusps]))
        places = chain.evaluate(np.stack([begin, 0.5 * (begin + stop), stop]), 0)[0]
        kept = np.ptp(places, axis=0).max(axis=1) > _POINT * size
        stop, begin = stop[kept], begin[kept]
    return tuple(Stretch(*pair) for pair in zip(begin.tolist(), stop.tolist(), strict=True))


def _at_breaks(chain: Chain, long: NDArray[np.intp], size: float) -> tuple[Float, Float]:
    """Ends and starts of stretches between the kinks at breaks of the pieces ``long`` (m,), which have a length."""
    at = np.flatnonzero(_turning(chain.flat_poles[long[:-1]], chain.flat_poles[long[1:]], size) > SMOOTH)
    stop = np.concatenate([chain.breaks[long[at] + 1], chain.breaks[long[-1:] + 1]])
    return stop, np.concatenate([chain.breaks[long[:1]], chain.breaks[long[at + 1]]])


def _cusps(chain: Chain, long: NDArray[np.intp], turns: Float, size: float) -> list[float]:
    """Parameters inside the pieces ``long`` (m,) where a coordinate turns and the derivative vanishes."""
    piece = np.clip(np.searchsorted(chain.breaks, turns) - 1, 0, len(chain.poles) - 1)
    width = chain.breaks[piece + 1] - chain.breaks[piece]
    share = (turns - chain.breaks[piece]) / width
    inside = (np.minimum(share, 1.0 - share) > _NO_DIRECTION) & np.isin(piece, long)
    slow = np.hypot(*chain.evaluate(turns, 1)[1].T) * width <= _NO_DIRECTION * size
    found: list[float] = []
    for t, k, u in sorted(zip(turns[inside & slow], piece[inside & slow], share[inside & slow], strict=True)):
        before, after = (part[:, :2] / part[:, 2:] for part in bernstein.split(chain.poles[k], u))
        again = bool(found) and t - found[-1] <= _NO_DIRECTION * width.max()
        if not again and _turning(before[None], after[None], size)[0] > SMOOTH:
            found.append(float(t))
    return found


def _turning(before: Float, after: Float, size: float) -> Float:
    """Degrees (p,) by which the tangent turns from the end of pieces to the start of others, both (p, d + 1, 2)."""
    arriving, leaving = _directions(before[:, ::-1], size), _directions(after, size)
    cross = arriving[:, 1] * leaving[:, 0] - arriving[:, 0] * leaving[:, 1]  # ``arriving`` points back
    return np.degrees(np.abs(np.arctan2(cross, -np.einsum("ij,ij->i", arriving, leaving))))


def _directions(poles: Float, size: float) -> Float:
    """For each piece (p, d + 1, 2) the way (p, 2) from its first control point to the next that lies apart from it."""
    ways = poles[:, 1:] - poles[:, :1]
    apart = np.hypot(ways[..., 0], ways[..., 1]) > _NO_DIRECTION * size
    apart[:, -1] |= ~apart.any(axis=1)
    return ways[np.arange(len(ways)), apart.argmax(axis=1)]
