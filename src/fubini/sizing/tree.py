"""A quadtree or octree as sorted tables of cells, level by level; balanced 2:1.

A cell of level l has the integer coordinates 0 .. 2^l - 1 along each axis, packed into one key.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: Bits of a key for each axis; no cell lies deeper than this.
BITS = 20


@dataclass(frozen=True)
class Tree:
    """The cells of a tree over the cube from ``low`` (d,) with edges of length ``width``.

    ``split[l]`` holds the keys of the cells of level l that have children, ``leaves[l]`` of those that have none; both
    sorted. Leaves are numbered level by level, from ``first[l]`` on.
    """

    low: Float
    width: float
    split: tuple[Int, ...]
    leaves: tuple[Int, ...]
    first: Int

    @classmethod
    def of(cls, low: Float, width: float, split: list[Int]) -> Tree:
        """The tree in which these cells, and no others, have children."""
        d = len(low)
        cells, leaves = np.zeros(1, np.int64), []
        for keys in split:
            leaves.append(np.setdiff1d(cells, keys))
            cells = np.sort(children(keys, d).ravel())
        leaves.append(cells)
        first = np.concatenate([[0], np.cumsum([len(keys) for keys in leaves])])
        return cls(low, width, (*split, np.empty(0, np.int64)), tuple(leaves), first)

    def locate(self, points: Float) -> Int:
        """Numbers (n,) of the leaves that hold points (n, d); -1 for points outside the cube."""
        share = (points - self.low) / self.width
        inside = ((share >= 0.0) & (share <= 1.0)).all(axis=1)
        found = np.full(len(points), -1)
        left = np.flatnonzero(inside)
        for level, (split, leaves) in enumerate(zip(self.split, self.leaves, strict=True)):
            cell = np.minimum((share[left] * 2.0**level).astype(np.int64), 2**level - 1)
            key = pack(cell)
            at = np.searchsorted(leaves, key)
            here = ~contained(split, key)
            found[left[here]] = self.first[level] + at[here]
            left = left[~here]
        return found

    def boxes(self) -> tuple[Float, Float]:
        """Lowest corners (n, d) and widths (n,) of all leaves, in the order of their numbers."""
        corners, widths = [], []
        for level, keys in enumerate(self.leaves):
            width = self.width / 2.0**level
            corners.append(self.low + width * unpack(keys, len(self.low)))
            widths.append(np.full(len(keys), width))
        return np.concatenate(corners), np.concatenate(widths)


def balanced(split: list[Int], d: int) -> list[Int]:
    """The least splits that hold these and leave no two leaves that touch more than one level apart.

    Whatever surrounds a cell with children must be there itself, so that its parent has children.
    """
    out = [np.unique(keys) for keys in split]
    for level in range(len(out) - 1, 0, -1):
        around = neighbours(out[level], d, level)
        out[level - 1] = np.union1d(out[level - 1], pack(unpack(around, d) >> 1))
    return out


def neighbours(keys: Int, d: int, level: int) -> Int:
    """Keys of the cells around cells of one level and of these cells themselves, each once."""
    cell = unpack(keys, d)
    found = []
    for step in itertools.product((-1, 0, 1), repeat=d):
        moved = cell + np.array(step)
        found.append(pack(moved[((moved >= 0) & (moved < 2**level)).all(axis=1)]))
    return np.unique(np.concatenate(found))


def children(keys: Int, d: int) -> Int:
    """Keys (n, 2^d) of the children of cells (n,)."""
    corner = np.array(list(itertools.product((0, 1), repeat=d)))
    return pack(2 * unpack(keys, d)[:, None] + corner)


def pack(cells: Int) -> Int:
    """Keys (...,) of integer coordinates (..., d)."""
    key = np.zeros(cells.shape[:-1], np.int64)
    for k in range(cells.shape[-1]):
        key |= cells[..., k] << (BITS + 1) * k
    return key


def unpack(keys: Int, d: int) -> Int:
    """Integer coordinates (..., d) of keys."""
    mask = 2 ** (BITS + 1) - 1
    return np.stack([keys >> (BITS + 1) * k & mask for k in range(d)], axis=-1)


def contained(keys: Int, wanted: Int) -> NDArray[np.bool_]:
    """Which of the ``wanted`` are among the sorted ``keys``."""
    if not len(keys):
        return np.zeros(len(wanted), bool)
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    found: NDArray[np.bool_] = keys[at] == wanted
    return found
