"""Second order: 6-node triangles whose boundary mid-side nodes lie on the true curves.

A mid-side node on a CAD edge is the point of the curve at equal distance from both ends of its segment;
all other sides are straight. The Jacobian determinant of a 6-node triangle is a polynomial of degree 2,
so six Bernstein coefficients bound it over the whole element: all positive is a proof, not a sample.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fubini.curves import Curve
from fubini.errors import InputError, OptionError
from fubini.model import Frame
from fubini.result import Certificate, Mesh

Float = NDArray[np.float64]
Int = NDArray[np.int32]

#: Images of one point in several planes that differ by more than this (times the diagonal) are reconciled.
SAME_POINT = 1e-13
#: The bound of the scaled Jacobian is at most this far below its least value.
GAP = 0.01
#: Elements of a lower scaled Jacobian have their straight sides bent to make room.
POOR = 0.05
#: Halvings of an element in search of a proof.
DEPTH = 24

#: Corner pairs of the three sides, in the order of ``Mesh.midsides``.
SIDES = np.array([[0, 1], [1, 2], [2, 0]])


def elevate(mesh: Mesh, order: int = 2) -> Mesh:
    """The same triangles with a node on every side, on the curve where the side lies on a CAD edge.

    The certificate gains ``min_scaled_jacobian``, proved over whole elements; a face with an element
    that folds is not certified. Order 1 gives the mesh itself.

    Raises ``OptionError`` for other orders or a mesh of second order, ``InputError`` for a mesh that does
    not know where its segments lie on their edges.
    """
    if order not in (1, 2):
        raise OptionError(f"order is {order!r}", fix="use 1 or 2")
    if mesh.order == order:
        return mesh
    if mesh.order == 2:
        raise OptionError("the mesh is of second order already", fix="mesh with order=1")
    n = len(mesh.points)
    pairs = np.sort(mesh.triangles[:, SIDES], axis=2).reshape(-1, 2).astype(np.int64)
    keys, first, number = np.unique(pairs[:, 0] * n + pairs[:, 1], return_index=True, return_inverse=True)
    midsides = number.reshape(-1, 3)
    places = mesh.points[pairs[first]].mean(axis=1)
    ends = np.sort(mesh.segments.astype(np.int64), axis=1)
    of_segment = np.minimum(np.searchsorted(keys, ends[:, 0] * n + ends[:, 1]), len(keys) - 1)
    if (keys[of_segment] != ends[:, 0] * n + ends[:, 1]).any():
        raise InputError("a segment of the mesh is no side of a triangle")
    bent = np.zeros(len(places), bool)
    if len(mesh.segments):
        on_curve, curved = curve_midpoints(mesh)
        places[of_segment[curved]] = on_curve[curved]
        bent[of_segment[curved]] = True
    bounds = _mend(mesh, midsides, places, bent)
    raised = dataclasses.replace(
        mesh,
        points=np.concatenate([mesh.points, places]),
        midsides=(midsides + n).astype(np.int32),
        segment_midsides=(of_segment + n).astype(np.int32),
        certificate=_certify(mesh, bounds),
    )
    for array in (raised.points, raised.midsides, raised.segment_midsides):
        if array is not None:
            array.setflags(write=False)
    return raised


def curve_midpoints(mesh: Mesh) -> tuple[Float, NDArray[np.bool_]]:
    """The middle of every segment on its curve (k, 3), and which segments (k,) lie on a curved edge."""
    if mesh.model is None or mesh.t_of_segment is None:
        raise InputError("the mesh does not know where its segments lie on CAD edges", fix="mesh the source again")
    uses: dict[int, list[tuple[Frame, Curve]]] = {}
    for face in mesh.model.faces:
        for loop in face.region.loops:
            for curve, edge, forward in zip(loop.curves, loop.edges, loop.forward, strict=True):
                uses.setdefault(edge, []).append((face.frame, curve if forward else curve.reverse()))
        for curve, edge in face.inner:
            uses.setdefault(edge, []).append((face.frame, curve))
    middle = mesh.points[mesh.segments].mean(axis=1)
    curved = np.zeros(len(middle), bool)
    order = np.argsort(mesh.edge_of_segment, kind="stable")
    edges, start = np.unique(mesh.edge_of_segment[order], return_index=True)
    for edge, rows in zip(edges.tolist(), np.split(order, start[1:]), strict=True):
        copies = uses.get(edge, [])
        if not copies or copies[0][1].kind == "line":
            continue
        t = _middle_parameters(copies[0][1], mesh.t_of_segment[rows])
        middle[rows] = _lift(copies, t, SAME_POINT * mesh.model.diagonal)
        curved[rows] = True
    return middle, curved


def jacobian_bounds(nodes: Float) -> Float:
    """Lower bounds (m,) of the Jacobian determinants of 6-node triangles (m, 6, 3).

    Relative to the straight triangle through the corners: 1 for straight sides. The bound holds over the
    whole element and is at most ``GAP`` below the least value, less where the sign is in doubt.
    """
    leaves = _bernstein(nodes)
    owner = np.arange(len(nodes))
    bounds = np.full(len(nodes), np.inf)
    attained = np.full(len(nodes), np.inf)
    for _ in range(DEPTH):
        low, seen = leaves.min(axis=1), leaves[:, :3].min(axis=1)
        np.minimum.at(attained, owner, seen)
        best = attained[owner]
        open_ = (low < best - GAP) | ((low <= 0.0) & (best > 0.0))
        np.minimum.at(bounds, owner[~open_], low[~open_])
        if not open_.any():
            return bounds
        leaves, owner = _quarters(leaves[open_]), np.tile(owner[open_], 4)
    np.minimum.at(bounds, owner, leaves.min(axis=1))
    return bounds


def _bernstein(nodes: Float) -> Float:
    """Bernstein coefficients (m, 6) of the Jacobian determinant: corners 0, 1, 2, sides 01, 12, 20."""
    p = nodes[:, :3]
    control = 2.0 * nodes[:, 3:] - 0.5 * (p + np.roll(p, -1, axis=1))
    c01, c12, c20 = control[:, 0], control[:, 1], control[:, 2]
    # both partial derivatives are linear: their values at the three corners
    u = 2.0 * np.stack([c01 - p[:, 0], p[:, 1] - c01, c12 - c20], axis=1)
    v = 2.0 * np.stack([c20 - p[:, 0], c12 - c01, p[:, 2] - c20], axis=1)
    straight = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    square = np.maximum(np.einsum("ij,ij->i", straight, straight), 1e-300)

    def product(i: int, j: int) -> Float:
        return np.asarray(np.einsum("ij,ij->i", np.cross(u[:, i], v[:, j]), straight) / square)

    squares = [product(i, i) for i in range(3)]
    mixed = [0.5 * (product(i, j) + product(j, i)) for i, j in SIDES]
    return np.stack([*squares, *mixed], axis=1)


def _quarters(b: Float) -> Float:
    """Coefficients (4 m, 6) over the four halves-by-sides of each element (m, 6)."""
    b0, b1, b2, b01, b12, b20 = b.T
    q01, q12, q20 = (b0 + 2 * b01 + b1) / 4, (b1 + 2 * b12 + b2) / 4, (b2 + 2 * b20 + b0) / 4
    at0, at1, at2 = (b0 + b01 + b20 + b12) / 4, (b1 + b01 + b12 + b20) / 4, (b2 + b12 + b20 + b01) / 4
    parts = [
        [b0, q01, q20, (b0 + b01) / 2, at0, (b0 + b20) / 2],
        [b1, q12, q01, (b1 + b12) / 2, at1, (b1 + b01) / 2],
        [b2, q20, q12, (b2 + b20) / 2, at2, (b2 + b12) / 2],
        [q01, q12, q20, at1, at2, at0],
    ]
    return np.concatenate([np.stack(part, axis=1) for part in parts])


def _middle_parameters(curve: Curve, spans: Float) -> Float:
    """Parameters (k,) within spans (k, 2) whose points are as far from one end of the span as from the other."""
    a, b = curve.point(spans[:, 0]), curve.point(spans[:, 1])
    centre, along = 0.5 * (a + b), b - a
    low, high = spans[:, 0].copy(), spans[:, 1].copy()
    for _ in range(52):
        t = 0.5 * (low + high)
        before = np.einsum("ij,ij->i", curve.point(t) - centre, along) < 0.0
        low, high = np.where(before, t, low), np.where(before, high, t)
    return 0.5 * (low + high)


def _lift(copies: Sequence[tuple[Frame, Curve]], t: Float, same: float) -> Float:
    """Points (k, 3) of an edge that lie in the planes of all its faces.

    CAD edges lie on their faces within a tolerance only: where the images differ, the point nearest to
    their middle on all planes is taken.
    """
    lifted = np.array([frame.to_space(curve.point(t)) for frame, curve in copies])
    points = lifted[0].copy()
    apart = np.linalg.norm(lifted - points, axis=2).max(axis=0)
    normals = np.array([frame.normal for frame, _ in copies])
    for k in np.flatnonzero(apart > same):
        middle = lifted[:, k].mean(axis=0)
        offset = np.array([frame.normal @ (frame.origin - middle) for frame, _ in copies])
        points[k] = middle + np.linalg.lstsq(normals, offset, rcond=1e-6)[0]
    return points


def _mend(mesh: Mesh, midsides: NDArray[np.intp], places: Float, bent: NDArray[np.bool_]) -> Float:
    """Bounds (m,) of all elements, after bending straight inner sides of poor ones; ``places`` in place.

    A poor element is one that a curved side comes too near to; its inner sides then give way in the same
    direction, as far as serves both elements beside them.
    """
    bounds = np.ones(len(midsides))
    touched = np.flatnonzero(bent[midsides].any(axis=1))
    if not len(touched):
        return bounds

    def judge(rows: NDArray[np.intp]) -> Float:
        return jacobian_bounds(np.concatenate([mesh.points[mesh.triangles[rows]], places[midsides[rows]]], axis=1))

    bounds[touched] = judge(touched)
    for row in np.flatnonzero(bounds < POOR).tolist():
        sides = midsides[row]
        inner = sides[~bent[sides]]
        beside = np.flatnonzero(np.isin(midsides, inner).any(axis=1))
        middle = mesh.points[mesh.triangles[row][SIDES]].mean(axis=1)
        push = (places[sides] - middle)[bent[sides]].sum(axis=0)
        before = places[inner].copy()
        best, chosen = float(bounds[beside].min()), 0.0
        for share in (0.25, 0.5, 0.75, 1.0):
            places[inner] = before + share * push
            worst = float(judge(beside).min())
            if worst > best:
                best, chosen = worst, share
        places[inner] = before + chosen * push
        if chosen:
            bounds[beside] = judge(beside)
    return bounds


def _certify(mesh: Mesh, bounds: Float) -> Certificate:
    """The certificate with the least scaled Jacobian of every face, and a reason where an element folds."""
    faces = []
    for face in mesh.certificate.faces:
        rows = np.flatnonzero(mesh.face_of_triangle == face.face)
        least = float(bounds[rows].min(initial=1.0))
        folded = rows[bounds[rows] <= 0.0]
        reasons = face.reasons
        if len(folded):
            x, y, z = mesh.points[mesh.triangles[folded[0]]].mean(axis=0).tolist()
            what = "curved element folds" if len(folded) == 1 else "curved elements fold"
            reasons = (*reasons, f"{len(folded)} {what}, the first at ({x:.6g}, {y:.6g}, {z:.6g})")
        faces.append(dataclasses.replace(face, min_scaled_jacobian=least, reasons=reasons))
    return dataclasses.replace(mesh.certificate, faces=tuple(faces))
