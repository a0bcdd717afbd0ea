"""``fubini mesh`` on parts that do not share edges."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("OCP")

from click.testing import CliRunner

from cad.shapes import box
from cli.conftest import _write
from fubini.cad import occ
from fubini.cli import main


def figures(path, *flags):
    result = CliRunner().invoke(main, ["mesh", str(path), "-o", str(path.with_suffix(".obj")), *flags, "--json", "-"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_imprint_and_sew(tmp_path):
    path = _write(occ.compound([box(2, 2, 1), box(1, 1, 1, at=(0.5, 0.5, 1))]), tmp_path / "two.brep")
    apart, joined = figures(path, "--size", "0.5"), figures(path, "--size", "0.5", "--imprint")
    assert len(apart["faces"]) == len(joined["faces"]) == 12
    assert any("imprinted" in note for note in joined["notes"]) and not apart["notes"]
    sewn = figures(path, "--size", "0.5", "--sew", "1e-6")
    assert any("sewn within 1e-06" in note for note in sewn["notes"])


def test_info_shows_the_faces_after_imprinting(tmp_path):
    path = _write(occ.compound([box(2, 2, 1), box(1, 1, 1, at=(0.5, 0.5, 1))]), tmp_path / "two.brep")
    loops = []
    for flags in ([], ["--imprint"]):
        result = CliRunner().invoke(main, ["info", str(path), *flags, "--json", "-"])
        assert result.exit_code == 0, result.output
        loops.append(sorted(len(face["loops"]) for face in json.loads(result.stdout)["faces"]))
    assert loops == [[1] * 12, [1] * 11 + [2]]  # the foot of the small box is cut into the large one


def test_a_tolerance_that_makes_no_sense(tmp_path):
    path = _write(box(), tmp_path / "box.brep")
    result = CliRunner().invoke(main, ["mesh", str(path), "-o", str(tmp_path / "a.obj"), "--sew", "-1"])
    assert result.exit_code == 2 and "sew is -1" in result.stderr
