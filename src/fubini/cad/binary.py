"""The kernel's binary shapes, as it writes them itself and as FreeCAD does."""

from __future__ import annotations

import io
import struct
from typing import Any

from fubini.cad.shapeset import check_shapes

HEAD = b"Open CASCADE Topology"
_SIDES = ("TopAbs_FORWARD", "TopAbs_REVERSED", "TopAbs_INTERNAL", "TopAbs_EXTERNAL")


def is_binary(data: bytes) -> bool:
    """Whether this begins as a binary shape does."""
    return HEAD in data[:64]


def read_binary(data: bytes) -> Any:
    """The ``TopoDS_Shape`` of a shape set and the reference that follows it.

    The kernel ends with orientation (one byte), shape number counted from the last, and location number; FreeCAD
    with shape number counted from the first, location number and orientation. Both follow the ``*`` that ends
    the last shape of the set. Raises ``ValueError`` where neither is there or a shape refers to nothing; the kernel
    raises its own errors.
    """
    from OCP.BinTools import BinTools_ShapeSet
    from OCP.TopAbs import TopAbs_Orientation

    if data[-10:-9] == b"*":
        orientation, last, location = struct.unpack("<B2i", data[-9:])
    elif data[-13:-12] == b"*":
        last = 0
        number, location, orientation = struct.unpack("<3i", data[-12:])
    else:
        raise ValueError("it is cut short")
    check_shapes(data)
    shapes = BinTools_ShapeSet()
    shapes.Read(io.BytesIO(data))
    if last:
        number = shapes.NbShapes() - last + 1
    if not (1 <= number <= shapes.NbShapes() and 0 <= location and 0 <= orientation < len(_SIDES)):
        raise ValueError("it ends with no reference to a shape")
    if location > shapes.Locations().NbLocations():
        raise ValueError("it ends with no reference to a place")
    shape = shapes.Shape(number)
    shape.Location(shapes.Locations().Location(location), False)
    shape.Orientation(getattr(TopAbs_Orientation, _SIDES[orientation]))
    return shape
