"""The cache of compiled kernels: never stale, never in the way."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pytest

import fubini
import fubini._jit as jit
import regions
from fubini._cache import COMPILING
from fubini._helper import LATER, compile_all, square
from fubini._packed import words_of
from fubini._reference import KINDS, Reference
from fubini._turns import ALONE, turn
from fubini.optimise import OptimiseOptions
from fubini.optimise._kernels_state import STATE_FIELDS, WORK_FIELDS, StateArrays, WorkArrays, work
from fubini.optimise.state import build_state
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate

RUN = """
import numpy as np
from fubini._cache import source_digest
from fubini.tracks import TrackBuilder, evaluate, _kernels
builder = TrackBuilder()
builder.add(0, (0, 0), (2, 4))
assert evaluate(builder.build(), 0, 0.5).tolist() == [[1, 2]]
kernel, hits, misses = _kernels.evaluate_many, len(_kernels.evaluate_many.loaded), 0
if "dispatcher" in vars(kernel):
    stats = kernel.dispatcher.stats
    hits, misses = hits + sum(stats.cache_hits.values()), sum(stats.cache_misses.values())
print(source_digest(), hits, misses)
"""


@pytest.fixture
def package(tmp_path):
    """A copy of the package whose sources may be changed."""
    return shutil.copytree(
        Path(fubini.__file__).parent, tmp_path / "src" / "fubini", ignore=shutil.ignore_patterns("__pycache__")
    )


def run(package, cache, **changes):
    env = {**os.environ, "PYTHONPATH": str(package.parent), "FUBINI_CACHE_DIR": str(cache), ALONE: "1", **changes}
    done = subprocess.run(
        [sys.executable, "-c", RUN], env=env, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    digest, hits, misses = done.stdout.split()
    return digest, int(hits), int(misses)


def test_second_process_loads_what_the_first_compiled_until_a_kernel_changes(package, tmp_path):
    cache = tmp_path / "cache"
    first = run(package, cache)
    assert first[1:] == (0, 1)
    assert run(package, cache) == (first[0], 1, 0)
    # a kernel that another kernel calls
    kernels = package / "tracks" / "_kernels.py"
    kernels.write_text(kernels.read_text().replace("s * data[o] + t * data[o + 2]", "t * data[o + 2] + s * data[o]"))
    changed = run(package, cache)
    assert changed[0] != first[0]
    assert changed[1:] == (0, 1)


def test_only_kernel_sources_count(package):
    digest = "from fubini._cache import source_digest; print(source_digest())"

    def now():
        env = {**os.environ, "PYTHONPATH": str(package.parent)}
        return subprocess.check_output([sys.executable, "-c", digest], env=env, text=True, timeout=60)

    before = now()
    (package / "errors.py").write_text((package / "errors.py").read_text() + "\n# changed\n")
    assert now() == before
    (package / "cells" / "_kernels_new.py").write_text("# new\n")
    assert now() != before


def test_kernels_take_values_and_functions_from_what_counts_alone():
    """A number from another file could change without a new compilation."""
    root = Path(fubini.__file__).parent
    for path in root.rglob("_kernels*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "fubini":
                last = node.module.split(".")[-1]
                assert last.startswith("_kernels") or last in COMPILING, (path, node.module)


def test_unwritable_cache_compiles_in_memory(package, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("a file, so no folder can be made below it")
    for _ in range(2):
        assert run(package, blocked / "cache")[1:] == (0, 1)
    assert blocked.read_text().startswith("a file")


def test_default_folder_is_the_users_cache(package, tmp_path):
    env = {**os.environ, "PYTHONPATH": str(package.parent), "XDG_CACHE_HOME": str(tmp_path / "xdg")}
    env.pop("FUBINI_CACHE_DIR", None)
    code = "from fubini._cache import cache_folder; print(cache_folder().parent)"
    found = subprocess.check_output([sys.executable, "-c", code], env=env, text=True, timeout=60)
    assert found.strip() == str(tmp_path / "xdg" / "fubini")


def test_arrays_need_the_counting_of_references():
    @jit.inner
    def careless(a):
        return a

    @jit.kernel
    def caller(a):
        return careless(a)[0]

    with pytest.raises(Exception, match="allocates"):
        caller(np.zeros(3))


def test_kernels_link_kernels_and_what_allocates():
    @jit.inner(allocates=True)
    def doubled(n):
        out = np.empty(n)
        for i in range(n):
            out[i] = 2.0 * i
        return out

    @jit.kernel(allocates=True)
    def middle(n):
        return doubled(n)

    @jit.kernel(allocates=True)
    def total(n):
        return middle(n).sum()

    assert total(5) == 20.0
    assert middle(3).tolist() == [0.0, 2.0, 4.0]


class Pair(NamedTuple):
    """What a reference stands for."""

    numbers: object
    total: object


pair_of = jit.reader(Pair, "d d")


@jit.inner
def add_up(P, n):
    """Add the first n numbers to the total, through whatever P is."""
    for i in range(n):
        P.total[0] += P.numbers[i]
    return n


def test_a_reference_reads_and_writes_the_arrays_of_its_tuple(tmp_path, monkeypatch):
    monkeypatch.setenv("FUBINI_CACHE_DIR", str(tmp_path))

    @jit.kernel
    def twice(P):
        P = pair_of(P)
        return add_up(P, 2) + add_up(P, P.numbers.shape[0])

    pair = Pair(np.array([1.0, 2.0, 4.0]), np.zeros(1))
    assert twice(words_of(pair, "d d")) == 5
    assert pair.total[0] == 10.0
    assert [isinstance(arguments[0], Reference) for arguments in add_up.dispatcher.overloads] == [True]


def test_words_are_what_numba_stores():
    """Arrays of every kind of entry, and of two dimensions, as the state of the optimiser has them."""
    for fields, of, made in ((STATE_FIELDS, StateArrays, state_arrays()), (WORK_FIELDS, WorkArrays, work())):
        kinds = [letter(array) + "".join(map(str, array.shape[1:])) for array in made]
        assert " ".join(kinds) == fields
        assert len(made.words) == sum(5 + 2 * array.ndim for array in made)
        assert len(of._fields) == len(kinds)


def letter(array):
    return next(name for name, kind in KINDS.items() if numba.from_dtype(array.dtype) == kind)


def state_arrays():
    boundary, sizing, _ = regions.discretise(regions.square(), 0.5)
    start = constrained_delaunay(boundary.points, boundary)
    return build_state(start, sizing.outlines[0].tracks, OptimiseOptions(), 10)


@pytest.mark.parametrize(
    "wrong", [np.zeros((2, 3), np.float32), np.zeros((2, 3), int), np.zeros((2, 2)), np.zeros((4, 3))[::2]]
)
def test_arrays_of_another_type_have_no_words(wrong):
    with pytest.raises(TypeError, match="no d3"):
        words_of([wrong], "d3")


def test_only_words_are_read():
    @jit.kernel
    def wrong(array):
        return pair_of(array).numbers.shape[0]

    with pytest.raises(numba.TypingError):
        wrong(np.zeros(2))


def test_two_processes_compile_a_kernel_once(package, tmp_path):
    env = {**os.environ, "PYTHONPATH": str(package.parent), "FUBINI_CACHE_DIR": str(tmp_path), ALONE: "1"}
    both = [subprocess.Popen([sys.executable, "-c", RUN], env=env, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    found = [process.communicate(timeout=120)[0].split()[1:] for process in both]
    assert sorted(found) == [["0", "1"], ["1", "0"]]
    assert not list(tmp_path.rglob("*.claim"))


def test_the_claim_of_a_process_that_died_is_void(tmp_path):
    index = tmp_path / "kernel.nbi"
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait(60)
    claim = index.with_suffix(".claim")
    claim.write_text(str(gone.pid))
    with turn(index):
        assert claim.read_text() == str(os.getpid())
    assert not claim.exists()


def test_nothing_is_claimed_where_nothing_can_be_written(tmp_path):
    with turn(tmp_path / "missing" / "kernel.nbi"):
        assert not list(tmp_path.iterdir())


def test_a_first_run_compiles_with_a_helper_and_says_so(tmp_path):
    code = "import fubini._turns as t, pathlib\nwith t.turn(pathlib.Path('kernel.nbi')): print(len(t._started))"
    env = {**os.environ, "FUBINI_CACHE_DIR": str(tmp_path)}
    env.pop(ALONE, None)
    done = subprocess.run(
        [sys.executable, "-c", code], env=env, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stderr.count("first run, compiling") == 1
    assert int(done.stdout) == (2 if len(os.sched_getaffinity(0)) > 1 else 1)


def test_the_helper_compiles_for_the_types_that_meshing_calls_with():
    from fubini.optimise._kernels_copy import read_out
    from fubini.optimise._kernels_loop import drive
    from fubini.optimise._kernels_start import start

    compile_all()
    assert validate(square()[0]) == ()
    fubini.mesh(regions.model_of(regions.quarter_disk()), 0.02)
    compiled = [drive, read_out, start, *(kernel for kernel, _ in LATER)]
    assert [len(kernel.keys) for kernel in compiled] == [1] * len(compiled)
