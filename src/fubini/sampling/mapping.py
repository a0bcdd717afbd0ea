"""From the reference square to a Fubini cell (Perumal 2019, Eq. 1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.cells import Cell

Float = NDArray[np.float64]


def map_points(cell: Cell, reference: ArrayLike) -> Float:
    """Images (n, 2) in ``cell`` of points (n, 2) of the square [-1, 1]^2.

    For a cell of kind I1

        x = m_x u + c_x,   m_x = (b - a) / 2,         c_x = (a + b) / 2,
        y = m_y v + c_y,   m_y = (s(x) - r(x)) / 2,   c_y = (r(x) + s(x)) / 2;

    for kind I2 y comes first, from v, then x, from u. The sides of the square go to a, b, r and s
    exactly.
    """
    p = np.asarray(reference, float).reshape(-1, 2)
    outer = _between(cell.a, cell.b, p[:, cell.axis])
    inner = _between(cell.r(outer), cell.s(outer), p[:, 1 - cell.axis])
    return cell.place(outer, inner)


def _between(low: Float | float, high: Float | float, w: Float) -> Float:
    """``m w + c`` written so that w = -1 gives ``low`` and w = 1 gives ``high`` bit for bit."""
    return 0.5 * (1.0 - w) * low + 0.5 * (1.0 + w) * high
