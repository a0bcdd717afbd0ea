"""Legacy VTK: double precision, binary, with the cell data array ``face``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fubini.export.convert import to_meshio

if TYPE_CHECKING:
    from fubini.result import Mesh


def write(mesh: Mesh, path: Path) -> None:
    """Write ``mesh`` to the new file ``path``."""
    to_meshio(mesh, names=False).write(path, file_format="vtk42", binary=True)
