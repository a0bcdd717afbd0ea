"""One function that takes every kind of CAD source."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fubini.cad.source import ReadOptions, Source, reader_for
from fubini.errors import InputError
from fubini.model import Model

if TYPE_CHECKING:
    from fubini.naming import Selection
    from fubini.result import Mesh


def load(
    source: Any,
    *,
    groups: Mapping[str, Any] | None = None,
    gap: float | None = None,
    check: bool = True,
    sew: float | None = None,
    imprint: bool = False,
) -> Model:
    """The planar faces of a CAD source, with their exact outlines and names.

    Parameters
    ----------
    source : a path (.step, .stp, .brep, .brp, .iges, .igs, .dxf, .svg, .FCStd); a build123d object
        (Face, Sketch, Part, Compound, ShapeList, builder context); a CadQuery object (Workplane,
        Sketch, Shape, Assembly); a ``TopoDS_Shape``; or a list of live objects. Closed planar wires
        without a face become faces.
    groups : name to live faces, edges or wires, such as ``{"hole": face.inner_wires()}``; these names
        come before those of the source.
    gap : loose ends in drawings closer than this (model units) are joined.
    check : look for outlines that cross or touch.
    sew : join edges of different faces that lie within this distance (model units) of each other; what
        was joined and what stays open is told in the notes of the model.
    imprint : cut faces and solids where they touch or overlap, so that they share faces, edges and
        vertices there; what belongs to two names A and B is named ``A|B``.

    Raises ``InputError`` when the source cannot be read or has no planar face, ``GeometryError``
    where an outline bounds no region, ``DependencyError`` when there is no CAD kernel.
    """
    try:
        return _load(source, groups, gap, check, sew, imprint)
    except Exception as error:
        # the kernel raises its own classes, which share no other base, where geometry that it took turns out to be none
        if not type(error).__module__.startswith("OCP"):
            raise
        what = f"the CAD kernel gives up on this source ({type(error).__name__})"
        label = str(source) if isinstance(source, str | os.PathLike) else None
        raise InputError(what, file=label, fix="heal the model, or export it again") from error


def _load(
    source: Any, groups: Mapping[str, Any] | None, gap: float | None, check: bool, sew: float | None, imprint: bool
) -> Model:
    """See ``load``; errors of the kernel come through."""
    found = read(source, gap=gap)
    from fubini.cad.build import build_model

    if groups:
        from fubini.cad.live import group_names

        faces, edges = group_names(groups)
        found = dataclasses.replace(
            found, face_names=(*faces, *found.face_names), edge_names=(*edges, *found.edge_names)
        )
    if sew is not None:
        from fubini.cad.sewing import sew_faces

        found = sew_faces(found, sew)
    if imprint:
        from fubini.cad.imprint import imprint_parts

        found = imprint_parts(found)
    return build_model(found, check)


def read(source: Any, *, gap: float | None = None) -> Source:
    """The CAD shape and the names of a source, before any face is looked at."""
    if isinstance(source, str | os.PathLike):
        return _read_file(Path(source), ReadOptions(gap))
    from fubini.cad.live import read_live

    return read_live(source)


def attach(mesh: Mesh) -> Any:
    """Write a mesh back onto its live CAD shape, so that the kernel's exporters and viewers use it.

    Returns the ``TopoDS_Shape``, which is changed in place. Raises ``InputError`` when the mesh has none.
    """
    from fubini.cad.attaching import attach as write

    return write(mesh)


def match(model: Model, value: Any) -> Selection:
    """CAD indices of live sub-shapes of the model; see ``fubini.cad.matching``."""
    from fubini.cad.matching import match as find

    return find(model, value)


def _read_file(path: Path, options: ReadOptions) -> Source:
    if path.is_dir():
        raise InputError("this is a folder, not a file", file=str(path))
    reader = reader_for(path)
    if not path.is_file():
        raise InputError("no such file", file=str(path), fix="check the path")
    if path.stat().st_size == 0:
        raise InputError("the file is empty", file=str(path))
    return reader(path, options)
