"""What every example does when it is run: write its STEP file, mesh it, print the table, draw the mesh."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from paper import first_mesh


def run(name: str, shape: Any, size: float, patterns: Sequence[str] = (), direction: str = "x") -> bool:
    """Command line of an example: ``FOLDER [--step] [--size H]``.

    Writes ``name.step``; then, unless ``--step`` is given, the mesh of the wanted size and one for each of the
    paper's reference sets, as ``name[-pattern].stl`` and ``.png``. ``direction`` is that of the cells that
    those are laid into. Gives False when only the STEP file was asked for.
    """
    parser = argparse.ArgumentParser(description=f"Make and mesh the example {name}.")
    parser.add_argument("folder", type=Path, nargs="?", default=Path(), help="where the files go")
    parser.add_argument("--step", action="store_true", help="only write the STEP file")
    parser.add_argument("--size", type=float, default=size, help=f"edge length (default {size:g})")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    print(f"wrote {write_step(shape, asked.folder / f'{name}.step')}")
    if asked.step:
        return False
    show(shape, asked.folder / name, asked.size)
    for pattern in patterns:
        show(shape, asked.folder / f"{name}-{pattern}", asked.size, pattern)
        print(f"before the optimiser: {first_mesh(shape, pattern, direction)}")
    return True


def write_step(shape: Any, path: Path) -> Path:
    """Write a build123d shape; the same shape gives the same bytes."""
    from build123d import export_step

    export_step(shape, path, timestamp="2019-08-01T00:00:00")
    return path


def show(shape: Any, stem: Path, size: float, pattern: str = "auto") -> Any:
    """Mesh a shape, print the table, write the mesh and its picture beside each other; gives the mesh."""
    import fubini
    from fubini.report import table

    mesh = fubini.mesh(shape, size, pattern=pattern)
    print(f"\n{stem.name}\n{table(mesh)}")
    mesh.save(stem.with_suffix(".stl"))
    mesh.plot(stem.with_suffix(".png"), title=stem.name)
    return mesh
