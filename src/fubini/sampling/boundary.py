"""Boundary nodes of all faces at once: every edge is discretised one time, for all faces that share it.

The size along an edge follows the asked size, the turning of the curve, the length of short edges,
the gaps that a triangulation of the boundary alone sees across thin parts, and a growth limit that
also acts through shared vertices. At corners too sharp for two triangles both edges start with a
segment of the same length, so that the one triangle there is isosceles.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini._values import value
from fubini.errors import GeometryError
from fubini.sampling import _kernels_boundary as kernels
from fubini.sampling import _kernels_sizes as kernels_of_sizes
from fubini.sampling.legs import Legs
from fubini.sampling.network import Network
from fubini.sampling.outline import Outline
from fubini.sampling.ratios import SHARP
from fubini.sampling.tables import EdgeTables, SizeOptions, sample_track
from fubini.sampling.tangles import chords_to_halve
from fubini.tracks import evaluate
from fubini.triangulation.constrained import constrained_delaunay, triangulate_all
from fubini.triangulation.value import CORNER, FROZEN, LOCKED, Boundary, Byte

Float = NDArray[np.float64]

#: A gap is resolved when the nodes beside it are no further apart than the wanted size over this.
RESOLVED = 0.85
#: Gaps are not looked for again where no node has moved by more than this share of the segments beside it.
CREEP = 0.1
#: The triangle of a sharp corner may be this much larger than the gap beside it asks for.
LEG_RESOLVED = 0.85


class BoundarySizing:
    """Sizes along all edges of a model, lowered until every gap is resolved; then the nodes.

    Parameters
    ----------
    network : the faces and their edges.
    options : sizes and limits.
    """

    def __init__(self, network: Network, options: SizeOptions) -> None:
        self.network, self.options = network, options
        self.outlines, self.ends = network.outlines, network.ends
        self.tables = EdgeTables(network, options)
        self.legs = Legs(network, options, self.tables)
        self._sharp = network.sharpest < SHARP and bool(self.legs.radius.any())
        self._vertex_size = np.empty(network.vertices)
        self._vertex_size.fill(np.inf)
        for v, asked in options.vertex_size.items():
            self._vertex_size[v] = asked
        self._seen: dict[int, tuple[EdgeNodes, Boundary, bool]] = {}
        if self._sharp:
            self._shorten_legs(self.legs.radius)
            self.legs.longest[:] = max(1.0, 1.0 / options.gradient)
            self.legs.lengthen()

    def resolve(self) -> EdgeNodes:
        """Lower the sizes until no face sees a gap narrower than its nodes allow; then place the nodes.

        Raises GeometryError when the boundary of a face cannot be triangulated at any size, or not
        within the budget of nodes; its ``face`` and ``edge`` are running numbers, ``at`` plane coordinates.
        """
        nodes = self._place()
        dirty: Iterable[int] = range(len(self.outlines))
        for round_ in range(self.options.rounds):
            close = [f for f in dirty if not self._is_apart(f, nodes)]
            if not close:
                break
            changed, moved = np.zeros((2, len(self.ends)), np.uint8)
            last = round_ == self.options.rounds - 1
            tangled = [f for f in close if self._look_across(f, nodes, changed, last)]
            if not np.count_nonzero(changed):
                break
            before, nodes = nodes, self._place()
            kernels.find_moved(nodes.first, nodes.t, before.first, before.t, CREEP, moved)
            dirty = self._faces_of(moved, tangled)
        return nodes

    def _faces_of(self, moved: Byte, tangled: list[int]) -> list[int]:
        """Faces with an edge that moved, and those tangled."""
        return sorted({*self.network.faces[moved[self.network.edges] > 0].tolist(), *tangled})

    def lower_near(self, face: int, places: ArrayLike, nodes: EdgeNodes, factor: float) -> bool:
        """Ask for smaller segments of one face near ``places`` (k, 2); False when nothing changed."""
        boundary = self.boundary(face, nodes)
        mid = boundary.points
        distance = np.min(np.linalg.norm(mid[:, None] - np.atleast_2d(places)[None], axis=2), axis=1)
        near = distance <= 2.5 * boundary.size
        if not near.any():
            near[np.argmin(distance)] = True
        want = np.where(near, factor * boundary.size, boundary.size)
        changed = np.zeros(len(self.ends), np.uint8)
        free = np.zeros(len(boundary.t)), np.full(len(boundary.t), np.inf)
        self._lower(face, boundary, want, free, 0.97, changed)
        return bool(changed.any())

    def _place(self) -> EdgeNodes:
        """Nodes of all edges from the present sizes."""
        legs, options = self.legs, self.options
        radius = steps = tilt = legs.radius  # all zero, if no corner is sharp
        if self._sharp:
            radius = radius.copy()
            self._shorten_legs(radius)
            steps = legs.steps(radius)
            tilt = legs.tilt
        counts, node_first, node_t = kernels.lay_nodes(
            *self.network.tracks, self.network.first, *self.tables.pool, self.ends, radius, tilt, steps,
            self._vertex_size, legs.longest, self.tables.at_least, options.gradient, options.most,
        )  # fmt: skip
        if not len(node_t):
            self._refuse(counts)
        return EdgeNodes(node_first, node_t)

    def _shorten_legs(self, radius: Float) -> None:
        """Shorten legs (e, 2) to what the sizes and the growth allow, in place."""
        legs, longest = np.full(self.network.vertices, np.inf), self.legs.longest
        kernels_of_sizes.shorten_legs(
            *self.tables.pool, self.ends, radius, self._vertex_size.copy(), legs, self.options.gradient, longest
        )

    def _refuse(self, counts: NDArray[np.int64]) -> None:
        """Raise for the edge that would need most nodes."""
        e = int(np.argmax(np.where(counts < 1, np.iinfo(np.int64).max, counts)))
        face = next(f for f, outline in enumerate(self.outlines) if e in outline.edges)
        outline = self.outlines[face]
        j = int(np.flatnonzero(outline.edges == e)[0])
        t, _, h = self.tables[e]
        at = evaluate(outline.tracks, j, t[np.argmin(h)])[0]
        raise GeometryError(
            f"the boundary would need more than {self.options.most:,} nodes",
            face=face, edge=e, at=at, fix="look for parts that all but touch here, or ask for a larger size",
        )  # fmt: skip

    def boundary(self, face: int, nodes: EdgeNodes) -> Boundary:
        """The boundary of one face, built from the nodes of its edges."""
        seen = self._seen.get(face)
        return seen[1] if seen is not None and seen[0] is nodes else self._gather(face, nodes, False)[0]

    def _is_apart(self, face: int, nodes: EdgeNodes) -> bool:
        """Whether the nodes of a face are known to be so far apart that it has no narrow gap: see ``all_apart``."""
        # legs of other faces may be too long for gaps that are wide enough for all else (``Legs.make_room``)
        if self._sharp:
            return False
        seen = self._seen.get(face)
        return seen[2] if seen is not None and seen[0] is nodes else self._gather(face, nodes, True)[1]

    def _gather(self, face: int, nodes: EdgeNodes, look: bool) -> tuple[Boundary, bool]:
        """``boundary``, built anew; and whether ``look`` is set and shows its nodes apart."""
        outline, options = self.outlines[face], self.options
        *arrays, apart = kernels.gather_face(
            *outline.tracks, outline.loop_first, outline.edges, outline.forward, outline.angles, self.network.uses,
            nodes.first, nodes.t, SHARP, options.size, look, options.gradient, options.gap, RESOLVED,
        )  # fmt: skip
        whole = Boundary(*arrays)
        if self._sharp and self.legs.held.any():
            self.legs.hold(outline, whole)
        if outline.inner < len(outline.edges):
            whole, apart = welded(whole, outline.inner), False
        self._seen[face] = nodes, whole, apart
        return whole, apart

    def _look_across(self, face: int, nodes: EdgeNodes, changed: Byte, last: bool) -> bool:
        """Triangulate the boundary of one face alone and lower sizes where it sees gaps.

        ``changed`` (e,) becomes 1 for the edges whose tables or legs change. True where chords cross.
        """
        boundary, options, outline = self.boundary(face, nodes), self.options, self.outlines[face]
        n = len(boundary.points)
        triangles, neighbours, _, lost, status = triangulate_all(boundary.points, boundary.segments, n)
        if len(lost) or len(triangles) == 0 or status:
            lost = constrained_delaunay(boundary.points, boundary).unrecovered
            if last:
                error = outline.crossing(boundary, int(lost[0]) if len(lost) else 0)
                error.face = face
                raise error
            self._untangle(face, boundary, lost, changed)
            return True
        missing = 1
        while missing > 0:
            want, foot, across, narrow, self.tables.fill, missing = kernels.look_across(
                boundary.points, boundary.segments, boundary.track, boundary.t, boundary.size, boundary.angle,
                outline.edges, triangles, neighbours, SHARP, options.gradient, options.gap,
                options.smallest * options.size, RESOLVED, LEG_RESOLVED, *self.tables.pool, self.tables.fill, changed,
            )  # fmt: skip
            if missing > 0:
                self.tables.grow(missing)
        if narrow and self._sharp:
            self._shorten(outline, boundary, want, (foot, across), changed)
        if self._sharp:
            changed[list(self.legs.make_room(outline, boundary, across))] = 1
        return False

    def _untangle(self, face: int, boundary: Boundary, lost: NDArray[np.int32], changed: Byte) -> None:
        """Chords cross where the curves do not: halve those that leave their curves most, on both sides."""
        outline = self.outlines[face]
        halve = chords_to_halve(outline.tracks, boundary, lost)
        ends = boundary.points[boundary.segments]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        want, foot_want = boundary.size.copy(), np.where(halve, 0.5 * length, np.inf)
        for side in (0, 1):
            np.minimum.at(want, boundary.segments[halve, side], 0.5 * length[halve])
        self._lower(face, boundary, want, (np.full(len(length), 0.5), foot_want), RESOLVED, changed)
        for k in np.flatnonzero(halve).tolist():
            changed[list(self.legs.shrink(outline, boundary, k))] = 1

    def _lower(
        self, face: int, boundary: Boundary, want: Float, feet: tuple[Float, Float], threshold: float, changed: Byte
    ) -> None:
        """Write wanted sizes into the tables of the edges where they fall below ``threshold`` times the present.

        ``want`` (n,) holds sizes at the nodes; ``feet`` shares (k,) of the segments and sizes (k,) there.
        ``changed`` (e,) becomes 1 for the edges whose tables or legs change.
        """
        outline, missing = self.outlines[face], 1
        if self._sharp:
            self._shorten(outline, boundary, want, feet, changed)
        while missing > 0:
            self.tables.fill, missing = kernels_of_sizes.lower_tables(
                outline.edges, boundary.segments, boundary.track, boundary.t, boundary.size, want, *feet, threshold,
                *self.tables.pool, self.tables.fill, changed,
            )  # fmt: skip
            if missing > 0:
                self.tables.grow(missing)

    def _shorten(
        self, outline: Outline, boundary: Boundary, want: Float, feet: tuple[Float, Float], changed: Byte
    ) -> None:
        """Shorten the legs of sharp corners that are longer than wanted; ``want`` and ``feet`` as in ``_lower``."""
        if boundary.angle.min() < SHARP:
            changed[list(self.legs.shorten(outline, boundary, want, feet))] = 1


@value(frozen=True)
class EdgeNodes:
    """Parameters of the nodes on every edge, ends included: ``t[first[e] : first[e + 1]]``."""

    first: NDArray[np.int64]
    t: Float

    def of(self, edge: int) -> Float:
        """Parameters on one edge, ascending from 0 to 1."""
        return self.t[self.first[edge] : self.first[edge + 1]]

    def differs(self, other: EdgeNodes) -> NDArray[np.bool_]:
        """Edges (e,) whose nodes are not those of ``other``."""
        lengths, others = np.diff(self.first), np.diff(other.first)
        out = lengths != others
        edge = np.repeat(np.arange(len(out)), lengths)
        out[edge[~out[edge]][self.t[~out[edge]] != other.t[np.repeat(~out, others)]]] = True
        return out

    def with_nodes(self, extra: Mapping[int, list[float]]) -> EdgeNodes:
        """The same with more nodes on some edges."""
        parts = [self.of(e) for e in range(len(self.first) - 1)]
        for e, t in extra.items():
            parts[e] = np.union1d(parts[e], t)
        first = np.zeros(len(parts) + 1, np.int64)
        np.cumsum([len(p) for p in parts], out=first[1:])
        return EdgeNodes(first, np.concatenate(parts))


def welded(boundary: Boundary, inner: int) -> Boundary:
    """One node for all that lie in one place, where segments from track ``inner`` on run inside the region.

    Both sides of such a segment must keep the same nodes, so these are fixed.
    """
    inside = boundary.track >= inner
    touched = np.zeros(len(boundary.points), bool)
    touched[boundary.segments[inside]] = True
    _, first, number = np.unique(boundary.points, axis=0, return_index=True, return_inverse=True)
    number = first[number.ravel()]  # the earliest of those in one place: the outline comes first
    kept = np.flatnonzero((number == np.arange(len(number))) | ~touched)
    number = np.where(touched, number, np.arange(len(number)))
    size = boundary.size.copy()
    np.minimum.at(size, number, boundary.size)
    angle = boundary.angle.copy()
    np.minimum.at(angle, number, boundary.angle)
    kind = np.where(touched & (boundary.kind != CORNER), FROZEN, boundary.kind).astype(np.uint8)
    renumber = np.full(len(number), -1, np.int32)
    renumber[kept] = np.arange(len(kept), dtype=np.int32)
    return Boundary(
        boundary.points[kept], kind[kept], size[kept], angle[kept], renumber[number[boundary.segments]],
        boundary.track, boundary.t, np.where(inside, LOCKED, boundary.mode).astype(np.uint8),
    )  # fmt: skip


__all__ = ["BoundarySizing", "EdgeNodes", "Outline", "SizeOptions", "sample_track"]
