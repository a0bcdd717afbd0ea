"""VTU (VTK XML): double precision, compressed, names as field data."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from fubini.export.layout import Layout, layout

if TYPE_CHECKING:
    from fubini.result import Mesh

#: VTK cell types of triangles of 3 and 6 nodes.
CELL_TYPES = {3: 5, 6: 22}
TYPE_NAMES = {"float64": "Float64", "int64": "Int64", "int32": "Int32", "uint8": "UInt8"}


def write(mesh: Mesh, path: Path) -> None:
    """Write ``mesh`` to the new file ``path``.

    Cell data: ``face``, the CAD face index, and ``region``, the number of the region. Field data: cells of
    each region as ``region:<name>``, nodes of each segment as ``boundary:<name>``, nodes as ``point:<name>``.
    """
    found = layout(mesh)
    with open(path, "w", encoding="utf-8", newline="\n") as out:
        out.write('<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" ')
        out.write('header_type="UInt64" compressor="vtkZLibDataCompressor">\n<UnstructuredGrid>\n<FieldData>\n')
        out.writelines(_field_data(found))
        out.write("</FieldData>\n")
        out.write(f'<Piece NumberOfPoints="{len(found.points)}" NumberOfCells="{len(found.cells)}">\n<Points>\n')
        out.write(_array("Points", found.points))
        out.write("</Points>\n<Cells>\n")
        out.write(_array("connectivity", found.cells.ravel()))
        nodes = found.cells.shape[1]
        out.write(_array("offsets", np.arange(1, len(found.cells) + 1, dtype=np.int64) * nodes))
        out.write(_array("types", np.full(len(found.cells), CELL_TYPES[nodes], np.uint8)))
        out.write("</Cells>\n<CellData>\n")
        out.write(_array("face", found.face))
        out.write(_array("region", found.region_of_cell.astype(np.int32)))
        out.write("</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n")


def _field_data(found: Layout) -> Iterator[str]:
    for name, rows in found.regions.items():
        yield _array(f"region:{name}", rows, tuples=True)
    for name, rows in found.boundaries.items():
        yield _array(f"boundary:{name}", found.segments[rows], tuples=True)
    for name, rows in found.named_points.items():
        yield _array(f"point:{name}", rows, tuples=True)


def _array(name: str, values: NDArray[np.generic], tuples: bool = False) -> str:
    """One data array, compressed as one block."""
    kind = TYPE_NAMES[values.dtype.name]
    little = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    raw = little.tobytes()
    packed = zlib.compress(raw, 6)
    header = np.array([1, len(raw), len(raw), len(packed)], "<u8").tobytes()
    text = base64.b64encode(header).decode() + base64.b64encode(packed).decode()
    width = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    count = f' NumberOfTuples="{len(values)}"' if tuples else ""
    return f'<DataArray type="{kind}" Name={quoteattr(name)}{width}{count} format="binary">\n{text}\n</DataArray>\n'
