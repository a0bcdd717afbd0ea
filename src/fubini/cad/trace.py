"""What became of the sub-shapes of a shape that the kernel rebuilt, and of their names."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from fubini.cad import occ
from fubini.cad.names import resolve
from fubini.cad.source import Source


@dataclass(frozen=True)
class Trace:
    """One rebuilding of a shape.

    ``shape``: as it was. ``images``: the sub-shapes of the new shape that one of its faces, edges or
    vertices became, in order; itself where it was left alone.
    """

    shape: Any
    images: Callable[[Any], Sequence[Any]]

    def after(self, part: Any, kind: Any) -> list[Any]:
        """Sub-shapes of this kind in the new shape that ``part`` of the old one, or what it holds, became."""
        shapes = occ.ShapeMap(self.shape, kind)
        return [new for index in sorted(resolve(shapes, [(part, "wanted")])) for new in self.images(shapes[index])]


def rebuilt(source: Source, trace: Trace, shape: Any, notes: Sequence[str]) -> Source:
    """The source with a new shape and the names of the old one; ``A|B`` where two names meet in one sub-shape."""
    return dataclasses.replace(
        source,
        shape=shape,
        face_names=_carried(trace, shape, occ.FACE, source.face_names),
        edge_names=_carried(trace, shape, occ.EDGE, source.edge_names),
        notes=(*source.notes, *notes),
        traces=(*source.traces, trace),
    )


def _carried(trace: Trace, shape: Any, kind: Any, named: tuple[tuple[Any, str], ...]) -> tuple[tuple[Any, str], ...]:
    """Pairs of new sub-shapes and names."""
    old, new = occ.ShapeMap(trace.shape, kind), occ.ShapeMap(shape, kind)
    found: dict[int, dict[str, None]] = {}
    for index, name in sorted(resolve(old, named).items()):
        for image in trace.images(old[index]):
            number = new.index(image)
            if number >= 0:
                found.setdefault(number, {})[name] = None
    return tuple((new[number], "|".join(names)) for number, names in sorted(found.items()))
