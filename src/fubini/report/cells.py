"""A picture of Fubini cells: coloured patches, slice lines dashed, CAD edges bold."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fubini.errors import OptionError
from fubini.report.canvas import BOLD, add_caption, check_picture_path, new_figure, write_figure

if TYPE_CHECKING:
    from fubini.cells import Cell
    from fubini.region import Region

Float = NDArray[np.float64]

#: Pale colours that neighbours take in turn.
PALETTE = ("#cfe3f5", "#d8eed3", "#fbe7c3", "#e6d9f0", "#f6d5d5", "#d3ecea", "#efefc6", "#e2dccf")

#: Points drawn on each smooth stretch of a limit or a curve.
SAMPLES = 33


def plot_cells(
    regions: Region | Sequence[Region],
    cells: Sequence[Cell] | Sequence[Sequence[Cell]],
    path: str | Path | None = None,
    *,
    titles: Sequence[str] | None = None,
    width: float = 10.0,
    dpi: float = 160.0,
) -> Any:
    """Draw the cells of a region, or those of several regions beside one another, each in its own plane.

    Parameters
    ----------
    regions, cells : one region and its cells, or as many of both.
    path : a .png, .svg or .pdf to write, or None.
    titles : a word for each region, written under it.

    Returns
    -------
    The ``matplotlib.figure.Figure``. Raises as ``plot`` does.
    """
    if path is not None:
        check_picture_path(path)
    several = list(regions) if isinstance(regions, Sequence) else [regions]
    groups: list[Any] = list(cells) if isinstance(regions, Sequence) else [cells]
    if not several or len(several) != len(groups):
        raise OptionError(f"{len(several)} regions, but {len(groups)} lists of cells")
    shifts, low, high = _arrange([np.asarray(r.bounding_box) for r in several])
    if titles is not None:
        low = low - (0.0, 0.03 * float((high - low).max()))
    figure, axes, _ = new_figure(low, high, width, dpi)
    font = float(np.clip(9.0 - 0.03 * sum(map(len, groups)), 4.0, 9.0))
    for k, (region, group) in enumerate(zip(several, groups)):
        _draw_region(axes, region, group, shifts[k], font if sum(map(len, groups)) <= 150 else 0.0)
        if titles is not None:
            x, y = np.asarray(region.bounding_box).mean(0)[0], region.bounding_box[0][1]
            axes.annotate(
                titles[k], shifts[k] + (x, y), (0, -4), textcoords="offset points", ha="center", va="top", fontsize=7
            )
    total = [cell for group in groups for cell in group]
    kinds = " and ".join(f"{n} {k}" for k in ("I1", "I2") if (n := sum(c.kind == k for c in total)))
    faces = "1 face" if len(several) == 1 else f"{len(several)} faces"
    add_caption(figure, f"{len(total)} cells on {faces}", f"{kinds}; dashed: slices, bold: CAD edges")
    if path is not None:
        write_figure(figure, path)
    return figure


def outline(cell: Cell) -> Float:
    """The boundary of the cell as a polygon (n, 2): along r, then back along s.

    Samples crowd towards the ends of each smooth stretch, where a limit may stand upright.
    """
    low, high = _samples(cell.r.smooth_breaks), _samples(cell.s.smooth_breaks)
    there = cell.place(low, np.asarray(cell.r(low)))
    back = cell.place(high, np.asarray(cell.s(high)))[::-1]
    return np.concatenate([there, back])


def colours(cells: Sequence[Cell]) -> list[int]:
    """Palette numbers, different for neighbours where the palette suffices (greedy, in order)."""
    chosen: list[int] = []
    for i, cell in enumerate(cells):
        taken = {chosen[n] for n in cell.neighbours if n < i}
        free = [c for c in range(len(PALETTE)) if c not in taken]
        chosen.append(free[0] if free else i % len(PALETTE))
    return chosen


def _samples(breaks: Float) -> Float:
    u = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, SAMPLES))
    stretches = breaks[:-1, None] + np.diff(breaks)[:, None] * u
    return np.append(stretches[:, :-1].ravel(), breaks[-1])


def slices(cells: Sequence[Cell]) -> list[Float]:
    """The slice lines between cells, (2, 2) each, no stretch twice: two cells share most of them."""
    sides: dict[tuple[str, float], list[tuple[float, float]]] = {}
    for cell in cells:
        for x in (cell.a, cell.b):
            low, high = float(cell.r(x)), float(cell.s(x))
            if high > low:
                sides.setdefault((cell.kind, x), []).append((low, high))
    lines = []
    for (kind, x), stretches in sides.items():
        for low, high in _union(stretches):
            line = np.array([[x, low], [x, high]])
            lines.append(line if kind == "I1" else line[:, ::-1])
    return lines


def _union(stretches: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Intervals joined where they overlap or touch."""
    joined: list[tuple[float, float]] = []
    for low, high in sorted(stretches):
        if joined and low <= joined[-1][1]:
            joined[-1] = (joined[-1][0], max(joined[-1][1], high))
        else:
            joined.append((low, high))
    return joined


def _arrange(boxes: Sequence[Float]) -> tuple[list[Float], Float, Float]:
    """Shifts (2,) that set boxes in rows, and the corners of the whole, rows about as wide as all is high."""
    spans = [box[1] - box[0] for box in boxes]
    gap = 0.08 * max(float(span.max()) for span in spans)
    limit = 1.3 * float(np.sqrt(sum(float((span + gap).prod()) for span in spans)))
    limit = max(limit, max(float(span[0]) for span in spans))
    x = y = row = right = 0.0
    shifts = []
    for box, span in zip(boxes, spans):
        if x > 0.0 and x + span[0] > limit:
            x, y, row = 0.0, y - row - gap, 0.0
        shifts.append(np.array([x, y - span[1]]) - box[0])
        x, row, right = x + span[0] + gap, max(row, float(span[1])), max(right, x + float(span[0]))
    return shifts, np.array([0.0, y - row]), np.array([right, 0.0])


def _draw_region(axes: Any, region: Region, cells: Sequence[Cell], shift: Float, font: float) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    fill = [PALETTE[c] for c in colours(cells)]
    patches = [outline(cell) + shift for cell in cells]
    axes.add_collection(PolyCollection(patches, facecolors=fill, edgecolors=fill, linewidths=0.4, zorder=1))
    dashed = [line + shift for line in slices(cells)]
    axes.add_collection(LineCollection(dashed, colors="#6b7f93", linewidths=0.8, linestyles=(0, (4, 3)), zorder=2))
    t = np.linspace(0.0, 1.0, 129)
    bold = [curve.point(t) + shift for curve in region.curves]
    axes.add_collection(LineCollection(bold, colors=BOLD, linewidths=1.3, capstyle="round", zorder=3))
    for i, cell in enumerate(cells if font else ()):
        middle = np.array([0.5 * (cell.a + cell.b)])
        inner = 0.5 * (np.asarray(cell.r(middle)) + np.asarray(cell.s(middle)))
        x, y = cell.place(middle, inner)[0] + shift
        axes.text(x, y, str(i), ha="center", va="center", fontsize=font, color="#44525f", zorder=4)
