"""Judge any triangle mesh by the same figures, without its CAD model."""

from __future__ import annotations

import contextlib
import io
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fubini.certificate import excuse
from fubini.errors import InputError, OptionError
from fubini.measure import TriangleFigures, triangle_figures
from fubini.quality import angles, corner_limit
from fubini.report.figures import strict
from fubini.tolerance import MAX_ASPECT_RATIO, MIN_SKEW

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: Formats that both libraries read and trimesh reads better.
SURFACE_SUFFIXES = frozenset({".stl", ".obj", ".ply", ".off"})


@dataclass(frozen=True)
class MeshCheck:
    """Figures of a triangle mesh; angles in degrees, the area in square units of the mesh.

    Attributes
    ----------
    unavoidable : corners of the mesh's own outline (of each ``face`` where it has that cell data) that no
        valid triangle fits into; each excuses one flawed triangle.
    excess : flawed triangles beyond those.
    worst_at : centroid of the triangle of worst skewness that is not excused.
    boundary_edges, boundary_loops : edges of one triangle, and the connected sets of them.
    nonmanifold_edges : edges of three or more triangles.
    misoriented_edges : edges that two triangles run through in one direction.
    duplicate_triangles : triangles with the same three corners as an earlier one.
    degenerate_triangles : triangles of no area.
    duplicate_points : points at the place of another, as one in the figures; those of STL are not counted,
        as the format itself cannot share points.
    other_cells : cells of the file that are no triangles, left out.
    faces : number of different values of the cell data ``face``; 0 without it.
    """

    source: str
    points: int
    triangles: int
    flawed: int
    unavoidable: int
    excess: int
    worst_skew: float
    worst_at: tuple[float, float, float]
    mean_skew: float
    worst_aspect_ratio: float
    min_angle: float
    max_angle: float
    area: float
    boundary_edges: int
    boundary_loops: int
    nonmanifold_edges: int
    misoriented_edges: int
    duplicate_triangles: int
    degenerate_triangles: int
    duplicate_points: int
    other_cells: int
    faces: int

    @property
    def valid(self) -> bool:
        """No triangle is flawed but the unavoidable ones, and none is without area."""
        return self.excess == 0 and self.degenerate_triangles == 0

    def to_json(self) -> dict[str, Any]:
        """All figures and ``valid``, for strict JSON."""
        result: dict[str, Any] = strict({"valid": self.valid, **asdict(self)})
        return result


def check(source: Any, *, min_skew: float = MIN_SKEW, max_aspect_ratio: float = MAX_ASPECT_RATIO) -> MeshCheck:
    """Figures of a mesh: a path, or a mesh of trimesh, meshio or fubini.

    Raises
    ------
    InputError : the file cannot be read or holds no triangle, or a coordinate is not finite.
    OptionError : a bound makes no sense.
    """
    if not 0.0 < min_skew < 90.0:
        raise OptionError(f"min_skew is {min_skew}", fix="use more than 0 and less than 90 degrees")
    if not 1.0 < max_aspect_ratio < np.inf:
        raise OptionError(f"max_aspect_ratio is {max_aspect_ratio}", fix="use a ratio above 1")
    label, points, triangles, owner, others = read_triangles(source)
    used = len(np.unique(triangles))
    points, triangles = merge_equal(points, triangles)
    shape = triangle_figures(points, triangles)
    flawed = np.flatnonzero(shape.flawed(min_skew, max_aspect_ratio))
    sharp = _sharp_corners(points, triangles, owner, flawed, corner_limit(min_skew, max_aspect_ratio))
    excused = _excused(triangles, owner, flawed, sharp)
    rest = shape.skew.copy()
    rest[excused] = np.inf
    worst = int(rest.argmin() if len(excused) < len(rest) else shape.skew.argmin())
    x, y, z = points[triangles[worst]].mean(0).tolist()
    return MeshCheck(
        source=label,
        points=len(points),
        triangles=len(triangles),
        flawed=len(flawed),
        unavoidable=len(sharp),
        excess=len(flawed) - len(excused),
        worst_skew=float(shape.skew.min()),
        worst_at=(x, y, z),
        mean_skew=float(shape.skew.mean()),
        worst_aspect_ratio=float(shape.aspect.max()),
        min_angle=float(shape.least.min()),
        max_angle=float(shape.greatest.max()),
        **_topology(triangles, len(points)),
        **_sizes(shape),
        duplicate_points=0 if label.lower().endswith(".stl") else used - len(points),
        other_cells=others,
        faces=0 if owner is None else len(np.unique(owner)),
    )


def read_triangles(source: Any) -> tuple[str, Float, Int, Int | None, int]:
    """Label, points (n, 3), triangles (m, 3), face of each or None, and the number of other cells."""
    others, owner = 0, None
    if isinstance(source, (str, Path)):
        label = str(source)
        mesh = _read(Path(source))
    else:
        label, mesh = type(source).__name__, source
    if hasattr(mesh, "face_of_triangle"):
        points, triangles, owner = mesh.points, mesh.triangles, mesh.face_of_triangle
    elif hasattr(mesh, "cells"):
        points, triangles, owner, others = _from_meshio(mesh)
    elif hasattr(mesh, "faces") and hasattr(mesh, "vertices"):
        points, triangles = mesh.vertices, mesh.faces
    else:
        raise InputError(f"{label} is no triangle mesh", fix="give a path or a mesh of trimesh or meshio")
    points = np.array(points, np.float64)
    triangles = np.array(triangles, np.int64).reshape(-1, 3)
    if not len(triangles):
        raise InputError("no triangle in the file", file=label)
    if points.shape[1] == 2:
        points = np.pad(points, ((0, 0), (0, 1)))
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise InputError("a triangle refers to a point that is not there", file=label)
    bad = np.flatnonzero(~np.isfinite(points).all(1))
    if len(bad):
        raise InputError(f"point {bad[0]} is not finite", file=label)
    return label, points, triangles, None if owner is None else np.asarray(owner, np.int64), others


