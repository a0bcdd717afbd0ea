"""Live objects of build123d, CadQuery and the kernel as a ``Source``; no front end is imported here."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from fubini.cad import occ
from fubini.cad.source import Source
from fubini.errors import InputError

#: CadQuery names an assembly by a UUID when the user does not.
_AUTOMATIC = re.compile(r"[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}")

#: build123d's builder contexts and where they keep their result.
_BUILDERS = {"BuildSketch": "sketch", "BuildPart": "part", "BuildLine": "line"}

_ACCEPTED = "a path, a build123d or CadQuery object, a TopoDS_Shape, or a list of these"


def read_live(value: Any) -> Source:
    """The shape and the names of a live object; ``InputError`` when it is none, or is empty."""
    parts = _Parts()
    parts.add(value)
    if not parts.shapes:
        raise InputError("no shape in it", file=describe(value), fix="give an object that holds faces or outlines")
    shape = parts.shapes[0] if len(parts.shapes) == 1 else occ.compound(parts.shapes)
    return Source(shape, describe(value), (*parts.face_names, *parts.part_names), tuple(parts.edge_names))


def group_names(groups: Mapping[str, Any]) -> tuple[list[tuple[Any, str]], list[tuple[Any, str]]]:
    """Face names and edge names that ``groups`` of live shapes give."""
    parts = _Parts()
    for name, members in groups.items():
        selection = _Parts()
        selection.add(members)
        for shape in selection.shapes:
            parts.name(shape, name)
    return [*parts.face_names, *parts.part_names], parts.edge_names


def describe(value: Any) -> str:
    """A label for messages, such as "build123d Part 'bracket'"."""
    front = _front_end(value)
    label = getattr(value, "label", "") or ""
    text = f"{front[0]} {type(value).__name__}" if front else type(value).__name__
    return f"{text} {label!r}" if isinstance(label, str) and label else text


class _Parts:
    """Shapes and names gathered from live objects. Names of faces come before names of whole parts."""

    def __init__(self) -> None:
        self.shapes: list[Any] = []
        self.face_names: list[tuple[Any, str]] = []
        self.part_names: list[tuple[Any, str]] = []
        self.edge_names: list[tuple[Any, str]] = []

    def name(self, shape: Any, name: str) -> None:
        """Name a sub-shape, by its kind: the faces of a part, or edges."""
        kind = shape.ShapeType()
        if kind == occ.FACE:
            self.face_names.append((shape, name))
        elif kind in (occ.EDGE, occ.WIRE):
            self.edge_names.append((shape, name))
        elif kind != occ.VERTEX:
            self.part_names.append((shape, name))

    def add(self, value: Any) -> None:
        """Take in a live object of any kind."""
        front = _front_end(value)
        if occ.is_shape(value):
            self._add_shape(value)
        elif front and front[1] in _BUILDERS:
            self.add(_built(value, _BUILDERS[front[1]]))
        elif front == ("cadquery", "Assembly"):
            self._add_assembly(value, None, "")
        elif front == ("cadquery", "Workplane"):
            self._add_workplane(value)
        elif front == ("cadquery", "Sketch"):
            self._add_sketch(value)
        elif _kernel_shape(value) is not None:
            self._add_labelled(value)
        elif (
            isinstance(value, Iterable)
            and not isinstance(value, str | bytes | Mapping)
            and not hasattr(type(value), "wrapped")
        ):
            for item in value:
                self.add(item)
        elif front:
            raise InputError("no shape in it", file=describe(value), fix="give an object that holds faces or outlines")
        else:
            raise InputError(f"cannot load a {type(value).__name__}", fix=f"give {_ACCEPTED}")

    def _add_shape(self, shape: Any) -> None:
        if shape.IsNull():
            raise InputError("a null shape", fix="give a shape that holds faces or outlines")
        self.shapes.append(shape)

    def _add_labelled(self, value: Any) -> None:
        """A shape of build123d or CadQuery; labels of children come before that of the whole."""
        self._add_shape(value.wrapped)
        self._labels(value, value.wrapped)

    def _labels(self, value: Any, shape: Any) -> None:
        """Labels of a tree of shapes. ``shape`` is the placed shape of ``value`` within the whole.

        Moving a tree of build123d leaves the children where they were, so the parts of the compound
        itself are taken, which stand in the same order.
        """
        children = [c for c in getattr(value, "children", ()) or () if _kernel_shape(c) is not None]
        parts = list(occ.children(shape))
        if len(parts) != len(children):
            parts = [c.wrapped for c in children]
        for child, part in zip(children, parts, strict=True):
            self._labels(child, part)
        label = getattr(value, "label", None)
        if isinstance(label, str) and label:
            self.name(shape, label)

    def _add_workplane(self, value: Any) -> None:
        """What lies on the stack; pending wires and edges, or the solid, where that has no faces."""
        stack = _wrapped(value.vals())
        if not any(len(occ.ShapeMap(s, occ.FACE)) for s in stack):
            pending = _wrapped([*value.ctx.pendingWires, *value.ctx.pendingEdges])
            solid = None if pending else _solid(value)
            stack = pending or ([solid.wrapped] if solid is not None else stack)
        for shape in stack:
            self._add_shape(shape)
        for tag, tagged in value.ctx.tags.items():
            for shape in _wrapped(tagged.vals()):
                self.name(shape, tag)

    def _add_sketch(self, value: Any) -> None:
        for shape in _wrapped(value):
            self._add_shape(shape)
        for tag, tagged in getattr(value, "_tags", {}).items():
            for shape in _wrapped(tagged):
                self.name(shape, tag)

    def _add_assembly(self, value: Any, placement: Any, inherited: str) -> None:
        place = value.loc if placement is None else placement * value.loc
        name = "" if _AUTOMATIC.fullmatch(value.name or "") else value.name or ""
        for shape, label in getattr(value, "_subshape_names", {}).items():
            self.name(shape.moved(place).wrapped, label)
        for shape in value.shapes:
            placed = shape.moved(place).wrapped
            self._add_shape(placed)
            if name or inherited:
                self.part_names.append((placed, name or inherited))
        for child in value.children:
            self._add_assembly(child, place, name or inherited)


def _front_end(value: Any) -> tuple[str, str] | None:
    """Front end and class name of the nearest ancestor class that a front end defines."""
    for kind in type(value).__mro__:
        package = kind.__module__.partition(".")[0]
        if package in ("build123d", "cadquery"):
            return package, kind.__name__
    return None


def _solid(workplane: Any) -> Any:
    """The solid that a CadQuery workplane has in context, or None: CadQuery raises where there is none."""
    try:
        return workplane.findSolid()
    except ValueError:
        return None


def _built(builder: Any, attribute: str) -> Any:
    result = getattr(builder, attribute)
    if result is None:
        raise InputError("an empty builder", file=describe(builder), fix="add geometry before loading it")
    return result


def _wrapped(values: Iterable[Any]) -> list[Any]:
    """The kernel shapes among these objects; places and vectors are left aside."""
    shapes = [_kernel_shape(v) for v in values]
    return [s for s in shapes if s is not None and not s.IsNull() and s.ShapeType() != occ.VERTEX]


def _kernel_shape(value: Any) -> Any:
    """The ``TopoDS_Shape`` that an object wraps, or None."""
    try:
        wrapped = getattr(value, "wrapped", None)
    except AssertionError:  # build123d's empty objects
        return None
    return wrapped if occ.is_shape(wrapped) else None
