"""CAD files that the kernel reads: STEP, BREP, IGES."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from OCP.BRep import BRep_Builder
from OCP.BRepTools import BRepTools
from OCP.IFSelect import IFSelect_ReturnStatus as ReturnStatus
from OCP.IGESControl import IGESControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TopoDS import TopoDS_Shape

from fubini.cad import occ
from fubini.cad.binary import is_binary, read_binary
from fubini.cad.iges import check_iges
from fubini.cad.integrity import check_brep, check_step, names_kind
from fubini.cad.source import ReadOptions, Source
from fubini.errors import InputError

#: What exporters write where a name is required and none was given.
_NO_NAME = {"", "NONE", "NULL", "''", "$"}

Names = tuple[tuple[Any, str], ...]


def read_step(path: Path, options: ReadOptions) -> Source:
    """A STEP file in millimetres, as the kernel reads it, with the names of faces, edges and solids.

    The name of a solid goes to its faces that have none of their own, where there are several solids.
    """
    notes = check_step(path)
    reader = STEPControl_Reader()
    shape = _transfer(reader, path, "STEP")
    transferred = reader.WS().TransferReader()
    # the kernel searches all entities for each shape, so it is asked only where there is a name to find
    faces = _step_names(transferred, shape, occ.FACE) if names_kind(path, "ADVANCED_FACE|FACE_SURFACE") else ()
    edges = _step_names(transferred, shape, occ.EDGE) if names_kind(path, "EDGE_CURVE") else ()
    if len(occ.ShapeMap(shape, occ.SOLID)) > 1:
        faces += _step_names(transferred, shape, occ.SOLID)
    return Source(shape, str(path), faces, edges, notes)


def read_iges(path: Path, options: ReadOptions) -> Source:
    """An IGES file in millimetres, as the kernel reads it."""
    check_iges(path)
    return Source(_transfer(IGESControl_Reader(), path, "IGES"), str(path))


def read_brep(path: Path, options: ReadOptions) -> Source:
    """A file in one of the kernel's own formats, text or binary."""
    data = path.read_bytes()
    if is_binary(data):
        return Source(_binary(data, path), str(path))
    check_brep(path)
    shape = TopoDS_Shape()
    try:
        with occ.quiet():
            done = occ.static(BRepTools, "Read")(shape, str(path), BRep_Builder())
    except Exception as error:  # the kernel raises its own classes, which share no other base
        raise InputError(f"the BREP file is damaged ({type(error).__name__})", file=str(path)) from error
    if not done or shape.IsNull():
        raise InputError("not readable as BREP", file=str(path))
    return Source(shape, str(path))


def _binary(data: bytes, path: Path) -> Any:
    try:
        with occ.quiet():
            shape = read_binary(data)
    except Exception as error:  # the kernel raises its own classes, which share no other base
        raise InputError(
            f"the BREP file is cut short or damaged: {error}", file=str(path), fix="export or download it again"
        ) from error
    if shape.IsNull():
        raise InputError("no shape in this BREP file", file=str(path))
    return shape


def _transfer(reader: Any, path: Path, kind: str) -> Any:
    """The shape of all roots of a file."""
    try:
        with occ.quiet():
            if reader.ReadFile(str(path)) != ReturnStatus.IFSelect_RetDone:
                raise InputError(f"not readable as {kind}", file=str(path))
            reader.TransferRoots()
            shape = reader.OneShape()
    except InputError:
        raise
    except Exception as error:  # as above
        raise InputError(f"the {kind} file is damaged ({type(error).__name__})", file=str(path)) from error
    if shape is None or shape.IsNull():
        raise InputError(f"no shape in this {kind} file", file=str(path))
    return shape


def _step_names(transferred: Any, shape: Any, kind: Any) -> Names:
    """Names of sub-shapes from the STEP entities they came from."""
    found = []
    for part in occ.ShapeMap(shape, kind):
        entity = transferred.EntityFromShapeResult(occ.unplaced(part), 1)
        text: Any = getattr(entity, "Name", lambda: None)()
        name = text.ToCString().strip() if hasattr(text, "ToCString") else ""
        if name.upper() not in _NO_NAME:
            found.append((part, name))
    return tuple(found)
