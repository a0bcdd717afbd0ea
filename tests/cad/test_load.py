"""Files and shapes through the one door: good ones, bad ones, names, placements."""

from __future__ import annotations

import itertools
import re
import threading
from pathlib import Path

import numpy as np
import pytest
from OCP.BRepTools import BRepTools
from OCP.Geom import Geom_BSplineCurve
from OCP.IGESControl import IGESControl_Writer
from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

import fubini
from cad import shapes as S
from fubini.cad import attach, load, occ
from fubini.errors import FubiniError, GeometryError, InputError
from fubini.result import Certificate, Mesh


def write_step(shape, path: Path) -> Path:
    writer = STEPControl_Writer()
    with occ.quiet():
        writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
        writer.Write(str(path))
    return path


def write_brep(shape, path: Path) -> Path:
    occ.static(BRepTools, "Write")(shape, str(path))
    return path


def write_iges(shape, path: Path) -> Path:
    writer = IGESControl_Writer("MM", 1)  # 1: solids as BRep
    writer.AddShape(shape)
    writer.ComputeModel()
    writer.Write(str(path))
    return path


def figures(model):
    """What must not depend on the way a model came in, sorted."""
    return sorted(
        (
            round(f.region.area, 9),
            len(f.region.holes),
            *np.round(f.frame.normal, 9).tolist(),
            *np.round(f.frame.to_space(f.region.centroid)[0], 9).tolist(),
            *sorted(c.kind for c in f.region.curves),
        )
        for f in model.faces
    )


WRITERS = {".step": write_step, ".stp": write_step, ".brep": write_brep, ".igs": write_iges, ".IGES": write_iges}


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_file_gives_the_regions_of_the_live_shape(suffix, tmp_path):
    shape = S.plate().Moved(S.turned(shift=(1, 2, 3)))
    model = load(WRITERS[suffix](shape, tmp_path / f"plate{suffix}"))
    assert len(model.faces) == 6 and [s.surface for s in model.skipped] == ["cylinder"]
    assert np.allclose([f[0] for f in figures(model)], [f[0] for f in figures(load(shape))], rtol=1e-9)
    assert figures(model)[0][2:8] == pytest.approx(figures(load(shape))[0][2:8], abs=1e-7)


def test_face_indices_are_those_of_mapshapes(tmp_path):
    path = write_step(occ.compound([S.plate(), S.box(at=(10, 0, 0))]), tmp_path / "two.step")
    model = load(path)
    listed = S.sub(model.native, occ.FACE)
    assert sorted([f.index for f in model.faces] + [s.index for s in model.skipped]) == list(range(len(listed)))
    from fubini.cad.build import _area

    for face in model.faces:
        assert _area(occ.as_face(listed[face.index]), True) == pytest.approx(face.region.area, rel=1e-12)


def test_nested_placements_are_applied():
    inner = occ.compound([S.box()]).Moved(S.turned(90, (0, 0, 1), (10, 0, 0)))
    outer = occ.compound([inner, S.box(at=(0, 0, 50))]).Moved(S.turned(0, (0, 0, 1), (0, 0, 5)))
    points = np.array(list(load(outer).vertices.values()))
    assert np.allclose(points.min(axis=0), (0, 0, 5)) and np.allclose(points.max(axis=0), (10, 3, 56))
    assert sum(np.allclose(p, (8, 3, 6)) for p in points) == 1


def test_names_of_step_faces_edges_and_solids(tmp_path):
    path = write_step(S.box(), tmp_path / "named.step")
    text = path.read_text()
    text = re.sub(r"ADVANCED_FACE\(''", "ADVANCED_FACE('clamp'", text, count=1)
    text = re.sub(r"EDGE_CURVE\(''", "EDGE_CURVE('seam'", text, count=1)
    text = re.sub(r"EDGE_CURVE\(''", "EDGE_CURVE('NONE'", text, count=1)
    path.write_text(text)
    model = load(path)
    assert [f.name for f in model.faces].count("clamp") == 1 and {f.name for f in model.faces} == {"clamp", None}
    assert [e.name for e in model.edges.values() if e.name] == ["seam"]


def test_solids_of_an_assembly_name_their_faces(tmp_path):
    boxes = [S.box(), S.box(at=(9, 0, 0)).Moved(S.turned(0, shift=(0, 7, 0)))]
    path = write_step(occ.compound(boxes), tmp_path / "a.step")
    text = path.read_text()
    for name in ("left", "right"):
        text = re.sub(r"MANIFOLD_SOLID_BREP\(''", f"MANIFOLD_SOLID_BREP('{name}'", text, count=1)
    path.write_text(text)
    model = load(path)
    by_name = {n: [f for f in model.faces if f.name == n] for n in ("left", "right")}
    assert [len(v) for v in by_name.values()] == [6, 6]
    for faces in by_name.values():
        x = np.concatenate([f.frame.to_space(f.region.outer.vertices) for f in faces])[:, 0]
        assert np.ptp(x) == pytest.approx(3)


def test_groups_name_live_faces_and_edges():
    shape = S.plate()
    pierced = [f for f in load(shape).faces if f.region.holes]
    rim = pierced[0].region.holes[0].edges[0]
    groups = {"top": S.sub(shape, occ.FACE)[pierced[0].index], "rim": [S.sub(shape, occ.EDGE)[rim]]}
    model = load(shape, groups=groups)
    assert {f.index: f.name for f in model.faces if f.name} == {pierced[0].index: "top"}
    assert {i: e.name for i, e in model.edges.items() if e.name} == {rim: "rim"}


# -- outlines without faces ----------------------------------------------------------------------


