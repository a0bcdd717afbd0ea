"""The result: points, triangles, names and the certificate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from fubini.model import Model

Float = NDArray[np.float64]
Int = NDArray[np.int32]


@dataclass(frozen=True)
class Corner:
    """A corner of a face too sharp for any valid triangle: place (3,) and interior angle in degrees."""

    face: int
    point: tuple[float, float, float]
    angle: float


@dataclass(frozen=True)
class FaceCertificate:
    """Figures of one face. Lengths are in model units, angles in degrees, the rest is relative.

    ``boundary_distance``: largest distance of a boundary node from its CAD edge.
    ``chord_error``: largest distance between a boundary segment and the piece of curve it stands for.
    ``area_error``: difference of mesh area and CAD area over the CAD area.
    ``unavoidable``: corners of the CAD face too sharp for any valid triangle, listed in ``corners``.
    ``excess``: flawed triangles that no such corner excuses (each excuses one triangle that touches it).
    ``worst_skew``, ``worst_aspect_ratio``: over all triangles; ``avoidable_skew``: over those not excused
    (90 where all are excused).
    ``longest_edge``: of all triangles; at a uniform size it is below 1.7 times that size (see the manual, sizes).
    ``worst_at``: centroid (3,) of the triangle of worst skewness that is not excused.
    ``min_scaled_jacobian``: lower bound, over whole elements of second order, of the Jacobian determinant
    over that of the straight triangle; None at first order.
    ``reasons``: why the face is not certified; empty when it is.
    """

    face: int
    name: str | None
    triangles: int
    flawed: int
    unavoidable: int
    corners: tuple[Corner, ...]
    worst_skew: float
    mean_skew: float
    worst_aspect_ratio: float
    worst_at: tuple[float, float, float]
    min_angle: float
    max_angle: float
    area_error: float
    boundary_distance: float
    chord_error: float
    reasons: tuple[str, ...] = ()
    moves: Mapping[str, int] = field(default_factory=dict)
    budget_exhausted: bool = False
    excess: int = 0
    avoidable_skew: float = 90.0
    min_scaled_jacobian: float | None = None
    longest_edge: float = 0.0

    @property
    def certified(self) -> bool:
        """No triangle is flawed but at most one in each unavoidable corner, and nothing else is amiss."""
        return not self.reasons


@dataclass(frozen=True)
class Certificate:
    """Figures of the whole mesh: sums and worst cases of its faces."""

    faces: tuple[FaceCertificate, ...]
    min_skew: float
    max_aspect_ratio: float
    skipped_faces: int = 0
    notes: tuple[str, ...] = ()

    @property
    def certified(self) -> bool:
        """Every face is certified, and there is at least one."""
        return bool(self.faces) and all(f.certified for f in self.faces)

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return sum(f.triangles for f in self.faces)

    @property
    def flawed(self) -> int:
        """Number of flawed triangles."""
        return sum(f.flawed for f in self.faces)

    @property
    def unavoidable(self) -> int:
        """Number of corners that force a flawed triangle."""
        return sum(f.unavoidable for f in self.faces)

    @property
    def excess(self) -> int:
        """Number of flawed triangles that no sharp corner excuses."""
        return sum(f.excess for f in self.faces)

    @property
    def worst_skew(self) -> float:
        """Smallest skewness of all triangles; 90 where there is none."""
        return min((f.worst_skew for f in self.faces), default=90.0)

    @property
    def avoidable_skew(self) -> float:
        """Smallest skewness of the triangles that no sharp corner excuses."""
        return min((f.avoidable_skew for f in self.faces), default=90.0)

    @property
    def mean_skew(self) -> float:
        """Mean skewness of all triangles."""
        return sum(f.mean_skew * f.triangles for f in self.faces) / max(self.triangles, 1)

    @property
    def worst_aspect_ratio(self) -> float:
        """Largest aspect ratio of all triangles; 1 where there is none."""
        return max((f.worst_aspect_ratio for f in self.faces), default=1.0)

    @property
    def longest_edge(self) -> float:
        """Length of the longest edge; 0 where there is no triangle."""
        return max((f.longest_edge for f in self.faces), default=0.0)

    @property
    def min_angle(self) -> float:
        """Smallest angle of all triangles."""
        return min((f.min_angle for f in self.faces), default=60.0)

    @property
    def max_angle(self) -> float:
        """Largest angle of all triangles."""
        return max((f.max_angle for f in self.faces), default=60.0)

    @property
    def area_error(self) -> float:
        """Largest relative area error of a face."""
        return max((f.area_error for f in self.faces), default=0.0)

    @property
    def boundary_distance(self) -> float:
        """Largest distance of a boundary node from its CAD edge."""
        return max((f.boundary_distance for f in self.faces), default=0.0)

    @property
    def min_scaled_jacobian(self) -> float | None:
        """Smallest scaled Jacobian of all faces; None at first order."""
        return min((f.min_scaled_jacobian for f in self.faces if f.min_scaled_jacobian is not None), default=None)

    @property
    def chord_error(self) -> float:
        """Largest distance between a boundary segment and its curve."""
        return max((f.chord_error for f in self.faces), default=0.0)


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh of the planar faces of a model.

    Attributes
    ----------
    points : (n, 3) float64.
    triangles : (m, 3) int32, counter-clockwise about the outward normal.
    face_of_triangle : (m,) int32, CAD face index (``MapShapes`` order).
    segments : (k, 2) int32, mesh edges that lie on CAD edges; one per mesh edge, along the CAD edge.
    edge_of_segment : (k,) int32, CAD edge index.
    face_names, edge_names : names from the source by CAD index.
    certificate : the figures and the verdict.
    seconds : wall time by stage.
    cpu_seconds : CPU time of the process by stage.
    size : wanted edge length.
    model : the model that was meshed.
    t_of_segment : (k, 2) parameters of the two ends on the CAD edge, from 0 to 1 along it; None where unknown.
    regions : name to sorted triangle indices; every triangle has a name.
    boundaries : name to sorted segment indices.
    named_points : name to node indices.
    midsides : (m, 3) int32, mid-side nodes between corners 0-1, 1-2 and 2-0; None at first order.
    segment_midsides : (k,) int32, mid-side node of each segment; None at first order.

    The corners come first in ``points``, mid-side nodes after them.
    """

    points: Float
    triangles: Int
    face_of_triangle: Int
    segments: Int
    edge_of_segment: Int
    face_names: Mapping[int, str]
    edge_names: Mapping[int, str]
    certificate: Certificate
    size: float
    seconds: Mapping[str, float] = field(default_factory=dict)
    cpu_seconds: Mapping[str, float] = field(default_factory=dict, repr=False)
    model: Model | None = field(default=None, repr=False)
    t_of_segment: Float | None = field(default=None, repr=False)
    regions: Mapping[str, Int] = field(default_factory=dict, repr=False)
    boundaries: Mapping[str, Int] = field(default_factory=dict, repr=False)
    named_points: Mapping[str, Int] = field(default_factory=dict, repr=False)
    midsides: Int | None = field(default=None, repr=False)
    segment_midsides: Int | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        """One line: the arrays of a mesh fill the screen."""
        verdict = "certified" if self.certificate.certified else "not certified"
        return (
            f"Mesh({len(self.points)} points, {len(self.triangles)} triangles on {len(self.certificate.faces)} faces, "
            f"size {self.size:.6g}, {verdict})"
        )

    @property
    def order(self) -> int:
        """1 for triangles of 3 nodes, 2 for triangles of 6."""
        return 1 if self.midsides is None else 2

    @property
    def quality(self) -> dict[str, Float]:
        """Per triangle (m,): ``skewness`` and ``aspect_ratio``."""
        from fubini.quality import aspect_ratios, skewness

        corners = self.points[self.triangles]
        return {"skewness": skewness(corners), "aspect_ratio": aspect_ratios(corners)}

    @property
    def nodes(self) -> Int:
        """Nodes of every triangle, (m, 3) or (m, 6): corners, then the middles of sides 0-1, 1-2 and 2-0."""
        return self.triangles if self.midsides is None else np.hstack([self.triangles, self.midsides])

    def elevate(self, order: int = 2) -> Mesh:
        """The mesh with 6-node triangles, true to the curves (see ``fubini.elevation.elevate``)."""
        from fubini.elevation import elevate

        return elevate(self, order)

    def save(self, path: str | Path, **options: Any) -> None:
        """Write the mesh; the suffix picks the format (see ``fubini.export.save``). Atomic."""
        from fubini.export import save

        save(self, path, **options)

    def to_trimesh(self) -> Any:
        """The mesh as ``trimesh.Trimesh`` (vertices kept as they are)."""
        from fubini.export import to_trimesh

        return to_trimesh(self)

    def to_meshio(self) -> Any:
        """The mesh as ``meshio.Mesh`` with the cell data arrays ``face`` and ``edge``, names as cell sets."""
        from fubini.export import to_meshio

        return to_meshio(self)

    def to_skfem(self) -> Any:
        """The mesh as ``skfem.MeshTri1`` or ``MeshTri2``, regions and boundaries by name."""
        from fubini.export import to_skfem

        return to_skfem(self)

    def to_pyvista(self) -> Any:
        """The mesh as ``pyvista.UnstructuredGrid`` with names as field data."""
        from fubini.export import to_pyvista

        return to_pyvista(self)

    def to_dolfinx_arrays(self) -> Any:
        """Arrays for dolfinx, in its node order (see ``fubini.export.DolfinxArrays``)."""
        from fubini.export import to_dolfinx_arrays

        return to_dolfinx_arrays(self)

    def plot(self, path: str | Path | None = None, **options: Any) -> Any:
        """Draw the mesh, flawed triangles in red (see ``fubini.report.plot``)."""
        from fubini.report import plot

        return plot(self, path, **options)

    def attach(self) -> Any:
        """Write the triangles back onto the live CAD shape (see ``fubini.cad.attach``)."""
        from fubini.cad import attach

        return attach(self)
