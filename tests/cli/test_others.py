"""``fubini check``, ``cells`` and ``info``."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner
from matplotlib.image import imread

from fubini.cli import main
from handmade import bad_square, box, square


def run(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


def test_check(tmp_path):
    box(2).save(tmp_path / "good.stl")
    bad_square().save(tmp_path / "bad.vtu")
    good = run("check", tmp_path / "good.stl")
    assert good.exit_code == 0
    assert good.stdout.splitlines()[-1] == "valid"
    bad = run("check", tmp_path / "bad.vtu", "--json", "-")
    assert bad.exit_code == 1
    data = json.loads(bad.stdout)
    assert data["valid"] is False
    assert data["flawed"] == bad_square().certificate.flawed
    run("check", tmp_path / "bad.vtu", "--json", tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text()) == data


def test_check_with_other_bounds(tmp_path):
    square(2).save(tmp_path / "a.obj")
    assert run("check", tmp_path / "a.obj").exit_code == 0
    assert run("check", tmp_path / "a.obj", "--min-skew", 64).exit_code == 1
    assert run("check", tmp_path / "a.obj", "--max-aspect-ratio", 1.1).exit_code == 1
    assert run("check", tmp_path / "a.obj", "--min-skew", "nan").exit_code == 2


@pytest.mark.parametrize("name", ["nowhere.stl", "empty.stl", "text.vtu"])
def test_check_of_bad_files(tmp_path, name):
    if name != "nowhere.stl":
        (tmp_path / name).write_bytes(b"" if name == "empty.stl" else b"hello")
    result = run("check", tmp_path / name, "--json", "-")
    assert result.exit_code == 2
    assert name in result.stderr
    assert result.stdout == ""
    assert "Traceback" not in result.output


def test_check_does_not_overwrite_its_input(tmp_path):
    square(2).save(tmp_path / "a.obj")
    assert run("check", tmp_path / "a.obj", "--json", tmp_path / "a.obj").exit_code == 2
    assert (tmp_path / "a.obj").read_text().startswith("v ")


def test_info(cylinder_file, tmp_path):
    result = run("info", cylinder_file, "--json", "-")
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert len(data["faces"]) == 2
    assert [f["curves"] for f in data["faces"]] == [{"circle": 1}, {"circle": 1}]
    assert [f["area"] for f in data["faces"]] == pytest.approx([3.14159265358979] * 2)
    assert data["faces"][0]["corners"] == []
    assert [s["surface"] for s in data["skipped"]] == ["cylinder"]
    assert data["edges"][0]["length"] == pytest.approx(6.28318530717959)
    text = run("info", cylinder_file).stdout
    assert "2 planar faces" in text
    assert "skipped, cylinder" in text


def test_info_of_sharp_corners(wedge_file):
    data = json.loads(run("info", wedge_file, "--json", "-").stdout)
    sharp = [c for f in data["faces"] for c in f["corners"] if c["unavoidable"]]
    assert [c["angle"] for c in sharp] == pytest.approx([15.0, 15.0])
    assert "1 too sharp for a valid triangle" in run("info", wedge_file).stdout


@pytest.mark.parametrize("flags", [[], ["--direction", "y"], ["--at-vertices"], ["--faces", "1"]])
def test_cells(box_file, tmp_path, flags):
    result = run("cells", box_file, "-o", tmp_path / "a.png", *flags)
    assert result.exit_code == 0, result.output
    assert imread(tmp_path / "a.png")[..., :3].std() > 0.02
    lines = result.stdout.splitlines()
    assert len(lines) == (1 if "--faces" in flags else 6)
    assert all("error" in line for line in lines)


def test_cells_as_svg(cylinder_file, tmp_path):
    assert run("cells", cylinder_file, "-o", tmp_path / "a.svg").exit_code == 0
    assert (tmp_path / "a.svg").read_text().startswith("<?xml")
    assert run("cells", cylinder_file, "-o", tmp_path / "a.stl").exit_code == 2
    assert run("cells", cylinder_file, "-o", tmp_path / "a.png", "--direction", "z").exit_code == 2
    assert [p.name for p in tmp_path.iterdir()] == ["a.svg"]
