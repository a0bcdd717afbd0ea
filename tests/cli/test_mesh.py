"""``fubini mesh``: outputs, exit codes, all or nothing."""

from __future__ import annotations

import json

import meshio
import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

import fubini
from fubini.cli import main
from fubini.export import WRITERS
from fubini.pipeline import attempts as meshing


def run(*arguments):
    """Run the command line in this process; the result keeps stdout and stderr apart."""
    return CliRunner().invoke(main, [str(a) for a in arguments])


def test_certified_mesh_in_all_formats(box_file, tmp_path):
    outputs = [tmp_path / f"a{suffix}" for suffix in WRITERS if suffix != ".su2"]
    flags = [part for path in outputs for part in ("-o", path)]
    result = run("mesh", box_file, *flags, "--size", 0.7, "--json", tmp_path / "a.json", "--plot", tmp_path / "a.png")
    assert result.exit_code == 0, result.output
    assert {p.name for p in tmp_path.iterdir()} == {p.name for p in outputs} | {"a.json", "a.png"}
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["certified"] is True
    assert data["flawed"] == 0
    assert [f["face"] for f in data["faces"]] == list(range(6))
    assert {"load", "write"} <= set(data["seconds"])
    solid = trimesh.load(tmp_path / "a.obj", process=False)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(24.0)
    assert len(solid.faces) == data["triangles"]
    assert np.unique(meshio.read(tmp_path / "a.vtu").cell_data["face"][0]).tolist() == list(range(6))
    assert "certified" in result.stdout.splitlines()[0]


def test_json_alone_on_stdout(box_file, tmp_path):
    result = run("mesh", box_file, "-o", tmp_path / "a.stl", "--size", 1, "--json", "-")
    assert result.exit_code == 0
    assert json.loads(result.stdout)["certified"] is True


def test_quiet(box_file, tmp_path):
    result = run("mesh", box_file, "-o", tmp_path / "a.stl", "--size", 1, "-q")
    assert (result.exit_code, result.output) == (0, "")


def test_unavoidable_corners_are_certified(wedge_file, tmp_path):
    result = run("mesh", wedge_file, "-o", tmp_path / "a.vtu", "--size", 0.1, "--json", "-")
    data = json.loads(result.stdout)
    assert result.exit_code == 0, data
    assert data["unavoidable"] == 2
    corners = [c for f in data["faces"] for c in f["corners"]]
    assert [c["angle"] for c in corners] == pytest.approx([15.0, 15.0])
    assert sorted(c["point"][2] for c in corners) == pytest.approx([0.0, 0.5], abs=1e-12)
    # every flawed triangle touches a sharp corner
    found = meshio.read(tmp_path / "a.vtu")
    p = found.points[found.cells[0].data]
    from fubini.quality import flawed

    bad = p[flawed(p)]
    assert len(bad) == data["flawed"] <= 2
    assert (np.abs(bad[:, :, :2]).sum(2).min(1) < 1e-12).all()


def test_not_certified_is_written_and_exits_1(box_file, tmp_path, monkeypatch):
    """A mesh with a spoiled node: written, told, exit 1."""
    import dataclasses

    real = fubini.mesh

    def spoiled(*args, **kwargs):
        mesh = real(*args, **kwargs)
        face = dataclasses.replace(mesh.certificate.faces[0], reasons=("3 flawed triangles",), flawed=3, excess=3)
        faces = (face, *mesh.certificate.faces[1:])
        return dataclasses.replace(mesh, certificate=dataclasses.replace(mesh.certificate, faces=faces))

    monkeypatch.setattr(fubini, "mesh", spoiled, raising=False)
    result = run("mesh", box_file, "-o", tmp_path / "a.stl", "--size", 1)
    assert result.exit_code == 1
    assert (tmp_path / "a.stl").exists()
    assert "face 0: 3 flawed triangles" in result.stdout


