"""Is a shape set sound? The kernel follows every number in it unseen, and crashes or hangs where one leads nowhere.

The layout is that of ``BinTools_ShapeSet`` and ``BRepTools_ShapeSet``: locations and geometry in sections that begin
with a line of text, then the shapes, each with its kind, its geometry, seven flags and its parts, which come before it.
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
    at = 0
    counts: list[int] = []
    for section in _SECTIONS:
        found = re.compile(section + rb" (\d+)\n").search(data, at)
        if found is None:
            raise ValueError(f"section {section.decode()} is missing")
        if counts and found.start() - at < counts[-1]:  # each takes a byte at least
            raise ValueError(f"the section before {section.decode()} holds less than it says")
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


#: The same in text, where continuity is a word, at the end of the number before it along a seam ("s"), and where curves
#: on surfaces carry their ends in version 2 only.
_TEXT_EDGE = {1: "CLrr", 2: "2SLrr", 3: "2sSLrr", 4: "wSLSL", 5: "PL", 6: "NTL", 7: "NNTL"}
_TEXT_VERTEX = {1: "CL", 2: "2SL", 3: "rSL"}
_SEAM = re.compile(rb"(?:C[0-3N]|G[12])$")
_SIGNS = {b"+", b"-", b"i", b"e"}
_TEXT_KINDS = {b"Ve", b"Ed", b"Wi", b"Fa", b"Sh", b"So", b"CS", b"Co"}


def check_text_shapes(words: list[bytes], counts: list[int], with_ends: bool) -> None:
    """Raises ``ValueError`` where the shapes of a text shape set are out of shape or refer to nothing.

    words : all that follows the line of the shapes. counts (8,) : of the sections, the shapes last. with_ends : whether
    curves on surfaces carry their ends.
    """
    try:
        _TextShapes(words, dict(zip(_LETTERS, counts, strict=False)), with_ends).check(counts[-1])
    except IndexError:
        raise ValueError("it is cut short") from None


class _TextShapes:
    """Walks through the words of the shapes; ``most`` holds how many there are of what shapes refer to."""

    def __init__(self, words: list[bytes], most: dict[str, int], with_ends: bool) -> None:
        self.words, self.at, self.most = words, 0, most
        self.edge = dict(_TEXT_EDGE)
        if with_ends:
            self.edge |= {mark: layout + "rrrr" for mark, layout in _TEXT_EDGE.items() if mark in (2, 3)}

    def check(self, count: int) -> None:
        for number in range(1, count + 1):
            kind = self._word()
            if kind not in _TEXT_KINDS:
                raise ValueError(f"shape {number} is of an unknown kind {kind!r}")
            if kind == b"Ve":
                self._follow("rrrr")
                self._marked(_TEXT_VERTEX, "r")
            elif kind == b"Ed":
                self._follow("rfff")
                self._marked(self.edge)
            elif kind == b"Fa":
                self._follow("frSL")
                if self.words[self.at] == b"2":
                    self._follow("wT")
            flags = self._word()
            if len(flags) != _FLAGS or flags.strip(b"01"):
                raise ValueError(f"shape {number} has the flags {flags!r}")
            self._parts(number, count)

    def _word(self) -> bytes:
        self.at += 1
        return self.words[self.at - 1]

    def _number(self) -> int:
        return int(self._word())

    def _marked(self, layouts: dict[int, str], before: str = "") -> None:
        """Pieces of geometry, each behind a mark, which may have something before it, up to a mark of zero."""
        while True:
            self._follow(before)
            mark = self._number()
            if not mark:
                return
            if mark not in layouts:
                raise ValueError(f"a shape with geometry of an unknown kind ({mark})")
            self._follow(layouts[mark])

    def _follow(self, layout: str) -> None:
        for letter in layout:
            word = self._word()
            if letter == "r":
                float(word)
            elif letter == "f":
                if word not in (b"0", b"1"):
                    raise ValueError(f"{word!r} is no flag")
            elif letter == "s":
                word, letter = _SEAM.sub(b"", word), "2"
            if letter not in "frw" and not 0 <= int(word) <= self.most[letter]:
                raise ValueError("a shape refers to geometry that is not there")

    def _parts(self, number: int, count: int) -> None:
        """Parts of shape ``number``: orientation and number counted from the last shape, location."""
        while (word := self._word()) != b"*":
            part, location = count + 1 - int(word[1:]), self._number()
            if not (word[:1] in _SIGNS and 1 <= part < number and 0 <= location <= self.most["L"]):
                raise ValueError(f"shape {number} has a part that is not there or not placed")
