"""Is a binary shape set sound? The kernel follows every number in it unseen, and crashes where one leads nowhere.

The layout is that of ``BinTools_ShapeSet``: locations and geometry in sections that begin with a line of text, then the
shapes, each with its kind, its geometry, seven flags and its parts, which come before it in the file.
"""

from __future__ import annotations

import re
import struct

_SECTIONS = (b"Locations", b"Curve2ds", b"Curves", b"Polygon3D", b"PolygonOnTriangulations", b"Surfaces",
             b"Triangulations", b"TShapes")  # fmt: skip
_VERSION = re.compile(rb"Open CASCADE Topology V(\d)")

#: Layout of what stands for an edge in space, on surfaces and as polygon, by its mark: reals, bytes, and numbers of
#: what the sections hold: Location, 2D curve, Curve, Polygon, polygoN on triangles, Surface, Triangulation.
_EDGE = {1: "CLrr", 2: "2SLrr", 3: "22bSLrr", 4: "bSLSL", 5: "PL", 6: "NTL", 7: "NNTL"}
_VERTEX = {1: "rCL", 2: "r2SL", 3: "rrSL"}
_LETTERS = "L2CPNST"
_VERTEX_KIND, _EDGE_KIND, _FACE_KIND = 7, 6, 4
_FLAGS, _ORIENTATIONS = 7, 4
_END = ord("*")
#: Version of the format in which curves on surfaces carry their ends, too; older ones have layouts of their own.
_WITH_ENDS = 3


def check_shapes(data: bytes) -> None:
    """Raises ``ValueError`` where a shape of a binary shape set refers to nothing, or to one that comes after it.

    Sets of the versions 1 and 2, of kernels long gone, are not looked at.
    """
    version = _VERSION.search(data[:128])
    if version is None or int(version.group(1)) < _WITH_ENDS:
        return
    at, counts = 0, []
    for section in _SECTIONS:
        found = re.compile(section + rb" (\d+)\n").search(data, at)
        if found is None:
            raise ValueError(f"section {section.decode()} is missing")
        at = found.end()
        counts.append(int(found.group(1)))
    try:
        _Shapes(data, at, dict(zip(_LETTERS, counts, strict=False)), int(version.group(1))).check(counts[-1])
    except (struct.error, IndexError):
        raise ValueError("it is cut short") from None


class _Shapes:
    """Walks through the shapes; ``most`` holds how many there are of what shapes refer to."""

    def __init__(self, data: bytes, at: int, most: dict[str, int], version: int) -> None:
        self.data, self.at, self.most = data, at, most
        self.edge = dict(_EDGE)
        if version == _WITH_ENDS:
            self.edge |= {mark: layout + "rrrr" for mark, layout in _EDGE.items() if mark in (2, 3)}

    def check(self, count: int) -> None:
        for number in range(1, count + 1):
            kind = self._byte()
            if kind == _VERTEX_KIND:
                self.at += 32
                self._marked(_VERTEX)
            elif kind == _EDGE_KIND:
                self.at += 11
                self._marked(self.edge)
            elif kind == _FACE_KIND:
                self.at += 9
                self._follow("SL")
                if self._byte() == 2:
                    self._follow("T")
            self.at += _FLAGS
            self._parts(number, count)

    def _byte(self) -> int:
        self.at += 1
        return self.data[self.at - 1]

    def _number(self) -> int:
        (value,) = struct.unpack_from("<i", self.data, self.at)
        self.at += 4
        return int(value)

    def _marked(self, layouts: dict[int, str]) -> None:
        """Pieces of geometry, each behind a mark, up to a mark of zero."""
        while mark := self._byte():
            if mark not in layouts:
                raise ValueError(f"a shape with geometry of an unknown kind ({mark})")
            self._follow(layouts[mark])

    def _follow(self, layout: str) -> None:
        for letter in layout:
            if letter == "r":
                self.at += 8
            elif letter == "b":
                self.at += 1
            elif not 0 <= self._number() <= self.most[letter]:
                raise ValueError("a shape refers to geometry that is not there")

    def _parts(self, number: int, count: int) -> None:
        """Parts of shape ``number``: orientation, number counted from the last shape, location."""
        while (orientation := self._byte()) != _END:
            part, location = count + 1 - self._number(), self._number()
            if not (orientation < _ORIENTATIONS and 1 <= part < number and 0 <= location <= self.most["L"]):
                raise ValueError(f"shape {number} has a part that is not there or not placed")
