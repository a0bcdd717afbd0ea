"""What all pictures share: the figure, the colours, writing it to a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fubini.errors import DependencyError, ExportError
from fubini.export.atomic import Transaction

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

#: Formats that pictures can be written in.
PICTURE_SUFFIXES = (".pdf", ".png", ".svg")

FILL = "#dfe8f1"
EDGE = "#4a6076"
BOLD = "#10202f"
FLAWED_COLOUR = "#e0201b"
EXCUSED_COLOUR = "#f59a0c"
TEXT = "#303a44"


def check_picture_path(path: str | Path) -> None:
    """Raise ``ExportError`` for a suffix that pictures do not have."""
    suffix = Path(path).suffix.lower()
    if suffix not in PICTURE_SUFFIXES:
        what = f"unknown suffix {suffix!r} for a picture" if suffix else "the path has no suffix"
        raise ExportError(what, file=str(path), fix="use one of " + ", ".join(PICTURE_SUFFIXES))


def require_matplotlib() -> None:
    """Raise ``DependencyError`` with the command that mends it where matplotlib is missing."""
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise DependencyError("pictures need matplotlib", fix='pip install "fubini[plot]"') from error


def new_figure(low: Float, high: Float, width: float, dpi: float) -> tuple[Figure, Axes, float]:
    """Figure ``width`` inches wide for a drawing between ``low`` and ``high`` (2,), and pixels per unit.

    The figure belongs to no window and no global state, so pictures can be drawn in any thread.
    """
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    span = np.maximum(high - low, 1e-9 * max(float(np.abs(high - low).max()), 1e-300))
    drawn = 0.94 * width
    height = float(np.clip(drawn * span[1] / span[0], 0.2 * width, 0.9 * width))
    figure = Figure(figsize=(width, height + 0.75), dpi=dpi, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.03, 0.55 / (height + 0.75), 0.94, height / (height + 0.75)))
    scale = min(drawn / span[0], height / span[1])
    middle, half = 0.5 * (low + high), 0.5 * np.array([drawn, height]) / scale * 1.02
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
    axes.set_axis_off()
    return figure, axes, float(scale * dpi)


def add_caption(figure: Figure, head: str, text: str, colour: str = TEXT) -> None:
    """Two centred lines under the drawing."""
    height = figure.get_figheight()
    figure.text(0.5, 0.32 / height, head, ha="center", va="bottom", fontsize=10, color=colour, weight="bold")
    figure.text(0.5, 0.26 / height, text, ha="center", va="top", fontsize=8.5, color=TEXT)


def write_figure(figure: Figure, path: str | Path, transaction: Transaction | None = None) -> None:
    """Write the figure whole or not at all, the same bytes every time; within ``transaction`` if given."""
    if transaction is None:
        with Transaction() as own:
            write_figure(figure, path, own)
        return
    from matplotlib import rc_context

    check_picture_path(path)
    suffix = Path(path).suffix.lower()
    nothing: dict[str, Any] = {
        ".png": {"Software": None},
        ".svg": {"Date": None},
        ".pdf": {"CreationDate": None, "ModDate": None},
    }[suffix]
    with rc_context({"svg.hashsalt": "fubini"}):
        figure.savefig(transaction.stage(path), format=suffix[1:], metadata=nothing)
