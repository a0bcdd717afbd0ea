"""Wavefront OBJ: double precision, one group for each CAD face."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fubini.export.convert import compact

if TYPE_CHECKING:
    from fubini.result import Mesh


def write(mesh: Mesh, path: Path) -> None:
    """Write ``mesh`` to the new file ``path``; groups are ``face_<index>``, or the name where it has one.

    Numbers are the shortest that read back to the same double. Faces of one name get the index behind it.
    """
    points, triangles = compact(mesh)
    owner = np.asarray(mesh.face_of_triangle)
    with open(path, "w", encoding="utf-8", newline="\n") as out:
        out.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist())
        for face, label in group_labels(mesh).items():
            out.write(f"g {label}\n")
            rows = (triangles[owner == face] + 1).tolist()
            out.writelines(f"f {a} {b} {c}\n" for a, b, c in rows)


def group_labels(mesh: Mesh) -> dict[int, str]:
    """CAD face index to group name, unique and without blanks, in index order."""
    indices = np.unique(mesh.face_of_triangle).tolist()
    plain = {i: "_".join((mesh.face_names.get(i) or "").split()) or f"face_{i}" for i in indices}
    count = Counter(plain.values())
    seen = {name for name, n in count.items() if n == 1}
    labels = {}
    for i, name in plain.items():
        label = name if count[name] == 1 else f"{name}_{i}"
        while count[name] > 1 and label in seen:
            label += "_"
        seen.add(label)
        labels[i] = label
    return labels
