"""Our triangles on CAD shapes, seen through the exporters of the front ends and of the kernel."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.GC import GC_MakeArcOfCircle
from OCP.Geom import Geom_BezierCurve, Geom_Ellipse
from OCP.gp import gp_Ax2, gp_Pnt, gp_Vec
from OCP.StlAPI import StlAPI_Writer
from OCP.TopLoc import TopLoc_Location
from scipy.spatial import cKDTree

import fubini
from cad import shapes as S
from cad.hand_mesh import hand_mesh
from fubini.cad import attach, load, occ


def assert_ours(mesh, found) -> None:
    """Every triangle of ours is found in the exported mesh, facing the same way, and the whole is closed."""
    ours = mesh.points[mesh.triangles]
    distance, index = cKDTree(found.triangles.mean(axis=1)).query(ours.mean(axis=1))
    assert distance.max() < 1e-5
    normals = np.cross(ours[:, 1] - ours[:, 0], ours[:, 2] - ours[:, 0])
    assert (np.einsum("ij,ij->i", normals, found.face_normals[index]) > 0).all()
    planar = len(mesh.triangles)
    assert len(found.faces) >= planar and found.is_watertight and found.volume > 0


def triangles_on(shape) -> list[int]:
    counts = []
    for face in S.sub(shape, occ.FACE):
        found = occ.static(BRep_Tool, "Triangulation")(occ.as_face(face), TopLoc_Location())
        counts.append(0 if found is None else found.NbTriangles())
    return counts


@pytest.mark.parametrize("place", [S.turned(0), S.turned(shift=(1, 2, 3))], ids=["as built", "placed"])
def test_the_kernel_keeps_our_triangles_and_meshes_the_rest_to_fit(place, tmp_path):
    shape = S.plate().Moved(place)
    mesh = hand_mesh(load(shape))
    assert attach(mesh) is mesh.model.native
    counts = np.bincount(mesh.face_of_triangle, minlength=7)
    assert triangles_on(shape) == counts.tolist()
    BRepMesh_IncrementalMesh(shape, 0.01, False, 0.1, False)
    after = triangles_on(shape)
    assert [a for a, c in zip(after, counts, strict=True) if c] == [c for c in counts if c]
    assert sum(after) > counts.sum()
    StlAPI_Writer().Write(shape, str(tmp_path / "out.stl"))
    assert_ours(mesh, trimesh.load(tmp_path / "out.stl"))


def test_a_part_mirrored_by_its_placement_fits_the_kernels_own_triangles(tmp_path):
    """The kernel writes such a part inside out as a whole; ours run the same way round as the wall of the hole."""
    shape = S.plate().Moved(S.mirrored(), False)
    mesh = hand_mesh(load(shape))
    attach(mesh)
    BRepMesh_IncrementalMesh(shape, 0.01, False, 0.1, False)
    StlAPI_Writer().Write(shape, str(tmp_path / "out.stl"))
    found = trimesh.load(tmp_path / "out.stl")
    assert found.is_watertight and found.is_winding_consistent
    assert len(found.faces) > len(mesh.triangles) and abs(found.volume) == pytest.approx(24 - np.pi, rel=0.01)


def test_parts_placed_several_times_share_the_first_mesh(tmp_path):
    part = S.plate()
    shape = occ.compound([part, part.Moved(S.turned(shift=(20, 0, 0)))])
    mesh = hand_mesh(load(shape))
    attach(mesh)
    BRepMesh_IncrementalMesh(shape, 0.01, False, 0.1, False)
    StlAPI_Writer().Write(shape, str(tmp_path / "out.stl"))
    found = trimesh.load(tmp_path / "out.stl")
    assert found.is_watertight and len(found.faces) >= len(mesh.triangles)


def prism(curve):
    """A sketch of a curve and the line back to its start, extruded: both ends are one face, placed twice."""
    a, b = (curve.Value(t) for t in (curve.FirstParameter(), curve.LastParameter()))
    wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(curve).Edge())
    if a.Distance(b) > 1e-9:
        wire.Add(BRepBuilderAPI_MakeEdge(b, a).Edge())
    face = BRepBuilderAPI_MakeFace(wire.Wire()).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, 0, 10)).Shape()


@pytest.mark.parametrize("tessellated", [False, True])
@pytest.mark.parametrize(
    "place",
    [S.turned(0), S.turned(40, shift=(1, 2, 3)), S.mirrored()],
    ids=["as built", "placed", "mirrored"],
)
@pytest.mark.parametrize(
    "make",
    [
        lambda: GC_MakeArcOfCircle(gp_Pnt(20, 0, 0), gp_Pnt(10, 12, 0), gp_Pnt(0, 0, 0)).Value(),
        lambda: Geom_Ellipse(gp_Ax2(), 20.0, 7.0),
        lambda: Geom_BezierCurve(S.points_array([(0, 0, 0), (30, -5, 0), (25, 20, 0), (-10, 15, 0), (0, 9, 0)])),
    ],
    ids=["arc", "ellipse", "bezier"],
)
def test_both_ends_of_an_extruded_sketch_fit_the_curved_faces_between(make, place, tessellated, tmp_path):
    """The kernel laid out anew the edges of the end that it takes for a copy, and the file had gaps there."""
    shape = prism(make()).Moved(place, False)
    if tessellated:
        BRepMesh_IncrementalMesh(shape, 0.1, False, 0.3, False)
    mesh = fubini.mesh(load(shape), 4.0)
    mesh.attach()
    BRepMesh_IncrementalMesh(shape, 0.01, False, 0.1, False)
    StlAPI_Writer().Write(shape, str(tmp_path / "out.stl"))
    found = trimesh.load(tmp_path / "out.stl")
    assert found.is_watertight and found.is_winding_consistent
    assert len(found.faces) > len(mesh.triangles)
    ours = np.bincount(mesh.face_of_triangle)[-2]  # the ends come last, and share the triangles of the first
    assert triangles_on(shape)[-2:] == [ours, ours]


def test_edges_of_every_kind_fit_the_curved_faces_beside_them(corpus, tmp_path):
    for name in ("gen-bd_warehouse/HexNut_M10-1.5.brep", "trimesh/models/featuretype.STEP"):
        mesh = hand_mesh(load(corpus / name), 16)
        shape = attach(mesh)
        BRepMesh_IncrementalMesh(shape, 0.05, False, 0.2, False)
        counts = np.bincount(mesh.face_of_triangle, minlength=len(triangles_on(shape)))
        for found, ours in zip(triangles_on(shape), counts, strict=True):
            assert found == ours if ours else found > 0
        StlAPI_Writer().Write(shape, str(tmp_path / "out.stl"))
        assert trimesh.load(tmp_path / "out.stl").is_watertight


def test_build123d_exports_our_triangles(tmp_path):
    b = pytest.importorskip("build123d", exc_type=ImportError)
    part = b.Pos(1, 2, 3) * (b.Rot(20, 30, 40) * (b.Box(3, 2, 1) - b.Cylinder(0.4, 2)))
    mesh = hand_mesh(load(part))
    attach(mesh)
    b.export_stl(part, tmp_path / "out.stl", tolerance=0.01, angular_tolerance=0.1)
    assert_ours(mesh, trimesh.load(tmp_path / "out.stl"))
    counts = np.bincount(mesh.face_of_triangle, minlength=7)
    assert all(len(f.tessellate(0.01)[1]) == c for f, c in zip(part.faces(), counts, strict=False) if c)
    assert len(part.tessellate(0.01, 0.1)[1]) == len(trimesh.load(tmp_path / "out.stl").faces)
    b.export_gltf(part, tmp_path / "out.glb", binary=True, linear_deflection=0.01, angular_deflection=0.1)
    assert len(trimesh.load(tmp_path / "out.glb", force="mesh").faces) == len(trimesh.load(tmp_path / "out.stl").faces)


def test_cadquery_exports_our_triangles(tmp_path):
    cq = pytest.importorskip("cadquery", exc_type=ImportError)
    plane = cq.Plane((1, 2, 3), (1, 1, 0), (1, -1, 2))
    work = cq.Workplane(plane).box(3, 2, 1).faces(">Z").workplane().hole(0.6)
    mesh = hand_mesh(load(work))
    attach(mesh)
    cq.exporters.export(work, str(tmp_path / "out.stl"), tolerance=0.01)
    found = trimesh.load(tmp_path / "out.stl")
    assert_ours(mesh, found)
    assert len(work.val().tessellate(0.01)[1]) == len(found.faces)
    cq.Assembly(work, loc=cq.Location((5, 0, 0), (0, 0, 1), 30)).export(str(tmp_path / "out.glb"), tolerance=0.01)
    assert len(trimesh.load(tmp_path / "out.glb", force="mesh").faces) == len(found.faces)