def test_a_bound_that_is_not_reached_is_told_with_place_and_figures(wedge_file, tmp_path, monkeypatch):
    """Bounds that the optimiser has no moves to reach: the mesh is written, what is missed is said everywhere."""
    monkeypatch.setattr(meshing, "MOVES", 0)
    monkeypatch.setattr(meshing, "MOVES_EACH", 0)
    flags = ("--size", 0.2, "--min-skew", 60, "--json", tmp_path / "a.json", "--plot", tmp_path / "a.png")
    result = run("mesh", wedge_file, "-o", tmp_path / "a.obj", *flags)
    assert result.exit_code == 1
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["certified"] is False and data["min_skew"] == 60
    missed = [face for face in data["faces"] if not face["certified"]]
    assert missed and (tmp_path / "a.obj").exists() and (tmp_path / "a.png").exists()
    for face in missed:
        assert face["budget_exhausted"] and face["excess"] > 0
        assert f"face {face['face']}: {face['excess']} flawed triangle" in result.stdout
        assert "(not above 60)" in face["reasons"][0] and "budget" in face["reasons"][0]
    assert run("check", tmp_path / "a.obj", "--min-skew", 60).exit_code == 1


def test_only_some_faces(box_file, tmp_path):
    result = run("mesh", box_file, "-o", tmp_path / "a.vtu", "--size", 1, "--faces", "0,2-3", "--json", "-")
    assert result.exit_code == 0
    data = json.loads(result.stdout)
    assert [f["face"] for f in data["faces"]] == [0, 2, 3]
    assert data["skipped_faces"] == 3
    assert np.unique(meshio.read(tmp_path / "a.vtu").cell_data["face"][0]).tolist() == [0, 2, 3]


def test_same_bytes_twice(cylinder_file, tmp_path):
    for name in ("a", "b"):
        flags = [part for suffix in WRITERS if suffix != ".su2" for part in ("-o", tmp_path / f"{name}{suffix}")]
        assert run("mesh", cylinder_file, *flags, "--size", 0.4, "--plot", tmp_path / f"{name}.png").exit_code == 0
    for suffix in (*WRITERS.keys() - {".su2"}, ".png"):
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes(), suffix


BAD_OPTIONS = [
    (["--size", "nan"], "size"),
    (["--size", "0"], "size"),
    (["--size", "-1"], "size"),
    (["--size", "inf"], "size"),
    (["--size", "abc"], "not a valid float"),
    (["--size", "1e-6"], "50,000,000"),
    (["--min-skew", "nan"], "min_skew"),
    (["--min-skew", "95"], "min_skew"),
    (["--max-aspect-ratio", "0.5"], "max_aspect_ratio"),
    (["--pattern", "SP99"], "SP13"),
    (["--faces", "0,x"], "face indices"),
    (["--faces", "-1"], "face indices"),
    (["--faces", "99"], "face 99"),
    (["--select", "nobody"], "nobody"),
    (["--select", "a", "--faces", "1"], "exclude"),
    (["--json", "{tmp}/missing/a.json"], "folder does not exist"),
    (["--plot", "{tmp}/a.jpeg"], ".png"),
    (["-o", "{tmp}/a.xyz"], ".vtu"),
    (["-o", "{tmp}/missing/a.stl"], "missing"),
    (["-o", "{tmp}/b.stl"], "another output"),
    (["--json", "{input}"], "the input"),
]


@pytest.mark.parametrize(("flags", "words"), BAD_OPTIONS)
def test_bad_options_exit_2_and_write_nothing(box_file, tmp_path, flags, words):
    flags = [f.format(tmp=tmp_path, input=box_file) for f in flags]
    before = box_file.read_bytes()
    result = run("mesh", box_file, "-o", tmp_path / "b.stl", *flags)
    assert result.exit_code == 2, result.output
    assert words in result.stderr
    assert "Traceback" not in result.output
    assert result.stdout == ""
    assert not list(tmp_path.iterdir())
    assert box_file.read_bytes() == before


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty.step", b""),
        ("text.step", b"This is no STEP file.\n"),
        ("cut.step", b"ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n"),
        ("text.brep", b"hello"),
        ("what.xyz", b"hello"),
    ],
)
def test_bad_files_exit_2_and_are_named(tmp_path, name, content):
    pytest.importorskip("OCP")
    (tmp_path / name).write_bytes(content)
    result = run("mesh", tmp_path / name, "-o", tmp_path / "a.stl")
    assert result.exit_code == 2, result.output
    assert name in result.stderr
    assert "Traceback" not in result.output
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_missing_file_and_no_planar_face(sphere_file, tmp_path):
    result = run("mesh", tmp_path / "nowhere.step", "-o", tmp_path / "a.stl")
    assert result.exit_code == 2
    assert "nowhere.step" in result.stderr
    result = run("mesh", sphere_file, "-o", tmp_path / "a.stl")
    assert result.exit_code == 2
    assert "sphere.brep" in result.stderr
    assert "planar" in result.stderr
    assert not list(tmp_path.iterdir())


