"""Sizes asked on the command line, met in the file that is written."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

import fubini
from fubini.cli import main


def meshed(source, folder, *flags):
    """Arrays of the mesh that the command writes, certified, and the length of its segments."""
    command = ["mesh", source, "-o", folder / "a.npz", "--size", 1, "--json", folder / "a.json", "-q", *flags]
    result = CliRunner().invoke(main, [str(word) for word in command])
    assert result.exit_code == 0, result.output
    assert json.loads((folder / "a.json").read_text())["certified"] is True
    data = dict(np.load(folder / "a.npz"))
    ends = data["points"][data["segments"]]
    return data, np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


@pytest.fixture(scope="session")
def plate(plate_file):
    """Edges of the plate: its two circles, and the straight edge from (0, 0, 1) to (6, 0, 1); a vertex of that."""
    model = fubini.load(plate_file)
    circles = sorted(i for i, edge in model.edges.items() if edge.kind == "circle")
    for i, edge in model.edges.items():
        a, b = model.vertices[edge.start], model.vertices[edge.end]
        if {tuple(np.round(a, 9)), tuple(np.round(b, 9))} == {(0, 0, 1), (6, 0, 1)}:
            return circles, i, edge.start
    raise AssertionError("the plate has changed")


def test_edges_by_index_name_and_range(plate_file, plate, tmp_path):
    circles, straight, _ = plate
    flags = ["--name", f"bore=edges {circles[0]},{circles[1]}", "--edge-size", "bore=0.1",
             "--edge-segments", f"edge {straight}=31", "--edge-segments", f"{straight}=9"]  # fmt: skip
    data, length = meshed(plate_file, tmp_path, *flags)
    on = np.isin(data["edge"], circles)
    assert length[on].max() < 0.15
    assert np.count_nonzero(on) == pytest.approx(2 * 2 * math.pi / 0.1, rel=0.15)
    assert 31 <= np.count_nonzero(data["edge"] == straight) < 40
    assert length.max() > 0.7


def test_faces_and_vertices(plate_file, plate, tmp_path):
    _, straight, vertex = plate
    plain, _ = meshed(plate_file, tmp_path)
    fine, _ = meshed(plate_file, tmp_path, "--face-size", "2=0.2", "--vertex-size", f"{vertex}=0.01")
    assert np.bincount(fine["face"])[2] > 15 * np.bincount(plain["face"])[2]
    model = fubini.load(plate_file)
    ends = fine["points"][fine["segments"][fine["edge"] == straight]]
    at_vertex = np.isclose(ends, model.vertices[vertex], atol=1e-12).all(axis=2).any(axis=1)
    assert np.linalg.norm(ends[at_vertex, 1] - ends[at_vertex, 0], axis=1).max() < 0.02


def test_growth(plate_file, plate, tmp_path):
    _, _, vertex = plate
    counts = [
        len(meshed(plate_file, tmp_path, "--vertex-size", f"{vertex}=0.005", "--growth", growth)[0]["triangles"])
        for growth in (1.2, 1.5, 2.5)
    ]
    assert counts[0] > 1.5 * counts[1] > 1.5 * counts[2]


@pytest.mark.parametrize(
    ("flags", "least", "most"),
    [
        (["--segments-per-turn", 90], 90, 100), (["--chord-tolerance", 0.001], 70, 85),
        (["--turn", 10], 36, 42), (["--turn", 60], 6, 8), ([], 8, 10),
    ],
)  # fmt: skip
def test_curves(plate_file, plate, tmp_path, flags, least, most):
    data, _ = meshed(plate_file, tmp_path, *flags)
    for circle in plate[0]:
        ends = data["points"][data["segments"][data["edge"] == circle]]
        assert least <= len(ends) <= most
        if "--chord-tolerance" in flags:
            sag = 1.0 - np.linalg.norm(ends.mean(axis=1)[:, :2] - (3, 2), axis=1)
            assert sag.max() < 0.001


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--edge-size", "bore"], "WHAT=NUMBER"), (["--edge-size", "=2"], "WHAT=NUMBER"),
        (["--edge-size", "3=x"], "WHAT=NUMBER"), (["--edge-size", "3=-1"], "edge_size"),
        (["--edge-size", "bore=0.1"], "no edge 'bore'"), (["--face-size", "99=0.1"], "face_size"),
        (["--vertex-size", "faces 1=0.1"], "vertex_size"), (["--edge-segments", "3=nan"], "edge_segments"),
        (["--growth", "1"], "growth"), (["--turn", "90"], "turn"), (["--segments-per-turn", "3"], "6 to 100,000"),
        (["--chord-tolerance", "0"], "chord_tolerance"),
    ],
)  # fmt: skip
def test_senseless_sizes_exit_2_and_write_nothing(plate_file, tmp_path, flags, words):
    result = CliRunner().invoke(main, ["mesh", str(plate_file), "-o", str(tmp_path / "a.stl"), *flags])
    assert result.exit_code == 2, result.output
    assert words in result.stderr
    assert not list(tmp_path.iterdir())
