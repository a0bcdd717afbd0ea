"""Orientation and in-circle tests whose signs are exact, on arrays of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini._kernels_predicates import in_circle_many, orient_many

Sign = NDArray[np.int8]


def orientation(a: ArrayLike, b: ArrayLike, c: ArrayLike) -> Sign:
    """Which way the corners a, b, c turn: 1 left (counter-clockwise), -1 right, 0 collinear.

    Parameters
    ----------
    a, b, c : (..., 2) points; the leading shapes broadcast.

    Returns
    -------
    (...,) int8, the exact sign for coordinates of magnitude zero or 1e-60 to 1e60.

    Examples
    --------
    >>> int(orientation((0, 0), (1, 0), (0, 1)))
    1
    >>> orientation((0, 0), (0.1, 0.1), [(0.3, 0.3), (0.3, 0.30000000000000004)]).tolist()
    [0, 1]
    """
    points, shape = _rows(a, b, c)
    out = np.empty(len(points[0]), np.int8)
    orient_many(*points, out)
    return out.reshape(shape)


def in_circle(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike) -> Sign:
    """Where d lies of the circle through a, b, c (counter-clockwise): 1 inside, -1 outside, 0 on it.

    Parameters
    ----------
    a, b, c, d : (..., 2) points; the leading shapes broadcast. Clockwise a, b, c change the sign.

    Returns
    -------
    (...,) int8, the exact sign for coordinates of magnitude zero or 1e-60 to 1e60.

    Examples
    --------
    >>> in_circle((0, 0), (1, 0), (1, 1), [(0, 1), (0.5, 0.5), (2, 2)]).tolist()
    [0, 1, -1]
    """
    points, shape = _rows(a, b, c, d)
    out = np.empty(len(points[0]), np.int8)
    in_circle_many(*points, out)
    return out.reshape(shape)


def _rows(*points: ArrayLike) -> tuple[list[NDArray[np.float64]], tuple[int, ...]]:
    """The points broadcast against each other as contiguous (n, 2) arrays, and their leading shape."""
    wide = np.broadcast_arrays(*[np.asarray(p, np.float64) for p in points])
    shape = wide[0].shape[:-1]
    return [np.array(p, np.float64, order="C").reshape(-1, 2) for p in wide], shape
