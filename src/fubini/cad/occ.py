"""The one place that knows how OCP 7.x and OCP 8 differ; importing it imports the CAD kernel.

Static methods carry a trailing ``_s`` in OCP 7 and in part of OCP 8; ``TopoDS`` casts lost it in 8;
the typed collections moved to ``OCP.collections``. Everything else is used as it is.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini.cad.kernel import require_kernel

require_kernel()

from OCP.Bnd import Bnd_Box  # noqa: E402
from OCP.BRep import BRep_Builder, BRep_Tool  # noqa: E402
from OCP.BRepBndLib import BRepBndLib  # noqa: E402
from OCP.Message import Message  # noqa: E402
from OCP.TopAbs import TopAbs_Orientation as Orientation  # noqa: E402
from OCP.TopAbs import TopAbs_ShapeEnum as Kind  # noqa: E402
from OCP.TopExp import TopExp, TopExp_Explorer  # noqa: E402
from OCP.TopLoc import TopLoc_Location  # noqa: E402
from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Iterator, TopoDS_Shape  # noqa: E402

try:
    from OCP.TopTools import TopTools_IndexedMapOfShape as _IndexedMap
    from OCP.TopTools import TopTools_ListOfShape as _ShapeList
except ImportError:
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as _IndexedMap
    from OCP.collections import List_TopoDS_Shape as _ShapeList

Float = NDArray[np.float64]
SOLID, SHELL, FACE = Kind.TopAbs_SOLID, Kind.TopAbs_SHELL, Kind.TopAbs_FACE
WIRE, EDGE, VERTEX = Kind.TopAbs_WIRE, Kind.TopAbs_EDGE, Kind.TopAbs_VERTEX
INTERNAL = Orientation.TopAbs_INTERNAL


def static(owner: Any, name: str) -> Any:
    """A static method of an OCP class, whatever this OCP calls it."""
    return getattr(owner, name + "_s", None) or getattr(owner, name)


as_face = static(TopoDS, "Face")
as_wire = static(TopoDS, "Wire")
as_edge = static(TopoDS, "Edge")
as_vertex = static(TopoDS, "Vertex")
tolerance = static(BRep_Tool, "Tolerance")
degenerated = static(BRep_Tool, "Degenerated")
_pnt = static(BRep_Tool, "Pnt")
_map_shapes = static(TopExp, "MapShapes")
_add_box = static(BRepBndLib, "AddOptimal")


def xyz(p: Any) -> Float:
    """Coordinates (3,) of a ``gp_Pnt``, ``gp_Vec`` or ``gp_Dir``."""
    return np.array((p.X(), p.Y(), p.Z()))


def vertex_point(vertex: Any) -> Float:
    """Place (3,) of a ``TopoDS_Vertex``."""
    return xyz(_pnt(vertex))


class ShapeMap:
    """Sub-shapes of one kind in the order of ``TopExp::MapShapes``, numbered from 0."""

    def __init__(self, shape: Any, kind: Any) -> None:
        self._map = _IndexedMap()
        if not shape.IsNull():
            _map_shapes(shape, kind, self._map)
        self.kind = kind

    def __len__(self) -> int:
        return int(self._map.Size())

    def __getitem__(self, index: int) -> Any:
        return self._map.FindKey(index + 1)

    def __iter__(self) -> Iterator[Any]:
        return (self._map.FindKey(i) for i in range(1, len(self) + 1))

    def index(self, shape: Any) -> int:
        """Number of the same sub-shape (``IsSame``), or -1."""
        return int(self._map.FindIndex(shape)) - 1


class ShapeSet:
    """A set of shapes that are told apart by ``IsSame``."""

    def __init__(self) -> None:
        self._map = _IndexedMap()

    def add(self, shape: Any) -> bool:
        """Put a shape in; False when it was there."""
        before = self._map.Size()
        self._map.Add(shape)
        return bool(self._map.Size() > before)


def unplaced(shape: Any) -> Any:
    """The shape without its placement: equal for all shapes that are ``IsPartner``."""
    return shape.Located(TopLoc_Location())


def mirrored(shape: Any) -> bool:
    """Whether the placement of the shape turns left into right."""
    return bool(shape.Location().Transformation().IsNegative())


def children(shape: Any) -> Iterator[Any]:
    """Direct sub-shapes with composed placement and orientation."""
    walk = TopoDS_Iterator(shape)
    while walk.More():
        yield walk.Value()
        walk.Next()


def explore(shape: Any, kind: Any) -> Iterator[Any]:
    """All sub-shapes of a kind as often as they occur, oriented as in ``shape``."""
    walk = TopExp_Explorer(shape, kind)
    while walk.More():
        yield walk.Current()
        walk.Next()


def parts(shape: Any) -> list[Any]:
    """Solids, and the faces that belong to none, each once."""
    solids = ShapeMap(shape, SOLID)
    taken = ShapeMap(compound(solids), FACE)
    return [*solids, *(f for f in ShapeMap(shape, FACE) if taken.index(f) < 0)]


def loose(shape: Any) -> list[Any]:
    """What may lie in faces and bounds none: edges outside faces or internal to one, vertices outside edges."""
    bounding = ShapeMap(compound(ShapeMap(shape, FACE)), EDGE)
    inside = ShapeSet()
    held = (e for face in ShapeMap(shape, FACE) for e in explore(face, EDGE))
    within = [e for e in held if e.Orientation() == INTERNAL and inside.add(e)]
    edges = ShapeMap(shape, EDGE)
    ends = ShapeMap(compound(edges), VERTEX)
    vertices = ShapeMap(shape, VERTEX)
    return [
        *within,
        *(e for e in edges if bounding.index(e) < 0),
        *(v for v in vertices if ends.index(v) < 0),
    ]


def compound(shapes: Iterable[Any]) -> Any:
    """A compound of these ``TopoDS_Shape``."""
    builder, result = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(result)
    for shape in shapes:
        builder.Add(result, shape)
    return result


def shape_list(shapes: Iterable[Any]) -> Any:
    """The kernel's own list of these ``TopoDS_Shape``."""
    result = _ShapeList()
    for shape in shapes:
        result.Append(shape)
    return result


def is_shape(value: Any) -> bool:
    """Whether this is a ``TopoDS_Shape`` of the kernel."""
    return isinstance(value, TopoDS_Shape)


def diagonal(shape: Any) -> float:
    """Diagonal of the bounding box of the geometry, without tolerances; 0 when there is none."""
    box = _box(shape)
    return 0.0 if box.IsVoid() else float(box.CornerMin().Distance(box.CornerMax()))


def box(shape: Any) -> tuple[Float, Float]:
    """Least and greatest coordinates (3,) of a shape that is not empty."""
    found = _box(shape)
    return xyz(found.CornerMin()), xyz(found.CornerMax())


def _box(shape: Any) -> Any:
    result = Bnd_Box()
    result.SetGap(0.0)
    _add_box(shape, result, False, False)
    return result


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep the kernel from printing to stdout, where a caller's own output belongs."""
    messenger = static(Message, "DefaultMessenger")()
    printers = list(messenger.Printers())
    for printer in printers:
        messenger.RemovePrinter(printer)
    try:
        yield
    finally:
        for printer in printers:
            messenger.AddPrinter(printer)
