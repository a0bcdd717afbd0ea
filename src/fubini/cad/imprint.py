"""Parts that touch or overlap, cut so that they share faces, edges and vertices (general fuse)."""

from __future__ import annotations

import dataclasses
from typing import Any

from OCP.BRepAlgoAPI import BRepAlgoAPI_BuilderAlgo
from OCP.BRepTools import BRepTools_ReShape

from fubini.cad import occ
from fubini.cad.build import with_faces
from fubini.cad.mirrors import without_mirrors
from fubini.cad.source import Source
from fubini.cad.trace import Trace, rebuilt
from fubini.errors import GeometryError


def imprint_parts(source: Source) -> Source:
    """The source with its solids, and its faces outside solids, cut at each other and at loose edges.

    What several of them cover is kept once. Edges that cross or touch are cut too; where some enclose a part of a
    face, it becomes a face of its own. Loose vertices inside a face are kept in it. Raises ``GeometryError`` where the
    kernel cannot cut them.
    """
    shape, _ = with_faces(source)
    source = without_mirrors(dataclasses.replace(source, shape=shape))
    shape, faces = source.shape, occ.ShapeMap(source.shape, occ.FACE)
    bare = _without_inner_edges(shape)
    parts = [*occ.parts(bare.Apply(shape)), *occ.loose(shape)]
    if len(parts) < 2:
        return source
    fuse = BRepAlgoAPI_BuilderAlgo()
    fuse.SetArguments(occ.shape_list(parts))
    fuse.SetNonDestructive(True)
    fuse.SetRunParallel(False)
    try:
        with occ.quiet():
            fuse.Build()
        done = fuse.IsDone()
        reason = "" if done else f"the kernel gives up on {len(parts)} parts"
    except Exception as error:  # the kernel raises its own classes, which share no other base
        done, reason = False, f"the kernel fails ({type(error).__name__})"
    if not done:
        raise GeometryError(f"the parts cannot be imprinted: {reason}", file=source.label, fix="heal the parts first")
    result = fuse.Shape()

    def images(part: Any) -> list[Any]:
        part = part if part.ShapeType() == occ.EDGE else bare.Value(part)
        return [] if fuse.IsDeleted(part) else list(fuse.Modified(part)) or [part]

    trace = Trace(shape, images)
    return rebuilt(source, trace, result, [_note(trace, faces, result)])


def _without_inner_edges(shape: Any) -> Any:
    """A rebuilding of the shape that takes internal edges out of its faces: these are cut as parts of their own."""
    reshape = BRepTools_ReShape()
    for face in occ.ShapeMap(shape, occ.FACE):
        for wire in occ.explore(face, occ.WIRE):
            edges = list(occ.children(wire))
            inner = [e for e in edges if e.Orientation() == occ.INTERNAL]
            for part in [wire] if edges and len(inner) == len(edges) else inner:
                reshape.Remove(part)
    return reshape


def _note(trace: Trace, faces: occ.ShapeMap, result: Any) -> str:
    """How many faces there were and are."""
    after = occ.ShapeMap(result, occ.FACE)
    owners = [0] * len(after)
    for face in faces:
        for image in trace.images(face):
            owners[after.index(image)] += 1
    shared = sum(n > 1 for n in owners)
    return f"imprinted: {len(faces)} faces became {len(after)}, {shared} of them from more than one"
