"""SU2: a plane mesh of one region, boundaries as markers of their name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fubini.errors import ExportError
from fubini.export.layout import Float, Int, Layout, flatten, layout
from fubini.export.titles import changed, titles
from fubini.naming import overlap, segment_sides

if TYPE_CHECKING:
    from fubini.result import Mesh

#: Cell types of VTK, which SU2 uses.
LINE, TRIANGLE = 3, 5
#: Characters that the configuration files of SU2 take for a mark between names.
MARKS = str.maketrans(dict.fromkeys("(),=%$|{} \t", "_"))
LONGEST_NAME = 120


def write(mesh: Mesh, path: Path) -> None:
    """Write ``mesh`` to the new file ``path``.

    Blanks, brackets, commas and ``|`` in names become ``_``. Raises ``ExportError`` for what SU2 cannot hold:
    second order, meshes that lie in no single plane, several regions, named points, and boundaries that
    overlap or lie inside.
    """
    found = layout(mesh)
    _refuse(found)
    points, cells = flatten(found)
    with open(path, "w", encoding="utf-8", newline="\n") as out:
        out.writelines(_lines(found, points, cells))


def renamed(mesh: Mesh) -> dict[str, str]:
    """Names that the file has in another form."""
    return changed(_titles(layout(mesh).boundaries))


def _titles(names: Iterable[str]) -> dict[str, str]:
    return titles(names, LONGEST_NAME, lambda name: name.translate(MARKS))


def _refuse(found: Layout) -> None:
    """Raise for what would be lost."""
    found.refuse_points("SU2")
    elsewhere = "use .msh, .inp, .unv, .vtu or .npz"
    if found.order == 2:
        raise ExportError("SU2 knows triangles of 3 nodes only", fix="mesh with order=1, or " + elsewhere)
    if len(found.regions) > 1:
        raise ExportError(f"SU2 would lose the names of {len(found.regions)} regions", fix=elsewhere)
    shared = overlap(found.boundaries, len(found.segments))
    if shared:
        raise ExportError(f"SU2 holds one marker of each edge, and {' and '.join(shared)} overlap", fix=elsewhere)
    segment, _, _ = segment_sides(found.cells, found.segments)
    sides = np.bincount(segment, minlength=len(found.segments))
    for name, rows in found.boundaries.items():
        if (sides[rows] > 1).any():
            raise ExportError(f"SU2 takes no marker inside the mesh, and {name!r} is one", fix=elsewhere)


def _lines(found: Layout, points: Float, cells: Int) -> Iterator[str]:
    yield f"NDIME= 2\nNELEM= {len(cells)}\n"
    yield from (f"{TRIANGLE} {a} {b} {c} {i}\n" for i, (a, b, c) in enumerate(cells.tolist()))
    yield f"NPOIN= {len(points)}\n"
    yield from (f"{x!r} {y!r} {i}\n" for i, (x, y) in enumerate(points.tolist()))
    yield f"NMARK= {len(found.boundaries)}\n"
    for name, title in _titles(found.boundaries).items():
        lines = found.segments[found.boundaries[name]].tolist()
        yield f"MARKER_TAG= {title}\nMARKER_ELEMS= {len(lines)}\n"
        yield from (f"{LINE} {a} {b}\n" for a, b in lines)
