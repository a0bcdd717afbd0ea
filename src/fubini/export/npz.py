"""NumPy archive: every array of the mesh, names included."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fubini.export.layout import Int, layout

if TYPE_CHECKING:
    from fubini.result import Mesh


def write(mesh: Mesh, path: Path) -> None:
    """Write ``mesh`` to the new file ``path``.

    Arrays: ``points`` (n, 3), ``triangles`` (m, 3 or 6), ``face`` (m,), ``segments`` (k, 2 or 3), ``edge`` (k,);
    and for each of ``region``, ``boundary`` and ``point``: ``<kind>_names`` (g,), ``<kind>_start`` (g + 1,) and
    ``<kind>_members``, where group i holds ``members[start[i] : start[i + 1]]``.
    """
    found = layout(mesh)
    arrays: dict[str, NDArray[np.generic]] = {
        "points": found.points,
        "triangles": found.cells,
        "face": found.face,
        "segments": found.segments,
        "edge": found.edge,
    }
    for kind, groups in (("region", found.regions), ("boundary", found.boundaries), ("point", found.named_points)):
        arrays |= _packed(kind, groups)
    with open(path, "wb") as out:
        np.savez_compressed(out, **arrays)  # type: ignore[arg-type]


def _packed(kind: str, groups: Mapping[str, Int]) -> dict[str, NDArray[np.generic]]:
    start = np.zeros(len(groups) + 1, np.int64)
    np.cumsum([len(rows) for rows in groups.values()], out=start[1:])
    members = np.concatenate([np.empty(0, np.int32), *groups.values()]).astype(np.int32)
    return {f"{kind}_names": np.array(list(groups), np.str_), f"{kind}_start": start, f"{kind}_members": members}
