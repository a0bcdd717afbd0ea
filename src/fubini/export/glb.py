"""Binary glTF: single precision, one mesh."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fubini.export.convert import to_trimesh

if TYPE_CHECKING:
    from fubini.result import Mesh


def write(mesh: Mesh, path: Path) -> None:
    """Write ``mesh`` to the new file ``path``."""
    path.write_bytes(to_trimesh(mesh).export(file_type="glb"))
