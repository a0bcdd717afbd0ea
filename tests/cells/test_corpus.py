"""Cells of every planar face of real CAD files: exact areas and moments."""

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
