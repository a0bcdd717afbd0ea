"""A folded plate as shells in CalculiX: one mesh through the fold, forces in balance."""

from __future__ import annotations

import re
import shutil
import subprocess

import numpy as np
import pytest

import fubini

bd = pytest.importorskip("build123d")

DECK = """*INCLUDE, INPUT=mesh.inp
*MATERIAL, NAME=M
*ELASTIC
210000., 0.3
*SHELL SECTION, ELSET=EALL, MATERIAL=M
0.1
*BOUNDARY
foot, 1, 6
*STEP
*STATIC
*DSLOAD
tip, P, -5.
*NODE PRINT, NSET=foot, TOTALS=ONLY
RF
*NODE PRINT, NSET=tip
U
*END STEP
"""


def folded(order):
    """The top (4 x 2) and one end (2 x 1) of a box, joined at right angles."""
    box = bd.Box(4, 2, 1)
    model = fubini.load(box)
    picked = [f.index for f in model.faces if f.frame.normal[2] > 0.9 or f.frame.normal[0] < -0.9]
    names = {
        "deck": box.faces().sort_by(bd.Axis.Z)[-1],
        "leg": box.faces().sort_by(bd.Axis.X)[0],
        "foot": lambda x, y, z: z < -0.499,
        "tip": lambda x, y, z: x > 1.999,
    }
    return fubini.mesh(box, 0.4, faces=picked, names=names, order=order)


@pytest.mark.parametrize("order", [1, 2])
def test_forces_balance_through_the_fold(tmp_path, order):
    mesh = folded(order)
    assert mesh.certificate.certified
    assert list(mesh.regions) == ["deck", "leg"]
    assert {"foot", "tip", "deck|leg", "outer"} == set(mesh.boundaries)
    mesh.save(tmp_path / "mesh.inp")
    assert f"TYPE=S{3 * order}" in (tmp_path / "mesh.inp").read_text()
    if not shutil.which("ccx"):
        pytest.skip("CalculiX (ccx) is not installed")
    (tmp_path / "frame.inp").write_text(DECK)
    subprocess.run(["ccx", "frame"], cwd=tmp_path, check=True, capture_output=True, timeout=100)
    result = (tmp_path / "frame.dat").read_text()
    force = np.array(re.search(r"total force.*\n\n\s*(\S+)\s+(\S+)\s+(\S+)", result).groups(), float)
    # 5 MPa on an edge 2 long and 0.1 thick pulls along x
    np.testing.assert_allclose(force, [-1.0, 0.0, 0.0], atol=1e-4)
