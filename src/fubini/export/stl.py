"""STL: one binary solid in single precision, or text with one solid for each face or region."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fubini.errors import OptionError
from fubini.export.convert import to_trimesh
from fubini.export.layout import Float, Layout, layout
from fubini.export.obj import group_labels

if TYPE_CHECKING:
    from fubini.result import Mesh


def write(mesh: Mesh, path: Path, solids: str = "one") -> None:
    """Write ``mesh`` to the new file ``path``, normals outward.

    ``solids``: "one" (binary, single precision, empty header), or "face" or "region": text in double precision with a
    ``solid`` of its name for each CAD face or for each region. The format knows triangles alone: no shared
    nodes, no boundaries, no second order.
    """
    if solids == "one":
        path.write_bytes(to_trimesh(mesh).export(file_type="stl"))
        return
    if solids not in ("face", "region"):
        raise OptionError(f"solids is {solids!r}", fix="use one, face or region")
    found = layout(mesh)
    with open(path, "w", encoding="utf-8", newline="\n") as out:
        for name, rows in _parts(mesh, found, solids):
            out.write(f"solid {name}\n")
            out.writelines(_facets(found.points[found.cells[rows, :3]]))
            out.write(f"endsolid {name}\n")


def _parts(mesh: Mesh, found: Layout, solids: str) -> Iterator[tuple[str, NDArray[np.signedinteger]]]:
    """Name and triangles of each solid."""
    if solids == "face":
        for face, label in group_labels(mesh).items():
            yield label, np.flatnonzero(found.face == face)
        return
    found.refuse_overlap("an STL file", 'save with solids="face"')
    yield from found.regions.items()


def _facets(corners: Float) -> Iterator[str]:
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    for (nx, ny, nz), triangle in zip(normals.tolist(), corners.tolist(), strict=True):
        yield f"facet normal {nx!r} {ny!r} {nz!r}\nouter loop\n"
        yield from (f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in triangle)
        yield "endloop\nendfacet\n"
