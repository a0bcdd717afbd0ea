"""Arrays as the numbers that compiled code knows them by: see ``fubini._reference``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Letters that stand for types of entries.
LETTERS: dict[str, np.dtype[Any]] = {
    "d": np.dtype(float), "i": np.dtype("i4"), "l": np.dtype("i8"), "u": np.dtype("u4"), "b": np.dtype("u1"),
}  # fmt: skip


def row_of(field: str) -> int:
    """Length of the rows of a table, 0 where the field stands for a list."""
    return int(field[1:] or 0)


def words_of(arrays: Iterable[NDArray], fields: str) -> NDArray[np.int64]:
    """The words of arrays one behind the other; they hold as long as the arrays do.

    Of an array numba stores who owns it (here nobody), size, size of an entry, address, shape and strides.

    fields : what each array must be: a letter for (n,), with a number r behind it for (n, r). Raises ``TypeError`` for
    another type or shape, and for arrays that are not C-contiguous: compiled code would read what is not there.
    """
    words: list[int] = []
    for array, field in zip(arrays, fields.split(), strict=True):
        rows = array.shape[1:] == ((row_of(field),) if field[1:] else ())
        if array.dtype != LETTERS[field[0]] or not rows or not array.flags.c_contiguous:
            raise TypeError(f"an array of {array.dtype} and shape {array.shape} is no {field}, or not contiguous")
        words += (0, 0, array.size, array.itemsize, array.__array_interface__["data"][0], *array.shape, *array.strides)
    return np.array(words, np.int64)
