"""A combination wrench: an open jaw, a tapered handle and a ring with a hexagonal socket (the third example).

    python cad_examples/wrench.py out

Dimensions in millimetres, for a hexagon of 19 across the flats.
"""

from __future__ import annotations

from typing import Any

NAME = "wrench"
SIZE = 3.0
PATTERNS = ("SP13", "SP41")

LENGTH = 150.0  # from the middle of the head to the middle of the ring
FLATS = 19.0
HEAD, RING = 20.0, 15.0  # outer radii
JAW_TURN = 15.0  # degrees between the jaw and the handle
JAW_DEPTH = 6.0  # how far the jaw reaches behind the middle of the head
HANDLE_AT_HEAD, HANDLE_AT_RING = 16.0, 12.0
FILLET = 12.0  # where the handle runs into head and ring


def build() -> Any:
    """The face, by build123d."""
    from build123d import Circle, Mode, Polygon, Pos, RegularPolygon, Rot, fillet

    a, b = HANDLE_AT_HEAD / 2, HANDLE_AT_RING / 2
    handle = Polygon((0, -a), (LENGTH, -b), (LENGTH, b), (0, a), align=None, mode=Mode.PRIVATE)
    body = Circle(HEAD) + handle + Pos(LENGTH, 0) * Circle(RING)
    necks = [v for v in body.vertices() if 0 < v.X < LENGTH]
    body = fillet(necks, FILLET)
    socket = Pos(LENGTH, 0) * Rot(0, 0, 30) * RegularPolygon(FLATS / 2, 6, major_radius=False)
    face = (body - _jaw() - socket).face()
    face.label = "wrench"
    return face


def _jaw() -> Any:
    """The open end: two parallel flats and the bottom of a hexagon between them, open to the left."""
    from build123d import Polygon, Rot

    half = FLATS / 2
    far = -2 * HEAD
    outline = Polygon(
        (far, -half), (0, -half), (JAW_DEPTH, -half + JAW_DEPTH * 0.9), (JAW_DEPTH, half - JAW_DEPTH * 0.9),
        (0, half), (far, half),
        align=None,
    )  # fmt: skip
    return Rot(0, 0, JAW_TURN) * outline


if __name__ == "__main__":
    from example import run

    run(NAME, build(), SIZE, PATTERNS)
