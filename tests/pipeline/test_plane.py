"""Regions meshed as they are: no CAD kernel, edges of neighbours shared."""

from __future__ import annotations

import itertools
import math
import subprocess
import sys

import numpy as np
import pytest

import fubini
import regions
from fubini.curves import CircularArc, Line
from fubini.errors import GeometryError, InputError, OptionError
from fubini.pipeline.plane import plane_model
from fubini.quality import areas
from fubini.region import Loop, Region


def test_a_region_is_meshed_and_its_boundary_named():
    region = regions.annulus_quarter()
    mesh = fubini.mesh(region, 0.1)
    assert mesh.certificate.certified
    assert mesh.certificate.area_error < 1e-2
    assert (mesh.points[:, 2] == 0.0).all()
    assert set(mesh.boundaries) == {"outer"}
    assert len(mesh.boundaries["outer"]) == len(mesh.segments)
    plate = fubini.mesh(regions.plate(3), 0.3, edge_segments={5: 40})
    assert set(plate.boundaries) == {"outer", "hole_1", "hole_2", "hole_3"}
    assert np.count_nonzero(plate.edge_of_segment == 5) >= 40
    assert np.count_nonzero(plate.edge_of_segment == 6) < 40


def test_edges_count_as_the_curves_of_the_region():
    region = regions.quarter_disk()
    model = fubini.load(region)
    assert [model.edges[e].kind for e in range(3)] == [c.kind for c in region.curves]
    by_edge = dict(zip(model.faces[0].region.edges, model.faces[0].region.curves, strict=True))
    for number, curve in enumerate(region.curves):
        np.testing.assert_array_equal(by_edge[number].start, curve.start)


def test_the_mesh_does_not_depend_on_where_the_loop_begins():
    region = regions.quarter_disk()
    turned = Region(region.outer.start_at(1))
    a, b = fubini.mesh(region, 0.1), fubini.mesh(turned, 0.1)
    order = [np.lexsort(m.points.T) for m in (a, b)]
    np.testing.assert_array_equal(a.points[order[0]], b.points[order[1]])


def test_regions_that_share_edges_fit_together():
    arc = CircularArc((0, 0), 1.0, 0.0, math.pi / 2)
    disk = Region(Loop.closed((Line((0, 0), (1, 0)), arc, Line((0, 1), (0, 0))), 1e-12), name="disk")
    corners = [(1, 0), (2, 0), (2, 2), (0, 2), (0, 1)]
    lines = [Line(a, b) for a, b in itertools.pairwise(corners)]
    rest = Region(Loop.closed((arc.reverse(), *lines), 1e-12), name="rest")
    mesh = fubini.mesh([disk, rest], 0.15)
    assert mesh.certificate.certified
    assert len(mesh.model.edges) == 7
    assert set(mesh.regions) == {"disk", "rest"}
    assert {"outer", "disk|rest"} == set(mesh.boundaries)
    ends = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, count = np.unique(ends, axis=0, return_counts=True)
    assert (count == 1).sum() == len(mesh.boundaries["outer"])
    area = areas(mesh.points[mesh.triangles]).sum()
    assert area == pytest.approx(4.0, abs=1e-12)  # chords on the shared arc cut nothing off


def test_senseless_regions_are_refused():
    bow_tie = Region.polygon([(0, 0), (2, 1), (2, 0), (0, 2)])
    with pytest.raises(GeometryError, match="cross"):
        fubini.mesh(bow_tie, 0.2)
    with pytest.raises(OptionError, match="imprint"):
        fubini.mesh(regions.square(), 0.2, imprint=True)
    with pytest.raises(InputError, match="empty list"):
        plane_model([])


def test_no_cad_kernel_is_imported():
    code = (
        "import sys, fubini; from fubini.region import Region;"
        "mesh = fubini.mesh(Region.polygon([(0, 0), (1, 0), (0, 1)]), 0.3);"
        "print(mesh.certificate.certified, 'OCP' in sys.modules, 'fubini.cad' in sys.modules)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    assert out.stdout.split() == ["True", "False", "False"]
