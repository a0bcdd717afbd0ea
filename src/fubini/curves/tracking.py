"""Curves as tracks: the flat form that compiled code evaluates."""

from __future__ import annotations

from fubini.curves.base import Curve
from fubini.curves.conic import Conic
from fubini.curves.line import Line
from fubini.curves.spline import Spline
from fubini.errors import OptionError
from fubini.tracks import TrackBuilder
from fubini.tracks.table import CONIC, LINE, RATIONAL


def track(builder: TrackBuilder, curve: Curve) -> int:
    """Append ``curve`` to ``builder`` and return its track number; t keeps its meaning."""
    if isinstance(curve, Line):
        return builder.add(LINE, curve.start, curve.end)
    if isinstance(curve, Conic):
        angles = (curve.angle0, curve.angle1)
        return builder.add(CONIC, curve.start, curve.end, curve.center, curve.major, curve.minor, angles)
    if isinstance(curve, Spline):
        c = curve.chain
        head = (len(c.poles), c.poles.shape[1] - 1)
        return builder.add(RATIONAL, curve.start, curve.end, head, c.breaks, c.homogeneous())
    raise OptionError(f"no track for a curve of type {type(curve).__name__}")
