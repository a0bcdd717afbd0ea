"""The model: what was read from a CAD source, as plain values that no CAD kernel stands behind."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.numbering import Numbering, number_edges

if TYPE_CHECKING:
    from fubini.curves import Curve
    from fubini.region import Region

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Frame:
    """A plane in space: origin (3,), unit axes x and y (3,); the outward normal is x cross y."""

    origin: Float
    x_axis: Float
    y_axis: Float

    @cached_property
    def normal(self) -> Float:
        """Unit normal (3,)."""
        (a, b, c), (u, v, w) = self.x_axis.tolist(), self.y_axis.tolist()
        return np.array([b * w - c * v, c * u - a * w, a * v - b * u])

    def to_plane(self, points: ArrayLike) -> Float:
        """Plane coordinates (n, 2) of space points (n, 3), projected along the normal."""
        d = np.atleast_2d(np.asarray(points, float)) - self.origin
        return np.stack([d @ self.x_axis, d @ self.y_axis], axis=1)

    def to_space(self, points: ArrayLike) -> Float:
        """Space points (n, 3) of plane coordinates (n, 2)."""
        x, y = np.ascontiguousarray(np.atleast_2d(np.asarray(points, float)).T)
        out = np.empty((len(x), 3))
        for k in range(3):  # rows of three are too short for numpy
            out[:, k] = self.origin[k] + x * self.x_axis[k] + y * self.y_axis[k]
        return out


@dataclass(frozen=True)
class Edge:
    """A CAD edge that bounds at least one planar face.

    Attributes
    ----------
    index : 0-based index in ``TopExp::MapShapes`` order of edges.
    kind : "line", "circle", "ellipse", "bezier", "bspline", or the kind it was converted from.
    start, end : indices of its CAD vertices (``MapShapes`` order of vertices), equal when closed.
    name : name from the source, or None.
    tolerance : tolerance that the CAD model states for the edge, in model units.
    conversion : largest distance between the curve used here and the CAD curve; 0 when exact.
    """

    index: int
    kind: str
    start: int
    end: int
    name: str | None = None
    tolerance: float = 0.0
    conversion: float = 0.0


@dataclass(frozen=True)
class Face:
    """A planar face: its region in the plane of ``frame``, counter-clockwise about the outward normal.

    ``region.loops[i].edges[j]`` is the CAD edge index of the j-th curve of the i-th loop and
    ``.forward[j]`` says whether the curve runs along the edge; its parameter is then that of the
    edge, else one minus it. ``inner`` holds edges inside the region that the mesh must follow: curves
    along the edge, and CAD edge indices. ``points`` holds vertices inside the region that become nodes: CAD vertex
    indices and plane coordinates (2,).
    """

    index: int
    region: Region
    frame: Frame
    name: str | None = None
    area: float | None = None
    tolerance: float = 0.0
    inner: tuple[tuple[Curve, int], ...] = ()
    points: tuple[tuple[int, Float], ...] = ()


@dataclass(frozen=True)
class SkippedFace:
    """A face that is not planar (or was not asked for) and why it was left out."""

    index: int
    surface: str
    reason: str
    name: str | None = None


@dataclass(frozen=True)
class Model:
    """All planar faces of a source.

    Attributes
    ----------
    source : path or label for messages.
    faces : planar faces in index order.
    edges : edge index to ``Edge`` for every edge of a planar face.
    vertices : vertex index to point (3,), the CAD vertices that bound those edges.
    skipped : faces left out.
    diagonal : diagonal of the bounding box of the whole model, in model units.
    notes : remarks for the report (conversions, healed gaps, embedded edges left out).
    native : the live CAD shape behind the model, for ``Mesh.attach``; None when there is none.
    traces : how sub-shapes of the source became those of ``native`` (``fubini.cad.trace.Trace``), in order.
    """

    source: str
    faces: tuple[Face, ...]
    edges: dict[int, Edge]
    vertices: dict[int, Float]
    skipped: tuple[SkippedFace, ...] = ()
    diagonal: float = 1.0
    notes: tuple[str, ...] = ()
    native: Any = field(default=None, repr=False, compare=False)
    traces: tuple[Any, ...] = field(default=(), repr=False, compare=False)

    @cached_property
    def numbering(self) -> Numbering:
        """Running numbers of the edges on or in faces, and of their vertices."""
        return number_edges(self.faces, self.edges, self.vertices)

    @cached_property
    def slack(self) -> dict[int, float]:
        """How far nodes of each edge may be off its curve: the largest tolerance of it and of all edges at its ends.

        A vertex is as loose as the loosest edge there, and its node lies on the planes of all faces around.
        """
        at: dict[int, float] = {}
        for edge in self.edges.values():
            for vertex in (edge.start, edge.end):
                at[vertex] = max(edge.tolerance, at.get(vertex, 0.0))
        return {i: max(at[edge.start], at[edge.end]) for i, edge in self.edges.items()}

    @property
    def faces_cut(self) -> tuple[Face, ...]:
        """The faces as they are meshed: edges that have kinks in pieces, called by the keys of ``numbering.number``."""
        pieces = self.numbering.pieces
        return self.faces if pieces is None else pieces.faces

    def __repr__(self) -> str:
        """One line: the curves of a model fill the screen."""
        return (
            f"Model({self.source!r}, {len(self.faces)} planar faces, {len(self.edges)} edges, "
            f"{len(self.skipped)} faces skipped, diagonal {self.diagonal:.6g})"
        )