def test_no_output_is_bad_usage(box_file):
    result = run("mesh", box_file)
    assert result.exit_code == 2
    assert "-o" in result.stderr


@pytest.mark.parametrize("broken", [OSError(28, "No space left on device"), RuntimeError("bug")])
def test_a_failing_second_output_removes_the_first(box_file, tmp_path, monkeypatch, broken):
    def fail(mesh, path):
        path.write_bytes(b"half")
        raise broken

    monkeypatch.setitem(WRITERS, ".ply", fail)
    out = ["-o", tmp_path / "a.stl", "-o", tmp_path / "b.ply", "--json", tmp_path / "c.json"]
    result = run("mesh", box_file, "--size", 1, *out)
    assert result.exit_code == (2 if isinstance(broken, OSError) else 3)
    assert not list(tmp_path.iterdir())
    assert ("b.ply" if isinstance(broken, OSError) else "please report") in result.stderr


def test_interruption(box_file, tmp_path, monkeypatch):
    def interrupt(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(fubini, "mesh", interrupt, raising=False)
    result = run("mesh", box_file, "-o", tmp_path / "a.stl")
    assert result.exit_code == 130
    assert not list(tmp_path.iterdir())


def test_debug_shows_the_traceback(box_file, tmp_path, monkeypatch):
    def fail(*args, **kwargs):
        raise RuntimeError("a bug")

    monkeypatch.setattr(fubini, "mesh", fail, raising=False)
    plain = run("mesh", box_file, "-o", tmp_path / "a.stl")
    assert (plain.exit_code, "Traceback" in plain.stderr) == (3, False)
    assert "RuntimeError: a bug" in plain.stderr
    monkeypatch.setenv("FUBINI_DEBUG", "1")
    assert "Traceback" in run("mesh", box_file, "-o", tmp_path / "a.stl").stderr


def test_rounding_is_warned_of(tmp_path):
    pytest.importorskip("OCP")
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.BRepTools import BRepTools
    from OCP.gp import gp_Pnt

    far = BRepPrimAPI_MakeBox(gp_Pnt(4e6, 4e6, 4e6), 1.0, 1.0, 1.0).Shape()
    (getattr(BRepTools, "Write_s", None) or BRepTools.Write)(far, str(tmp_path / "far.brep"))
    result = run("mesh", tmp_path / "far.brep", "-o", tmp_path / "a.stl", "--size", 0.1)
    assert result.exit_code == 0, result.output
    assert "single precision" in result.stderr
    result = run("mesh", tmp_path / "far.brep", "-o", tmp_path / "a.obj", "--size", 0.1)
    assert result.stderr == ""


def test_names_and_second_order(box_file, tmp_path):
    result = run("mesh", box_file, "-o", tmp_path / "a.msh", "--size", 1, "--order", 2,
                 "--name", "lid=face 1", "--name", "rim = edges 0,2-3", "--json", "-")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["min_scaled_jacobian"] == 1.0
    found = meshio.read(tmp_path / "a.msh")
    assert {"lid", "rim"} <= set(found.field_data)
    assert "triangle6" in found.cells_dict


@pytest.mark.parametrize("text", ["lid", "=face 1"])
def test_senseless_names_are_refused(box_file, tmp_path, text):
    result = run("mesh", box_file, "-o", tmp_path / "a.msh", "--name", text)
    assert result.exit_code == 2
    assert "NAME=WHAT" in result.stderr
    assert not list(tmp_path.iterdir())


def test_cracks_and_points(box_file, tmp_path):
    out = tmp_path / "a.msh"
    flags = ["--crack", "edges 0", "--name", "cut=edge 0", "--point", "g=1,1,0"]
    result = run("mesh", box_file, "-o", out, "--size", 0.7, *flags)
    assert result.exit_code == 0, result.output
    assert {"cut+", "cut-", "g"} < set(meshio.read(out).field_data)
    assert run("mesh", box_file, "-o", out, "--point", "g=1").exit_code == 2
    assert "no planar face" in run("mesh", box_file, "-o", out, "--point", "g=9,9,9").output
