"""Order of insertion: the same compiled and in plain Python, rounds as large as they are to be."""

from __future__ import annotations

import numpy as np

from fubini._jit import kernel
from fubini.triangulation._kernels_order import ROUNDS, insertion_order, insertion_round


@kernel
def rounds_into(out):
    for i in range(out.shape[0]):
        out[i] = insertion_round(i)


@kernel(allocates=True)
def order_of(points):
    return insertion_order(points, 0.0, 0.0, 1.0)


def test_rounds_are_those_of_plain_python():
    """Products of signed integers that leave their range come out as the compiler likes; each round is a quarter of the
    next."""
    out = np.zeros(20_000)
    rounds_into(out)
    with np.errstate(over="ignore"):
        assert out.astype(int).tolist() == [insertion_round.py_func(i) for i in range(len(out))]
    number = np.bincount(out.astype(int), minlength=ROUNDS)[::-1]
    wanted = len(out) * 0.75 * 0.25 ** np.arange(5)
    assert (np.abs(number[:5] - wanted) < 5.0 * np.sqrt(wanted)).all()


def test_every_point_is_inserted_once_and_neighbours_follow_each_other():
    points = np.random.default_rng(1).random((3000, 2))
    order = order_of(points)
    assert sorted(order.tolist()) == list(range(3000))
    last = points[order[1000:]]  # of the last round
    assert np.median(np.hypot(*np.diff(last, axis=0).T)) < 2.0 / np.sqrt(2000)
