"""Nodes and segments of several faces joined, against sorting by numpy."""

from __future__ import annotations

import numpy as np
import pytest

from fubini.pipeline._kernels_assemble import join


def rows_of_faces(rng: np.random.Generator, edges: int, faces: int):
    """Nodes and segments of faces that share edges, along them or back, in the arrays that ``enter`` fills."""
    place, param, edge, t, nodes = [], [], [], [], []
    inner = [np.sort(rng.random(rng.integers(0, 6))) for _ in range(edges)]
    for _ in range(faces):
        for e in rng.permutation(edges)[: rng.integers(1, edges + 1)].tolist():
            ts = np.concatenate([[0.0], inner[e], [1.0]])
            at = len(place) + np.arange(len(ts))
            place += [-1 - e, *[e] * len(inner[e]), -2 - e]
            param += [0.0, *inner[e], 0.0]
            spans = np.stack([ts[:-1], ts[1:]], axis=1), np.stack([at[:-1], at[1:]], axis=1)
            order = (
                rng.permutation(len(ts) - 1) if rng.random() < 0.3 else np.arange(len(ts) - 1)[:: rng.choice([1, -1])]
            )
            edge += [e] * len(order)
            t += spans[0][order].tolist()
            nodes += spans[1][order].tolist()
    shuffle = np.arange(len(place)) if rng.random() < 0.5 else rng.permutation(len(place))
    moved = np.empty_like(shuffle)
    moved[shuffle] = np.arange(len(place))
    arrays = np.array(place)[shuffle], np.array(param)[shuffle], np.array(edge), np.array(t), moved[np.array(nodes)]
    return arrays


@pytest.mark.parametrize("seed", range(20))
def test_rows_are_joined_as_numpy_sorts_them(seed):
    rng = np.random.default_rng(seed)
    edges = int(rng.integers(1, 9))
    place, param, edge, t, nodes = rows_of_faces(rng, edges, int(rng.integers(1, 5)))
    lifted = np.stack([place.astype(float), param, np.ones(len(place))], axis=1)
    ids = np.cumsum(rng.integers(1, 4, edges))
    first, index, segments, edge_of, params, far = join(
        place, param, lifted, -1 - edges, 1e-12, edge, t, nodes.copy(), ids
    )
    kinds, start, number = np.unique(np.stack([place, param], axis=1), axis=0, return_index=True, return_inverse=True)
    assert (np.stack([place[first], param[first]], axis=1) == kinds).all()
    assert (first == start).all()
    assert (index == number.ravel()).all()
    assert not far
    wanted = np.unique(np.column_stack([ids[edge], t, number.ravel()[nodes]]), axis=0)
    assert (np.column_stack([edge_of, params, segments]) == wanted).all()


def test_rows_of_one_node_at_two_places_are_told():
    place, param = np.array([0, -1, 0]), np.array([0.5, 0.0, 0.5])
    lifted = np.array([[1.0, 0, 0], [0, 0, 0], [1.0, 0, 1e-6]])
    none = np.empty(0, np.int64), np.empty((0, 2)), np.empty((0, 2), np.int64), np.array([7])
    assert join(place, param, lifted, -1, 1e-7, *none)[-1]
    assert not join(place, param, lifted, -1, 1e-5, *none)[-1]
