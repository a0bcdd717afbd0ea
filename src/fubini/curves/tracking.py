"""Curves as tracks: the flat form that compiled code evaluates."""

from __future__ import annotations

from fubini.curves.base import Curve
from fubini.curves.conic import Conic
from fubini.curves.line import Line
from fubini.curves.spline import Spline
from fubini.errors import OptionError
from fubini.tracks import TrackBuilder
from fubini.tracks.table import CONIC, LINE, RATIONAL


def track(builder: TrackBuilder, curve: Curve, backwards: bool = False) -> int:
    """Append ``curve``, or its ``reverse()``, to ``builder`` and return its track number; t keeps its meaning."""
    start, end = (curve.end, curve.start) if backwards else (curve.start, curve.end)
    ends: list[float] = start.tolist() + end.tolist()
    if isinstance(curve, Line):
        return builder.append(LINE, ends)
    if isinstance(curve, Conic):
        angles = [curve.angle1, curve.angle0] if backwards else [curve.angle0, curve.angle1]
        axes = curve.center.tolist() + curve.major.tolist() + curve.minor.tolist()
        return builder.append(CONIC, ends + axes + angles)
    if isinstance(curve, Spline):
        c = curve.reverse().chain if backwards else curve.chain
        head = (len(c.poles), c.poles.shape[1] - 1)
        return builder.add(RATIONAL, start, end, head, c.breaks, c.homogeneous())
    raise OptionError(f"no track for a curve of type {type(curve).__name__}")
