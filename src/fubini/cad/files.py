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
from fubini.cad.source import ReadOptions, Source
from fubini.errors import InputError


def read_step(path: Path, options: ReadOptions) -> Source:
    """A STEP file in millimetres, as the kernel reads it."""
    shape, reader = _transfer(STEPControl_Reader(), path, "STEP")
    return Source(shape, str(path))


def read_iges(path: Path, options: ReadOptions) -> Source:
    """An IGES file in millimetres, as the kernel reads it."""
    shape, _ = _transfer(IGESControl_Reader(), path, "IGES")
    return Source(shape, str(path))


def read_brep(path: Path, options: ReadOptions) -> Source:
    """A file in the kernel's own text format."""
    shape = TopoDS_Shape()
    with occ.quiet():
        done = occ.static(BRepTools, "Read")(shape, str(path), BRep_Builder())
    if not done or shape.IsNull():
        raise InputError("not readable as BREP", file=str(path))
    return Source(shape, str(path))


def _transfer(reader: Any, path: Path, kind: str) -> tuple[Any, Any]:
    with occ.quiet():
        if reader.ReadFile(str(path)) != ReturnStatus.IFSelect_RetDone:
            raise InputError(f"not readable as {kind}", file=str(path))
        reader.TransferRoots()
        shape = reader.OneShape()
    if shape is None or shape.IsNull():
        raise InputError(f"no shape in this {kind} file", file=str(path))
    return shape, reader
