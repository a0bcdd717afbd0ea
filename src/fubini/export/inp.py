"""Abaqus and CalculiX: nodes, elements by region, node sets and surfaces of the boundaries."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fubini.errors import ExportError, OptionError
from fubini.export.layout import Float, Int, Layout, flatten, layout
from fubini.export.titles import changed, titles
from fubini.naming import segment_sides

if TYPE_CHECKING:
    from fubini.result import Mesh

#: What ``elements`` may be, and the family of element types.
FAMILIES = {"plane stress": "CPS", "plane strain": "CPE", "axisymmetric": "CAX", "shell": "S"}
#: CalculiX numbers the sides of a shell from here: its two faces come first.
FIRST_SHELL_SIDE = 3
#: Sets of all elements and of all nodes.
EVERYTHING = ("EALL", "NALL")
#: Sets may hold this many characters.
LONGEST_NAME = 80


def write(mesh: Mesh, path: Path, elements: str = "auto") -> None:
    """Write ``mesh`` to the new file ``path``.

    ``elements``: "plane stress" (CPS3, CPS6), "plane strain" (CPE), "axisymmetric" (CAX), "shell" (S3, S6
    in space), or "auto": plane stress where the mesh lies in one plane, else shells. The first three have
    plane coordinates, z = 0 and counter-clockwise elements.

    Regions are ELSETs, boundaries an NSET and a SURFACE of one name, points NSETs; boundaries are never
    elements. ``EALL`` and ``NALL`` hold everything. Letters that sets may not have become ``_``.
    """
    found = layout(mesh)
    points, cells, family = _placed(found, elements)
    safe = safe_names(found.names, *EVERYTHING)
    elset = {name: safe[name] for name in found.regions}
    nset = {name: safe[name] for name in found.names if name in found.boundaries or name in found.named_points}
    with open(path, "w", encoding="ascii", newline="\n") as out:
        out.write(f"*HEADING\nfubini: {len(points)} nodes, {len(cells)} elements\n")
        for name, title in changed(safe).items():
            out.write(f"** {title}: {name.encode('ascii', 'backslashreplace').decode()}\n")
        out.write("*NODE, NSET=NALL\n")
        rows = np.where(np.abs(points) < 1e-99, 0.0, points).tolist()
        out.writelines(f"{i}, {x:.13e}, {y:.13e}, {z:.13e}\n" for i, (x, y, z) in enumerate(rows, start=1))
        out.writelines(_elements(found, cells, f"{family}{cells.shape[1]}", elset))
        for name, title in nset.items():
            nodes = [found.named_points.get(name, np.empty(0, np.int32))]
            nodes += [found.boundary_nodes(name)] if name in found.boundaries else []
            out.write(f"*NSET, NSET={title}\n")
            out.writelines(_list(np.unique(np.concatenate(nodes)) + 1))
        out.writelines(_surfaces(found, cells, nset, FIRST_SHELL_SIDE if family == "S" else 1))


def safe_names(names: Iterable[str], *taken: str) -> dict[str, str]:
    """Names that sets may have: letters, digits and ``_-.|+``, at most 80, unique whatever their case."""
    return titles(names, LONGEST_NAME, _clean, taken, fold=True)


def renamed(mesh: Mesh) -> dict[str, str]:
    """Names that the file has in another form."""
    return changed(safe_names(layout(mesh).names, *EVERYTHING))


def _clean(name: str) -> str:
    base = re.sub(r"[^A-Za-z0-9_.|+-]", "_", name)
    return base if base[:1].isalpha() else f"N_{base}"


def _placed(found: Layout, elements: str) -> tuple[Float, Int, str]:
    """Points (n, 3), cells and element family."""
    if elements not in ("auto", *FAMILIES):
        raise OptionError(f"elements is {elements!r}", fix="use auto, " + ", ".join(FAMILIES))
    if elements == "shell":
        return found.points, found.cells, "S"
    try:
        flat, cells = flatten(found)
    except ExportError:
        if elements == "auto":
            return found.points, found.cells, "S"
        raise
    return np.pad(flat, ((0, 0), (0, 1))), cells, FAMILIES.get(elements, "CPS")


def _elements(found: Layout, cells: Int, kind: str, elset: dict[str, str]) -> Iterator[str]:
    """Elements by their first region, then further sets for regions that overlap."""
    owner = found.region_of_cell
    for number, (name, rows) in enumerate(found.regions.items()):
        own = np.flatnonzero(owner == number)
        if len(own):
            yield f"*ELEMENT, TYPE={kind}, ELSET={elset[name]}\n"
            for i, nodes in zip((own + 1).tolist(), (cells[own] + 1).tolist(), strict=True):
                yield f"{i}, {', '.join(map(str, nodes))}\n"
        shared = np.setdiff1d(rows, own)
        if len(shared):
            yield f"*ELSET, ELSET={elset[name]}\n"
            yield from _list(shared + 1)
    yield "*ELSET, ELSET=EALL\n"
    yield from (f"{safe}\n" for safe in elset.values())


def _surfaces(found: Layout, cells: Int, nset: dict[str, str], first: int) -> Iterator[str]:
    """Sides of elements on every boundary; of an interface, those of the element of the lowest number."""
    segment, element, side = segment_sides(cells[:, :3], found.segments[:, :2])
    _, once = np.unique(segment, return_index=True)
    at = np.full(len(found.segments), -1)
    at[segment[once]] = once
    for name, rows in found.boundaries.items():
        sides = at[rows]
        sides = sides[sides >= 0]
        if len(sides):
            yield f"*SURFACE, NAME={nset[name]}, TYPE=ELEMENT\n"
            for e, s in zip((element[sides] + 1).tolist(), (side[sides] + first).tolist(), strict=True):
                yield f"{e}, S{s}\n"


def _list(numbers: Int) -> Iterator[str]:
    """Numbers, eight a line."""
    values = numbers.tolist()
    for i in range(0, len(values), 8):
        yield ", ".join(map(str, values[i : i + 8])) + ",\n"
