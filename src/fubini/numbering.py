"""Running numbers: how meshing counts the edges of a model, each cut at its kinks, and their ends."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fubini.curves.kinks import WHOLE
from fubini.region.pieces import Stretches, along_edge, cut_curve, cut_region

if TYPE_CHECKING:
    from fubini.model import Edge, Face

Float = NDArray[np.float64]
Int = NDArray[np.int64]


class Pieces(NamedTuple):
    """What becomes of a model where edges have kinks: an edge counts as its pieces, and kinks are vertices.

    ``faces`` have their edges cut; pieces are called by keys of ``Numbering.number``. ``spans`` (e, 4), by running
    number: parameters on the edge, of the first node of a piece, of where it begins and where it stops, and of its last
    node; they differ where the edge rests in one place. ``shares`` (e,) : its length over that of the edge.
    """

    faces: tuple[Face, ...]
    spans: Float
    shares: Float


class Numbering(NamedTuple):
    """Running numbers of the edges on or in faces, and of their vertices. Not to be written to.

    ``edges`` (e,) are CAD indices by running number, ``vertices`` (e, 2) those of the ends, ``ends`` (e, 2) the running
    numbers of these; ``number`` is the running number by CAD index. Where an edge has kinks, its pieces follow each
    other, the first of them has its key, the others, like the vertices between them, have keys that are no CAD index.
    """

    edges: Int
    vertices: Int
    ends: Int
    number: dict[int, int]
    pieces: Pieces | None = None

    def parts(self, edge: int) -> dict[int, float]:
        """Running numbers of the pieces of a CAD edge, and their shares of its length; the edge itself if uncut."""
        if self.pieces is None:
            return {self.number[edge]: 1.0}
        return {i: float(self.pieces.shares[i]) for i in np.flatnonzero(self.edges == edge).tolist()}


def number_edges(faces: Sequence[Face], edges: Mapping[int, Edge], vertices: Mapping[int, Float]) -> Numbering:
    """Number the edges of these faces, by rising CAD index, cut at their kinks."""
    used = sorted({edge for face in faces for edge in (*face.region.edges, *(e for _, e in face.inner))})
    ends = [(edges[e].start, edges[e].end) for e in used]
    cuts = _find_cuts(faces)
    if not cuts:
        return _numbered(used, ends, dict(zip(used, range(len(used)))))
    counts = {e: len(cuts.get(e, WHOLE)) for e in used}
    key, vertex = itertools.count(used[-1] + 1), itertools.count(1 + max(*vertices, *itertools.chain(*ends)))
    keys = {e: [e, *itertools.islice(key, n - 1)] for e, n in counts.items()}
    through = [[a, *itertools.islice(vertex, counts[e] - 1), b] for e, (a, b) in zip(used, ends, strict=True)]
    indices = [e for e in used for _ in keys[e]]
    number = {k: i for i, k in enumerate(itertools.chain(*keys.values()))}
    faces_cut = tuple(_cut(face, cuts, keys) for face in faces)
    spans = [span for e in used for span in _spans(cuts.get(e, WHOLE))]
    pieces = Pieces(faces_cut, np.array(spans), _shares(faces_cut, number, np.array(indices)))
    return _numbered(indices, [pair for way in through for pair in itertools.pairwise(way)], number, pieces)


def _numbered(
    edges: list[int], ends: list[tuple[int, int]], number: dict[int, int], pieces: Pieces | None = None
) -> Numbering:
    vertices = np.array(ends, np.int64).reshape(-1, 2)
    numbers = np.unique(vertices, return_inverse=True)[1].reshape(-1, 2)
    return Numbering(np.array(edges, np.int64), vertices, numbers, number, pieces)


def _find_cuts(faces: Sequence[Face]) -> dict[int, Stretches]:
    """Stretches of every edge with kinks: those of the first curve that shows them, for all faces beside it."""
    found: dict[int, Stretches] = {}
    for face in faces:
        if all(c.stretches == WHOLE for c in face.region.curves) and all(c.stretches == WHOLE for c, _ in face.inner):
            continue
        uses = [use for loop in face.region.loops for use in zip(loop.curves, loop.edges, loop.forward, strict=True)]
        for curve, edge, forward in (*uses, *((c, e, True) for c, e in face.inner)):
            if curve.stretches != WHOLE:
                found.setdefault(edge, along_edge(curve.stretches, forward))
    return found


def _cut(face: Face, cuts: Mapping[int, Stretches], keys: Mapping[int, Sequence[int]]) -> Face:
    """The face with its edges in pieces, which go by their keys."""
    inner = [
        piece
        for curve, edge in face.inner
        for piece in zip(cut_curve(curve, cuts.get(edge, WHOLE)), keys[edge], strict=True)
    ]
    return dataclasses.replace(face, region=cut_region(face.region, cuts, keys), inner=tuple(inner))


def _spans(stretches: Stretches) -> list[tuple[float, float, float, float]]:
    """First node, beginning, stop and last node of each piece of an edge; see ``Pieces``."""
    nodes = [0.0, *(s.stop for s in stretches[:-1]), 1.0]
    return [(a, *s, b) for a, s, b in zip(nodes, stretches, nodes[1:])]


def _shares(faces: Sequence[Face], number: Mapping[int, int], edges: Int) -> Float:
    """Length of every piece over that of its edge (e,); ``edges`` (e,) are the CAD indices of the pieces."""
    lengths = np.zeros(len(edges))
    for face in faces:
        for curve, key in (*zip(face.region.curves, face.region.edges, strict=True), *face.inner):
            if not lengths[number[key]]:
                lengths[number[key]] = curve.length()
    return np.asarray(lengths / np.bincount(edges, lengths)[edges])
