"""Damaged files are refused before the kernel reads them, which would crash, hang, or raise errors of its own."""

from __future__ import annotations

import contextlib
import dataclasses
import random
import re

import pytest
from OCP import TopTools
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Dir

import fubini
from cad import shapes as S
from cad.test_kinks import STAR, sheet
from cad.test_load import WRITERS, write_brep, write_iges, write_step
from fubini.cad import build, load, occ
from fubini.errors import FubiniError, InputError


def replaced(path, pattern, by):
    """The file with the first match of a pattern replaced."""
    text, count = re.subn(pattern, by, path.read_bytes(), count=1)
    assert count == 1
    path.write_bytes(text)
    return path


def eights(found):
    """In place of the second group: an even number, which no directory entry has."""
    return found[1] + b"8" * len(found[2])


@pytest.mark.parametrize(
    ("pattern", "by"),
    [
        (rb"CARTESIAN_POINT\s*\(\s*'',", b"CARTESIAN_POINT(''$"),
        (rb"DIRECTION\('',\(", b"DIRECTION('',"),
        (rb"VECTOR\('',(#\d+),", rb"VECTOR('',\1 "),
        (rb"= VECTOR", b"= VECTO:"),
        (rb"(EDGE_CURVE\('',)", rb"\1,"),
    ],
)
def test_a_step_file_with_broken_statements_is_refused(pattern, by, tmp_path):
    with pytest.raises(InputError, match=r"a\.step: the STEP file is damaged near"):
        load(replaced(write_step(S.plate(), tmp_path / "a.step"), pattern, by))


@pytest.mark.parametrize(
    ("pattern", "by", "message"),
    [
        (rb"(\nEd\s+\S+) 1", rb"\1 !", "no flag"),
        (rb"\n0101101", b"\n0 0101101", "flags|part|kind|literal"),
        (rb"\n2  (\d+) (\d+) 0 0 ", rb"\n2  \1| \2 0 ", "invalid literal|could not convert"),
        (rb"\n1  (\d+) 0 ", b"\n1  99 0 ", "not there"),
        (rb"\n9  ?|\n1  1 0 ", b"\n9  1 0 ", "unknown kind"),
        (rb"\n\+(\d+) (\d+) ([-+])", rb"\n+77 \2 \3", "part that is not there"),
        (rb"\nFa\s+0", b"\nFa  6", "no flag"),
    ],
)
def test_a_text_brep_whose_shapes_are_out_of_shape_is_refused(pattern, by, message, tmp_path):
    with pytest.raises(InputError, match=rf"a\.brep: the BREP file is cut short or damaged: .*({message})"):
        load(replaced(write_brep(S.plate(), tmp_path / "a.brep"), pattern, by))


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("shape", [S.plate(), sheet(STAR, 1)], ids=["plate", "star"])
def test_text_breps_of_all_versions_are_read(shape, version, tmp_path):
    form = getattr(TopTools.TopTools_FormatVersion, f"TopTools_FormatVersion_VERSION_{version}")
    BRepMesh_IncrementalMesh(shape, 0.1)
    path = tmp_path / "a.brep"
    occ.static(BRepTools, "Write")(shape, str(path), True, False, form)
    assert f"CASCADE Topology V{version}".encode() in path.read_bytes()
    assert len(load(path).faces) == len(load(shape).faces)


@pytest.mark.parametrize(
    ("pattern", "by", "message"),
    [
        (rb"\nS +1G[^\n]*", b"", "last line is missing"),
        (rb"(\n504,\d+,)(\d+)", eights, "points to"),
        (rb"(\n510,)(\d+)", eights, "points to"),
        (rb"(\n514,[^;\n]*);", rb"\1 ", "no end"),
        (rb"D0000005", b"D0000:05", "invalid literal"),
        (rb"\n110,\d", b"\n110,\x00", "no text"),
        (rb"\n190[^\n]*", b"", "another number"),
    ],
)
def test_an_iges_file_whose_pointers_lead_nowhere_is_refused(pattern, by, message, tmp_path):
    path = write_iges(S.plate(), tmp_path / "a.igs")
    path.write_bytes(path.read_bytes().replace(b"\r\n", b"\n"))
    with pytest.raises(InputError, match=rf"a\.igs: the IGES file is cut short or damaged: .*({message})"):
        load(replaced(path, pattern, by))


@pytest.mark.parametrize("suffix", [".brep", ".igs"])
def test_random_damages_raise_errors_of_ours_alone(suffix, tmp_path):
    whole = WRITERS[suffix](S.box(), tmp_path / f"whole{suffix}").read_bytes()
    path, random_ = tmp_path / f"damaged{suffix}", random.Random(1)
    for _ in range(25):
        data, at = bytearray(whole), random_.randrange(len(whole))
        data[at] = random_.randrange(256)
        path.write_bytes(data)
        with contextlib.suppress(FubiniError):
            load(path)


def test_errors_of_the_kernel_name_the_file(tmp_path, monkeypatch):
    path = write_brep(S.box(), tmp_path / "a.brep")
    monkeypatch.setattr(build, "build_model", lambda *_: gp_Dir(0.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"a\.brep: the CAD kernel gives up on this source \(Standard_Construction"):
        load(path)


def test_a_drawing_of_another_namespace_is_refused(tmp_path):
    pytest.importorskip("svgelements")
    path = tmp_path / "a.svg"
    path.write_text('<svg xmlns="http://ww5.w3.org/2000/svg" width="9" height="9"><path d="M0,0 h5 v5 z"/></svg>')
    with pytest.raises(InputError, match="namespace"):
        load(path)


def test_a_face_to_which_the_kernel_gives_no_area_is_not_certified():
    model = load(S.box())
    faces = tuple(dataclasses.replace(face, area=0.0) for face in model.faces)
    certificate = fubini.mesh(dataclasses.replace(model, faces=faces), 1.0).certificate
    assert not certificate.certified
    assert "gives the face an area of 0" in certificate.faces[0].reasons[0]
