"""Reference points on the square [-1, 1]^2, coordinates (u, v).

``SP13`` and ``SP41`` are quincunx lattices: an n x n grid and the centres of its squares. The paper
names ``ASP20`` and ``ASP48``, 20 and 48 points with more of them in the upper half, without giving
coordinates; the sets here are a reconstruction with these counts, symmetric in u, from the graded
family: rows of evenly spaced points, mostly staggered, each 0.8 times as far from the next as from
the one below.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.errors import OptionError

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: Points in the rows of the graded sets, from v = -1 to v = 1.
_ASP20 = (3, 4, 3, 4, 3, 3)
_ASP48 = (5, 6, 5, 6, 5, 6, 5, 5, 5)

#: Ratio of the distances of their rows.
_CLOSER = 0.8


def quincunx(n: int, m: int | None = None) -> Float:
    """The lattice SP(n, m): n x m grid points and (n-1) x (m-1) centres, (n m + (n-1)(m-1), 2).

    ``n`` counts the columns (along u), ``m`` the rows; m = n when not given. Rows come from v = -1
    upwards, each from u = -1. Where the image of a square of the grid is sqrt(3) times as long in one
    direction as in the other, the image of the lattice is the hexagonal one.
    """
    m = n if m is None else m
    if n < 2 or m < 2:
        raise OptionError(f"a lattice of {n} x {m} points", fix="take at least 2 x 2")
    rows = []
    for k in range(2 * m - 1):
        u = _even(n) if k % 2 == 0 else _middles(n)
        rows.append(_row(u, (k - (m - 1)) / (m - 1)))
    return np.concatenate(rows)


def graded(counts: Sequence[int], ratio: float | None = None) -> Float:
    """Rows of evenly spaced points from v = -1 to v = 1: ``counts[i]`` in row i, (sum(counts), 2).

    ``ratio`` is that of consecutive row distances (below 1: closer towards v = 1); when not given,
    the distance of two rows is proportional to the spacing of the points in them. Symmetric in u.
    """
    if len(counts) < 2 or min(counts) < 2:
        raise OptionError(f"rows of {tuple(counts)} points", fix="take two rows of two points at least")
    if ratio is not None and not (np.isfinite(ratio) and ratio > 0.0):
        raise OptionError(f"a ratio of row distances of {ratio!r}", fix="take a positive number")
    spacing = 2.0 / (np.asarray(counts, float) - 1.0)
    step = spacing[:-1] + spacing[1:] if ratio is None else ratio ** np.arange(len(counts) - 1.0)
    height = np.concatenate([[0.0], np.cumsum(step)])
    v = -1.0 + 2.0 * height / height[-1]
    return np.concatenate([_row(_even(n), height) for n, height in zip(counts, v, strict=True)])


def sp13() -> Float:
    """The 13 points SP(3, 3)."""
    return quincunx(3)


def sp41() -> Float:
    """The 41 points SP(5, 5)."""
    return quincunx(5)


def asp20() -> Float:
    """20 points, 13 of them in the upper half; a reconstruction."""
    return graded(_ASP20, _CLOSER)


def asp48() -> Float:
    """48 points, 32 of them in the upper half; a reconstruction."""
    return graded(_ASP48, _CLOSER)


REFERENCE_SETS = {"SP13": sp13, "SP41": sp41, "ASP20": asp20, "ASP48": asp48}


def reference_points(name: str) -> Float:
    """The set of this name: one of ``REFERENCE_SETS``, in capitals or not."""
    try:
        return REFERENCE_SETS[name.upper()]()
    except KeyError:
        raise OptionError(f"no reference points {name!r}; there are {', '.join(REFERENCE_SETS)}") from None


def turn(points: ArrayLike, quarter_turns: int) -> Float:
    """Points (n, 2) turned counter-clockwise by multiples of 90 degrees, exactly."""
    p = np.array(points, dtype=float)
    for _ in range(quarter_turns % 4):
        p = np.stack([-p[:, 1], p[:, 0]], axis=1)
    return p


def distinct(points: ArrayLike, tolerance: float) -> tuple[Float, Int]:
    """Points without repetitions, and the number of the kept point for each of the given ones.

    Of points (n, 2) within ``tolerance`` of each other the first is kept: a point is dropped when an
    earlier one that is kept lies that close. Order is kept.
    """
    p = np.asarray(points, float).reshape(-1, 2)
    pairs = _close_pairs(p, tolerance)
    keeper = np.arange(len(p))
    for i, j in pairs.tolist():
        if keeper[j] == j and keeper[i] == i:
            keeper[j] = i
    kept = np.flatnonzero(keeper == np.arange(len(p)))
    number = np.empty(len(p), dtype=np.int64)
    number[kept] = np.arange(len(kept))
    return p[kept], number[keeper]


def _close_pairs(points: Float, tolerance: float) -> Int:
    """Pairs i < j (k, 2) of points within ``tolerance`` of each other, by j, then by i.

    Along x: a k-d tree is no faster for what there is here, and takes longer to load than all of this package.
    """
    order = np.argsort(points[:, 0], kind="stable")
    x = points[order, 0]
    ends = np.searchsorted(x, x + tolerance, side="right")
    found = [np.empty((0, 2), np.int64)]
    first, step = np.arange(len(x)), 1
    while len(first := first[first + step < ends[first]]):
        near = np.hypot(*(points[order[first + step]] - points[order[first]]).T) <= tolerance
        found.append(np.sort(np.stack([order[first], order[first + step]], axis=1)[near], axis=1))
        step += 1
    pairs = np.concatenate(found)
    return pairs[np.lexsort((pairs[:, 0], pairs[:, 1]))]


def _even(n: int) -> Float:
    """n even points from -1 to 1, symmetric bit for bit."""
    return np.arange(1 - n, n, 2) / (n - 1)


def _middles(n: int) -> Float:
    return np.arange(2 - n, n - 1, 2) / (n - 1)


def _row(u: Float, v: float) -> Float:
    return np.stack([u, np.full(len(u), v)], axis=1)
