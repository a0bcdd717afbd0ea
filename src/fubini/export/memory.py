"""The mesh as values of finite element and picture libraries, names included."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fubini.errors import DependencyError, ExportError
from fubini.export.layout import Float, Int, flatten, layout
from fubini.naming import overlap, primary

if TYPE_CHECKING:
    from fubini.result import Mesh

#: Node order of dolfinx and Netgen: the middle opposite to corner i is node 3 + i.
DOLFINX_ORDER = [0, 1, 2, 4, 5, 3]


@dataclass(frozen=True)
class DolfinxArrays:
    """What ``dolfinx.mesh.create_mesh`` and ``meshtags`` take.

    Attributes
    ----------
    points : (n, 2) where the mesh lies in a plane of constant z, else (n, 3).
    cells : (m, 3) or (m, 6) in dolfinx's node order.
    degree : 1 or 2, of the Lagrange coordinate element on triangles.
    cell_tags : (m,) int32, tag of the region of each cell.
    facets : (f, 2) corner nodes of the tagged facets.
    facet_tags : (f,) int32, tag of the boundary of each facet.
    regions, boundaries : name to tag, from 1.
    """

    points: Float
    cells: Int
    degree: int
    cell_tags: Int
    facets: Int
    facet_tags: Int
    regions: Mapping[str, int]
    boundaries: Mapping[str, int]


def to_dolfinx_arrays(mesh: Mesh) -> DolfinxArrays:
    """Arrays for dolfinx; needs no dolfinx. Raises ``ExportError`` where names overlap."""
    found = layout(mesh)
    found.refuse_overlap("a set of tags", "name every face once")
    shared = overlap(found.boundaries, len(found.segments))
    if shared:
        raise ExportError(f"a set of tags holds one boundary of each facet, and {' and '.join(shared)} overlap")
    points, cells = found.points, found.cells
    if np.ptp(points[:, 2]) == 0.0:
        points, cells = flatten(found)
    owner = primary(found.boundaries, len(found.segments))
    named = np.flatnonzero(owner >= 0)
    return DolfinxArrays(
        points,
        cells if found.order == 1 else np.ascontiguousarray(cells[:, DOLFINX_ORDER]),
        found.order,
        (found.region_of_cell + 1).astype(np.int32),
        np.ascontiguousarray(found.segments[named, :2]),
        (owner[named] + 1).astype(np.int32),
        {name: k for k, name in enumerate(found.regions, start=1)},
        {name: k for k, name in enumerate(found.boundaries, start=1)},
    )


def to_skfem(mesh: Mesh) -> Any:
    """``skfem.MeshTri1`` or ``MeshTri2`` with regions as subdomains and boundaries by name.

    Raises ``ExportError`` for a mesh that lies in no single plane, ``DependencyError`` without scikit-fem.
    """
    skfem = _import("skfem", "fem")
    found = layout(mesh)
    points, cells = flatten(found)
    corners = int(cells[:, :3].max()) + 1
    flat = skfem.MeshTri1(np.ascontiguousarray(points[:corners].T), np.ascontiguousarray(cells[:, :3].T))
    facets = np.sort(flat.facets.astype(np.int64), axis=0)
    keys = facets[0] * corners + facets[1]
    order = np.argsort(keys)

    def facet(pairs: Int) -> Int:
        ends = np.sort(pairs.astype(np.int64), axis=1)
        return np.asarray(order[np.searchsorted(keys[order], ends[:, 0] * corners + ends[:, 1])], np.int32)

    result = flat
    if found.order == 2:
        places = np.empty((len(keys), 2))
        for side in range(3):
            ends = np.stack([cells[:, side], cells[:, (side + 1) % 3]], axis=1)
            places[facet(ends)] = points[cells[:, 3 + side]]
        result = skfem.MeshTri2(np.hstack([flat.p, places.T]), flat.t)
    result = result.with_subdomains(dict(found.regions))
    return result.with_boundaries({name: facet(found.segments[rows, :2]) for name, rows in found.boundaries.items()})


def to_pyvista(mesh: Mesh) -> Any:
    """``pyvista.UnstructuredGrid`` with the cell data ``face`` and ``region``, and names as field data.

    ``field_data["regions"]`` holds the names that the cell data ``region`` numbers; the segments of each
    boundary stand in ``boundary:<name>`` as rows of node numbers.
    """
    pyvista = _import("pyvista", "pyvista")
    found = layout(mesh)
    cells = np.insert(found.cells, 0, found.cells.shape[1], axis=1)
    kind = 5 if found.order == 1 else 22
    grid = pyvista.UnstructuredGrid(cells.ravel(), np.full(len(cells), kind, np.uint8), found.points)
    grid.cell_data["face"] = found.face
    grid.cell_data["region"] = found.region_of_cell.astype(np.int32)
    grid.field_data["regions"] = list(found.regions)
    for name, rows in found.boundaries.items():
        grid.field_data[f"boundary:{name}"] = found.segments[rows]
    for name, rows in found.named_points.items():
        grid.field_data[f"point:{name}"] = rows
    return grid


def _import(module: str, extra: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise DependencyError(f"{module} cannot be imported", fix=f'pip install "fubini[{extra}]"') from error