def test_closed_wires_become_faces_with_holes():
    from OCP.Geom import Geom_Circle
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    circle = S.edge_of(Geom_Circle(gp_Ax2(gp_Pnt(2, 2, 1), gp_Dir(0, 0, -1)), 1.0), 0.0, 2 * np.pi)
    a, b, c, d = (0, 0, 1), (4, 0, 1), (4, 4, 1), (0, 4, 1)
    loose = [S.line(b, c), S.line(a, b), S.line(d, c), S.line(a, d)]
    model = load([circle, *loose])
    (face,) = model.faces
    assert face.region.area == pytest.approx(16 - np.pi, rel=1e-13) and np.allclose(face.frame.normal, (0, 0, 1))
    assert face.area == pytest.approx(face.region.area, rel=1e-9)


def test_an_open_wire_is_refused_with_both_ends():
    with pytest.raises(GeometryError, match=r"open: 2 loose ends, the next one at \(2, 1, 0\)") as caught:
        load([S.line((0, 0, 0), (2, 0, 0)), S.line((2, 0, 0), (2, 1, 0))])
    assert caught.value.at == (0, 0, 0)


def test_branching_and_bent_outlines_are_refused():
    square = S.sub(S.polygon_wire([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]), occ.EDGE)
    with pytest.raises(GeometryError, match="meet in one point"):
        load([*square, S.line((0, 0, 0), (1, 1, 0))])
    with pytest.raises(GeometryError, match="leaves its plane"):
        load(S.polygon_wire([(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)]))


# -- bad input -----------------------------------------------------------------------------------


def test_paths_that_are_no_files(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load(tmp_path / "none.step")
    (tmp_path / "folder.step").mkdir()
    with pytest.raises(InputError, match="folder"):
        load(tmp_path / "folder.step")
    (tmp_path / "part.sldprt").write_text("x")
    with pytest.raises(InputError, match=r"unknown file type '.sldprt'.*\.brep.*\.step"):
        load(tmp_path / "part.sldprt")


@pytest.mark.parametrize("suffix", [".step", ".brep", ".igs"])
@pytest.mark.parametrize("content", [b"", b"hello world\n", bytes(range(256)) * 40], ids=["empty", "text", "binary"])
def test_files_of_something_else(suffix, content, tmp_path, capfd):
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        load(path)
    assert str(path) in str(caught.value)
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize("suffix", [".step", ".brep"])
def test_files_cut_anywhere_are_refused(suffix, tmp_path, capfd):
    whole = WRITERS[suffix](S.plate(), tmp_path / f"whole{suffix}").read_bytes()
    path = tmp_path / f"cut{suffix}"
    for share in np.linspace(0.02, 0.995, 23):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(InputError, match=r"cut short|does not begin"):
            load(path)
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize("kind", ["ADVANCED_FACE", "PLANE", "CLOSED_SHELL", "CARTESIAN_POINT", "MANIFOLD_SOLID_BREP"])
def test_a_step_file_that_lost_geometry_is_refused(kind, tmp_path):
    path = write_step(S.box(), tmp_path / "box.step")
    text = path.read_text()
    path.write_text(re.sub(r"#\d+\s*=\s*" + kind + r"\b[^;]*;", "", text, count=1))
    with pytest.raises(InputError, match="refers to #"):
        load(path)


def test_a_lost_colour_is_only_a_remark(tmp_path):
    path = write_step(S.box(), tmp_path / "box.step")
    text = path.read_text()
    path.write_text(text.replace("ENDSEC;\nEND-ISO", "#9990 = STYLED_ITEM('colour',(#9991),#9992);\nENDSEC;\nEND-ISO"))
    model = load(path)
    assert len(model.faces) == 6 and any("#9991" in n for n in model.notes)


@pytest.mark.parametrize("value", [5, None, [], "", {}, object()], ids=lambda value: type(value).__name__)
def test_things_that_are_no_source(value):
    with pytest.raises(FubiniError):
        load(value)


def test_loading_works_in_a_thread():
    found = []
    thread = threading.Thread(target=lambda: found.append(load(S.box())))
    thread.start()
    thread.join(30)
    assert len(found[0].faces) == 6


def test_a_mesh_without_a_shape_cannot_be_attached():
    none = np.empty((0, 3))
    ints = np.empty((0, 3), np.int32)
    mesh = Mesh(none, ints, ints[:, 0], ints[:, :2], ints[:, 0], {}, {}, Certificate((), 0.0, 0.0), 1.0)
    with pytest.raises(InputError, match="no live CAD shape"):
        attach(mesh)


@pytest.mark.parametrize("size", [1e-2, 1e-5])
def test_an_edge_that_crosses_itself_is_named_with_file_and_place(size, tmp_path):
    points = [(0, 0, 7), (2, 0.5, 7), (5, 0, 7), (5 + size, 0, 7), (5 - size, 0, 7), (5, 0, 7), (8, 0.5, 7), (10, 0, 7)]
    weights = S.reals([1, 1.4, 1.5, 1.1, 0.6, 0.5, 0.9, 1.3])
    knots = S.reals([0, 1, 2, 3, 4, 5]), S.integers([4, 1, 1, 1, 1, 4])
    curve = Geom_BSplineCurve(S.points_array(points), weights, *knots, 3)
    corners = [(10, 0, 7), (10, 10, 7), (0, 10, 7), (0, 0, 7)]
    edges = [S.edge_of(curve, 0, 5), *(S.line(a, b) for a, b in itertools.pairwise(corners))]
    path = write_brep(S.face_of(S.wire_of(*edges)), tmp_path / "loop.brep")
    with pytest.raises(GeometryError, match="crosses itself") as caught:
        fubini.mesh(path)
    error = caught.value
    assert error.file == str(path) and (error.face, error.edge) == (0, 0)
    assert error.at == pytest.approx((5.0, 0.0, 7.0), abs=size)
