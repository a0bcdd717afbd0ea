"""``evened_across``: triangles of different faces with a common edge, of about the same size."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fubini.optimise import OptimiseOptions
from fubini.optimise.levels import flawed_shape
from fubini.optimise.smooth import evened
from fubini.pipeline._kernels_across import beside
from fubini.pipeline.strip import stacked, with_core
from fubini.quality import squared_lengths
from fubini.sampling.boundary import EdgeNodes
from fubini.sampling.network import Network

if TYPE_CHECKING:
    from fubini.pipeline.faces import FaceResult

Float = NDArray[np.float64]

#: Rounds in which the larger triangles of pairs give way, and the smaller ones, in turns.
ROUNDS = 4
#: Columns of ``Beside.found``.
NUMBER, LEAST, MOST = range(3)


@dataclass(frozen=True)
class Beside:
    """What lies beside the segments of all faces: see ``_kernels_across.beside``. ``first`` (f + 1,) of each face."""

    first: list[int]
    size: Float
    place: NDArray[np.int64]
    found: Float

    def uneven(self, limit: float, column: int) -> list[int]:
        """Faces with the LEAST or MOST of sizes that differ by more than the limit, ascending."""
        over = self.found[:, MOST] > limit * self.found[:, LEAST]
        segments = np.flatnonzero(over[self.place] & (self.place >= 0))
        own = segments[self.size[segments] == self.found[self.place[segments], column]]
        return sorted(set((np.searchsorted(self.first, own, side="right") - 1).tolist()))

    def outside(self, face: int) -> Float:
        """Sizes (k,) that differ most from those inside, beyond the segments of a face; 0 for none."""
        part = slice(self.first[face], self.first[face + 1])
        number, least, most = self.found[self.place[part]].T
        return np.where((self.place[part] >= 0) & (number > 1), np.where(self.size[part] == least, most, least), 0.0)


def evened_across(
    network: Network, nodes: EdgeNodes, results: list[FaceResult], options: OptimiseOptions
) -> list[FaceResult]:
    """The faces with nodes moved inside where triangles across a shared edge differ by more than ``options.growth``.

    As in ``even_out`` no triangle becomes worse than it is and than that allows, and none leaves a face with a longer
    edge. Pairs whose corners all lie on edges stay as they are.
    """
    if not len(network.uses) or network.uses.max() < 2:
        return results
    for turn in range(ROUNDS):
        now = _beside(network, nodes, results, options)
        if not (now.found[:, MOST] > options.growth * now.found[:, LEAST]).any():
            break
        for f in now.uneven(options.growth, (MOST, LEAST)[turn % 2]):
            old = results[f].outcome.triangulation
            even, _, longest = evened(old, options, now.outside(f))
            if even is not old and longest <= math.sqrt(squared_lengths(old.points[old.triangles]).max()):
                mesh = with_core(even, results[f].mesh.core)
                outcome = results[f].outcome.on(even)
                results = [*results[:f], replace(results[f], mesh=mesh, outcome=outcome), *results[f + 1 :]]
    return results


def _beside(network: Network, nodes: EdgeNodes, results: list[FaceResult], options: OptimiseOptions) -> Beside:
    """Sizes of triangles on both sides of all shared segments."""
    meshes = [result.outcome.triangulation for result in results]
    lengths = [
        (len(mesh.points), len(mesh.triangles), len(mesh.boundary.track), len(outline.edges))
        for mesh, outline in zip(meshes, network.outlines, strict=True)
    ]
    starts = np.zeros((len(meshes) + 1, 4), np.int64)
    np.add.accumulate(lengths, out=starts[1:])
    k = int(starts[-1, 2])
    size, place, found = np.empty(k), np.empty(k, np.int64), np.empty((len(nodes.t), 3))
    parts = (
        [mesh.points for mesh in meshes], [mesh.triangles for mesh in meshes], [mesh.neighbours for mesh in meshes],
        [mesh.boundary.track for mesh in meshes], [mesh.boundary.t for mesh in meshes],
    )  # fmt: skip
    beside(
        starts, *(stacked(part) for part in parts), network.edges, network.uses, nodes.first, nodes.t,
        flawed_shape(options), size, place, found,
    )  # fmt: skip
    return Beside(starts[:, 2].tolist(), size, place, found)
