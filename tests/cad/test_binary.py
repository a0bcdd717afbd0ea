"""Binary shapes: the kernel's own and FreeCAD's, placed and turned; damaged ones are refused."""

from __future__ import annotations

import io
import struct

import pytest
from OCP.BinTools import BinTools, BinTools_ShapeSet

from cad import shapes as S
from fubini.cad import load, occ
from fubini.cad.binary import read_binary
from fubini.errors import InputError


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
