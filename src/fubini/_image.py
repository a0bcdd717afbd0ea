"""Machine code without a linker: an object file laid out once, put into memory and connected in later processes.

Compiled kernels are ELF files for x86-64, all of whose references are 64 bits wide. ``lay_out`` puts the sections that
a process needs one behind the other and notes which places hold an address; ``place`` copies them into memory, fills
these places in and makes the code executable. Anything else, other systems and processors too, is refused: such code
is loaded by numba.
"""

from __future__ import annotations

import ctypes
import mmap
import struct
from collections.abc import Callable
from typing import NamedTuple

#: Kinds of sections and flags, symbols without a section, relocations (ELF and its supplement for x86-64).
SYMBOLS, RELOCATIONS, EMPTY, UNWINDING = 2, 4, 8, 0x70000001
WRITABLE, IN_MEMORY, LOCAL_STORAGE = 1, 2, 0x400
UNDEFINED, COMMON = 0, 0xFFF2
ADDRESS, RELATIVE, CALL, RELATIVE_64 = 1, 2, 4, 24
X86_64 = b"\x7fELF\x02\x01", 62

PAGE = 4096
READ_EXECUTE = 5


class Image(NamedTuple):
    """Code laid out: plain values only, so that it can be written to a file.

    code : bytes, the first ``fixed`` of them not to be written; ``size`` bytes with what starts as zeros.
    inside : places of the addresses of other places, and these. outside : names and places of the addresses of what
    the process must have. names : places of the defined symbols.
    """

    code: bytes
    fixed: int
    size: int
    inside: tuple[tuple[int, int], ...]
    outside: tuple[tuple[str, tuple[tuple[int, int], ...]], ...]
    names: dict[str, int]


class _Section(NamedTuple):
    name: int
    kind: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    info: int
    alignment: int
    entry: int


class _Refused(Exception):
    """Something in an object file that is not known here."""


def lay_out(code: bytes) -> Image | None:
    """An object file as an image; None where it has what is not known here."""
    try:
        return _laid_out(code)
    except (_Refused, struct.error, IndexError, ValueError):
        return None


def _sections(code: bytes) -> list[_Section]:
    if code[:6] != X86_64[0] or struct.unpack_from("<H", code, 18)[0] != X86_64[1]:
        raise _Refused
    (start,) = struct.unpack_from("<Q", code, 40)
    entry, count, _ = struct.unpack_from("<HHH", code, 58)
    return [_Section(*struct.unpack_from("<IIQQQQIIQQ", code, start + i * entry)) for i in range(count)]


def _laid_out(code: bytes) -> Image:
    sections = _sections(code)
    needed = [s.flags & IN_MEMORY and s.size and not _for_debuggers(code, s, sections) for s in sections]
    loaded = [i for i, need in enumerate(needed) if need]
    if any(sections[i].flags & LOCAL_STORAGE for i in loaded):
        raise _Refused
    place: dict[int, int] = {}
    content = bytearray()
    for writable in (False, True):
        for i in loaded:
            section = sections[i]
            if bool(section.flags & WRITABLE) == writable:
                place[i] = _padded(content, max(section.alignment, 16))
                part = code[section.offset : section.offset + section.size]
                content += bytes(section.size) if section.kind == EMPTY else part
        if not writable:
            fixed = _padded(content, PAGE)
    symbols, names, size = _symbols(code, sections, place, len(content))
    inside, outside = _references(code, sections, place, symbols, content)
    return Image(
        bytes(content), fixed, size, tuple(inside), tuple((name, tuple(at)) for name, at in outside.items()), names
    )


def _for_debuggers(code: bytes, section: _Section, sections: list[_Section]) -> bool:
    """Whether a section tells how to unwind the stack: nothing here throws through compiled code."""
    (names,) = struct.unpack_from("<H", code, 62)
    return section.kind == UNWINDING or _text(code, sections[names].offset + section.name) == ".eh_frame"


def _padded(content: bytearray, alignment: int) -> int:
    content += bytes(-len(content) % alignment)
    return len(content)


def _text(code: bytes, start: int) -> str:
    return code[start : code.index(b"\0", start)].decode()


def _symbols(
    code: bytes, sections: list[_Section], place: dict[int, int], size: int
) -> tuple[list[int | str | None], dict[str, int], int]:
    """Of each symbol its place, or its name where another one defines it; the places by name; the size with what has
    no section."""
    (table,) = (s for s in sections if s.kind == SYMBOLS)
    found: list[int | str | None] = []
    names: dict[str, int] = {}
    for at in range(table.offset, table.offset + table.size, 24):
        text, info, _, section, value, length = struct.unpack_from("<IBBHQQ", code, at)
        name = _text(code, sections[table.link].offset + text)
        where: int | str | None = None
        if section == UNDEFINED:
            where = name
        elif section == COMMON:
            where = size + -size % max(value, 8)
            size = where + length
        elif section in place:
            where = place[section] + value
        found.append(where)
        if name and isinstance(where, int) and info >> 4:
            names[name] = where
    return found, names, size


def _references(
    code: bytes, sections: list[_Section], place: dict[int, int], symbols: list[int | str | None], content: bytearray
) -> tuple[list[tuple[int, int]], dict[str, list[tuple[int, int]]]]:
    """Places of addresses inside and outside of the image; distances inside are written into ``content``."""
    inside: list[tuple[int, int]] = []
    outside: dict[str, list[tuple[int, int]]] = {}
    for section in sections:
        if section.kind != RELOCATIONS or section.info not in place:
            continue
        for at in range(section.offset, section.offset + section.size, 24):
            offset, info, addend = struct.unpack_from("<QQq", code, at)
            target, here, kind = symbols[info >> 32], place[section.info] + offset, info & 0xFFFFFFFF
            if kind == ADDRESS and isinstance(target, int):
                inside.append((here, target + addend))
            elif kind == ADDRESS and target:
                outside.setdefault(target, []).append((here, addend))
            elif isinstance(target, int) and kind in (RELATIVE, CALL):
                struct.pack_into("<i", content, here, target + addend - here)
            elif isinstance(target, int) and kind == RELATIVE_64:
                struct.pack_into("<q", content, here, target + addend - here)
            else:
                raise _Refused
    return inside, outside


def place(image: Image, address_of: Callable[[str], int | None]) -> int | None:
    """Put an image into memory for good: its address, None where a symbol has none or the system allows no new code."""
    found = [(address_of(name), places) for name, places in image.outside]
    if not all(address for address, _ in found):
        return None
    memory = mmap.mmap(-1, image.size + -image.size % PAGE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    memory[: len(image.code)] = image.code
    base = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    for at, target in image.inside:
        struct.pack_into("<Q", memory, at, base + target)
    for address, places in found:
        for at, addend in places:
            struct.pack_into("<Q", memory, at, (address or 0) + addend)
    protect = ctypes.CDLL(None).mprotect
    protect.argtypes = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int
    if protect(base, image.fixed, READ_EXECUTE):
        return None
    # never given back: a thread may run the code up to the end of the process
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(memory))
    return base
