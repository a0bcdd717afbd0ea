"""Every example of cad_examples: built, meshed by default and by the paper's settings, certified."""

from __future__ import annotations

import importlib
import math
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("build123d", reason="no build123d installed")

import fubini
from fubini.quality import aspect_ratios, skewness

FOLDER = Path(__file__).resolve().parents[2] / "cad_examples"
sys.path.insert(0, str(FOLDER))  # as Python does for a program in that folder
NAMES = ("quarter_disk", "hollow_cylinder_quarter", "wrench", "free_form", "bracket")
ON_PAPER = [
    ("quarter_disk", "SP13"), ("quarter_disk", "SP41"), ("quarter_disk", "ASP20"), ("quarter_disk", "ASP48"),
    ("hollow_cylinder_quarter", "SP13"), ("hollow_cylinder_quarter", "SP41"),
    ("wrench", "SP13"), ("wrench", "SP41"),
    ("free_form", "SP13"), ("free_form", "SP41"),
]  # fmt: skip


def example(name):
    """The module of an example."""
    return importlib.import_module(name)


@cache
def shape(name):
    """The shape of an example, built once."""
    return example(name).build()


def assert_all_good(mesh):
    """Every triangle is good by the figures of the mesh itself, and the certificate says so."""
    corners = mesh.points[mesh.triangles]
    assert skewness(corners).min() > 45
    assert aspect_ratios(corners).max() < 2
    assert mesh.certificate.certified, [f.reasons for f in mesh.certificate.faces]
    assert mesh.certificate.flawed == 0


AREAS = {
    "quarter_disk": math.pi / 4,
    "hollow_cylinder_quarter": math.pi / 4 * (1 - 0.25),
}


@pytest.mark.parametrize("name", NAMES)
def test_default_mesh_is_certified(name):
    module = example(name)
    model = fubini.load(shape(name))
    assert len(model.faces) == (16 if name == "bracket" else 1)
    if name in AREAS:
        assert model.faces[0].region.area == pytest.approx(AREAS[name], rel=1e-13)
    for size in (module.SIZE, 2.5 * module.SIZE):
        assert_all_good(fubini.mesh(model, size))


@pytest.mark.parametrize(("name", "pattern"), ON_PAPER)
def test_mesh_by_the_papers_settings_is_certified(name, pattern):
    module = example(name)
    assert pattern in module.PATTERNS
    mesh = fubini.mesh(shape(name), module.SIZE, pattern=pattern)
    assert_all_good(mesh)
    # the points come from the reference set, whatever the size
    other = fubini.mesh(shape(name), module.SIZE / 3, pattern=pattern)
    assert len(other.triangles) < 2 * len(mesh.triangles)
    if pattern in ("SP41", "ASP48"):
        coarse = fubini.mesh(shape(name), module.SIZE, pattern={"SP41": "SP13", "ASP48": "ASP20"}[pattern])
        assert len(mesh.triangles) > 1.5 * len(coarse.triangles)


def test_cadquery_gives_the_same_quarter_disk():
    pytest.importorskip("cadquery", reason="no CadQuery installed")
    module = example("quarter_disk")
    one = fubini.mesh(shape("quarter_disk"), module.SIZE)
    other = fubini.mesh(module.build_cadquery(), module.SIZE)
    assert len(one.triangles) == len(other.triangles)
    assert ordered(one.points) == pytest.approx(ordered(other.points), abs=1e-12)


@pytest.mark.parametrize("name", ["free_form", "hollow_cylinder_quarter"])
def test_step_file_gives_the_same_mesh(name, tmp_path):
    path = example("example").write_step(shape(name), tmp_path / "part.step")
    one, other = (fubini.mesh(s, example(name).SIZE) for s in (shape(name), path))
    assert len(one.triangles) == len(other.triangles)
    assert ordered(one.points) == pytest.approx(ordered(other.points), abs=1e-9)


def ordered(points):
    """Points sorted by their rounded coordinates."""
    return points[np.lexsort(np.round(points, 6).T)]


