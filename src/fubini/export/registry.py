"""Suffix to writer; ``save`` and ``save_all``."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fubini.errors import ExportError, OptionError
from fubini.export import glb, inp, mfem, msh, npz, obj, ply, stl, su2, threemf, unv, vtk, vtu
from fubini.export.atomic import Transaction, check_target
from fubini.quality import flawed

if TYPE_CHECKING:
    from fubini.result import Mesh

#: Suffix (lower case) to the function that writes a mesh to a new file at the given path.
WRITERS: dict[str, Callable[..., None]] = {
    ".stl": stl.write,
    ".obj": obj.write,
    ".ply": ply.write,
    ".glb": glb.write,
    ".vtu": vtu.write,
    ".vtk": vtk.write,
    ".inp": inp.write,
    ".msh": msh.write,
    ".unv": unv.write,
    ".npz": npz.write,
    ".mesh": mfem.write,
    ".su2": su2.write,
    ".3mf": threemf.write,
}

#: Formats that cannot hold every name as it is: suffix to what they change.
RENAMING: dict[str, Callable[[Mesh], dict[str, str]]] = {
    ".inp": inp.renamed,
    ".mesh": mfem.renamed,
    ".msh": msh.renamed,
    ".unv": unv.renamed,
    ".su2": su2.renamed,
}

#: Formats of solvers that would lose the names of regions and boundaries, and why: refused.
NAMELESS = {
    ".bdf": "Nastran numbers properties and sets, and knows names in comments of single programs alone",
    ".cgns": "no writer at hand keeps its families",
    ".dat": "Nastran numbers properties and sets, and knows names in comments of single programs alone",
    ".e": "Exodus numbers its blocks and side sets in every writer at hand",
    ".exo": "Exodus numbers its blocks and side sets in every writer at hand",
    ".fem": "Nastran numbers properties and sets, and knows names in comments of single programs alone",
    ".med": "no writer at hand keeps its families beside second order",
    ".nas": "Nastran numbers properties and sets, and knows names in comments of single programs alone",
    ".xdmf": "its readers take numbered tags only",
    ".xml": "its readers take numbered tags only",
}

#: Formats that keep coordinates in single precision.
FLOAT32_SUFFIXES = frozenset({".stl", ".ply", ".glb"})


def formats() -> tuple[str, ...]:
    """Suffixes that can be written, sorted.

    >>> formats()
    ('.3mf', '.glb', '.inp', '.mesh', '.msh', '.npz', '.obj', '.ply', '.stl', '.su2', '.unv', '.vtk', '.vtu')
    """
    return tuple(sorted(WRITERS))


def check_path(path: str | Path) -> None:
    """Raise ``ExportError`` where ``save`` would fail for the path alone; writes nothing."""
    _writer(path)
    check_target(path)


def save(mesh: Mesh, path: str | Path, **options: Any) -> None:
    """Write the mesh to ``path``; the suffix picks the format. The same mesh gives the same bytes.

    ``options`` of the format: ``elements`` for .inp (see ``fubini.export.inp.write``), ``version`` for
    .msh ("2.2" or "4.1"), ``solids`` for .stl ("one", "face" or "region").

    Raises
    ------
    ExportError : unknown suffix, the format would lose what the mesh holds, or the file cannot be
        written; nothing half-written stays behind.
    OptionError : the format has no such option.
    """
    writer = _writer(path)
    known = set(inspect.signature(writer).parameters) - {"mesh", "path"}
    for name in options:
        if name not in known:
            fix = "options are " + ", ".join(sorted(known)) if known else "this format has no options"
            raise OptionError(f"unknown option {name!r}", file=str(path), fix=fix)
    with Transaction() as own:
        _stage_all(mesh, [path], [partial(writer, **options)], own)


def save_all(mesh: Mesh, paths: Sequence[str | Path], transaction: Transaction | None = None) -> None:
    """Write the mesh to every path, or to none; within ``transaction`` where one is given."""
    writers = [_writer(path) for path in paths]
    if transaction is None:
        with Transaction() as own:
            _stage_all(mesh, paths, writers, own)
    else:
        _stage_all(mesh, paths, writers, transaction)


def renamed(mesh: Mesh, path: str | Path) -> dict[str, str]:
    """Names of the mesh that the file holds in another form: cut, or with other characters, but still unique.

    Formats whose names are free (.vtu, .npz) change none.
    """
    _writer(path)
    rename = RENAMING.get(Path(path).suffix.lower())
    return {} if rename is None else rename(mesh)


def flawed_after_rounding(mesh: Mesh) -> int:
    """How many more triangles are flawed once the coordinates are single precision.

    Small triangles far from the origin lose their shape in STL, PLY and GLB; .obj, .vtk and .vtu keep
    double precision.
    """
    limits = (mesh.certificate.min_skew, mesh.certificate.max_aspect_ratio)
    rounded = mesh.points.astype(np.float32).astype(np.float64)
    after = int(flawed(rounded[mesh.triangles], *limits).sum())
    return max(0, after - mesh.certificate.flawed)


def _writer(path: str | Path) -> Callable[..., None]:
    suffix = Path(path).suffix.lower()
    if suffix in NAMELESS:
        raise ExportError(
            f"{suffix} would lose the names of regions and boundaries: {NAMELESS[suffix]}",
            file=str(path), fix="use .inp, .msh, .unv, .vtu, .mesh or .npz, or mesh.to_meshio().write(path)",
        )  # fmt: skip
    if suffix not in WRITERS:
        what = f"unknown suffix {suffix!r}" if suffix else "the path has no suffix"
        raise ExportError(what, file=str(path), fix="use one of " + ", ".join(formats()))
    return WRITERS[suffix]


def _stage_all(
    mesh: Mesh,
    paths: Sequence[str | Path],
    writers: Sequence[Callable[..., None]],
    transaction: Transaction,
) -> None:
    for path, writer in zip(paths, writers, strict=True):
        temporary = transaction.stage(path)
        try:
            writer(mesh, temporary)
        except ExportError as error:
            raise ExportError(error.message, file=str(path), fix=error.fix) from error
        except OSError as error:
            reason = error.strerror or str(error)
            raise ExportError(f"cannot be written: {reason}", file=str(path)) from error
