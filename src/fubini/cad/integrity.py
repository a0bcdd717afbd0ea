"""Is a CAD text file whole? The kernel prints, hangs or silently drops faces when it is not.

These checks read the text alone. They look for what a cut or damaged file lacks and leave the rest
of the judgement to the kernel.
"""

from __future__ import annotations

import re
from pathlib import Path

from fubini.cad.shapeset import check_text_shapes
from fubini.errors import InputError

_STRING = re.compile(rb"'(?:[^']|'')*'")
_COMMENT = re.compile(rb"/\*.*?\*/", re.DOTALL)
#: Text, an omitted value or a reference that something else than a comma or a bracket follows, and two commas.
_ODD = re.compile(rb"(?:''|[(,]\s*[$*])\s*+[^,)]|[,(]\s*#\d++\s*+[^,)]|,\s*[,)]|\(\s*,")
#: An instance whose type is no name, where not several types stand in brackets.
_NO_TYPE = re.compile(rb"\s*#\d+\s*=\s*+(?!\(|!?[A-Za-z][A-Za-z0-9_]*\s*\()")
_DEFINED = re.compile(rb"#(\d+)\s*=")
_REFERRED = re.compile(rb"#(\d+)")
_GEOMETRY = re.compile(
    rb"SHELL|FACE|LOOP|EDGE|VERTEX|BREP|SOLID|SURFACE|PLANE|CURVE|LINE|CIRCLE|ELLIPSE|POINT|AXIS"
    rb"|DIRECTION|VECTOR|BOUND|SHAPE_REPRESENTATION"
)
_APPEARANCE = re.compile(rb"STYLE|(?<!RE)PRESENTATION|COLOUR|ANNOTATION|DRAUGHTING|LAYER|PROPERTY|CONTEXT")

_BREP_HEADERS = (b"DBRep_DrawableShape", b"CASCADE Topology V")
_BREP_SECTIONS = (b"Locations", b"Curve2ds", b"Curves", b"Polygon3D", b"PolygonOnTriangulations", b"Surfaces",
                  b"Triangulations", b"TShapes")  # fmt: skip


def check_step(path: Path) -> tuple[str, ...]:
    """Remarks on a STEP file; ``InputError`` when it is no STEP, cut short, or lacks geometry it refers to."""
    data = path.read_bytes()
    if b"ISO-10303-21" not in data[:4096]:
        raise InputError("this is no STEP file: it does not begin with ISO-10303-21", file=str(path))
    if b"END-ISO-10303-21" not in data[-65536:] and b"END-ISO-10303-21" not in data:
        raise InputError(
            "the STEP file is cut short: its end mark END-ISO-10303-21 is missing",
            file=str(path),
            fix="export or download it again",
        )
    text = _COMMENT.sub(b"", _STRING.sub(b"''", data))
    _check_statements(text[max(0, text.find(b"DATA")) :], path)  # the header holds nothing that matters
    known = set(_DEFINED.findall(text))
    if known.issuperset(_REFERRED.findall(text)):
        return ()
    return _dangling(text, known, path)


def _check_statements(text: bytes, path: Path) -> None:
    """``InputError`` where values are not parted by commas, brackets do not close, or an entity has no proper type."""
    odd = _ODD.search(text)
    at = b"" if odd is None else text[max(0, odd.start() - 30) : odd.end() + 10]
    if not at:
        at = next((s for s in text.split(b";") if s.count(b"(") != s.count(b")") or _NO_TYPE.match(s)), b"")
    if at:
        raise InputError(
            f"the STEP file is damaged near {' '.join(at[:80].decode('ascii', 'replace').split())!r}",
            file=str(path),
            fix="export or download it again",
        )


def _dangling(text: bytes, known: set[bytes], path: Path) -> tuple[str, ...]:
    """Remarks on references to nothing; an error when a piece of geometry makes one."""
    notes = []
    for statement in text.split(b";"):
        head, _, body = statement.partition(b"=")
        missing = [r for r in _REFERRED.findall(body) if r not in known]
        if not missing:
            continue
        name = head.strip().decode("ascii", "replace")
        kind = body.split(b"(")[0].strip() or body.strip()
        what = f"{name} ({kind[:40].decode('ascii', 'replace')}) refers to #{missing[0].decode()}, which is not there"
        if _GEOMETRY.search(kind) and not _APPEARANCE.search(kind):
            raise InputError(f"the STEP file is damaged: {what}", file=str(path), fix="export or download it again")
        notes.append(what)
    return tuple(notes[:10])


def names_kind(path: Path, kind: str) -> bool:
    """Whether some entity of a STEP file whose type matches the pattern ``kind`` carries a real name."""
    named = re.compile(rb"(?:" + kind.encode() + rb")\s*\(\s*'\s*(?!NONE\s*'|NULL\s*')[^'\s]", re.IGNORECASE)
    return named.search(path.read_bytes()) is not None


def check_brep(path: Path) -> None:
    """``InputError`` unless this is the kernel's text format with all sections and all shapes."""
    data = path.read_bytes()
    if not any(mark in data[:4096] for mark in _BREP_HEADERS):
        raise InputError("this is no BREP file: it does not begin with a CASCADE Topology header", file=str(path))
    at = 0
    counts: list[int] = []
    for section in _BREP_SECTIONS:
        found = re.compile(rb"^" + section + rb"[ \t]+(\d+)", re.MULTILINE).search(data, at)
        if found is None:
            raise InputError(
                f"the BREP file is cut short or damaged: section {section.decode()} is missing",
                file=str(path),
                fix="export or download it again",
            )
        at, count = found.end(), int(found.group(1))
        counts.append(count)
    shapes = data[at:].split()
    if shapes.count(b"*") != count or not _is_reference(shapes):
        raise InputError(
            f"the BREP file is cut short or damaged: {shapes.count(b'*')} of its {count} shapes are whole",
            file=str(path),
            fix="export or download it again",
        )
    try:
        check_text_shapes(shapes, counts, b"CASCADE Topology V2" in data[:4096])
    except ValueError as error:
        raise InputError(
            f"the BREP file is cut short or damaged: {error}", file=str(path), fix="export or download it again"
        ) from error


def _is_reference(words: list[bytes]) -> bool:
    """Whether the text ends with the reference to the whole shape, such as ``+1 0``."""
    tail = words[len(words) - words[::-1].index(b"*") :] if b"*" in words else words
    return len(tail) >= 2 and tail[0][:1] in (b"+", b"-", b"i", b"e") and tail[1].isdigit()
