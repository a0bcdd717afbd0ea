"""Random solids through a CAD kernel: outlines extruded or revolved, then holes, pockets, fillets, chamfers, shells.

Every part follows from its seed alone. What the kernel refuses to build is left out of the part; bodies that it calls
invalid, such as a profile that crosses itself, are drawn again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import build123d as bd
import numpy as np


def random_part(seed: int) -> Any:
    """A ``build123d.Part`` of one solid or more."""
    rng = np.random.default_rng(seed)
    part = next(body for body in iter(lambda: _BODIES[seed % len(_BODIES)](rng), None) if body.is_valid)
    for _ in range(int(rng.integers(1, 5))):
        feature = _FEATURES[int(rng.integers(len(_FEATURES)))]
        part = _tried(lambda: feature(rng, part), part)  # noqa: B023 - called at once
    place = bd.Location(tuple(rng.uniform(-50, 50, 3)), tuple(rng.uniform(0, 360, 3)))
    return part.moved(place) if rng.random() < 0.5 else part


def _tried(make: Callable[[], Any], otherwise: Any) -> Any:
    """What ``make`` gives, if it is a valid solid and has planar faces."""
    try:
        found = make()
        flat = any(f.geom_type == bd.GeomType.PLANE for f in found.faces())
        # the kernel calls bodies valid that have a face without an outline, and so no end
        return found if flat and found.is_valid and 0.0 < found.volume < 1e9 else otherwise
    except Exception:  # the kernel raises whatever it likes
        return otherwise


# ---- bodies --------------------------------------------------------------------------------------


def _star(rng: Any, inner: float, outer: float, count: int) -> list[tuple[float, float]]:
    """Corners of a star-shaped polygon."""
    angles = np.sort(rng.uniform(0.0, 2.0 * math.pi, count)) + np.linspace(0.0, 0.01, count)
    radii = rng.uniform(inner, outer, count)
    return list(zip((radii * np.cos(angles)).tolist(), (radii * np.sin(angles)).tolist(), strict=True))


def _polygon(rng: Any) -> Any:
    outline = bd.Polyline(*_star(rng, 12.0, 40.0, int(rng.integers(5, 14))), close=True)
    return _solid(rng, bd.make_face(outline))


def _curved(rng: Any) -> Any:
    points = _star(rng, 20.0, 40.0, int(rng.integers(5, 9)))
    return _solid(rng, bd.make_face(bd.Spline(*points, periodic=True)))


def _mixed(rng: Any) -> Any:
    """Two rounded boxes, a disk and an ellipse in one outline."""
    sketch = bd.RectangleRounded(rng.uniform(30, 60), rng.uniform(20, 40), rng.uniform(0.5, 9.0))
    sketch += bd.Pos(rng.uniform(-20, 20), rng.uniform(-15, 15)) * bd.Ellipse(rng.uniform(8, 30), rng.uniform(4, 12))
    sketch += bd.Pos(rng.uniform(-20, 20), rng.uniform(-15, 15)) * bd.Circle(rng.uniform(5, 18))
    sketch += bd.Rot(0, 0, rng.uniform(0, 180)) * bd.Rectangle(rng.uniform(30, 70), rng.uniform(2, 15))
    return _solid(rng, sketch)


def _revolved(rng: Any) -> Any:
    """A profile beside an axis, turned by less than a full turn: two flat ends and flat rings."""
    points = [(x + 45.0, y) for x, y in _star(rng, 8.0, 30.0, int(rng.integers(4, 9)))]
    profile = bd.make_face(bd.Polyline(*points, close=True))
    return bd.revolve(bd.Plane.XZ * profile, bd.Axis.Z, float(rng.uniform(20.0, 340.0)))


def _block(rng: Any) -> Any:
    return bd.Box(*rng.uniform(5.0, 60.0, 3).tolist())


def _solid(rng: Any, face: Any) -> Any:
    taper = float(rng.uniform(0.0, 12.0)) if rng.random() < 0.3 else 0.0
    height = float(rng.uniform(2.0, 30.0))
    straight = bd.extrude(face, height)
    return _tried(lambda: bd.extrude(face, height, taper=taper), straight) if taper else straight


# ---- features ------------------------------------------------------------------------------------


def _top(part: Any) -> tuple[Any, Any]:
    """The highest flat face and its bounding box."""
    flat = [f for f in part.faces() if f.geom_type == bd.GeomType.PLANE and f.normal_at().Z > 0.99]
    face = max(flat, key=lambda f: (f.center().Z, f.area))
    return face, face.bounding_box()


def _place(rng: Any, box: Any) -> tuple[float, float, float]:
    return float(rng.uniform(box.min.X, box.max.X)), float(rng.uniform(box.min.Y, box.max.Y)), box.max.Z


def _hole(rng: Any, part: Any) -> Any:
    _, box = _top(part)
    radius = 10.0 ** rng.uniform(-0.7, 0.9)
    return part - bd.Pos(*_place(rng, box)) * bd.Cylinder(radius, 2.0 * part.bounding_box().size.Z + 1.0)


def _pattern(rng: Any, part: Any) -> Any:
    """A grid of round, square or hexagonal holes."""
    _, box = _top(part)
    nx, ny = (int(k) for k in rng.integers(2, 7, 2))
    pitch = min(box.size.X / (nx + 1), box.size.Y / (ny + 1))
    r = pitch * rng.uniform(0.15, 0.495)
    shape = (bd.Circle(r), bd.Rectangle(1.4 * r, 1.4 * r), bd.RegularPolygon(r, 6))[int(rng.integers(3))]
    at = bd.Pos(box.center().X, box.center().Y, box.max.Z)
    tool = at * bd.GridLocations(pitch, pitch, nx, ny) * shape
    return part - bd.extrude(bd.Sketch() + list(tool), -(10.0 if rng.random() < 0.5 else 100.0))


def _pocket(rng: Any, part: Any) -> Any:
    _, box = _top(part)
    x, y, z = _place(rng, box)
    size = rng.uniform(0.1, 0.7, 2) * (box.size.X, box.size.Y)
    sketch = bd.RectangleRounded(*size.tolist(), float(size.min() * rng.uniform(0.01, 0.45)))
    depth = part.bounding_box().size.Z * rng.uniform(0.1, 0.9)
    return part - bd.Pos(x, y, z) * bd.Rot(0, 0, rng.uniform(0, 90)) * bd.extrude(sketch, -depth)


def _slots(rng: Any, part: Any) -> Any:
    """Narrow slots side by side."""
    _, box = _top(part)
    width, count = 10.0 ** rng.uniform(-1.3, 0.5), int(rng.integers(1, 6))
    slot = bd.SlotOverall(max(3.0 * width, 0.5 * box.size.X), width)
    tool = bd.Pos(*_place(rng, box)) * bd.GridLocations(1.0, 1.7 * width, 1, count) * slot
    return part - bd.extrude(bd.Sketch() + list(tool), -rng.uniform(1.0, 50.0))


def _boss(rng: Any, part: Any) -> Any:
    _, box = _top(part)
    x, y, z = _place(rng, box)
    made = (bd.Cylinder(rng.uniform(1, 8), 9), bd.Box(*rng.uniform(2, 20, 3).tolist()))[int(rng.integers(2))]
    return part + bd.Pos(x, y, z) * bd.Rot(0, 0, rng.uniform(0, 90)) * made


def _fillets(rng: Any, part: Any) -> Any:
    return bd.fillet(_some_edges(rng, part), 10.0 ** rng.uniform(-1.5, 0.6))


def _chamfers(rng: Any, part: Any) -> Any:
    return bd.chamfer(_some_edges(rng, part), 10.0 ** rng.uniform(-1.5, 0.6))


def _some_edges(rng: Any, part: Any) -> list[Any]:
    edges = part.edges().sort_by(bd.Axis.Z)
    return [edges[int(k)] for k in rng.choice(len(edges), min(len(edges), int(rng.integers(1, 7))), replace=False)]


def _shelled(rng: Any, part: Any) -> Any:
    return bd.offset(part, -(10.0 ** rng.uniform(-0.5, 0.6)), openings=_top(part)[0])


def _cut_off(rng: Any, part: Any) -> Any:
    """What lies on one side of a plane through the part."""
    normal = rng.normal(size=3)
    middle = part.bounding_box().center()
    return bd.split(part, bd.Plane((middle.X, middle.Y, middle.Z), z_dir=tuple(normal.tolist())))


_BODIES = (_polygon, _curved, _mixed, _revolved, _block)
_FEATURES = (
    _hole, _pattern, _pocket, _slots, _boss, _fillets, _chamfers, _shelled, _cut_off,
)  # fmt: skip
