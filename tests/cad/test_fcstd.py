"""FreeCAD documents written by hand: a zip of Document.xml and shapes of the kernel."""

from __future__ import annotations

import io
import struct
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

pytest.importorskip("OCP", reason="no CAD kernel installed")

from OCP.BinTools import BinTools_ShapeSet
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from fubini.cad.fcstd import read_fcstd
from fubini.errors import InputError


@dataclass
class Object:
    """One object of a document to write."""

    name: str
    type: str = "Part::Feature"
    shape: object = None
    label: str = ""
    placement: tuple = ()
    links: dict = field(default_factory=dict)
    visible: bool = True
    binary: bool = False
    count: int = 0


def box(size=1.0, at=(0, 0, 0)):
    """A cube whose position is its location, as FreeCAD saves it."""
    motion = gp_Trsf()
    motion.SetTranslation(gp_Vec(*at))
    return BRepPrimAPI_MakeBox(size, size, size).Shape().Located(TopLoc_Location(motion))


def binary(shape) -> bytes:
    """The shape as FreeCAD writes it into a .bin file."""
    shapes, stream = BinTools_ShapeSet(), io.BytesIO()
    number = shapes.Add(shape)
    location = shapes.Locations().Index(shape.Location())
    shapes.Write(stream)
    return stream.getvalue() + struct.pack("<3i", number, location, 0)


def text(shape) -> bytes:
    """The shape as BREP text."""
    stream = io.BytesIO()
    BRepTools.Write_s(shape, stream)
    return stream.getvalue()


def properties(o: Object, file: str) -> str:
    """The properties of an object as XML."""
    out = [
        f'<Property name="Label"><String value={quoteattr(o.label or o.name)}/></Property>',
        f'<Property name="Visibility"><Bool value="{str(o.visible).lower()}"/></Property>',
    ]
    if file:
        out.append(f'<Property name="Shape" type="Part::PropertyPartShape"><Part file="{file}"/></Property>')
    if o.placement:
        keys = ("Px", "Py", "Pz", "Q0", "Q1", "Q2", "Q3")
        values = " ".join(f'{k}="{v}"' for k, v in zip(keys, o.placement, strict=True))
        key = "LinkPlacement" if o.type == "App::Link" else "Placement"
        out.append(f'<Property name="{key}"><PropertyPlacement {values}/></Property>')
    if o.count:
        out.append(f'<Property name="ElementCount"><Integer value="{o.count}"/></Property>')
    for key, targets in o.links.items():
        if key == "LinkedObject":
            inner = f'<XLink file="" name="{targets[0]}"/>'
        elif key == "Profile":
            inner = f'<LinkSub value="{targets[0]}" count="0"/>'
        else:
            inner = "<LinkList>" + "".join(f'<Link value="{t}"/>' for t in targets) + "</LinkList>"
        out.append(f'<Property name="{key}">{inner}</Property>')
    return "<Properties>" + "".join(out) + "</Properties>"


def write(path: Path, *objects: Object, leave_out: str = "") -> Path:
    """Write a document; ``leave_out`` names a shape file to forget."""
    with zipfile.ZipFile(path, "w") as archive:
        data = ""
        for o in objects:
            file = "" if o.shape is None else f"{o.name}.Shape." + ("bin" if o.binary else "brp")
            data += f'<Object name="{o.name}">{properties(o, file)}</Object>'
            if file and o.name != leave_out:
                raw = isinstance(o.shape, bytes)
                archive.writestr(file, o.shape if raw else binary(o.shape) if o.binary else text(o.shape))
        head = "".join(f'<Object type="{o.type}" name="{o.name}"/>' for o in objects)
        body = f"<Objects>{head}</Objects><ObjectData>{data}</ObjectData>"
        archive.writestr("Document.xml", f"<Document>{body}</Document>")
    return path


def corners(shape) -> tuple:
    """Lowest and highest vertex of a shape."""
    walk, found = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_VERTEX), []
    while walk.More():
        p = BRep_Tool.Pnt_s((getattr(TopoDS, "Vertex", None) or TopoDS.Vertex_s)(walk.Current()))
        found.append((round(p.X(), 9), round(p.Y(), 9), round(p.Z(), 9)))
        walk.Next()
    return min(found), max(found)


def faces(shape) -> int:
    """Number of faces met."""
    walk, n = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE), 0
    while walk.More():
        n += 1
        walk.Next()
    return n


@pytest.mark.parametrize("as_binary", [False, True])
def test_shape_comes_with_its_place_and_label(tmp_path, as_binary):
    thing = Object("Box", shape=box(2, (5, 6, 7)), label="Plate & rib", binary=as_binary)
    source = read_fcstd(write(tmp_path / "a.FCStd", thing))
    assert faces(source.shape) == 6
    assert corners(source.shape) == ((5, 6, 7), (7, 8, 9))
    assert [name for _, name in source.face_names] == ["Plate & rib"]
    assert source.face_names[0][0].IsSame(source.shape)


