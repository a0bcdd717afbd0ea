"""CAD files for the command line, made on the spot."""

from __future__ import annotations

import math
from pathlib import Path

import pytest


def _write(shape, path: Path) -> Path:
    from OCP.BRepTools import BRepTools

    write = getattr(BRepTools, "Write_s", None) or BRepTools.Write
    assert write(shape, str(path))
    return path


def _prism(corners, height):
    """A prism over a polygon in the plane z = 0."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Pnt, gp_Vec

    outline = BRepBuilderAPI_MakePolygon()
    for x, y in corners:
        outline.Add(gp_Pnt(x, y, 0.0))
    outline.Close()
    face = BRepBuilderAPI_MakeFace(outline.Wire(), True).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0.0, 0.0, height)).Shape()


@pytest.fixture(scope="session")
def box_file(tmp_path_factory) -> Path:
    """A box of 4 x 3 x 2."""
    pytest.importorskip("OCP")
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    return _write(BRepPrimAPI_MakeBox(4.0, 3.0, 2.0).Shape(), tmp_path_factory.mktemp("cad") / "box.brep")


@pytest.fixture(scope="session")
def wedge_file(tmp_path_factory) -> Path:
    """A prism with an edge of 15 degrees: two faces with a corner that is too sharp."""
    pytest.importorskip("OCP")
    h = math.tan(math.radians(7.5))
    shape = _prism([(0.0, 0.0), (1.0, -h), (1.0, h)], 0.5)
    return _write(shape, tmp_path_factory.mktemp("cad") / "wedge.brep")


@pytest.fixture(scope="session")
def sphere_file(tmp_path_factory) -> Path:
    """A solid without planar face."""
    pytest.importorskip("OCP")
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

    return _write(BRepPrimAPI_MakeSphere(1.0).Shape(), tmp_path_factory.mktemp("cad") / "sphere.brep")


@pytest.fixture(scope="session")
def cylinder_file(tmp_path_factory) -> Path:
    """A cylinder: two planar faces and one that is skipped."""
    pytest.importorskip("OCP")
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder

    return _write(BRepPrimAPI_MakeCylinder(1.0, 2.0).Shape(), tmp_path_factory.mktemp("cad") / "cylinder.brep")


@pytest.fixture(scope="session")
def plate_file(tmp_path_factory) -> Path:
    """A STEP file: plate of 6 x 4 x 1 with a hole of radius 1 through it."""
    pytest.importorskip("OCP")
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    tool = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(3, 2, -1), gp_Dir(0, 0, 1)), 1.0, 3.0).Shape()
    writer = STEPControl_Writer()
    writer.Transfer(BRepAlgoAPI_Cut(BRepPrimAPI_MakeBox(6.0, 4.0, 1.0).Shape(), tool).Shape(),
                    STEPControl_StepModelType.STEPControl_AsIs)  # fmt: skip
    path = tmp_path_factory.mktemp("cad") / "plate.step"
    writer.Write(str(path))
    return path
