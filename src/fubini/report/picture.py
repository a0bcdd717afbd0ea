"""A picture of a mesh: flat meshes in their own plane, others from the side, nearest last."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fubini.errors import OptionError
from fubini.report.canvas import (
    BOLD,
    EDGE,
    EXCUSED_COLOUR,
    FILL,
    FLAWED_COLOUR,
    TEXT,
    add_caption,
    check_picture_path,
    new_figure,
    write_figure,
)
from fubini.report.states import EXCUSED, FLAWED, VALID, triangle_states
from fubini.tolerance import FLAT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fubini.result import Mesh

Float = NDArray[np.float64]
Byte = NDArray[np.uint8]

#: Edges fade out below this length on the picture, in pixels, and are left away below the second, each by itself.
FADE, VANISH = 8.0, 1.5

#: A flawed triangle smaller than this on the picture, in pixels, gets a ring around it.
SMALL = 14.0


def plot(
    mesh: Mesh,
    path: str | Path | None = None,
    *,
    width: float = 10.0,
    dpi: float = 160.0,
    view: tuple[float, float, float] = (1.0, -1.4, 0.9),
    title: str | None = None,
) -> Any:
    """Draw the mesh; flawed triangles red, unavoidable ones orange, CAD edges bold, the figures below.

    Parameters
    ----------
    path : a .png, .svg or .pdf to write, or None.
    width : of the picture in inches; ``dpi`` pixels each.
    view : direction from the model to the eye, for a mesh that is not flat.
    title : first words of the caption, else the name of the source.

    Returns
    -------
    The ``matplotlib.figure.Figure``.

    Raises
    ------
    DependencyError : matplotlib is missing. OptionError, ExportError : as their words say.
    """
    if path is not None:
        check_picture_path(path)
    if not (0.5 <= width <= 100.0 and 10.0 <= dpi <= 2400.0):
        raise OptionError(f"a picture of {width} inches at {dpi} dpi", fix="0.5 to 100 inches, 10 to 2400 dpi")
    flat, depth, shade = project(mesh, view)
    states = triangle_states(mesh)
    used = flat[np.unique(mesh.triangles)]
    figure, axes, pixels = new_figure(used.min(0), used.max(0), width, dpi)
    if depth is None:
        _draw_flat(axes, mesh, flat, states, pixels)
    else:
        _draw_deep(axes, mesh, flat, depth, shade, states, pixels)
    _mark_small(axes, flat[mesh.triangles], states, pixels)
    _caption(figure, mesh, title)
    if path is not None:
        write_figure(figure, path)
    return figure


def project(mesh: Mesh, view: tuple[float, float, float]) -> tuple[Float, Float | None, Float]:
    """Picture coordinates (n, 2) of the points, their depth towards the eye (n,), brightness (m,).

    A flat mesh is seen along its normal, x to the right where that can be, and has no depth (None).
    """
    corners = mesh.points[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = normals.sum(0)
    size = float(np.linalg.norm(np.ptp(mesh.points[np.unique(mesh.triangles)], axis=0)))
    one = np.ones(len(corners))
    if np.linalg.norm(total) > 0.0:
        axis = total / np.linalg.norm(total)
        height = (corners - corners[0, 0]) @ axis
        if np.abs(height).max() <= 10 * FLAT * size:
            return mesh.points @ _axes_of_view(axis)[:2].T, None, one
    eye = np.asarray(view, float)
    if eye.shape != (3,) or not np.isfinite(eye).all() or not eye.any():
        raise OptionError(f"view {view!r} is no direction", fix="give three numbers, for example (1, -1, 1)")
    right, up, towards = _axes_of_view(eye / np.linalg.norm(eye))
    length = np.linalg.norm(normals, axis=1)
    unit = normals / np.maximum(length, 1e-300)[:, None]
    light = 0.25 * right + 0.55 * up + 0.8 * towards
    facing = np.sign(unit @ towards)
    shade = np.where(facing >= 0, 0.82 + 0.18 * np.clip(unit @ light, 0, 1), 0.7)
    return mesh.points @ np.stack([right, up]).T, mesh.points @ towards, shade


def _axes_of_view(towards: Float) -> Float:
    """Rows right, up and ``towards`` (3, 3): z upward on the picture, or y where the view is along z."""
    up = np.array([0.0, 0, 1]) if abs(towards[2]) < 0.999 else np.array([0.0, 1, 0])
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(towards, right), towards])


def _edge_style(side: Float) -> tuple[Float, Float]:
    """Width in points and opacity (k,) of edges by length in pixels: finer and paler as they get short."""
    width = np.clip(0.02 * side, 0.22, 0.7)
    alpha = np.where(side < VANISH, 0.0, np.clip(0.25 + 0.65 * side / FADE, 0.3, 0.9))
    return width, alpha


def _colours(states: Byte, shade: Float) -> Float:
    """Fill colours (m, 4)."""
    from matplotlib.colors import to_rgba

    fill = np.array([to_rgba(c) for c in (FILL, EXCUSED_COLOUR, FLAWED_COLOUR)])[states]
    fill[:, :3] *= shade[:, None]
    fill[states != VALID, :3] /= shade[states != VALID, None]
    return fill


def _draw_flat(axes: Axes, mesh: Mesh, flat: Float, states: Byte, pixels: float) -> None:
    """Everything of one colour is one path: quick, and no background shines through between triangles."""
    triangles = flat[mesh.triangles]
    _add_path(axes, triangles, facecolor=FILL, edgecolor="none", zorder=1)
    for state, colour in ((EXCUSED, EXCUSED_COLOUR), (FLAWED, FLAWED_COLOUR)):
        chosen = triangles[states == state]
        if len(chosen):
            _add_path(axes, chosen, facecolor=colour, edgecolor=colour, linewidth=0.6, zorder=2)
    _draw_edges(axes, flat[_unique_edges(mesh.triangles)], pixels)
    _add_path(axes, flat[_border(mesh)], edgecolor=BOLD, facecolor="none", linewidth=1.2, zorder=4)


def _draw_edges(axes: Axes, edges: Float, pixels: float) -> None:
    """Edges (k, 2, 2) in a few classes of length, each class one path in the style of its longest."""
    side = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1) * pixels
    classes = np.ceil(2.0 * np.log2(np.clip(side, VANISH / 2, 40.0))).astype(int)
    for k in np.unique(classes):
        width, alpha = _edge_style(np.array([2.0 ** (k / 2)]))
        if alpha[0] > 0.0:
            style = {"linewidth": float(width[0]), "alpha": float(alpha[0])}
            _add_path(axes, edges[classes == k], edgecolor=EDGE, facecolor="none", zorder=3, **style)


def _add_path(axes: Axes, pieces: Float, **style: Any) -> None:
    """Polygons (k, n, 2), open polylines for n = 2, drawn as one path."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    k, n = pieces.shape[:2]
    points = pieces
    codes = np.full((k, n), Outline.LINETO, np.uint8)
    codes[:, 0] = Outline.MOVETO
    if n > 2:
        points = np.concatenate([pieces, pieces[:, :1]], axis=1)
        codes = np.concatenate([codes, np.full((k, 1), Outline.CLOSEPOLY, np.uint8)], axis=1)
    patch = PathPatch(Outline(points.reshape(-1, 2), codes.ravel()), capstyle="round", **style)
    axes.add_artist(patch)


