"""Kernels loaded without numba: the same results, whatever they are called with, and no process that breaks."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from numba import float32, int64
from numba.core.errors import NumbaError

import fubini
from fubini import _load
from fubini._image import Image, lay_out, place
from fubini._jit import Kernel, kernel
from fubini._turns import ALONE

pytestmark = pytest.mark.skipif(not _load.host(), reason="kernels are kept in another form here")

MESH = """
import hashlib, sys
import fubini, fubini.pipeline
from fubini.region import Region
mesh = fubini.mesh(Region.polygon([(0, 0), (4, 0), (4, 3), (0, 3)], [[(1, 1), (2, 1), (1.5, 2)]]), 0.3)
data = mesh.points.tobytes() + mesh.triangles.tobytes()
print("numba" in sys.modules, "llvmlite" in sys.modules, hashlib.sha256(data).hexdigest())
"""


def scaled(values, by, first, doubled):
    """A kernel that writes into its argument and makes no arrays."""
    for i in range(first, values.shape[0]):
        values[i] *= 2.0 * by if doubled else by
    return values.shape[0], by


def counted(looked, n):
    """A kernel that returns arrays, one of them a copy of its argument."""
    ones = np.ones((n, 2), np.int32)
    return ones, looked.copy(), np.full(n, looked.sum())


def run(code, **changes):
    env = {**os.environ, "PYTHONPATH": str(Path(fubini.__file__).parent.parent), ALONE: "1", **changes}
    done = subprocess.run(
        [sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A cache in which both kernels are kept."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setenv("FUBINI_CACHE_DIR", str(folder))
        kernel(scaled)(np.ones(3), 2.0, 0, True)
        kernel(counted, allocates=True)(np.ones(3), 2)
        yield folder


@pytest.fixture
def again(folder):
    """The first kernel, as a later process sees it."""
    return kernel(scaled)


def is_loaded(found: Kernel) -> bool:
    return bool(found.loaded) and "dispatcher" not in vars(found)


def file_of(key):
    return _load.path_of(scaled, key)


def test_a_warm_process_meshes_without_numba_and_to_the_same_bytes():
    by_numba = run(MESH, NUMBA_OPT="3")
    assert by_numba[:2] == ["True", "True"]
    run(MESH)  # keeps what is not kept
    assert run(MESH) == ["False", "False", by_numba[2]]


def test_results_are_those_of_python(again):
    values, expected = np.arange(5.0), np.arange(5.0)
    assert again(values, 3.0, 1, True) == scaled(expected, 3.0, 1, True) == (5, 3.0)
    assert values.tolist() == expected.tolist()
    assert again(values, 3.0, 9, False) == (5, 3.0)
    assert is_loaded(again)


def test_arrays_that_kernels_make_outlive_the_call(folder):
    again, looked = kernel(counted, allocates=True), np.arange(4.0)
    references = sys.getrefcount(looked)
    for _ in range(100):
        ones, copy, sums = again(looked, 3)
    assert sys.getrefcount(looked) == references
    del looked
    assert ones.tolist() == [[1, 1]] * 3
    assert copy.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert sums.tolist() == [6.0] * 3
    assert [array.dtype.name for array in (ones, copy, sums)] == ["int32", "float64", "float64"]
    assert all(type(array) is np.ndarray and array.flags.carray for array in (ones, copy, sums))
    assert is_loaded(again)


def test_errors_come_out_of_kernels(folder):
    again = kernel(counted, allocates=True)
    with pytest.raises(MemoryError):
        again(np.ones(2), 2**58)
    assert again(np.ones(2), 1)[0].tolist() == [[1, 1]]
    assert is_loaded(again)


@pytest.mark.parametrize("by", [3.0, np.float64(3.0), 3, np.int32(3), np.float32(3.0), True])
@pytest.mark.parametrize("first", [1, np.int64(1), np.uint8(1), True])
def test_numbers_of_any_type(again, by, first):
    again(np.ones(1), 1.0, 0, False)
    values, expected = np.arange(5.0), np.arange(5.0)
    assert again(values, by, first, False) == scaled(expected, by, int(first), False)
    assert values.tolist() == expected.tolist()


@pytest.mark.parametrize(
    "values",
    [
        np.arange(5, dtype=np.float32),
        np.arange(5),
        np.arange(10.0)[::2],
        np.arange(5.0)[::-1],
        np.arange(5.0).view(np.recarray),
        np.frombuffer(bytearray(41), np.float64, 5, 1),
        np.array(7 * [1.0])[1:6],
    ],
    ids=["float32", "int64", "strided", "reversed", "subclass", "unaligned", "part"],
)
def test_arrays_of_any_type(again, values):
    again(np.ones(1), 1.0, 0, False)
    expected = np.array(values)
    assert again(values, 3.0, 1, True) == scaled(expected, 3.0, 1, True)
    assert values.tolist() == expected.tolist()
    assert again(np.ones(2), 2.0, 0, True) == (2, 2.0)


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        (np.ones(3), 1.0, 0),
        (np.ones(3), 1.0, 0, True, 1),
        (None, 1.0, 0, True),
        (object(), 1.0, 0, True),
        (np.ones(()), 1.0, 0, True),
        (np.arange(5.0).astype(">f8"), 1.0, 0, True),
        (np.array(["a"]), 1.0, 0, True),
        (np.ones(3), "1.0", 0, True),
        (np.ones(3), 1.0, 2**70, True),
        (np.ones(3), None, 0, True),
    ],
    ids=["none", "few", "many", "None", "object", "0-d", "byte order", "text", "string", "too large", "no number"],
)
def test_other_arguments_are_refused_as_numba_refuses_them(again, arguments):
    again(np.ones(1), 1.0, 0, False)
    with pytest.raises((TypeError, ValueError, OverflowError, NumbaError)):
        again(*arguments)
    assert again(np.ones(2), 2.0, 0, True) == (2, 2.0)


def test_read_only_arrays_are_not_written(again):
    again(np.ones(1), 1.0, 0, False)
    values = np.ones(3)
    values.flags.writeable = False
    with pytest.raises(NumbaError):
        again(values, 2.0, 0, True)
    assert values.tolist() == [1.0] * 3


def test_names_of_arguments(again):
    values = np.ones(2)
    assert again(values, by=2.0, doubled=True, first=0) == (2, 2.0)
    assert values.tolist() == [4.0, 4.0]


def test_types_that_alternate_are_all_loaded(folder):
    integers = np.arange(3)
    kernel(counted, allocates=True)(integers, 1)
    again = kernel(counted, allocates=True)
    for _ in range(3):
        assert again(integers, 1)[2].tolist() == [3]
        assert again(np.ones(2), np.int64(1))[2].tolist() == [2.0]
    assert is_loaded(again)
    assert len(again.loaded) == 2


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: b"",
        lambda content: content[:-9],
        lambda content: content[:99] + bytes([content[99] ^ 1]) + content[100:],
        lambda content: _load.path_of(counted, "d1 I").read_bytes(),
    ],
    ids=["empty", "cut", "changed", "another"],
)
def test_a_damaged_file_is_made_anew(again, damage):
    path = file_of("d1 F I B")
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    assert again(np.ones(3), 2.0, 0, True) == (3, 2.0)
    assert not is_loaded(again)
    assert path.read_bytes() == whole
    later = kernel(scaled)
    assert later(np.ones(3), 2.0, 0, True) == (3, 2.0)
    assert is_loaded(later)


def test_other_processors_and_settings_find_no_file(folder, monkeypatch):
    path = file_of("d1 F I B")
    with monkeypatch.context() as patch:
        patch.setattr(_load, "host", lambda: "another")
        assert file_of("d1 F I B") != path
        found = kernel(scaled)
        assert found(np.ones(3), 2.0, 0, True) == (3, 2.0)
        assert not is_loaded(found)
        file_of("d1 F I B").unlink()
    for name, value in (("NUMBA_OPT", "3"), ("NUMBA_CPU_NAME", "generic")):
        with monkeypatch.context() as patch:
            patch.setenv(name, value)
            assert _load.host.__wrapped__() == ""
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    assert _load.host.__wrapped__() == _load.host()


def test_a_symbol_without_address_is_no_end_of_the_process(again, monkeypatch):
    monkeypatch.setattr(_load, "address_of", lambda name: None)
    assert again(np.ones(3), 2.0, 0, True) == (3, 2.0)
    assert not is_loaded(again)


def test_code_with_what_is_not_known_is_refused(folder, monkeypatch):
    codes = []
    monkeypatch.setattr("fubini._build.lay_out", lambda code: codes.append(code))
    found = kernel(counted, allocates=True)
    found.compile((float32[::1], int64))
    (code,) = codes
    image = lay_out(code)
    assert place(image, _load.address_of)
    assert place(image._replace(outside=(("no_such_function", ((0, 0),)),)), _load.address_of) is None
    assert lay_out(code[:500]) is None
    assert lay_out(b"") is None
    assert lay_out(b"\xcf\xfa\xed\xfe" + code[4:]) is None
    assert lay_out(relocations_changed(code)) is None


def relocations_changed(code: bytes) -> bytes:
    """The same object file, with references relative to a table that nothing here has."""
    out = bytearray(code)
    start = int.from_bytes(code[40:48], "little")
    entry, count = (int.from_bytes(code[i : i + 2], "little") for i in (58, 60))
    for i in range(count):
        header = code[start + i * entry : start + (i + 1) * entry]
        if int.from_bytes(header[4:8], "little") == 4:
            offset, size = (int.from_bytes(header[k : k + 8], "little") for k in (24, 32))
            for at in range(offset, offset + size, 24):
                out[at + 8] = 9
    return bytes(out)


def test_an_image_is_connected_where_it_is_put():
    code = bytes.fromhex("48b80000000000000000ffe0")  # jump to an address
    image = Image(code.ljust(4096, b"\0") + bytes(16), 4096, 4112, ((4096, 10),), (("abs", ((2, 0),)),), {})
    base = place(image, _load.address_of)
    assert ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int)(base)(-7) == 7
    assert ctypes.c_uint64.from_address(base + 4096).value == base + 10


def test_threads_load_a_kernel_together(folder):
    for _ in range(5):
        again = kernel(scaled)
        with ThreadPoolExecutor(8) as pool:
            found = list(pool.map(lambda n, again=again: again(np.ones(n), 2.0, 0, True)[0], range(200)))
        assert found == list(range(200))
        assert is_loaded(again)


BOTH = """
import sys
import numpy as np
from fubini._kernels_predicates import orient
from fubini.triangulation._kernels_cdt import rank_points
def ours():
    points = np.array([(0.0, 0), (1, 0), (0, 1), (1, 1.5)])
    return orient(0.0, 0.0, 1.0, 0.0, 0.0, 1.0), len(rank_points(points))
def theirs():
    import numba
    from numba import _dynfunc, _helperlib
    from numba.core.runtime import _nrt_python
    assert numba._helperlib is _helperlib and numba._dynfunc is _dynfunc
    @numba.njit
    def table(n):
        return np.ones((n, 2)) * np.arange(2)
    assert table(2).tolist() == [[0, 1], [0, 1]]
    return "numba"
"""


def test_numba_before_and_after():
    expected = run(BOTH + "print(*ours())")
    first = run(BOTH + "print(*ours(), 'numba' in sys.modules, theirs(), *ours())")
    assert first == [*expected, "False", "numba", *expected]
    assert run(BOTH + "print(theirs(), *ours())") == ["numba", *expected]
