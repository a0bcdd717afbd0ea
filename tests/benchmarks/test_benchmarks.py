"""The scripts of ``benchmarks`` that need no other mesh generator."""

from __future__ import annotations

import csv
import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

import regions

PLACE = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture
def scripts(monkeypatch):
    """Imports a script by name; its folder is on the path meanwhile."""
    monkeypatch.setattr(sys, "path", [str(PLACE), *sys.path])
    yield importlib.import_module
    for name in ("generators", "peers", "tables", "compare", "counts"):
        sys.modules.pop(name, None)


NAMES = (
    "Poisson disk", "Lloyd", "bubble packing", "quadtree", "bars (DistMesh)", "hexagonal lattice", "mapping SP(n, m)",
    "SP13", "SP41", "ASP20", "ASP48",
)  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_the_optimiser_mends_every_kind_of_points(scripts, name):
    generators = scripts("generators")
    assert set(generators.NAMES) == set(NAMES)
    region = regions.quarter_disk()
    start, tracks, _ = generators.matched_mesh(name, region, 400)
    outcome, _ = generators.improve(start, tracks)
    assert len(start.unrecovered) == 0
    assert outcome.excess == outcome.flawed_after == 0
    if name not in generators.SETS:
        assert abs(len(start.triangles) / 400 - 1) < 0.15
        assert abs(len(outcome.triangulation.triangles) / 400 - 1) < 0.2


def test_a_mesh_is_judged_against_its_region(scripts):
    peers = scripts("peers")
    square = regions.square()
    points = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0.01)], float)
    triangles = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    found = peers.judge(square, points, triangles)
    assert (found["triangles"], found["unavoidable"]) == (4, 0)
    assert found["flawed"] == 1
    assert found["area_error"] < 1e-15
    assert found["boundary_distance"] < 1e-15
    assert sum(found["histogram"]) == 4
    moved = points.copy()
    moved[0] = 0.1, 0.1
    assert peers.judge(square, moved, triangles)["boundary_distance"] > 0.01


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")  # threads of the test runner
def test_a_run_that_dies_is_told(scripts):
    peers = scripts("peers")

    def die():
        import os
        import signal

        os.kill(os.getpid(), signal.SIGKILL)

    assert peers.forked(die) == {"error": "the process ended with status -9"}
    assert peers.forked(lambda: 1 / 0)["error"].startswith("ZeroDivisionError")
    assert peers.forked(lambda: {"cpu": 1.5}) == {"cpu": 1.5}


def test_counts_are_those_of_faces_of_one_size(scripts, monkeypatch):
    counts, peers = scripts("counts"), scripts("peers")
    monkeypatch.setattr(counts.attempts, "thinned", counts.attempts.thinned)
    monkeypatch.setitem(peers.TOOLS, "gmsh 6", lambda region, size: (None, range(300), None))
    monkeypatch.setattr(counts, "COUNTS", (200,))
    finer = regions.plate()  # its holes ask for smaller triangles
    monkeypatch.setattr(counts, "all_faces", lambda: (("square", regions.square()), ("plate", finer)))
    ((face, count, own, other),) = counts.measure("")
    assert (face, count, other) == ("square", 200, 1.5)
    assert 0.9 < own < 1.1
    text = counts.summary([(face, low, own, other) for low, _ in counts.BINS])
    assert text.count(f"| 1 | {own:.3f} | {own:.3f} | 0 | 1.500 | 1.500 | 1 |") == len(counts.BINS)


def test_ratios_and_tables(scripts, tmp_path):
    compare, tables = scripts("compare"), scripts("tables")
    base = dict.fromkeys(tables.COLUMNS, 0) | {"face": "plate", "count": 20_000, "triangles": 20_000, "error": ""}
    rows = {
        "fubini": base | {"tool": "fubini", "cpu": 0.01, "cpu_all": 0.02, "worst_skew": 50.0},
        "gmsh 6": base | {"tool": "gmsh 6", "cpu": 0.5, "cpu_all": 0.5, "triangles": 10_000, "flawed": 3},
    }
    compare.add_ratios(rows)
    failed = {"tool": "netgen", "face": "plate", "count": 20_000, "error": "the process ended with status -11"}
    compare.write([*rows.values(), failed], str(tmp_path / "out"))
    read = tables.read(tmp_path / "out")
    assert read[1]["ratio"] == pytest.approx(100.0)
    assert read[1]["ratio_all"] == pytest.approx(50.0)
    assert "| gmsh 6 | **100** |" in tables.ratio_table(read, "ratio")
    assert "| gmsh 6 | 1 | 0 | 3 |" in tables.quality_table(read)
    assert "20,000 wanted: the process ended with status -11" in tables.full_table(read)
    with open(tmp_path / "out.csv", newline="") as file:
        assert len(list(csv.DictReader(file))) == 3
