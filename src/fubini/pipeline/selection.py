"""What of a model is meshed: faces chosen by index or name, without the edges inside them where a pattern is laid."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from fubini.errors import OptionError
from fubini.model import Model, SkippedFace


def select_faces(model: Model, faces: Iterable[int] | None, name: str | None) -> Model:
    """The model with only the faces of these indices or of this name.

    Raises OptionError when there is no such planar face.
    """
    if faces is None and name is None:
        return model
    wanted = {face.index for face in model.faces}
    if faces is not None:
        asked = {int(f) for f in faces}
        missing = sorted(asked - wanted)
        if missing:
            raise OptionError("no planar face with this index", file=model.source, face=missing[0])
        if not asked:
            raise OptionError("no face is asked for: the list of faces is empty", file=model.source)
        wanted &= asked
    if name is not None:
        wanted &= {face.index for face in model.faces if face.name == name}
        if not wanted:
            names = sorted({face.name for face in model.faces if face.name})
            fix = "names are " + ", ".join(names) if names else "the source names no face"
            raise OptionError(f"no planar face is named {name!r}", file=model.source, fix=fix)
    left = [f for f in model.faces if f.index not in wanted]
    skipped = tuple(SkippedFace(f.index, "plane", "not selected", f.name) for f in left)
    return replace(model, faces=tuple(f for f in model.faces if f.index in wanted), skipped=model.skipped + skipped)


def without_inner_edges(model: Model, pattern: str) -> Model:
    """The model with outlines alone: the paper's sets know nothing of edges and points inside a face."""
    edges, points = (sum(len(part) for part in parts) for parts in zip(*((f.inner, f.points) for f in model.faces)))
    if not edges + points:
        return model
    note = f"pattern {pattern}: {edges} edges and {points} points inside faces are not followed"
    faces = tuple(replace(face, inner=(), points=()) for face in model.faces)
    return replace(model, faces=faces, notes=(*model.notes, note))
