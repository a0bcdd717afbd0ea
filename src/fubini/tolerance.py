"""Named tolerances, all relative to the size of the model unless said otherwise.

A tolerance is passed explicitly to the function that needs it; the names here are the defaults.
"""

from __future__ import annotations

#: Ends of consecutive curves closer than this (times the diagonal) are one vertex.
VERTEX_GAP = 1e-7

#: A boundary node may lie this far (times the diagonal) from its CAD edge.
ON_CURVE = 1e-7

#: A surface is flat when it stays within this (times the diagonal) of one plane.
FLAT = 1e-7

#: Cell areas, moments and the area of the face agree to this (relative).
AREA = 1e-12

#: A curve is replaced by a spline only within this (times the diagonal); the report names it.
CONVERSION = 1e-8

#: Default bounds of a valid triangle (Perumal 2019, section 3.1).
MIN_SKEW = 45.0
MAX_ASPECT_RATIO = 2.0

#: More triangles than this are refused before any work is done.
MAX_TRIANGLES = 50_000_000
