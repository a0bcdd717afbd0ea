"""``SizeTree``: the sizes wanted at some places, growing from there by a limited rate, found through a tree."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fubini.errors import OptionError
from fubini.model import Model
from fubini.pipeline.options import MeshOptions
from fubini.pipeline.parts import by_part, edge_points
from fubini.sizing.tree import BITS, Tree, balanced, children, contained, unpack

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: Points are evaluated so many at a time.
BLOCK = 32768
#: A function may vary by this ratio within a cell before the cell is cut up; coarser cells are cut anyway.
VARIES, COARSEST = 1.1, 4
#: Sampled places along an edge lie this share of the size apart.
SPACING = 0.5
#: More cells than this are refused.
MOST_CELLS = 5_000_000


class SizeTree:
    """A size field: ``min(largest, s_i + gradient * distance to box i)`` over boxes with sizes, points among them.

    The field grows by no more than its gradient, exactly. It is found through a quadtree (octree in space) whose
    leaves are no wider than the size in their middle and differ by one level at most where they touch; each leaf knows
    the boxes that matter in it, so that an evaluation looks at a few of them and still finds the least over all.

    Use the constructors ``from_points``, ``from_function`` and ``from_model``; the value is called with points.

    Attributes
    ----------
    largest : size far away from everything.
    gradient : growth of the size per unit of distance.
    tree : the cells (``fubini.sizing.tree.Tree``).
    centers, halves, sizes : (n, d) middles and half widths of the boxes, and their sizes (n,).

    Example
    -------
    >>> import numpy as np
    >>> field = SizeTree.from_points([(0.0, 0.0)], 0.1, largest=1.0)
    >>> field(np.array([(0.0, 0.0), (2.0, 0.0), (9.0, 9.0)])).round(3).tolist()
    [0.1, 0.8, 1.0]
    """

    def __init__(self, centers: Float, halves: Float, sizes: Float, largest: float, gradient: float) -> None:
        self.largest, self.gradient = float(largest), float(gradient)
        useful = sizes < self.largest
        self.centers, self.halves, self.sizes = centers[useful], halves[useful], sizes[useful]
        d = centers.shape[1]
        if not useful.any():
            self.tree = Tree.of(np.zeros(d), 1.0, [])
            self._first, self._items = np.zeros(2, np.int64), np.empty(0, np.int64)
            return
        reach = (self.largest - self.sizes.min()) / self.gradient
        low = (self.centers - self.halves).min(axis=0) - reach
        width = float(((self.centers + self.halves).max(axis=0) + reach - low).max())
        split, _ = self._grow(low, width, None)
        self.tree = Tree.of(low, width, balanced(split, d))
        _, (self._first, self._items) = self._grow(low, width, self.tree)

    @classmethod
    def from_points(cls, points: ArrayLike, sizes: ArrayLike, *, largest: float, growth: float = 1.5) -> SizeTree:
        """Sizes wanted at points (n, 2) or (n, 3): one for each, or one for all.

        ``growth`` is that of ``fubini.mesh``: the limit for the sizes of triangles with a common edge.
        """
        p = np.atleast_2d(np.asarray(points, float))
        s = np.broadcast_to(np.asarray(sizes, float), (len(p),)).copy()
        if p.shape[1] not in (2, 3) or not len(p):
            raise OptionError(f"points of shape {p.shape}", fix="give at least one row of 2 or 3 coordinates")
        return cls(p, np.zeros_like(p), _positive(s), _positive(np.array([largest]))[0], gradient_of(growth))

    @classmethod
    def from_function(
        cls,
        function: Callable[[Float], ArrayLike],
        low: ArrayLike,
        high: ArrayLike,
        *,
        largest: float,
        growth: float = 1.5,
    ) -> SizeTree:
        """A function of points (n, d), asked once and for all within a box, and limited in its growth.

        Cells are cut up where the function varies by more than a tenth within them, down to half the size that it
        gives; the least value found in a cell stands for all of it. Outside the box the size grows to ``largest``.
        """
        a, b = np.asarray(low, float), np.asarray(high, float)
        if a.shape != b.shape or a.shape not in ((2,), (3,)) or not (a < b).all():
            raise OptionError(f"a box from {a.tolist()} to {b.tolist()}", fix="give two corners, the lower one first")
        keys, boxes = np.zeros(1, np.int64), []
        for level in range(BITS):
            half = (b - a) / 2.0 ** (level + 1)
            middle = a + half * (2 * unpack(keys, len(a)) + 1)
            least, most = _probe(function, middle, half)
            cut = (most > VARIES * least) & (2.0 * half.max() > 0.5 * least) | (level < COARSEST)
            boxes.append((middle[~cut], np.broadcast_to(half, middle.shape)[~cut], least[~cut]))
            if not cut.any():
                break
            keys = children(keys[cut], len(a)).ravel()
            _check_number(len(keys))
        centers, halves, sizes = (np.concatenate(parts) for parts in zip(*boxes, strict=True))
        return cls(centers, halves, sizes, _positive(np.array([largest]))[0], gradient_of(growth))

    @classmethod
    def from_model(
        cls, model: Model, edges: Mapping[Any, float], points: Mapping[tuple[float, float, float], float] | None = None,
        *, largest: float, growth: float = 1.5,
    ) -> SizeTree:  # fmt: skip
        """Small sizes along edges of a model and around points in space.

        Parameters
        ----------
        edges : size by edge: index, name, text or predicate, as for ``edge_size`` of ``fubini.mesh``.
        points : size by point (x, y, z).
        """
        asked = by_part(model, "edges", "edge", edges, {})
        places = [edge_points(model, edge, SPACING * size) for edge, size in asked.items()]
        sizes = [np.full(len(p), size) for p, size in zip(places, asked.values(), strict=True)]
        for point, size in (points or {}).items():
            places.append(np.array([point], float))
            sizes.append(np.array([size], float))
        if not places:
            raise OptionError("a field of no edge and no point", fix="give at least one")
        return cls.from_points(np.concatenate(places), np.concatenate(sizes), largest=largest, growth=growth)

    def __call__(self, points: ArrayLike) -> Float:
        """Sizes (n,) at points (n, 2) or (n, 3); a field in the plane takes the first two coordinates."""
        p = np.atleast_2d(np.asarray(points, float))[:, : self.centers.shape[1]]
        out = np.full(len(p), self.largest)
        for begin in range(0, len(p), BLOCK):
            part = p[begin : begin + BLOCK]
            leaf = self.tree.locate(part)
            owner, item = _ragged(self._first, self._items, leaf)
            value = self.sizes[item] + self.gradient * self._distance(part[owner], item)
            np.minimum.at(out[begin : begin + BLOCK], owner, value)
        return out

    def evaluate(self, x: ArrayLike, y: ArrayLike, z: ArrayLike | None = None) -> Float:
        """Sizes at coordinates of any one shape."""
        parts = np.broadcast_arrays(*(np.asarray(c, float) for c in (x, y, *(() if z is None else (z,)))))
        return self(np.stack([c.ravel() for c in parts], axis=1)).reshape(parts[0].shape)

    def _distance(self, points: Float, item: Int) -> Float:
        """Distances (n,) of points from the boxes of these numbers."""
        off = np.maximum(np.abs(points - self.centers[item]) - self.halves[item], 0.0)
        return np.sqrt((off * off).sum(axis=1))

    def _grow(self, low: Float, width: float, tree: Tree | None) -> tuple[list[Int], tuple[Int, Int]]:
        """Cells to split by size, or as in ``tree``; and the boxes that matter in each leaf of the tree.

        A box matters in a cell unless another gives less in all of it. A child looks at the boxes of its parent alone.
        """
        d = len(low)
        keys, owner, item = np.zeros(1, np.int64), np.zeros(len(self.sizes), np.int64), np.arange(len(self.sizes))
        split, counts, items = [], [], []
        for level in range(BITS + 1):
            cell = width / 2.0**level
            middle = low + cell * (unpack(keys, d) + 0.5)
            owner, item = self._prune(middle, 0.5 * cell, owner, item)
            if tree is None:
                least = np.full(len(keys), self.largest)
                np.minimum.at(least, owner, self.sizes[item] + self.gradient * self._distance(middle[owner], item))
                cut = (cell > least) & (level < BITS)
            else:
                cut = contained(tree.split[level], keys)
                counts.append(np.bincount(owner[~cut[owner]], minlength=len(keys))[~cut])
                alone = np.flatnonzero(~cut[owner])
                items.append(item[alone[np.argsort(owner[alone], kind="stable")]])
            if not cut.any():
                break
            split.append(keys[cut])
            keys, owner, item = _descend(keys, cut, owner, item, d)
            _check_number(len(keys))
        if tree is None:
            return split, (np.empty(0, np.int64), np.empty(0, np.int64))
        return split, (np.concatenate([[0], np.cumsum(np.concatenate(counts))]), np.concatenate(items))

    def _prune(self, middle: Float, half: float, owner: Int, item: Int) -> tuple[Int, Int]:
        """The pairs of a cell and a box that may give the least size somewhere in the cell."""
        off = np.abs(middle[owner] - self.centers[item])
        near = np.maximum(off - self.halves[item] - half, 0.0)
        far = np.maximum(off + half - self.halves[item], 0.0)
        lowest = self.sizes[item] + self.gradient * np.sqrt((near * near).sum(axis=1))
        highest = self.sizes[item] + self.gradient * np.sqrt((far * far).sum(axis=1))
        bound = np.full(len(middle), self.largest)
        np.minimum.at(bound, owner, highest)
        kept = lowest <= bound[owner]
        return owner[kept], item[kept]


def gradient_of(growth: float) -> float:
    """Growth of the size per unit of distance for a limit on neighbouring triangles."""
    return MeshOptions(growth=growth).gradient


def _descend(keys: Int, cut: NDArray[np.bool_], owner: Int, item: Int, d: int) -> tuple[Int, Int, Int]:
    """Sorted keys of the children of the cells that are cut, and the pairs of their parents for each of them."""
    below = children(keys[cut], d)
    order = np.argsort(below.ravel())
    place = np.empty(below.shape, np.int64)
    place.ravel()[order] = np.arange(below.size)
    number = np.cumsum(cut) - 1
    kept = cut[owner]
    parent = number[owner[kept]]
    owner = place[parent].ravel()
    return below.ravel()[order], owner, np.repeat(item[kept], 2**d)


def _ragged(first: Int, items: Int, rows: Int) -> tuple[Int, Int]:
    """For rows (n,) of a ragged table, -1 for none: numbers 0 .. n - 1 repeated, and the members of each."""
    count = np.where(rows >= 0, first[rows + 1] - first[rows], 0)
    owner = np.repeat(np.arange(len(rows)), count)
    offset = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    return owner, items[first[rows[owner]] + offset]


def _probe(function: Callable[[Float], ArrayLike], middle: Float, half: Float) -> tuple[Float, Float]:
    """Least and largest value (n,) of a function at corners, middles of sides and the centre of cells."""
    d = middle.shape[1]
    grid = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=d)))
    places = (middle[:, None] + half * grid).reshape(-1, d)
    values = np.asarray(function(places), float)
    if values.shape != (len(places),):
        raise OptionError(
            f"the function gives shape {values.shape} for {len(places)} points", fix="return one size for each row"
        )
    table = _positive(values).reshape(len(middle), -1)
    return table.min(axis=1), table.max(axis=1)


def _positive(sizes: Float) -> Float:
    if not (np.isfinite(sizes) & (sizes > 0.0)).all():
        raise OptionError("a size that is not positive", fix="give edge lengths above 0")
    return sizes


def _check_number(cells: int) -> None:
    if cells > MOST_CELLS:
        raise OptionError(f"the size field needs more than {MOST_CELLS:,} cells", fix="ask for larger sizes")
