"""Universal files (I-DEAS): nodes, shells and boundary lines as elements, names as groups."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fubini.export.layout import Int, Layout, layout
from fubini.export.titles import changed, titles

if TYPE_CHECKING:
    from fubini.result import Mesh

#: Element descriptors at first and second order: rods, parabolic beams; plane triangles.
LINES, TRIANGLES = (11, 22), (41, 42)
#: Names of groups have 40 characters (20A2).
LONGEST_NAME = 40
#: Entity codes in groups.
NODE, ELEMENT = 7, 8


def write(mesh: Mesh, path: Path) -> None:
    """Write ``mesh`` to the new file ``path``: data sets 2411 (nodes), 2412 (elements), 2467 (groups).

    Elements of regions come first and have the numbers of the triangles, from 1; those of the named
    segments follow. Nodes of second-order elements run around them: corner, middle, corner, ... Names longer than
    40 characters are cut, and stay unique.
    """
    found = layout(mesh)
    with open(path, "w", encoding="utf-8", newline="\n") as out:
        out.writelines(_data_set(2411, _nodes(found)))
        named = np.unique(np.concatenate([np.empty(0, np.int32), *found.boundaries.values()]))
        out.writelines(_data_set(2412, _elements(found, named)))
        out.writelines(_data_set(2467, _groups(found, named)))


def renamed(mesh: Mesh) -> dict[str, str]:
    """Names that the file has in another form."""
    return changed(_titles(layout(mesh)))


def _titles(found: Layout) -> dict[str, str]:
    return titles(found.names, LONGEST_NAME, str.strip)


def _data_set(number: int, lines: Iterable[str]) -> Iterator[str]:
    yield f"    -1\n{number:6d}\n"
    yield from lines
    yield "    -1\n"


def _nodes(found: Layout) -> Iterator[str]:
    for i, p in enumerate(found.points.tolist(), start=1):
        yield f"{i:10d}{1:10d}{1:10d}{11:10d}\n"
        yield "".join(f"{x:25.16E}" for x in p) + "\n"


def _elements(found: Layout, named: Int) -> Iterator[str]:
    second = found.order - 1
    around = [0, 3, 1, 4, 2, 5] if second else [0, 1, 2]
    for i, nodes in enumerate((found.cells[:, around] + 1).tolist(), start=1):
        yield _record(i, TRIANGLES[second], 2, 1, 7, len(nodes))
        yield _record(*nodes)
    along = [0, 2, 1] if second else [0, 1]
    for i, nodes in enumerate((found.segments[named][:, along] + 1).tolist(), start=len(found.cells) + 1):
        yield _record(i, LINES[second], 1, 1, 7, len(nodes))
        yield _record(0, 1, 1)
        yield _record(*nodes)


def _groups(found: Layout, named: Int) -> Iterator[str]:
    title = _titles(found)
    groups: list[tuple[str, int, NDArray[np.signedinteger]]] = []
    groups += [(name, ELEMENT, rows + 1) for name, rows in found.regions.items()]
    first = len(found.cells) + 1
    groups += [(name, ELEMENT, np.searchsorted(named, rows) + first) for name, rows in found.boundaries.items()]
    groups += [(name, NODE, rows + 1) for name, rows in found.named_points.items()]
    for number, (name, kind, members) in enumerate(groups, start=1):
        yield _record(number, 0, 0, 0, 0, 0, 0, len(members))
        yield f"{title[name]}\n"
        items = members.tolist()
        for i in range(0, len(items), 2):
            yield "".join(_record(kind, item, 0, 0)[:-1] for item in items[i : i + 2]) + "\n"


def _record(*numbers: int) -> str:
    return "".join(f"{n:10d}" for n in numbers) + "\n"
