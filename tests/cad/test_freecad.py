"""A document that FreeCAD itself has written, where it is installed: what is meshed, and its labels."""

from __future__ import annotations

import os
import shutil
import subprocess

import numpy as np
import pytest

import fubini
from meshes import volume

SCRIPT = """
import os, sys, traceback
code = 1
try:
    import FreeCAD as App, Part, Sketcher
    doc = App.newDocument("bracket")
    plate = doc.addObject("Part::Box", "Box")
    plate.Length, plate.Width, plate.Height = 40, 30, 5
    tool = doc.addObject("Part::Box", "Box001")
    tool.Length, tool.Width, tool.Height = 6, 8, 20
    tool.Placement.Base = App.Vector(12, 11, -5)
    cut = doc.addObject("Part::Cut", "Cut")
    cut.Base, cut.Tool, cut.Label = plate, tool, "Grundplatte Ä"
    sketch = doc.addObject("Sketcher::SketchObject", "Sketch")
    corners = [(0, 0), (20, 0), (20, 10), (8, 10), (8, 18), (0, 18)]
    for a, b in zip(corners, corners[1:] + corners[:1]):
        sketch.addGeometry(Part.LineSegment(App.Vector(*a, 0), App.Vector(*b, 0)), False)
    sketch.Placement = App.Placement(App.Vector(5, 0, 50), App.Rotation(App.Vector(1, 0, 0), 90))
    rib = doc.addObject("Part::Extrusion", "Extrude")
    rib.Base, rib.DirMode, rib.LengthFwd, rib.Solid, rib.Label = sketch, "Normal", 30, True, "rib"
    link = doc.addObject("App::Link", "Link")
    link.LinkedObject, link.Label = rib, "rib again"
    link.Placement = App.Placement(App.Vector(100, 0, 0), App.Rotation())
    mirror = doc.addObject("Part::Mirroring", "Mirror")
    mirror.Source, mirror.Normal, mirror.Label = link, App.Vector(1, 0, 0), "mirrored"
    doc.recompute()
    doc.saveAs(os.environ["FUBINI_OUT"] + "/text.FCStd")
    App.ParamGet("User parameter:BaseApp/Preferences/Document").SetBool("SaveBinaryBrep", True)
    doc.saveAs(os.environ["FUBINI_OUT"] + "/binary.FCStd")
    cut.Shape.exportBinary(os.environ["FUBINI_OUT"] + "/cut.brep")
    code = 0
except BaseException:
    traceback.print_exc()
sys.stdout.flush()
os._exit(code)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with the documents."""
    program = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
    if program is None:
        pytest.skip("FreeCAD is not installed")
    place = tmp_path_factory.mktemp("freecad")
    (place / "make.py").write_text(SCRIPT)
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "QT_"))}
    done = subprocess.run(
        [program, place / "make.py"], capture_output=True, text=True, timeout=120, check=False,
        env=clean | {"FUBINI_OUT": str(place), "FREECAD_USER_HOME": str(place)},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return place


@pytest.mark.parametrize("file", ["text.FCStd", "binary.FCStd"])
def test_labels_arrive(folder, file):
    mesh = fubini.mesh(folder / file, 4.0)
    assert mesh.certificate.certified and not mesh.certificate.skipped_faces
    assert list(mesh.regions) == ["Grundplatte Ä", "rib", "mirrored"]
    sizes = {"Grundplatte Ä": 5 * (40 * 30 - 6 * 8), "rib": 30 * 264.0, "mirrored": 30 * 264.0}
    p, q, r = (mesh.points[mesh.triangles[:, k]] for k in range(3))
    enclosed = np.einsum("ij,ij->i", p, np.cross(q, r)) / 6
    for name, size in sizes.items():
        assert enclosed[mesh.regions[name]].sum() == pytest.approx(size, rel=1e-12)
    assert mesh.points[mesh.triangles[mesh.regions["mirrored"]]][..., 0].max() == pytest.approx(-105)


def test_a_binary_shape(folder):
    mesh = fubini.mesh(folder / "cut.brep", 4.0)
    assert mesh.certificate.certified and volume(mesh) == pytest.approx(5 * (40 * 30 - 6 * 8), rel=1e-12)
