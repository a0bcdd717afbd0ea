"""Reference sets turned, and laid into cells of either direction: denser where it was asked, certified."""

from __future__ import annotations

import math

import numpy as np
import pytest
from click.testing import CliRunner

import fubini
import regions
from fubini.cells import decompose
from fubini.cli import main
from fubini.errors import OptionError
from fubini.sampling.reference import reference_points

#: Direction in the plane of the dense side, by degrees of turning.
SIDES = {0: (0, 1), 90: (-1, 0), 180: (0, -1), 270: (1, 0)}


@pytest.mark.parametrize("degrees", SIDES)
@pytest.mark.parametrize("pattern", ["ASP20", "ASP48"])
@pytest.mark.parametrize("direction", ["x", "y", "auto"])
def test_the_dense_side_lies_where_it_is_turned_to(degrees, pattern, direction):
    mesh = fubini.mesh(regions.square(), pattern=pattern, pattern_direction=direction, pattern_turn=degrees)
    assert mesh.certificate.certified
    toward = np.array(SIDES[degrees])
    height = (mesh.points[:, :2] - 0.5) @ toward
    assert (height > 1e-9).sum() > 1.4 * (height < -1e-9).sum()
    plain = fubini.mesh(regions.square(), pattern=pattern, pattern_direction=direction)
    assert abs(len(plain.triangles) - len(mesh.triangles)) <= 0.25 * len(plain.triangles)


@pytest.mark.parametrize("make", [regions.quarter_disk, regions.annulus_quarter, regions.blob])
@pytest.mark.parametrize("degrees", SIDES)
@pytest.mark.parametrize("direction", ["x", "y"])
def test_curved_faces_are_certified(make, degrees, direction):
    region = make()
    mesh = fubini.mesh(region, pattern="ASP20", pattern_direction=direction, pattern_turn=degrees)
    assert mesh.certificate.certified
    cells = len(decompose(region, direction, at_vertices=True))
    assert len(mesh.points) > 8 * cells > 0


def test_uniform_sets_look_the_same_turned_by_half():
    a, b = (fubini.mesh(regions.square(), pattern="SP41", pattern_turn=degrees) for degrees in (0, 180))
    for mesh in (a, b):
        assert len(mesh.points) == len(reference_points("SP41"))
    order = [np.lexsort(np.round(m.points, 9).T) for m in (a, b)]
    np.testing.assert_allclose(a.points[order[0]], b.points[order[1]], atol=1e-12)


@pytest.mark.parametrize("options", [{"pattern_direction": "z"}, {"pattern_turn": 45}, {"pattern_turn": math.nan}])
def test_senseless_turns_are_refused(options):
    with pytest.raises(OptionError, match="use"):
        fubini.mesh(regions.square(), pattern="ASP20", **options)


def test_the_command_line_turns_too(tmp_path):
    path = tmp_path / "square.svg"
    path.write_text('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 4 4"><rect width="4" height="4"/></svg>')
    pytest.importorskip("OCP")
    found = {}
    for degrees in ("0", "180"):
        out = tmp_path / f"{degrees}.npz"
        flags = ["--pattern", "ASP20", "--pattern-direction", "x", "--pattern-turn", degrees]
        result = CliRunner().invoke(main, ["mesh", str(path), "-o", str(out), "-q", *flags])
        assert result.exit_code == 0, result.output
        y = np.load(out)["points"][:, 1]
        found[degrees] = np.sign(y.mean() - 0.5 * (y.min() + y.max()))
    assert found == {"0": 1.0, "180": -1.0}
