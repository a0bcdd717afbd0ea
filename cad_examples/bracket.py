"""An angle bracket with holes, slots, rounded corners and a fillet in the bend: the part of ``make demo``.

    python cad_examples/bracket.py out
    python cad_examples/bracket.py out --step     only write out/bracket.step

Dimensions in millimetres. Of its 34 faces 16 are plane; the walls of the holes, the corners and the bend are not.
"""

from __future__ import annotations

from typing import Any

NAME = "bracket"
SIZE = 3.0
PATTERNS: tuple[str, ...] = ()

WIDTH, DEPTH, HEIGHT, THICKNESS = 80.0, 60.0, 50.0, 6.0
BEND, CORNER = 8.0, 10.0  # radii


def build() -> Any:
    """The part, by build123d."""
    from build123d import Axis, Box, Cylinder, GeomType, Pos, fillet

    base = Pos(0, DEPTH / 2, THICKNESS / 2) * Box(WIDTH, DEPTH, THICKNESS)
    wall = Pos(0, THICKNESS / 2, HEIGHT / 2) * Box(WIDTH, THICKNESS, HEIGHT)
    part = base + wall
    along = part.edges().filter_by(Axis.X)
    bend = [e for e in along if abs(e.center().Y - THICKNESS) < 1e-6 and abs(e.center().Z - THICKNESS) < 1e-6]
    part = fillet(bend, BEND)
    tips = [e for e in part.edges().filter_by(GeomType.LINE) if _is_tip(e)]
    part = fillet(tips, CORNER)
    for x in (-26.0, 26.0):
        part -= Pos(x, 45, THICKNESS / 2) * Cylinder(4.5, 2 * THICKNESS)
        part -= Pos(x, 26, THICKNESS / 2) * Cylinder(3.0, 2 * THICKNESS)
        part -= _upright_slot(x)
    part -= Pos(0, 38, THICKNESS / 2) * Cylinder(11.0, 2 * THICKNESS)
    part -= _window()
    part.label = "bracket"
    return part


def _is_tip(edge: Any) -> bool:
    """Whether an edge is one of the four sharp corners of the outline, seen along its plate."""
    if abs(edge.length - THICKNESS) > 1e-6:
        return False
    middle = edge.center()
    at_side = abs(abs(middle.X) - WIDTH / 2) < 1e-6
    upright = abs(edge.tangent_at(0.5).Z) > 0.5
    far = abs(middle.Y - DEPTH) < 1e-6 if upright else abs(middle.Z - HEIGHT) < 1e-6
    return at_side and far


def _upright_slot(x: float) -> Any:
    """A vertical slot through the wall."""
    from build123d import Pos, Rot, SlotOverall, extrude

    outline = Pos(x, 0, 31) * Rot(90, 0, 0) * Rot(0, 0, 90) * SlotOverall(20, 7)
    return extrude(outline, amount=2 * THICKNESS, both=True)


def _window() -> Any:
    """A rounded rectangular opening in the middle of the wall."""
    from build123d import Pos, RectangleRounded, Rot, extrude

    outline = Pos(0, 0, 32) * Rot(90, 0, 0) * RectangleRounded(26, 14, 3)
    return extrude(outline, amount=2 * THICKNESS, both=True)


if __name__ == "__main__":
    from example import run

    run(NAME, build(), SIZE, PATTERNS)
