"""The plate with a hole of ``benchmarks/fem``: rates, stress concentration, two solvers on the same files."""

from __future__ import annotations

import importlib.util
import math
import shutil
from pathlib import Path

import pytest

import fubini

pytest.importorskip("skfem")

PLACE = Path(__file__).resolve().parents[2] / "benchmarks" / "fem" / "plate.py"
ORDERS = pytest.mark.parametrize("order", [1, 2])


@pytest.fixture(scope="module")
def plate():
    spec = importlib.util.spec_from_file_location("plate", PLACE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def exported(plate, folder, order, size):
    """The mesh and what scikit-fem makes of its .msh."""
    mesh = fubini.mesh(plate.model(), size, order=order, names=plate.NAMES | {"corner": "vertex 1"})
    mesh.save(folder / "plate.msh")
    found, found_order = plate.load(folder / "plate.msh")
    assert found_order == order
    return mesh, found


@ORDERS
def test_kirsch(plate, tmp_path, order):
    found = []
    for size in (0.2, 0.1):
        mesh = exported(plate, tmp_path, order, size)[1]
        found.append((mesh.nelements**-0.5, *plate.kirsch(mesh, order)))
    (h0, l0, e0, _), (h1, l1, e1, _) = found
    assert math.log(l0 / l1) / math.log(h0 / h1) > order + 1 - 0.2
    assert math.log(e0 / e1) / math.log(h0 / h1) > order - 0.2
    concentration = plate.kirsch(exported(plate, tmp_path, order, 0.07)[1], order)[2]  # about 7,200 triangles
    assert concentration == pytest.approx(3.0, rel=0.005 if order == 2 else 0.08)


@ORDERS
def test_calculix_and_scikit_fem_agree(plate, tmp_path, order):
    if not shutil.which("ccx"):
        pytest.skip("CalculiX (ccx) is not installed")
    mesh, found = exported(plate, tmp_path, order, 0.4)
    assert plate.calculix(tmp_path, mesh) == pytest.approx(plate.tension(found, order), rel=1e-6)
