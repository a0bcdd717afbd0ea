"""Mirrored and reversed parts, alone and in assemblies: faces outwards, by the volume that their planes enclose."""

from __future__ import annotations

import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform

from cad import shapes as S
from fubini.cad import load, occ
from fubini.cad.mirrors import without_mirrors
from fubini.cad.source import Source

FAR = S.turned(40.0, (1, 2, 3), (20, -7, 2))


def enclosed(model):
    """Volume by the divergence theorem: positive where faces are directed outwards."""
    return sum(f.area * float(f.frame.origin @ f.frame.normal) for f in model.faces) / 3


def mirror(shape):
    return shape.Moved(S.mirrored(), False)


def baked(shape):
    return BRepBuilderAPI_Transform(shape, S.mirrored().Transformation(), True).Shape()


CASES = {
    "mirrored by placement": (lambda b: mirror(b), 6),
    "mirrored, then moved": (lambda b: mirror(b).Moved(FAR), 6),
    "moved, then mirrored": (lambda b: mirror(b.Moved(FAR)), 6),
    "mirrored twice": (lambda b: mirror(mirror(b)), 6),
    "mirrored in its geometry": (baked, 6),
    "reversed": (lambda b: b.Reversed(), -6),
    "reversed and mirrored": (lambda b: mirror(b.Reversed()), -6),
    "a part and its image": (lambda b: occ.compound([b.Moved(FAR), mirror(b)]), 12),
    "an assembly mirrored as a whole": (lambda b: mirror(occ.compound([b, b.Moved(FAR)])), 12),
    "an image within an image": (lambda b: mirror(occ.compound([b, occ.compound([mirror(b)]).Moved(FAR)])), 12),
}


@pytest.mark.parametrize("case", CASES)
def test_outside_stays_outside(case):
    make, volume = CASES[case]
    assert enclosed(load(make(S.box()))) == pytest.approx(volume, rel=1e-12)


@pytest.mark.parametrize("options", [{"sew": 1e-5}, {"imprint": True}])
def test_after_sewing_and_imprinting(options):
    apart = occ.compound([S.box(), mirror(S.box(at=(5, 0, 0)))])
    assert enclosed(load(apart, **options)) == pytest.approx(12, rel=1e-12)


def test_parts_built_anew_keep_their_names():
    part, image = S.box(), mirror(S.box())
    lid = S.sub(image, occ.FACE)[3]
    source = Source(occ.compound([part, image]), "pair", ((lid, "lid"), (image, "image"), (part, "part")))
    found = without_mirrors(source)
    assert not any(occ.mirrored(p) for p in occ.parts(found.shape))
    names = [name for _, name in found.face_names]
    assert (names.count("part"), names.count("image"), names.count("lid")) == (6, 5, 1)
    plain = Source(part, "one")
    assert without_mirrors(plain) is plain


def test_mirrored_in_build123d():
    b3d = pytest.importorskip("build123d")
    part = b3d.Pos(10, 0, 0) * b3d.Box(3, 2, 1)
    image = b3d.mirror(part, about=b3d.Plane.YZ)
    assert enclosed(load(b3d.Compound(children=[part, image]))) == pytest.approx(12, rel=1e-12)
