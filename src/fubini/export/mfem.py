"""MFEM's mesh format 1.3: attributes for what elements have in common, names as sets of attributes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fubini.export.layout import Float, Int, Layout, flatten, layout
from fubini.export.msh import unquoted
from fubini.export.titles import changed

if TYPE_CHECKING:
    from fubini.result import Mesh

#: Geometry types of MFEM.
SEGMENT, TRIANGLE = 1, 2
#: Where MFEM keeps our six nodes of a triangle in its lexicographic order: row by row from the corner 0.
LEXICOGRAPHIC = [0, 3, 1, 5, 4, 2]


def write(mesh: Mesh, path: Path) -> None:
    """Write ``mesh`` to the new file ``path``.

    Elements with the same regions share an attribute, segments with the same boundaries too; every name is an
    attribute set, so names may overlap. A mesh that lies in a plane of constant z has two coordinates. At second
    order the nodes are a grid function of each element's own (``L2_T1_2D_P2``). Raises ``ExportError`` for named
    points, which the format does not know. Quotation marks in names become ``'``.
    """
    found = layout(mesh)
    found.refuse_points("the MFEM format")
    points, cells = found.points, found.cells
    if np.ptp(points[:, 2]) == 0.0:
        points, cells = flatten(found)
    with open(path, "w", encoding="utf-8", newline="\n") as out:
        out.writelines(_lines(found, points, cells))


def renamed(mesh: Mesh) -> dict[str, str]:
    """Names that the file has in another form."""
    return changed(unquoted(layout(mesh).names))


def _lines(found: Layout, points: Float, cells: Int) -> Iterator[str]:
    yield "MFEM mesh v1.3\n\ndimension\n2\n\nelements\n"
    attribute, sets = _attributes(found.regions, len(cells))
    yield from _elements(attribute, TRIANGLE, cells[:, :3])
    yield from _sets("attribute_sets", sets, unquoted(found.names))
    named = np.unique(np.concatenate([np.empty(0, np.int32), *found.boundaries.values()]))
    attribute, sets = _attributes(found.boundaries, len(found.segments))
    yield "\nboundary\n"
    yield from _elements(attribute[named], SEGMENT, found.segments[named, :2])
    yield from _sets("bdr_attribute_sets", sets, unquoted(found.names))
    corners = int(cells[:, :3].max()) + 1
    yield f"\nvertices\n{corners}\n"
    if found.order == 1:
        yield f"{points.shape[1]}\n"
        yield from _numbers(points)
    else:
        yield "\nnodes\nFiniteElementSpace\nFiniteElementCollection: L2_T1_2D_P2\n"
        yield f"VDim: {points.shape[1]}\nOrdering: 1\n\n"
        yield from _numbers(points[cells[:, LEXICOGRAPHIC]].reshape(-1, points.shape[1]))
    yield "\nmfem_mesh_end\n"


def _attributes(groups: Mapping[str, Int], count: int) -> tuple[Int, dict[str, list[int]]]:
    """A number from 1 for every combination of groups that occurs (count,), and the numbers of each group."""
    of_row: list[list[int]] = [[] for _ in range(count)]
    for number, rows in enumerate(groups.values()):
        for row in rows.tolist():
            of_row[row].append(number)
    number_of = {combination: k for k, combination in enumerate(sorted({tuple(c) for c in of_row if c}), start=1)}
    attribute = np.array([number_of.get(tuple(c), 0) for c in of_row], np.int32)
    return attribute, {name: [k for c, k in number_of.items() if i in c] for i, name in enumerate(groups)}


def _elements(attribute: Int, kind: int, nodes: Int) -> Iterator[str]:
    yield f"{len(nodes)}\n"
    for a, corners in zip(attribute.tolist(), nodes.tolist(), strict=True):
        yield f"{a} {kind} {' '.join(map(str, corners))}\n"


def _sets(title: str, sets: Mapping[str, list[int]], safe: Mapping[str, str]) -> Iterator[str]:
    yield f"\n{title}\n{len(sets)}\n"
    for name in sorted(sets):
        yield f'"{safe[name]}" {len(sets[name])} {" ".join(map(str, sets[name]))}\n'


def _numbers(points: Float) -> Iterator[str]:
    yield from (" ".join(map(repr, row)) + "\n" for row in points.tolist())
