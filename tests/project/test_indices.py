"""No kernel reads or writes outside its arrays: all of them compiled with checks, and a bad index for comparison."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import fubini
from fubini._turns import ALONE, CHECK

BAD = """
import numpy as np
from fubini._jit import kernel

@kernel
def entry(values, i):
    return values[i]

assert entry(np.arange(3.0), 2) == 2.0
print("inside", flush=True)
entry(np.arange(3.0), {index})
print("outside", flush=True)
"""

MESHES = """
import math
import fubini, random_regions, regions
for k in range(60):
    region = regions.random_polygon(k) if k % 2 else random_regions.random_region(k)
    fubini.mesh(region, region.diagonal / (12, 25, 50)[k % 3])
for degrees in (1, 7, 24, 25, 49):
    fubini.mesh(regions.wedge(degrees), 0.1)
for region in (regions.plate(4), regions.gear()):
    for share in (5, 20, 150):
        mesh = fubini.mesh(region, region.diagonal / share, min_skew=50.0 if share == 20 else 45.0)
fubini.mesh(regions.plate(4), 0.5, size_field=lambda p: 0.05 + 0.2 * abs(p[:, 0]), order=2)
fubini.mesh(regions.plate(4), 0.5, pattern="SP13")
print("meshed")
"""


def run(code, cache, **changes):
    paths = [str(Path(fubini.__file__).parents[1]), str(Path(__file__).parents[1])]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "FUBINI_CACHE_DIR": str(cache), CHECK: "1", **changes}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=400, check=False)
    return done.returncode, done.stdout.split(), done.stderr


@pytest.mark.parametrize("index", [-1, 3, 2**40])
def test_a_checked_kernel_ends_the_process_at_a_bad_index(index, tmp_path):
    code, said, _ = run(BAD.format(index=index), tmp_path, **{ALONE: "1"})  # no second process outlives it
    assert code != 0
    assert said == ["inside"]


def test_no_index_leaves_its_array(tmp_path):
    code, said, errors = run(MESHES, tmp_path)
    assert (code, said) == (0, ["meshed"]), errors
