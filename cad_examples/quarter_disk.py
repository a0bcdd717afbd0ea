"""Quarter of a disk of radius 1: two straight sides and an arc (the paper's first example).

python cad_examples/quarter_disk.py out
"""

from __future__ import annotations

import math
from typing import Any

NAME = "quarter_disk"
SIZE = 0.2
PATTERNS = ("SP13", "SP41", "ASP20", "ASP48")


def build() -> Any:
    """The face, by build123d."""
    from build123d import CenterArc, Line, make_face

    arc = CenterArc((0, 0), 1, 0, 90)
    face = make_face([Line((0, 0), (1, 0)), arc, Line((0, 1), (0, 0))]).face()
    face.label = "quarter"
    return face


def build_cadquery() -> Any:
    """The same face, by CadQuery: a workplane that holds one face."""
    import cadquery as cq

    middle = math.sqrt(0.5)
    outline = cq.Workplane().lineTo(1, 0).threePointArc((middle, middle), (0, 1)).close().wire()
    return cq.Workplane().add(cq.Face.makeFromWires(outline.val()))


if __name__ == "__main__":
    from example import run

    run(NAME, build(), SIZE, PATTERNS, direction="y")
