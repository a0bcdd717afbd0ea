"""Exact plane curves: lines, circular and elliptical arcs, Bezier and B-spline curves, all rational.

Every curve runs over t in [0, 1] and obeys one contract, ``Curve``. The curves know nothing of regions,
cells or CAD; ``track`` writes them into the tables that compiled code evaluates.
"""

from fubini.curves.base import Curve
from fubini.curves.conic import CircularArc, EllipticalArc
from fubini.curves.fit import BezierFit, fit_bezier
from fubini.curves.limit import LimitFunction
from fubini.curves.line import Line
from fubini.curves.spline import Bezier, BSpline
from fubini.curves.tracking import track

__all__ = [
    "BSpline",
    "Bezier",
    "BezierFit",
    "CircularArc",
    "Curve",
    "EllipticalArc",
    "LimitFunction",
    "Line",
    "fit_bezier",
    "track",
]
