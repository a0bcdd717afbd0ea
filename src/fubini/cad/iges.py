"""Is an IGES file whole? The kernel follows its pointers unseen, and crashes where one leads nowhere.

Lines have 80 columns; column 73 names the section: start, global, directory entries (two lines each), parameters, and
a last line that counts the others; the number in the section follows. Pointers are the odd numbers of directory
lines. What is not laid out so is left to the kernel.
"""

from __future__ import annotations

import re
from pathlib import Path

from fubini.errors import InputError

_COUNTS = re.compile(rb"([SGDP]) *(\d+)")
_CONTROL = re.compile(rb"[\x00-\x1f\x7f]")
#: How a file begins whose parameters are parted by commas and end with semicolons, as nearly all do.
_PLAIN = (b"1H,,1H;,", b"1H,,,", b",1H;,", b",,")
#: Types of the entities that make up solids and sheets, and what they point to: shells, faces, loops, lists.
_SOLID, _SHELL, _FACE, _LOOP, _EDGES, _VERTICES = 186, 514, 510, 508, 504, 502


def check_iges(path: Path) -> None:
    """``InputError`` where the file is cut short, or an entry or a boundary of it points to what is not there."""
    lines = path.read_bytes().splitlines()
    if not lines or lines[0][72:73] != b"S":
        return
    try:
        _check(lines)
    except (ValueError, IndexError) as error:
        raise InputError(
            f"the IGES file is cut short or damaged: {error}", file=str(path), fix="export or download it again"
        ) from error


def _check(lines: list[bytes]) -> None:
    sections = _sections(lines)
    plain = b"".join(line[:72] for line in sections[b"G"]).startswith(_PLAIN)
    kinds: dict[int, int] = {}
    values: dict[int, list[bytes]] = {}
    for row in range(0, len(sections[b"D"]) - 1, 2):
        head, tail = sections[b"D"][row : row + 2]
        if head[:8].strip(b" 0"):  # else it stands for nothing
            kinds[row + 1] = int(head[:8])
            values[row + 1] = _values(row + 1, head, tail, sections[b"P"], plain)
    for pointer, kind in kinds.items() if plain else ():
        if kind in (_SOLID, _SHELL, _FACE, _LOOP, _EDGES):
            _Boundary(pointer, kinds, values).check(kind)


def _sections(lines: list[bytes]) -> dict[bytes, list[bytes]]:
    """Lines by the letter of their section; ``ValueError`` where they are not as many as the last line counts."""
    sections: dict[bytes, list[bytes]] = {letter: [] for letter in (b"S", b"G", b"D", b"P", b"T")}
    for number, line in enumerate(lines, start=1):
        if line.strip(b" \x00\x1a"):
            if line[72:73] not in sections:
                raise ValueError(f"line {number} belongs to no section")
            section = sections[line[72:73]]
            section.append(line)
            if int(line[73:80]) != len(section):
                raise ValueError(f"line {number} has another number")
    if not sections[b"T"]:
        raise ValueError("its last line is missing")
    for letter, count in _COUNTS.findall(sections[b"T"][0][:32]):
        if int(count) != len(sections[letter]):
            raise ValueError(f"section {letter.decode()} has {len(sections[letter])} lines, not {int(count)}")
    return sections


def _values(entry: int, head: bytes, tail: bytes, parameters: list[bytes], plain: bool) -> list[bytes]:
    """Parameters of a directory entry, given its two lines; they must end where ``plain`` says that they are parted."""
    first, count = int(head[8:16]), int(tail[24:32])
    own = parameters[first - 1 : first - 1 + count]
    if first < 1 or len(own) < count or head[:8].split() != tail[:8].split():
        raise ValueError(f"directory entry {entry} has no parameters")
    if any(int(line[64:72]) != entry for line in own):
        raise ValueError(f"the parameters of directory entry {entry} are those of another one")
    text, end, rest = b"".join(line[:64] for line in own).partition(b";")
    if _CONTROL.search(text + rest):
        raise ValueError(f"the parameters of directory entry {entry} are no text")
    if not end and plain:
        raise ValueError(f"the parameters of directory entry {entry} have no end")
    return text.split(b",")


class _Boundary:
    """The parameters of one entity of a boundary representation."""

    def __init__(self, pointer: int, kinds: dict[int, int], values: dict[int, list[bytes]]) -> None:
        self.pointer, self.kinds, self.all = pointer, kinds, values
        self.values, self.at = values[pointer], 1

    def check(self, kind: int) -> None:
        if kind == _SOLID:
            self._to(_SHELL)
            self._number()
            for _ in range(self._number()):
                self._to(_SHELL)
                self._number()
        elif kind == _SHELL:
            for _ in range(self._number()):
                self._to(_FACE)
                self._number()
        elif kind == _FACE:
            self._to()
            loops = self._number()
            self._number()
            for _ in range(loops):
                self._to(_LOOP)
        elif kind == _LOOP:
            for _ in range(self._number()):
                self._number()
                self._member(_EDGES, _VERTICES)
                self._number()
                for _ in range(self._number()):
                    self._number()
                    self._to()
        elif kind == _EDGES:
            for _ in range(self._number()):
                self._to()
                self._member(_VERTICES)
                self._member(_VERTICES)

    def _number(self) -> int:
        self.at += 1
        return int(self.values[self.at - 1].strip() or b"0")

    def _to(self, *wanted: int) -> int:
        """A pointer to an entity, of these types where some are given."""
        pointer = self._number()
        if pointer not in self.kinds or (wanted and self.kinds[pointer] not in wanted):
            raise ValueError(f"directory entry {self.pointer} points to {pointer}, which is no such entity")
        return pointer

    def _member(self, *wanted: int) -> None:
        """A pointer to a list, and the number of one of its members."""
        pointer = self._to(*wanted)
        if not 1 <= self._number() <= int(self.all[pointer][1]):
            raise ValueError(f"directory entry {self.pointer} refers to a member that a list does not have")
