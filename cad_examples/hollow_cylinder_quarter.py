"""Quarter of the cross-section of a hollow cylinder (the paper's second example).

No single cell covers it: the inner arc ends at x = ``INNER``, so it falls into the cells R1 and R2.

    python cad_examples/hollow_cylinder_quarter.py out
"""

from __future__ import annotations

from typing import Any

NAME = "hollow_cylinder_quarter"
SIZE = 0.15
PATTERNS = ("SP13", "SP41")
INNER = 0.5
OUTER = 1.0


def build() -> Any:
    """The face, by build123d."""
    from build123d import CenterArc, Line, make_face

    inner, outer = CenterArc((0, 0), INNER, 0, 90), CenterArc((0, 0), OUTER, 0, 90)
    face = make_face([Line((INNER, 0), (OUTER, 0)), outer, Line((0, OUTER), (0, INNER)), inner]).face()
    face.label = "section"
    return face


if __name__ == "__main__":
    from example import run

    run(NAME, build(), SIZE, PATTERNS)
