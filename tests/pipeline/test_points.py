"""Points inside faces become nodes, exactly there, and named points of the mesh."""

from __future__ import annotations

import meshio
import numpy as np
import pytest

import fubini
from fubini.errors import OptionError
from fubini.pipeline.points import with_points
from materials import TILTED, two_materials
from meshes import apart, area

POINTS = {"p": (0.31, 0.47, 0), "q": (0.33, 0.45), "near": (1.1, 0.02, 0), "v": (2, 1, 0)}


@pytest.mark.parametrize("size", [0.08, 0.3, 9.0])
@pytest.mark.parametrize("order", [1, 2])
def test_points_are_nodes(size, order):
    mesh = fubini.mesh(two_materials(), size, points=POINTS, order=order)
    assert mesh.certificate.certified
    assert area(mesh, mesh.regions["face_0"]) == pytest.approx(1.0, rel=1e-13)
    for name, place in POINTS.items():
        (node,) = mesh.named_points[name]
        np.testing.assert_array_equal(mesh.points[node], [*place, 0][:3])
        assert (mesh.triangles == node).any()
    assert apart(mesh) > 0.003


def test_many_points_at_random():
    places = np.random.default_rng(5).uniform(0.02, 0.98, (25, 2))
    mesh = fubini.mesh(two_materials(), 0.2, points={f"p{i}": p for i, p in enumerate(places)})
    assert mesh.certificate.certified
    found = mesh.points[[int(mesh.named_points[f"p{i}"][0]) for i in range(25)]]
    np.testing.assert_array_equal(found[:, :2], places)


def test_points_hold_in_a_face_with_a_core():
    """A fine mesh whose middle would be taken from the lattice as it is."""
    mesh = fubini.mesh(two_materials(), 0.015, faces=[0], points={"p": (0.5003, 0.5001, 0)})
    assert mesh.certificate.certified and len(mesh.triangles) > 8000
    np.testing.assert_array_equal(mesh.points[mesh.named_points["p"][0]], [0.5003, 0.5001, 0])


def test_points_in_space_and_on_shared_vertices(tmp_path):
    place = TILTED.to_space([0.4, 0.6])[0]
    mesh = fubini.mesh(two_materials(TILTED), 0.3, points={"gauge": place, "joint": TILTED.to_space([1, 0])[0]})
    np.testing.assert_allclose(mesh.points[mesh.named_points["gauge"][0]], place, atol=1e-15)
    mesh.save(tmp_path / "a.msh")
    found = meshio.read(tmp_path / "a.msh")
    assert len(found.cells_dict["vertex"]) == 2 and {"gauge", "joint"} < set(found.field_data)
    mesh.save(tmp_path / "a.inp")
    assert f"*NSET, NSET=gauge\n{mesh.named_points['gauge'][0] + 1},\n" in (tmp_path / "a.inp").read_text()


@pytest.mark.parametrize(
    ("place", "what"),
    [((5, 5, 0), "no planar face"), ((0.5, 0.5, 1), "no planar face"), ((0.5, 0, 0), "edge 0.*on an edge"),
     ((1.5, 0.5, 0), "no planar face"), ((1, np.nan, 0), "x, y, z"), ((1, 2, 3, 4), "x, y, z")],
)  # fmt: skip
def test_places_that_will_not_do(place, what):
    with pytest.raises(OptionError, match=f"(?s){what}"):
        fubini.mesh(two_materials(), 0.3, points={"p": place})


def test_the_papers_sets_follow_no_points():
    with pytest.raises(OptionError, match="pattern auto"):
        fubini.mesh(two_materials(), pattern="SP13", points={"p": (0.3, 0.4, 0)})
    model, _ = with_points(two_materials(), {"p": (0.3, 0.4, 0)})
    mesh = fubini.mesh(model, pattern="SP13")
    assert any("0 edges and 1 points inside faces are not followed" in note for note in mesh.certificate.notes)


def test_vertices_that_the_kernel_puts_into_a_face():
    pytest.importorskip("OCP")
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.gp import gp_Pnt

    from cad.shapes import face_of, line, polygon_wire

    plate = face_of(polygon_wire([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]))
    inside, on_edge, on_slit = (
        BRepBuilderAPI_MakeVertex(gp_Pnt(*p)).Vertex() for p in ((0.7, 0.4, 0), (0.3, 0, 0), (1.2, 1, 0))
    )
    slit = line((0.5, 1, 0), (1.5, 1, 0))
    names = {"inside": inside, "on edge": on_edge, "on slit": on_slit, "slit": slit}
    mesh = fubini.mesh([plate, slit, inside, on_edge, on_slit], 0.3, imprint=True, names=names)
    assert mesh.certificate.certified and len(mesh.model.faces[0].points) == 1
    places = {name: mesh.points[rows].tolist() for name, rows in mesh.named_points.items()}
    assert places == {"inside": [[0.7, 0.4, 0]], "on edge": [[0.3, 0, 0]], "on slit": [[1.2, 1, 0]]}
    assert len(np.unique(mesh.edge_of_segment[mesh.boundaries["slit"]])) == 2
