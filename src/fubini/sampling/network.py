"""What the discretisation knows of all edges of a model before any size is asked."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.sampling.outline import Outline
from fubini.tracks import Tracks, joined
from fubini.tracks.table import LINE

Int = NDArray[np.int64]


@dataclass(frozen=True)
class Network:
    """The edges of a model, and the curves of its faces that run along them; not to be written to.

    Attributes
    ----------
    outlines : the faces.
    ends : (e, 2) running numbers of the vertices of the edges.
    vertices : how many of them there are.
    tracks, exact : the curves of all faces in one table, face by face; see ``Outline``.
    edges, faces : (c,) edge and face of each of them.
    first : (e,) int32, the first of them on each edge.
    uses : (e,) how many of them lie on each edge.
    least : (e,) segments that an edge needs so that its loops do not collapse.
    sharpest : least interior angle of all corners, degrees.
    grain : largest of those of the outlines.
    """

    outlines: Sequence[Outline]
    ends: Int
    vertices: int
    tracks: Tracks
    exact: Tracks
    edges: Int
    faces: Int
    first: NDArray[np.int32]
    uses: Int
    least: Int
    sharpest: float
    grain: float

    @classmethod
    def of(cls, outlines: Sequence[Outline], ends: ArrayLike) -> Network:
        """Network of the edges with these ``ends`` (e, 2), numbered as in the outlines."""
        ends = np.array(ends, np.int64, order="C")
        edges = np.concatenate([outline.edges for outline in outlines])
        faces = np.array([f for f, outline in enumerate(outlines) for _ in range(len(outline.edges))], np.int64)
        first = np.empty(len(ends), np.int32)
        first[edges[::-1]] = np.arange(len(edges), dtype=np.int32)[::-1]
        return cls(
            outlines, ends, int(ends.max(initial=-1)) + 1, joined([outline.tracks for outline in outlines]),
            joined([outline.exact for outline in outlines]), edges, faces, first,
            np.bincount(edges, minlength=len(ends)), _least(outlines, len(ends)),
            min(outline.sharpest for outline in outlines), max(outline.grain for outline in outlines),
        )  # fmt: skip


def _least(outlines: Sequence[Outline], edges: int) -> Int:
    """A loop of one curve needs three segments, one of two curves two on a curved one."""
    least = np.ones(edges, np.int64)
    for outline in outlines:
        for a, b in itertools.pairwise(outline.loop_first.tolist()):
            for j in range(a, b) if b - a < 3 else ():
                asked = 3 if b - a == 1 else 2 if outline.tracks.kinds[j] != LINE else 1
                e = outline.edges[j]
                least[e] = max(least[e], asked)
    return least
