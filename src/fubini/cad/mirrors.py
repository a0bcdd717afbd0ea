"""Parts that their placement mirrors, built anew: the kernel's own operations turn such solids inside out."""

from __future__ import annotations

from typing import Any

from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.TopLoc import TopLoc_Location

from fubini.cad import occ
from fubini.cad.source import Source
from fubini.cad.trace import Trace, rebuilt


def without_mirrors(source: Source) -> Source:
    """The source with solids, and faces outside solids, of which no placement is a mirror image.

    Itself where that is so already.
    """
    parts = occ.parts(source.shape)
    if not any(occ.mirrored(part) for part in parts):
        return source
    made = [_Built(part) if occ.mirrored(part) else None for part in parts]
    result = occ.compound(p if m is None else m.shape for p, m in zip(parts, made, strict=True))

    def images(sub: Any) -> list[Any]:
        found = [m.image(sub) for m in made if m is not None and m.holds(sub)]
        return found or [sub]

    return rebuilt(source, Trace(source.shape, images), result, [])


class _Built:
    """A mirrored part with its placement worked into its geometry."""

    def __init__(self, part: Any) -> None:
        place = part.Location()
        self._back = place.Inverted()
        self._subs = {kind: occ.ShapeMap(part, kind) for kind in (occ.FACE, occ.EDGE, occ.VERTEX)}
        self._maker = BRepBuilderAPI_Transform(part.Located(TopLoc_Location()), place.Transformation(), True)
        self.shape = self._maker.Shape()

    def holds(self, sub: Any) -> bool:
        return sub.ShapeType() in self._subs and self._subs[sub.ShapeType()].index(sub) >= 0

    def image(self, sub: Any) -> Any:
        return self._maker.ModifiedShape(sub.Moved(self._back, False))
