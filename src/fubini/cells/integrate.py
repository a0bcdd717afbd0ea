"""Integration over cells: Gauss quadrature through the mapping of the reference square.

Over one panel of a cell, with (u, v) on the reference square and Eq. (1) of the paper,

    integral of f = int int f(x(u), y(u, v)) m_x m_y du dv .

The outer variable runs through a second substitution ``x = x0 + (x1 - x0) (1 - cos(pi w)) / 2``, under
which limits with vertical tangents at the ends of a panel (half circles, splines split where they
turn back) become smooth functions of w.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini.cells.cell import Cell
from fubini.cells.decompose import decompose
from fubini.errors import OptionError
from fubini.quadrature import adaptive, gauss
from fubini.region import Region

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: Agreement (relative) at which a panel is no longer halved.
_AGREEMENT = 1e-14


def integrate(
    domain: Region | Cell | Sequence[Cell],
    f: Callable[[Float], Any],
    order: int = 12,
) -> Any:
    """Integral of ``f`` over a region, a cell or several cells.

    Parameters
    ----------
    domain : a region is decomposed first (``decompose(region, "auto")``).
    f : takes points (n, 2) and gives values (n,) or (n, m), or one number.
    order : Gauss points across a cell: exact where f is a polynomial of degree below ``2 order`` in
        the inner variable. Along the outer variable panels are halved until they agree to 1e-14.

    Returns a float, or (m,) for values (n, m).

    >>> from fubini.region import Region
    >>> unit = Region.polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
    >>> round(integrate(unit, lambda p: p[:, 0] * p[:, 1]), 12)
    0.25
    """
    if isinstance(domain, Region):
        cells: Sequence[Cell] = decompose(domain, "auto")
    else:
        cells = (domain,) if isinstance(domain, Cell) else tuple(domain)
        if len({cell.kind for cell in cells}) > 1:
            return sum(integrate([c for c in cells if c.kind == kind], f, order) for kind in ("I1", "I2"))
    if not len(cells):
        raise OptionError("nothing to integrate over: no cells")
    middle = np.array([0.5 * (cells[0].a + cells[0].b)])
    scalar = np.ndim(f(cells[0].place(middle, cells[0].r(middle)))) < 2
    total = _over_cells(cells, f, order)
    return float(total[0]) if scalar else total


def panels(cell: Cell) -> Float:
    """Sorted outer coordinates (k + 1,) between which both limits are smooth."""
    x = np.unique(np.concatenate([cell.r.smooth_breaks, cell.s.smooth_breaks, [cell.a, cell.b]]))
    return x[(x >= cell.a) & (x <= cell.b)]


def _over_cells(cells: Sequence[Cell], f: Callable[[Float], Any], order: int) -> Float:
    """Integrals (m,) over all cells; their panels are laid end to end on w = 0, 1, 2, ..."""
    breaks = [panels(cell) for cell in cells]
    owner = np.repeat(np.arange(len(cells)), [len(x) - 1 for x in breaks])
    low = np.concatenate([x[:-1] for x in breaks])
    width = np.concatenate([np.diff(x) for x in breaks])
    nodes, weights = gauss(order)

    def outer_integrand(w: Float) -> Float:
        k = np.clip(w.astype(np.int64), 0, len(owner) - 1)
        phase = math.pi * (w - k)
        outer = low[k] + width[k] * np.sin(0.5 * phase) ** 2
        points, height = _columns(cells, owner[k], outer, nodes)
        values = np.asarray(f(points), np.float64)
        values = np.full(len(points), values) if values.ndim == 0 else values
        values = values.reshape(len(w), order, -1)
        jacobian = height * width[k] * 0.5 * math.pi * np.sin(phase)
        return np.einsum("nkm,k,n->nm", values, weights, jacobian)

    return adaptive(outer_integrand, np.arange(len(owner) + 1, dtype=float), _AGREEMENT)


def _columns(cells: Sequence[Cell], owner: Int, outer: Float, nodes: Float) -> tuple[Float, Float]:
    """Points (n k, 2) at the Gauss nodes (k,) across the cells at ``outer`` (n,), and the heights (n,)."""
    inner = np.empty((len(outer), len(nodes)))
    height = np.empty(len(outer))
    order = np.argsort(owner, kind="stable")
    stops = np.searchsorted(owner[order], np.arange(len(cells) + 1))
    for i in np.unique(owner):
        mine = order[stops[i] : stops[i + 1]]
        r, s = cells[i].r(outer[mine]), cells[i].s(outer[mine])
        height[mine] = s - r
        inner[mine] = r[:, None] + (s - r)[:, None] * nodes
    return cells[0].place(np.repeat(outer, len(nodes)), inner.ravel()), height