def _draw_deep(axes: Axes, mesh: Mesh, flat: Float, depth: Float, shade: Float, states: Byte, pixels: float) -> None:
    """Triangles and bold edges in one sequence, far ones first; an edge follows its nearest triangle."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgba

    corners = mesh.points[mesh.triangles]
    width, alpha = _edge_style(np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2).mean(1) * pixels)
    fill = _colours(states, shade)
    line = np.tile(to_rgba(EDGE), (len(fill), 1))
    line[:, :3] = alpha[:, None] * line[:, :3] + (1.0 - alpha[:, None]) * fill[:, :3]
    border = _border(mesh)
    near = depth[mesh.triangles].mean(1)
    nearest = np.full(len(mesh.points), -np.inf)
    np.maximum.at(nearest, mesh.triangles.ravel(), np.repeat(near, 3))
    keys = np.concatenate([near, nearest[border].min(1)])
    order = np.argsort(keys, kind="stable")
    shapes = flat[np.concatenate([mesh.triangles, border[:, [0, 1, 1]]])]
    faces = np.concatenate([fill, np.zeros((len(border), 4))])
    lines = np.concatenate([line, np.tile(to_rgba(BOLD), (len(border), 1))])
    widths = np.concatenate([width, np.full(len(border), 1.1)])
    axes.add_collection(
        PolyCollection(
            shapes[order],
            facecolors=faces[order],
            edgecolors=lines[order],
            linewidths=widths[order],
            joinstyle="round",
        ),
        autolim=False,
    )


def _mark_small(axes: Axes, triangles: Float, states: Byte, pixels: float) -> None:
    """Rings around flawed and unavoidable triangles that are too small to be seen."""
    size = np.ptp(triangles, axis=1).max(1) * pixels
    for state, colour in ((EXCUSED, EXCUSED_COLOUR), (FLAWED, FLAWED_COLOUR)):
        rows = (states == state) & (size < SMALL)
        if rows.any():
            x, y = triangles[rows].mean(1).T
            axes.plot(x, y, "o", ms=7, mfc="none", mec=colour, mew=1.1, ls="none", zorder=5)


def _unique_edges(triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    """All edges (k, 2), each once."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).astype(np.int64)
    span = int(edges.max()) + 1
    keys = np.unique(edges[:, 0] * span + edges[:, 1])
    return np.stack([keys // span, keys % span], axis=1).astype(np.int32)


def _border(mesh: Mesh) -> NDArray[np.int32]:
    """Mesh edges on CAD edges: those of the mesh, or where it has none the borders of its faces."""
    if len(mesh.segments):
        return mesh.segments
    t = mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
    keys = np.column_stack([np.repeat(mesh.face_of_triangle, 3), np.sort(t, axis=1)])
    edges, uses = np.unique(keys, axis=0, return_counts=True)
    return np.unique(edges[uses == 1, 1:], axis=0).astype(np.int32)


def _caption(figure: Any, mesh: Mesh, title: str | None) -> None:
    certificate = mesh.certificate
    name = title if title is not None else Path(mesh.model.source).name if mesh.model is not None else ""
    verdict = "certified" if certificate.certified else "not certified"
    head = f"{name}: {verdict}" if name else verdict
    flaws = f"{certificate.flawed} flawed"
    if certificate.unavoidable:
        flaws += f" ({certificate.unavoidable} unavoidable)"
    triangles = "triangle" if certificate.triangles == 1 else "triangles"
    text = (
        f"{certificate.triangles:,} {triangles}, {flaws};  skewness ≥ {certificate.worst_skew:.2f}°,  "
        f"aspect ratio ≤ {certificate.worst_aspect_ratio:.3f},  "
        f"angles {certificate.min_angle:.1f}° to {certificate.max_angle:.1f}°"
    )
    add_caption(figure, head, text, TEXT if certificate.certified else FLAWED_COLOUR)
