"""What a reader hands over: one CAD shape and what the source calls its parts."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fubini.errors import InputError

if TYPE_CHECKING:
    from fubini.cad.trace import Trace


@dataclass(frozen=True)
class Source:
    """One CAD shape with names and remarks: the value between a reader and ``build_model``.

    Attributes
    ----------
    shape : ``TopoDS_Shape`` with every face, placed. Edges and wires alone are taken too: closed
        planar ones become faces. Indices of the model count its sub-shapes in ``MapShapes`` order.
    label : path or description for messages.
    face_names, edge_names : pairs (``TopoDS_Shape``, name). The shape may be a face (edge) of
        ``shape`` or hold several of them; it is matched by ``IsSame``, else by ``IsPartner`` (same
        geometry, other placement). The first pair that names a sub-shape wins.
    notes : remarks for the report.
    traces : what became of the sub-shapes that were read, where the shape was sewn or imprinted.
    """

    shape: Any
    label: str
    face_names: tuple[tuple[Any, str], ...] = ()
    edge_names: tuple[tuple[Any, str], ...] = ()
    notes: tuple[str, ...] = ()
    traces: tuple[Trace, ...] = ()


@dataclass(frozen=True)
class ReadOptions:
    """Options of file readers.

    ``gap``: loose ends closer than this (model units) are joined; None lets the reader pick a value
    relative to the size of the drawing.
    """

    gap: float | None = None


Reader = Callable[[Path, ReadOptions], Source]

#: Lower-case suffix to "module:function" of its reader, imported when first used.
READERS: dict[str, str] = {
    ".step": "fubini.cad.files:read_step",
    ".stp": "fubini.cad.files:read_step",
    ".brep": "fubini.cad.files:read_brep",
    ".brp": "fubini.cad.files:read_brep",
    ".iges": "fubini.cad.files:read_iges",
    ".igs": "fubini.cad.files:read_iges",
    ".dxf": "fubini.cad.dxf:read_dxf",
    ".svg": "fubini.cad.svg:read_svg",
    ".fcstd": "fubini.cad.fcstd:read_fcstd",
}


def reader_for(path: Path) -> Reader:
    """The reader of a file's suffix; ``InputError`` lists the known ones."""
    place = READERS.get(path.suffix.lower())
    if place is None:
        raise InputError(
            f"unknown file type {path.suffix or '(no suffix)'!r}",
            file=str(path),
            fix="known are " + ", ".join(sorted(READERS)),
        )
    module, _, function = place.partition(":")
    reader: Reader = getattr(importlib.import_module(module), function)
    return reader
