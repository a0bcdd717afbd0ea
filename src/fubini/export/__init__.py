"""Writing meshes: the suffix of the path picks the writer, and a file appears whole or not at all."""

from fubini.export.atomic import Transaction, check_target
from fubini.export.convert import compact, to_meshio, to_trimesh
from fubini.export.layout import Layout, layout
from fubini.export.memory import DolfinxArrays, to_dolfinx_arrays, to_pyvista, to_skfem
from fubini.export.registry import (
    FLOAT32_SUFFIXES,
    WRITERS,
    check_path,
    flawed_after_rounding,
    formats,
    renamed,
    save,
    save_all,
)

__all__ = [
    "FLOAT32_SUFFIXES",
    "WRITERS",
    "DolfinxArrays",
    "Layout",
    "Transaction",
    "check_path",
    "check_target",
    "compact",
    "flawed_after_rounding",
    "formats",
    "layout",
    "renamed",
    "save",
    "save_all",
    "to_dolfinx_arrays",
    "to_meshio",
    "to_pyvista",
    "to_skfem",
    "to_trimesh",
]