def test_a_program_writes_its_step_file(tmp_path):
    command = [sys.executable, str(FOLDER / "quarter_disk.py"), str(tmp_path / "new"), "--step"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert [p.name for p in (tmp_path / "new").iterdir()] == ["quarter_disk.step"]
    assert fubini.load(tmp_path / "new" / "quarter_disk.step").faces[0].region.area == pytest.approx(math.pi / 4)


def test_a_program_meshes_and_draws(tmp_path, capsys):
    pytest.importorskip("matplotlib", reason="no matplotlib installed")
    example("example").show(shape("quarter_disk"), tmp_path / "quarter", 0.3)
    assert {p.suffix for p in tmp_path.iterdir()} == {".stl", ".png"}
    assert "certified" in capsys.readouterr().out


def test_free_form_keeps_to_its_points():
    module = example("free_form")
    (face,) = fubini.load(shape("free_form")).faces
    distance = np.min([c.closest(module.POINTS)[1] for c in face.region.curves], axis=0)
    assert distance.max() <= module.TOLERANCE
    assert distance[[0, -1]].max() < 1e-12


def test_free_form_by_lines_moved_to_the_boundary():
    module = example("free_form")
    outcome = module.mesh_by_lines()
    mesh = outcome.triangulation
    corners = mesh.points[mesh.triangles]
    assert outcome.excess == 0
    assert skewness(corners).min() > 45
    assert aspect_ratios(corners).max() < 2
    rim = mesh.boundary.points
    assert abs(module.nearest_on(module.POINTS, rim) - rim).max() < 1e-12
    # the coarse lines cut off 2.2 percent of the outline, the moved nodes less than half of that
    exact = fubini.load(shape("free_form")).faces[0].region.area
    coarse = fubini.load(module.build_lines()).faces[0].region.area
    moved = fubini.region.Region.polygon(_loop(mesh.boundary)).area
    assert abs(moved - exact) < 0.5 * abs(coarse - exact)


def _loop(boundary):
    """Boundary points in the order of the segments."""
    following = dict(boundary.segments.tolist())
    loop = [0]
    while following[loop[-1]] != 0:
        loop.append(following[loop[-1]])
    return boundary.points[loop]


def test_first_meshes_of_the_quarter_disk_are_those_of_the_paper():
    """Section 4.1: what the paper reports, measured here."""
    first_mesh = example("paper").first_mesh
    coarse = first_mesh(shape("quarter_disk"), "SP13", "y")
    assert (len(coarse.points), len(coarse.triangles), coarse.redundant, coarse.flawed) == (11, 13, 0, 1)
    assert coarse.skewness.min() == pytest.approx(37.09, abs=0.005)
    assert coarse.off_boundary == pytest.approx(np.array([[0.496, 0.75]]), abs=5e-4)
    fine = first_mesh(shape("quarter_disk"), "SP41", "y")
    assert (len(fine.points), len(fine.triangles), fine.redundant) == (37, 59, 0)
    middles = fine.points[fine.triangles].mean(axis=1)[fine.skewness <= 45]
    near_arc, near_top = np.hypot(*middles.T) > 0.9, middles[:, 1] > 0.8
    assert len(middles) > 0
    assert np.all(near_arc | near_top)


def test_first_meshes_of_the_hollow_cylinder_have_redundant_triangles_in_its_bore():
    first_mesh = example("paper").first_mesh
    for pattern, points in (("SP13", 13 + 11 - 3), ("SP41", 41 + 37 - 5)):  # R1, R2 and the slice between them
        first = first_mesh(shape("hollow_cylinder_quarter"), pattern, "x")
        assert len(first.points) == points
        assert first.redundant > 0
        assert first.flawed > 0
        # Euler: a triangulated disk of n points, b of them on its rim, has 2 n - 2 - b triangles
        sides = np.sort(first.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        rim = np.count_nonzero(np.unique(sides, axis=0, return_counts=True)[1] == 1)
        assert len(first.triangles) == 2 * points - 2 - rim