def test_containers_place_what_they_hold(tmp_path):
    half = 0.5**0.5  # a quarter turn about z
    path = write(
        tmp_path / "a.FCStd",
        Object("Outer", "App::Part", placement=(100, 0, 0, 0, 0, 0, 1), links={"Group": ("Inner",)}),
        Object("Inner", "App::Part", placement=(0, 10, 0, 0, 0, half, half), links={"Group": ("Folder",)}),
        Object("Folder", "App::DocumentObjectGroup", links={"Group": ("Box",)}),
        Object("Box", shape=box(1, (5, 0, 0))),
    )
    # (5..6, 0..1) turned to (-1..0, 5..6), then shifted by (100, 10)
    assert corners(read_fcstd(path).shape) == ((99, 15, 0), (100, 16, 1))


def test_steps_on_the_way_are_left_out_with_a_note(tmp_path):
    pad = {"Group": ("Sketch", "Pad"), "Tip": ("Pad",)}
    path = write(
        tmp_path / "a.FCStd",
        Object("Base", shape=box(3)),
        Object("Tool", shape=box(1)),
        Object("Cut", "Part::Cut", box(2, (9, 0, 0)), links={"Base": ("Base",), "Tool": ("Tool",)}),
        Object("Body", "PartDesign::Body", box(1, (20, 0, 0)), links=pad),
        Object("Sketch", "Sketcher::SketchObject", shape=box(7)),
        Object("Pad", "PartDesign::Pad", shape=box(8), links={"Profile": ("Sketch",)}),
        Object("Plane", "PartDesign::Plane", shape=box(50)),
        Object("Stash", shape=box(30), visible=False),
    )
    source = read_fcstd(path)
    assert [name for _, name in source.face_names] == ["Cut", "Body"]
    assert faces(source.shape) == 12
    assert corners(source.shape) == ((9, 0, 0), (21, 1, 1))
    for word in ("Base", "Tool", "Plane", "Stash"):
        assert any(repr(word) in note for note in source.notes), word


def test_attachment_does_not_use_an_object_up(tmp_path):
    path = write(
        tmp_path / "a.FCStd",
        Object("Box", shape=box()),
        Object("Top", shape=box(1, (0, 0, 1)), links={"AttachmentSupport": ("Box",)}),
    )
    assert [name for _, name in read_fcstd(path).face_names] == ["Box", "Top"]


def test_link_puts_a_second_instance_where_it_says(tmp_path):
    path = write(
        tmp_path / "a.FCStd",
        Object("Box", shape=box(1, (5, 0, 0))),
        Object("Again", "App::Link", placement=(0, 40, 0, 0, 0, 0, 1), links={"LinkedObject": ("Box",)}),
    )
    source = read_fcstd(path)
    assert [name for _, name in source.face_names] == ["Box", "Again"]
    assert corners(source.face_names[1][0]) == ((0, 40, 0), (1, 41, 1))
    assert not source.face_names[0][0].IsSame(source.face_names[1][0])


def test_an_array_of_links_is_left_out_with_a_note(tmp_path):
    path = write(
        tmp_path / "a.FCStd",
        Object("Box", shape=box()),
        Object("Row", "App::Link", links={"LinkedObject": ("Box",)}, count=3),
    )
    source = read_fcstd(path)
    assert [name for _, name in source.face_names] == ["Box"]
    assert source.notes == ("link array 'Row' left out",)


def test_a_lone_sketch_is_kept_but_not_beside_a_solid(tmp_path):
    line = BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 0), gp_Pnt(1, 0, 0)).Edge()
    sketch = Object("Sketch", "Sketcher::SketchObject", shape=line)
    assert not read_fcstd(write(tmp_path / "a.FCStd", sketch)).shape.IsNull()
    source = read_fcstd(write(tmp_path / "b.FCStd", sketch, Object("Box", shape=box())))
    assert [name for _, name in source.face_names] == ["Box"]
    assert "no face" in source.notes[0]


def test_bad_documents_are_refused_with_their_name(tmp_path):
    text_file = tmp_path / "text.FCStd"
    text_file.write_text("no zip at all")
    no_document = tmp_path / "empty.FCStd"
    with zipfile.ZipFile(no_document, "w") as archive:
        archive.writestr("Other.xml", "<a/>")
    torn = tmp_path / "torn.FCStd"
    with zipfile.ZipFile(torn, "w") as archive:
        archive.writestr("Document.xml", "<Document><Objects>")
    lid = Object("Box", shape=box(), label="Lid")
    broken = Object("Box", shape=b"no shape", label="Lid")
    broken_binary = Object("Box", shape=b"no shape", label="Lid", binary=True)
    cases = {
        text_file: "zip",
        no_document: "Document.xml",
        torn: "damaged",
        tmp_path / "absent.FCStd": "cannot be read",
        write(tmp_path / "nothing.FCStd", Object("Group", "App::DocumentObjectGroup")): "no shape",
        write(tmp_path / "lost.FCStd", lid, leave_out="Box"): "'Lid'.*missing",
        write(tmp_path / "text.brp.FCStd", broken): "'Lid'.*damaged",
        write(tmp_path / "bin.FCStd", broken_binary): "'Lid'.*damaged",
    }
    for path, message in cases.items():
        with pytest.raises(InputError, match=message) as caught:
            read_fcstd(path)
        assert caught.value.file == str(path)
