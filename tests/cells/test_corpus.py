"""Cells of every planar face of real CAD files: exact areas and moments."""

import numpy as np
import pytest

pytest.importorskip("OCP")

from fubini.cad import load
from fubini.cells import check_cells, decompose
from fubini.errors import GeometryError

#: Outlines that cross or touch themselves, as the file's own description says.
FAULTY = ("fingerprint", "touching-holes5")


def test_cells_of_every_face(corpus):
    faces = 0
    for path in sorted(p for p in corpus.rglob("*") if p.suffix.lower() in {".step", ".stp", ".brep"}):
        if any(name in path.name for name in FAULTY):
            with pytest.raises(GeometryError, match=r"touch|cross"):
                load(path)
            continue
        seen = set()
        for face in load(path).faces:
            region = face.region
            shape = (len(region.curves), round(region.area, 9), round(region.perimeter, 9))
            if shape in seen:  # parts are full of equal faces
                continue
            seen.add(shape)
            figures = check_cells(region, decompose(region))
            assert figures.area_error <= 1e-12, (path.name, face.index, figures)
            assert max(figures.centroid_error, figures.moment_error) <= 1e-9, (path.name, face.index, figures)
            faces += 1
    assert faces > 100


def kernel_moments(shape, frame):
    """Area, centroid (3,) and second moments (3,) in the plane of a face, as the CAD kernel has them."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    from fubini.cad import occ

    figures = GProp_GProps()
    occ.static(BRepGProp, "SurfaceProperties")(occ.as_face(shape), figures, 1e-12)
    center, inertia = figures.CentreOfMass(), figures.MatrixOfInertia()
    matrix = np.array([[inertia.Value(i, j) for j in (1, 2, 3)] for i in (1, 2, 3)])
    spread = np.trace(matrix) / 2 * np.eye(3) - matrix  # int d d^T of int (|d|^2 I - d d^T)
    axes = np.stack([frame.x_axis, frame.y_axis])
    (xx, xy), (_, yy) = axes @ spread @ axes.T * np.sign(figures.Mass())
    return abs(figures.Mass()), np.array([center.X(), center.Y(), center.Z()]), np.array([xx, xy, yy])


@pytest.mark.parametrize("name", ["CBeamGantryPlateXLarge.brep", "2-3-4-6-10-23.step", "1001.dxf.brep", "hilbert.brep"])
def test_moments_agree_with_the_cad_kernel(corpus, name):
    """Faces of lines and circles only: the kernel's quadrature of moments is not adaptive on other edges."""
    from fubini.cad import occ

    compared = 0
    for path in corpus.rglob("*" + name):
        model = load(path)
        shapes = occ.ShapeMap(model.native, occ.FACE)
        for face in model.faces:
            region = face.region
            if {c.kind for c in region.curves} <= {"line", "circle"}:
                area, centroid, second = kernel_moments(shapes[face.index], face.frame)
                assert area == pytest.approx(region.area, rel=1e-9)
                away = face.frame.to_space([region.centroid])[0] - centroid
                assert np.linalg.norm(away) <= 1e-9 * region.diagonal
                polar = second[0] + second[2]
                assert np.abs(second - region.second_moments).max() <= 1e-9 * polar
                compared += 1
    assert compared
