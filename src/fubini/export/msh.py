"""Gmsh's text formats 2.2 and 4.1, names as physical groups."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fubini.errors import OptionError
from fubini.export.layout import Int, Layout, layout
from fubini.export.titles import changed, titles

if TYPE_CHECKING:
    from fubini.result import Mesh

#: Element types by dimension, at first and second order.
TYPES = ((15, 15), (1, 8), (2, 9))
#: Gmsh reads longer names, up to its buffers of 1024 characters.
LONGEST_NAME = 1000


def write(mesh: Mesh, path: Path, version: str = "2.2") -> None:
    """Write ``mesh`` to the new file ``path`` in version "2.2" or "4.1".

    Physical groups are numbered through regions, boundaries and points, so that no two share a tag.
    Elementary tags are CAD indices from 1. Only named segments and points become elements. Version 2.2
    holds one region of each element, and repeats a segment that has several names. Quotation marks in names
    become ``'``.
    """
    if str(version) not in ("2.2", "4.1"):
        raise OptionError(f"version is {version!r}", fix="use 2.2 or 4.1")
    found = layout(mesh)
    lines = _version_2(found) if str(version) == "2.2" else _version_4(found)
    with open(path, "w", encoding="utf-8", newline="\n") as out:
        out.writelines(lines)


@dataclass(frozen=True)
class _Entity:
    """Elements of one dimension, one CAD entity and one set of physical tags."""

    dim: int
    tag: int
    physical: tuple[int, ...]
    cells: Int


def _tags(found: Layout) -> list[tuple[int, Mapping[str, Int], dict[str, int]]]:
    """By falling dimension: the groups and the physical tag of each name."""
    result, count = [], 0
    for dim, groups in ((2, found.regions), (1, found.boundaries), (0, found.named_points)):
        result.append((dim, groups, {name: count + k for k, name in enumerate(groups, start=1)}))
        count += len(groups)
    return result


def renamed(mesh: Mesh) -> dict[str, str]:
    """Names that the file has in another form."""
    return changed(unquoted(layout(mesh).names))


def unquoted(names: Iterable[str]) -> dict[str, str]:
    """Names without quotation marks, which stand around them in the file."""
    return titles(names, LONGEST_NAME, lambda name: name.replace('"', "'"))


def _physical_names(found: Layout) -> Iterator[str]:
    tags = _tags(found)
    yield f"$PhysicalNames\n{sum(len(t) for _, _, t in tags)}\n"
    title = unquoted(found.names)
    for dim, _, names in reversed(tags):
        yield from (f'{dim} {tag} "{title[name]}"\n' for name, tag in names.items())
    yield "$EndPhysicalNames\n"


def _version_2(found: Layout) -> Iterator[str]:
    found.refuse_overlap("version 2.2 of .msh", 'save with version="4.1"')
    yield "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
    yield from _physical_names(found)
    yield f"$Nodes\n{len(found.points)}\n"
    yield from (f"{i} {x!r} {y!r} {z!r}\n" for i, (x, y, z) in enumerate(found.points.tolist(), start=1))
    yield "$EndNodes\n$Elements\n"
    rows: list[str] = []
    for dim, groups, tags in reversed(_tags(found)):
        cells, entity = _of_dimension(found, dim)
        for name, members in groups.items():
            for nodes, cad in zip((cells[members] + 1).tolist(), (entity[members] + 1).tolist(), strict=True):
                head = f"{len(rows) + 1} {TYPES[dim][found.order - 1]} 2 {tags[name]} {cad}"
                rows.append(f"{head} {' '.join(map(str, nodes))}\n")
    yield f"{len(rows)}\n"
    yield from rows
    yield "$EndElements\n"


def _of_dimension(found: Layout, dim: int) -> tuple[Int, Int]:
    """Connectivity and CAD index of all elements of a dimension."""
    if dim == 2:
        return found.cells, found.face
    if dim == 1:
        return found.segments, found.edge
    nodes = np.arange(len(found.points), dtype=np.int32)
    return nodes[:, None], nodes


def _entities(found: Layout) -> list[_Entity]:
    """Elements grouped by CAD entity and physical tags, points first."""
    result: list[_Entity] = []
    for dim, groups, tags in reversed(_tags(found)):
        cells, cad = _of_dimension(found, dim)
        of_row: dict[int, list[int]] = {}
        for name, members in groups.items():
            for row in members.tolist():
                of_row.setdefault(row, []).append(tags[name])
        sorted_rows: dict[tuple[int, tuple[int, ...]], list[int]] = {}
        for row in sorted(of_row):
            sorted_rows.setdefault((int(cad[row]), tuple(of_row[row])), []).append(row)
        for tag, (_, physical) in enumerate(sorted(sorted_rows), start=1):
            members = np.array(sorted_rows[sorted(sorted_rows)[tag - 1]])
            result.append(_Entity(dim, tag, physical, cells[members]))
    return result


def _version_4(found: Layout) -> Iterator[str]:
    yield "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
    yield from _physical_names(found)
    entities = _entities(found)
    counts = [sum(e.dim == d for e in entities) for d in range(4)]
    yield "$Entities\n" + " ".join(map(str, counts)) + "\n"
    for e in entities:
        places = found.points[e.cells.ravel()]
        box = places[:1] if e.dim == 0 else np.array([places.min(axis=0), places.max(axis=0)])
        physical = " ".join(map(str, (len(e.physical), *e.physical)))
        yield f"{e.tag} {' '.join(map(repr, box.ravel().tolist()))} {physical}{'' if e.dim == 0 else ' 0'}\n"
    yield "$EndEntities\n"
    yield from _nodes_4(found, entities)
    total = sum(len(e.cells) for e in entities)
    yield f"$Elements\n{len(entities)} {total} 1 {total}\n"
    number = 0
    for e in entities:
        yield f"{e.dim} {e.tag} {TYPES[e.dim][found.order - 1]} {len(e.cells)}\n"
        for nodes in (e.cells + 1).tolist():
            number += 1
            yield f"{number} {' '.join(map(str, nodes))}\n"
    yield "$EndElements\n"


def _nodes_4(found: Layout, entities: list[_Entity]) -> Iterator[str]:
    """Every node in the block of the first entity, points before curves before surfaces, that has it."""
    free = np.ones(len(found.points), bool)
    blocks = []
    for e in entities:
        nodes = np.unique(e.cells)
        nodes = nodes[free[nodes]]
        free[nodes] = False
        if len(nodes):
            blocks.append((e, nodes))
    yield f"$Nodes\n{len(blocks)} {len(found.points)} 1 {len(found.points)}\n"
    for e, nodes in blocks:
        yield f"{e.dim} {e.tag} 0 {len(nodes)}\n"
        yield from (f"{i}\n" for i in (nodes + 1).tolist())
        yield from (f"{x!r} {y!r} {z!r}\n" for x, y, z in found.points[nodes].tolist())
    yield "$EndNodes\n"
