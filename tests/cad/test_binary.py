"""Binary shapes: the kernel's own and FreeCAD's, placed and turned; damaged ones are refused."""

from __future__ import annotations

import io
import re
import struct

import pytest
from OCP.BinTools import BinTools, BinTools_ShapeSet

from cad import shapes as S
from fubini.cad import load, occ
from fubini.cad.binary import read_binary
from fubini.cad.shapeset import check_shapes
from fubini.errors import GeometryError, InputError


def by_the_kernel(shape) -> bytes:
    out = io.BytesIO()
    occ.static(BinTools, "Write")(shape, out)
    return out.getvalue()


def by_freecad(shape) -> bytes:
    shapes, out = BinTools_ShapeSet(), io.BytesIO()
    number = shapes.Add(shape)
    shapes.Write(out)
    location = shapes.Locations().Index(shape.Location())
    return out.getvalue() + struct.pack("<3i", number, location, int(shape.Orientation()))


@pytest.mark.parametrize("write", [by_the_kernel, by_freecad])
@pytest.mark.parametrize("suffix", [".brep", ".brp"])
def test_reads_back(write, suffix, tmp_path):
    shape = occ.compound([S.box(), S.plate()]).Moved(S.turned(30, shift=(5, 0, 0))).Reversed()
    again = read_binary(write(shape))
    assert again.Orientation() == shape.Orientation()
    path = tmp_path / f"a{suffix}"
    path.write_bytes(write(shape))
    found, wanted = load(path), load(shape)
    assert len(found.faces) == len(wanted.faces) == 12 and len(found.skipped) == 1
    for a, b in zip(found.faces, wanted.faces, strict=True):
        assert a.frame.normal == pytest.approx(b.frame.normal, abs=1e-15)
        assert a.frame.to_space(a.region.outer.vertices) == pytest.approx(
            b.frame.to_space(b.region.outer.vertices), abs=1e-14
        )


@pytest.mark.parametrize("write", [by_the_kernel, by_freecad])
@pytest.mark.parametrize("share", [0.02, 0.4, 0.99])
def test_a_cut_file_is_refused(write, share, tmp_path):
    data = write(S.plate())
    path = tmp_path / "a.brep"
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match=r"a\.brep: .*cut short"):
        load(path)


def test_a_reference_to_nothing_is_refused(tmp_path):
    data = by_freecad(S.box())
    path = tmp_path / "a.brep"
    path.write_bytes(data[:-12] + struct.pack("<3i", 999, 0, 0))
    with pytest.raises(InputError, match="no reference to a shape"):
        load(path)


@pytest.mark.parametrize(
    ("back", "wrong"),
    [
        (19, b"\x5e"),  # orientation of the last part of the last shape
        (18, struct.pack("<i", 0)),  # its number, counted from the last shape: one that comes later
        (18, struct.pack("<i", 1)),  # the shape itself
        (18, struct.pack("<i", 999)),
        (14, struct.pack("<i", 77)),  # its place
        (14, struct.pack("<i", -1)),
        (4, struct.pack("<i", 77)),  # the place of the whole
    ],
)
def test_a_reference_to_nothing_never_reaches_the_kernel(back, wrong, tmp_path):
    """The kernel follows such numbers unseen, and crashes."""
    data = by_the_kernel(occ.compound([S.box()]))
    at = len(data) - back
    path = tmp_path / "a.brep"
    path.write_bytes(data[:at] + wrong + data[at + len(wrong) :])
    with pytest.raises(InputError, match="damaged"):
        load(path)


def test_geometry_that_is_not_there_never_reaches_the_kernel():
    data = by_the_kernel(S.plate())
    check_shapes(data)
    first = re.search(rb"TShapes \d+\n", data).end()
    mark = first + 1 + 32  # the first shape is a vertex: its kind, tolerance and place, then marks of geometry
    assert data[first] == 7 and data[mark] == 0
    with pytest.raises(ValueError, match="unknown kind"):
        check_shapes(data[:mark] + b"\x09" + data[mark + 1 :])
    with pytest.raises(ValueError, match="not there"):
        check_shapes(data.replace(b"Surfaces 7", b"Surfaces 6"))
    with pytest.raises(ValueError, match="holds less"):
        check_shapes(data.replace(b"Polygon3D 0", b"Polygon3D 2"))
    with pytest.raises(ValueError, match="missing"):
        check_shapes(data.replace(b"Curve2ds", b"Curve2dz"))


def test_what_the_kernel_cannot_measure_is_told(monkeypatch):
    class Refuses:
        @staticmethod
        def SurfaceProperties_s(*_):
            raise ArithmeticError

        SurfaceProperties = SurfaceProperties_s

    monkeypatch.setattr("fubini.cad.build.BRepGProp", Refuses)
    with pytest.raises(GeometryError, match="cannot measure this face"):
        load(S.box())
