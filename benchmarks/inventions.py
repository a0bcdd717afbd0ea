"""Twenty invented parts, written as STEP files: python benchmarks/inventions.py FOLDER

Sheet metal, gears, text, splines, ellipses, fillets, boolean cuts, lofts, shells, mirrored and rotated assemblies:
shapes that no collection of files was asked for, for trying the whole way from a STEP file to a certified mesh.
Needs build123d.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path

from build123d import (
    Axis,
    Box,
    Compound,
    Cone,
    Cylinder,
    Edge,
    Ellipse,
    Face,
    GridLocations,
    Kind,
    Location,
    Plane,
    Polygon,
    Pos,
    Rectangle,
    RegularPolygon,
    Rot,
    Shape,
    SlotOverall,
    Sphere,
    Text,
    Torus,
    Wire,
    chamfer,
    export_step,
    extrude,
    fillet,
    loft,
    mirror,
    offset,
    revolve,
    sweep,
)


def sheet_metal() -> Shape:
    """A bent bracket with round bends, slots and a hem."""
    profile = Edge.make_line((0, 0), (40, 0)), Edge.make_line((40, 0), (40, 30)), Edge.make_line((40, 30), (70, 30))
    spine = Wire(profile).fillet_2d(4, Wire(profile).vertices()[1:3])
    strip = spine.offset_2d(1.0, Kind.ARC)
    part = extrude(Plane.XZ * Face(strip), 25)
    slots = [Pos(x, -12.5, 0) * extrude(SlotOverall(14, 5), 8, both=True) for x in (12, 28)]
    return part - slots


def spur_gear(teeth: int = 17, module: float = 2.0) -> Shape:
    """A gear of involute flanks fitted by splines, with a keyway."""
    pitch, base = teeth * module / 2, teeth * module / 2 * math.cos(math.radians(20))
    tip, root = pitch + module, pitch - 1.25 * module
    inv = math.tan(math.radians(20)) - math.radians(20)
    half = math.pi / (2 * teeth) + inv
    edges: list[Edge] = []
    for k in range(teeth):
        middle = 2 * math.pi * k / teeth

        def flank(side: int, middle: float = middle) -> list[tuple[float, float]]:
            points = []
            for i in range(8):
                r = base + (tip - base) * i / 7
                roll = math.sqrt(max((r / base) ** 2 - 1, 0.0))
                angle = middle + side * (half - (roll - math.atan(roll)))
                points.append((r * math.cos(angle), r * math.sin(angle)))
            return points

        up, down = flank(-1), flank(1)[::-1]
        foot = [(root * math.cos(a), root * math.sin(a)) for a in (middle - half, middle + half)]
        gap = middle + math.pi / teeth
        after = middle + 2 * math.pi / teeth - half
        edges += [
            Edge.make_line(foot[0], up[0]),
            Edge.make_spline(up),
            Edge.make_three_point_arc(up[-1], (tip * math.cos(middle), tip * math.sin(middle)), down[0]),
            Edge.make_spline(down),
            Edge.make_line(down[-1], foot[1]),
            Edge.make_three_point_arc(
                foot[1], (root * math.cos(gap), root * math.sin(gap)), (root * math.cos(after), root * math.sin(after))
            ),
        ]
    blank = extrude(Face(Wire(edges)), 8)
    return blank - Cylinder(5, 30) - Pos(5, 0, 0) * Box(4, 3, 30)


def engraved_plate() -> Shape:
    """Text cut into a plate."""
    return Box(80, 30, 5) - Pos(0, 0, 2) * extrude(Text("Fubini & Co", 12), 2)


def raised_text() -> Shape:
    """Text standing on a tilted plate."""
    return Rot(20, 30, 40) * (Box(60, 20, 2) + Pos(0, 0, 1) * extrude(Text("SaQ%8", 14), 1.5))


def spline_cam() -> Shape:
    """A cam of one closed spline with an elliptic window."""
    outline = Edge.make_spline([(30, 0), (10, 22), (-18, 15), (-22, -8), (5, -20)], periodic=True)
    return extrude(Face(Wire([outline])), 6) - extrude(Ellipse(9, 4), 20, both=True)


def elliptic_flange() -> Shape:
    """Ellipse in ellipse, with bolt holes."""
    sketch = Ellipse(40, 22) - Ellipse(22, 10)
    holes = [Pos(x, 0, 0) * Cylinder(3, 40) for x in (-32, 32)]
    return extrude(sketch, 7) - holes


def filleted_block() -> Shape:
    """A block with fillets of different radii and chamfers."""
    block = Box(30, 20, 12)
    block = fillet(block.edges().filter_by(Axis.Z), 3)
    block = chamfer(block.faces().sort_by(Axis.Z)[-1].edges(), 1.2)
    return fillet(block.faces().sort_by(Axis.Z)[0].edges(), 0.8)


def crossed_cylinders() -> Shape:
    """Boolean cuts that leave thin rims."""
    block = Box(20, 20, 20) - Cylinder(9.7, 40) - Rot(90, 0, 0) * Cylinder(6, 40)
    return block - Pos(10, 10, 10) * Sphere(6)


def loft_with_caps() -> Shape:
    """From a hexagon to an ellipse."""
    return loft([RegularPolygon(10, 6).face(), (Pos(3, 2, 18) * Ellipse(6, 3)).face()])


def open_shell() -> Shape:
    """A thin box open at the top."""
    block = Box(40, 30, 15)
    return offset(block, -0.8, openings=block.faces().sort_by(Axis.Z)[-1])


def mirrored_pair() -> Shape:
    """An odd part beside its mirror image."""
    part = extrude(Polygon((0, 0), (20, 0), (24, 9), (8, 16), (2, 12), align=None), 5)
    part = Pos(2, 1, 0) * (part - Pos(8, 6, 0) * Cylinder(2.5, 20))
    return Compound(children=[part, mirror(part, Plane.YZ)])


def nested_assembly() -> Shape:
    """Placed groups of placed parts."""
    pin = Cylinder(2, 10) + Pos(0, 0, 5) * Cylinder(4, 2)
    row = Compound(children=[Location((12 * i, 0, 0), (0, 0, 20 * i)) * pin for i in range(3)])
    plate = Pos(12, 0, -6) * (Box(40, 14, 2) - [Pos(12 * (i - 1), 0, 0) * Cylinder(2.1, 5) for i in range(3)])
    return Compound(children=[Location((5, 50, 3), (30, 0, 45)) * Compound(children=[row, plate]), Box(5, 5, 5)])


def perforated() -> Shape:
    """Sixty holes close together."""
    sheet = Rectangle(60, 36)
    with_holes = sheet - [loc * RegularPolygon(2.3, 6) for loc in GridLocations(6, 6, 9, 5)]
    return extrude(with_holes, 1)


def ratchet() -> Shape:
    """Sharp teeth like those of a saw."""
    points = []
    for k in range(10):
        a = 2 * math.pi * k / 10
        points += [(20 * math.cos(a), 20 * math.sin(a)), (12 * math.cos(a + 0.08), 12 * math.sin(a + 0.08))]
    return extrude(Polygon(*points, align=None), 3)


def tangent_slivers() -> Shape:
    """Circles that touch the sides of a plate from inside: cusps."""
    sheet = Rectangle(40, 20) - Pos(-10, 0.0, 0) * Rectangle(6, 6)
    arc = Edge.make_three_point_arc((0, -10), (10, 0), (0, 10))
    lens = Face(Wire([arc, Edge.make_line((0, 10), (0, -10))]))
    return extrude(sheet - lens, 2)


def cone_section() -> Shape:
    """A cone cut along a hyperbola, and one along ellipses."""
    cone = Cone(12, 2, 20)
    steep, slanted = cone & Pos(16, 0, 0) * Box(20, 40, 40), cone & Rot(0, 25, 0) * Box(60, 60, 14)
    return Compound(children=[steep, Pos(40, 0, 0) * slanted])


def half_torus() -> Shape:
    """A torus cut through: two rings of caps and an offset section."""
    return Torus(15, 4) & Pos(0, 16, 0) * Box(60, 30, 20)


def swept_rail() -> Shape:
    """A profile with a dovetail swept along a spline."""
    path = Edge.make_spline([(0, 0, 0), (0, 30, 4), (6, 60, 0)])
    profile = Plane((0, 0, 0), x_dir=(1, 0, 0), z_dir=path.tangent_at(0)) * Polygon(
        (-5, 0), (5, 0), (3, 4), (7, 8), (-7, 8), (-3, 4), align=None
    )
    return sweep(profile.face(), path)


def thin_washer() -> Shape:
    """A ring a hundredth as wide as it is large, and a tiny plate far away."""
    ring = Cylinder(50, 1) - Cylinder(49.5, 2)
    return Compound(children=[ring, Pos(300, 0, 0) * Box(0.5, 0.4, 0.3)])


def revolved_pulley() -> Shape:
    """A revolved profile, cut open by a wedge, with lightening holes."""
    profile = Plane.XZ * Polygon((4, -6), (20, -6), (20, -4), (15, 0), (20, 4), (20, 6), (4, 6), align=None)
    wheel = revolve(profile, Axis.Z, 300)
    return wheel - [Rot(0, 0, a) * Pos(9.5, 0, 0) * Cylinder(2.2, 30) for a in (60, 120, 180, 240)]


PARTS: tuple[Callable[[], Shape], ...] = (
    sheet_metal, spur_gear, engraved_plate, raised_text, spline_cam, elliptic_flange, filleted_block,
    crossed_cylinders, loft_with_caps, open_shell, mirrored_pair, nested_assembly, perforated, ratchet,
    tangent_slivers, cone_section, half_torus, swept_rail, thin_washer, revolved_pulley,
)  # fmt: skip


def main(folder: Path) -> None:
    """Write every part."""
    folder.mkdir(parents=True, exist_ok=True)
    for make in PARTS:
        export_step(make(), folder / f"{make.__name__}.step")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
