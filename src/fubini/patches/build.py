"""The model of a triangle mesh: a face for each planar patch."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from fubini.curves import Line
from fubini.errors import GeometryError
from fubini.model import Edge, Face, Frame, Model
from fubini.patches.grow import Facets, grow
from fubini.patches.outline import Borders, find_borders
from fubini.region import Loop, Region

Float = NDArray[np.float64]

#: Corners of a patch lie this close (times the diagonal) to its plane, those of an edge to its line.
PLANAR = 1e-6


def facet_model(facets: Facets, *, tolerance: float | None = None, angle: float = 1.0) -> Model:
    """The planar patches of a triangle mesh as faces bounded by straight edges that they share.

    Parameters
    ----------
    tolerance : how far corners may lie off the plane of their patch (model units); by default 1e-6 times the
        diagonal, or what single precision leaves of coordinates far from the origin.
    angle : largest lean of a triangle against its patch, in degrees.

    A patch whose outline touches itself is taken triangle by triangle. Raises ``GeometryError`` with a place
    where a triangle bounds no region.
    """
    if tolerance is None:
        tolerance = max(PLANAR * facets.diagonal, 2.0**-22 * float(np.abs(facets.points).max()))
    patch = grow(facets, tolerance, angle)
    kept = patch >= 0
    if not kept.all():  # triangles of no area that no patch takes in
        facets = Facets(facets.label, facets.points, facets.triangles[kept], facets.dropped + int((~kept).sum()))
        patch = patch[kept]
    borders, faces, broken = _faces(facets, patch, tolerance)
    split = len(broken)
    if split:
        patch = _single(patch, broken)
        borders, faces, broken = _faces(facets, patch, tolerance)
    if broken:
        raise next(iter(broken.values()))
    used = sorted({v for edge in borders.edges for v in edge})
    number = {v: i for i, v in enumerate(used)}
    slack = 2.0 * tolerance
    return Model(
        source=facets.label,
        faces=tuple(faces),
        edges={i: Edge(i, "line", number[a], number[b], tolerance=slack) for i, (a, b) in enumerate(borders.edges)},
        vertices={i: facets.points[v] for i, v in enumerate(used)},
        diagonal=facets.diagonal,
        notes=_notes(facets, len(faces), split),
    )


def _faces(
    facets: Facets, patch: NDArray[np.int64], tolerance: float
) -> tuple[Borders, list[Face], dict[int, GeometryError]]:
    """Borders, faces, and what is wrong with patches that are no regions, as where holes meet in a point."""
    borders = find_borders(facets, patch, tolerance)
    faces: list[Face] = []
    broken: dict[int, GeometryError] = {}
    for p in range(len(borders.loops)):
        try:
            faces.append(_face(facets, patch, p, borders, tolerance))
        except GeometryError as error:
            broken[p] = error
    return borders, faces, broken


def _single(patch: NDArray[np.int64], broken: Iterable[int]) -> NDArray[np.int64]:
    """The patches with each triangle of the broken ones as a patch of its own, numbered in order."""
    alone = np.isin(patch, list(broken))
    apart = patch.copy()
    apart[alone] = int(patch.max()) + 1 + np.arange(int(alone.sum()))
    _, number = np.unique(apart, return_inverse=True)
    return np.asarray(number.ravel(), np.int64)


def _face(facets: Facets, patch: NDArray[np.int64], p: int, borders: Borders, tolerance: float) -> Face:
    """One patch as a region in the plane that fits it best."""
    frame = _frame(facets, patch == p)
    loops = [_loop(facets, frame, runs, borders) for runs in borders.loops[p]]
    loops = sorted(loops, key=lambda loop: -abs(loop.signed_area))
    at = facets.points[borders.edges[borders.loops[p][0][0][0]][0]] if loops else frame.origin
    try:
        if not loops:
            raise GeometryError("a patch without a border", at=at)
        region = Region(loops[0], tuple(loops[1:]), f"patch {p}")
        region.check()
    except GeometryError as error:
        raise GeometryError(
            error.message, file=facets.label, face=p, at=at, fix="look for triangles thinner than the tolerance"
        ) from error
    inner = tuple((_line(facets, frame, *borders.edges[e]), e) for e in borders.inner[p])
    return Face(p, region, frame, tolerance=2.0 * tolerance, inner=inner)


def _frame(facets: Facets, rows: NDArray[np.bool_]) -> Frame:
    """The plane through the middle of the corners, across the mean normal; x along the most level axis."""
    normal = facets.normals[rows].sum(axis=0)
    normal = normal / np.linalg.norm(normal)
    middle = facets.points[np.unique(facets.triangles[rows])].mean(axis=0)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(normal)))], normal)
    x = x / np.linalg.norm(x)
    return Frame(middle, x, np.cross(normal, x))


def _line(facets: Facets, frame: Frame, a: int, b: int) -> Line:
    return Line(*frame.to_plane(facets.points[[a, b]]))


def _loop(facets: Facets, frame: Frame, runs: tuple[tuple[int, bool], ...], borders: Borders) -> Loop:
    curves = []
    for edge, forward in runs:
        a, b = borders.edges[edge]
        curves.append(_line(facets, frame, *((a, b) if forward else (b, a))))
    return Loop(tuple(curves), tuple(edge for edge, _ in runs), tuple(forward for _, forward in runs))


def _notes(facets: Facets, patches: int, split: int) -> tuple[str, ...]:
    notes = [f"{len(facets.triangles)} triangles form {patches} planar patches"]
    if facets.dropped:
        notes.append(f"{facets.dropped} triangles without area left out")
    if split:
        notes.append(f"{split} patches whose outline touches itself were taken triangle by triangle")
    return tuple(notes)