def merge_equal(points: Float, triangles: Int) -> tuple[Float, Int]:
    """The points that triangles use, each place once, and the triangles over them."""
    used, number = np.unique(triangles, return_inverse=True)
    place = number_rows(points[used])
    places = np.empty((int(place.max()) + 1, 3))
    places[place] = points[used]
    return places, place[number.reshape(-1)].reshape(-1, 3)


def number_rows(rows: NDArray[Any]) -> Int:
    """For each row (n, k) a number from 0, the same for equal rows; column by column, which is quick."""
    result = np.zeros(len(rows), np.int64)
    for column in rows.T:
        values, number = np.unique(column, return_inverse=True)
        _, result = np.unique(result * len(values) + number.reshape(-1), return_inverse=True)
        result = result.reshape(-1)
    return result


def _read(path: Path) -> Any:
    """The mesh of a file: by meshio, which keeps cell data, but for the surface formats of trimesh."""
    if not path.is_file():
        raise InputError("no such file", file=str(path))
    import meshio
    import trimesh

    suffix = path.suffix.lower()
    by_meshio = suffix in meshio.extension_to_filetypes and suffix not in SURFACE_SUFFIXES
    if not by_meshio and suffix[1:] not in trimesh.available_formats():
        raise InputError(f"unknown mesh format {suffix or '(no suffix)'!r}", file=str(path))
    said = io.StringIO()
    try:
        # readers raise whatever they meet; meshio prints what it dislikes and ends the process
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path) if by_meshio else trimesh.load_mesh(path, process=False)
    except (Exception, SystemExit) as error:
        words = " ".join(said.getvalue().split()) or str(error)
        raise InputError(f"cannot be read as a mesh: {words}", file=str(path)) from error


def _from_meshio(mesh: Any) -> tuple[Float, Int, Int | None, int]:
    names = mesh.cell_data.get("face")
    triangles, owner, others = [np.empty((0, 3), np.int64)], [], 0
    for k, block in enumerate(mesh.cells):
        if block.type not in ("triangle", "triangle6"):
            others += len(block.data) if block.type not in ("vertex", "line", "line3") else 0
            continue
        triangles.append(np.asarray(block.data, np.int64)[:, :3])
        if names is not None:
            owner.append(np.asarray(names[k]).ravel().astype(np.int64))
    faces = np.concatenate(owner) if owner else None
    return mesh.points, np.concatenate(triangles), faces, others


def _sizes(shape: TriangleFigures) -> dict[str, Any]:
    double = np.sqrt((shape.normals * shape.normals).sum(1))
    return {"area": 0.5 * float(double.sum()), "degenerate_triangles": int((double == 0.0).sum())}


def _topology(triangles: Int, points: int) -> dict[str, int]:
    """Counts over the edges of all triangles."""
    start, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    forward = np.minimum(start, end) * points + np.maximum(start, end)
    keys, number, uses = np.unique(forward, return_inverse=True, return_counts=True)
    turn = np.bincount(number.reshape(-1), np.sign(end - start))
    border = keys[uses == 1]
    low, high = border // points, border % points
    different = int(number_rows(np.sort(triangles, axis=1)).max()) + 1
    return {
        "boundary_edges": len(border),
        "boundary_loops": _components(low, high),
        "nonmanifold_edges": int((uses > 2).sum()),
        "misoriented_edges": int(((uses == 2) & (turn != 0)).sum()),
        "duplicate_triangles": len(triangles) - different,
    }


def _components(start: Int, end: Int) -> int:
    """Number of connected sets of edges."""
    if not len(start):
        return 0
    nodes, number = np.unique(np.concatenate([start, end]), return_inverse=True)
    n, k = len(nodes), len(start)
    number = number.reshape(-1)
    graph = coo_array((np.ones(k), (number[:k], number[k:])), shape=(n, n))
    return int(connected_components(graph, directed=False, return_labels=False))


def _sharp_corners(
    points: Float, triangles: Int, owner: Int | None, flawed: NDArray[np.intp], limit: float
) -> list[tuple[int, int]]:
    """Pairs (face, node): boundary nodes where all triangles of the face together span less than ``limit``."""
    if not len(flawed):
        return []
    face = np.zeros(len(triangles), np.int64) if owner is None else owner
    found = []
    for f in np.unique(face[flawed]).tolist():
        mine = triangles[face == f]
        start, end = mine.ravel(), mine[:, [1, 2, 0]].ravel()
        edge = np.minimum(start, end) * len(points) + np.maximum(start, end)
        keys, uses = np.unique(edge, return_counts=True)
        border = keys[uses == 1]
        rim = np.unique(np.concatenate([border // len(points), border % len(points)]))
        nodes, number = np.unique(mine, return_inverse=True)
        total = np.bincount(number.reshape(-1), angles(points[mine]).ravel())
        sharp = nodes[(total < limit) & np.isin(nodes, rim)]
        found += [(f, int(node)) for node in sharp]
    return found


def _excused(
    triangles: Int, owner: Int | None, flawed: NDArray[np.intp], sharp: list[tuple[int, int]]
) -> NDArray[np.intp]:
    rows = []
    for f in sorted({f for f, _ in sharp}):
        mine = flawed if owner is None else flawed[owner[flawed] == f]
        nodes = np.array([node for g, node in sharp if g == f], np.int64)
        rows.append(mine[excuse(triangles[mine], nodes)])
    return np.concatenate(rows) if rows else np.empty(0, np.intp)
