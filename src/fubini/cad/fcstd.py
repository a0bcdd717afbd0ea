"""FreeCAD documents (.FCStd) without FreeCAD: a zip of Document.xml and the shapes as BREP.

Taken are the end results: objects with a shape that no other shape is made of (a cut uses its base and
tool, a body its features), that are shown, and that have faces, each placed by the containers around it.
"""

from __future__ import annotations

import io
import zipfile
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from fubini.cad.binary import is_binary, read_binary
from fubini.cad.source import ReadOptions, Source
from fubini.errors import InputError

DEFAULTS = ReadOptions()

#: Links by which an object refers to another one without using it up.
REFERENCES = {
    "Group", "Origin", "OriginFeatures", "Tip", "_Body", "LinkedObject", "Objects",
    "Support", "AttachmentSupport", "ExternalGeometry", "Material",
}  # fmt: skip

#: Types whose shape is a help for construction, not a part.
HELPERS = (
    "App::", "Part::Datum", "Part::LocalCoordinateSystem",
    "PartDesign::Plane", "PartDesign::Line", "PartDesign::Point", "PartDesign::CoordinateSystem",
    "PartDesign::ShapeBinder", "PartDesign::SubShapeBinder",
)  # fmt: skip

#: Containers inside containers; deeper than this is a cycle.
MAX_NESTING = 64


@dataclass(frozen=True)
class Item:
    """A document object: what matters of its properties.

    ``placement``: position and quaternion (px, py, pz, qx, qy, qz, qw), None when it has none.
    ``links``: names of the objects that each of its link properties refers to. ``flags``: values of its
    boolean and integer properties as they are written.
    """

    name: str
    type: str
    label: str
    file: str = ""
    visible: bool = True
    placement: tuple[float, ...] | None = None
    links: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    flags: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_body(self) -> bool:
        """A PartDesign body: its own shape is that of its tip, its features are steps on the way."""
        return self.type.startswith("PartDesign::Body")

    @property
    def is_link(self) -> bool:
        """Another instance of an object of the document."""
        return self.type.startswith("App::Link") and "LinkedObject" in self.links


def read_fcstd(path: Path, options: ReadOptions = DEFAULTS) -> Source:
    """The end results of a FreeCAD document, placed; faces are named by the labels of their objects.

    ``options`` is not used: the shapes are finished. What was left out is named in the notes.

    Raises InputError: no zip archive, no Document.xml, no shape, or a shape that cannot be read.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            items = _items(_document(archive, path))
            notes = Counter[str]()
            shapes = list(_placed(archive, items, notes, path))
    except zipfile.BadZipFile as error:
        raise InputError(f"not a FreeCAD document: {error}", file=str(path)) from error
    except OSError as error:
        raise InputError(f"cannot be read: {error}", file=str(path)) from error
    shapes = _with_faces(shapes, notes)
    if not shapes:
        raise InputError("the document holds no shape that is an end result", file=str(path),
                         fix="; ".join(notes) or "recompute and save it in FreeCAD")  # fmt: skip
    names = tuple((shape, item.label) for item, shape in shapes)
    remarks = [what if n == 1 else f"{what} ({n} times)" for what, n in notes.items()]
    return Source(_compound([s for _, s in shapes]), str(path), face_names=names, notes=tuple(remarks))


def _document(archive: zipfile.ZipFile, path: Path) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(archive.read("Document.xml"))
    except KeyError as error:
        raise InputError("not a FreeCAD document: it holds no Document.xml", file=str(path)) from error
    except ElementTree.ParseError as error:
        raise InputError(f"Document.xml is damaged: {error}", file=str(path)) from error


def _items(root: ElementTree.Element) -> dict[str, Item]:
    """All objects of the document by name, in document order."""
    types = {o.get("name", ""): o.get("type", "") for o in root.iterfind("./Objects/Object")}
    data = {o.get("name", ""): o for o in root.iterfind("./ObjectData/Object")}
    return {name: _item(name, kind, data.get(name)) for name, kind in types.items()}


def _item(name: str, kind: str, data: ElementTree.Element | None) -> Item:
    properties = {} if data is None else {p.get("name", ""): p for p in data.iterfind("./Properties/Property")}
    links, flags = {}, {}
    for key, node in properties.items():
        targets = tuple(target for link in node.iter() if (target := _target(link)))
        if targets:
            links[key] = targets
        for value in (*node.findall("Bool"), *node.findall("Integer")):
            flags[key] = value.get("value", "")
    label, shape = properties.get("Label"), properties.get("Shape")
    string = None if label is None else label.find("String")
    part = None if shape is None else shape.find("Part")
    return Item(
        name=name,
        type=kind,
        label=name if string is None else string.get("value", name),
        file="" if part is None else part.get("file", ""),
        visible=flags.get("Visibility", "true") == "true",
        placement=_placement(properties.get("LinkPlacement", properties.get("Placement"))),
        links=links,
        flags=flags,
    )


def _target(node: ElementTree.Element) -> str:
    """Name of the object that a link element refers to; empty for other elements and for other files."""
    if node.tag not in ("Link", "LinkSub", "XLink", "XLinkSub") or node.get("file"):
        return ""
    return node.get("value") or node.get("obj") or node.get("name") or ""


def _placement(node: ElementTree.Element | None) -> tuple[float, ...] | None:
    values = None if node is None else node.find("PropertyPlacement")
    if values is None:
        return None
    keys = ("Px", "Py", "Pz", "Q0", "Q1", "Q2", "Q3")
    return tuple(float(values.get(k, "1" if k == "Q3" else "0")) for k in keys)


def _placed(
    archive: zipfile.ZipFile, items: dict[str, Item], notes: Counter[str], path: Path
) -> Iterator[tuple[Item, Any]]:
    """The end results with their shapes in the coordinates of the document."""
    used = {t for i in items.values() for key, to in i.links.items() if key not in REFERENCES and i.file for t in to}
    parent = {child: item.name for item in items.values() for child in item.links.get("Group", ())}
    wanted = []
    for item in items.values():
        around = _containers(item, items, parent)
        if not (item.file or item.is_link) or any(a.is_body for a in around):
            continue
        if item.type.startswith(HELPERS) and not item.is_link:
            notes[f"helper {item.label!r} left out"] += 1
        elif item.name in used:
            notes[f"{item.label!r} left out: another object is made of it"] += 1
        else:
            wanted.append((item, around, all(i.visible for i in (item, *around))))
    shown = any(visible for *_, visible in wanted)
    for item, around, visible in wanted:
        if shown and not visible:
            notes[f"{item.label!r} left out: hidden"] += 1
            continue
        shape = _shape(archive, item, items, notes, path)
        if shape is not None:
            for container in around:
                shape = shape.Moved(_location(container.placement))
            yield item, shape


def _containers(item: Item, items: dict[str, Item], parent: dict[str, str]) -> list[Item]:
    """The containers around an object, innermost first."""
    around: list[Item] = []
    name = item.name
    while name in parent:
        name = parent[name]
        if name not in items or len(around) == MAX_NESTING:
            break
        around.append(items[name])
    return around


def _shape(archive: zipfile.ZipFile, item: Item, items: dict[str, Item], notes: Counter[str], path: Path) -> Any | None:
    """The shape of an object, or of the object that a link stands for, where the link puts it."""
    if not item.is_link:
        return _read_shape(archive, item, path)
    if item.flags.get("ElementCount", "0") != "0":
        notes[f"link array {item.label!r} left out"] += 1
        return None
    chain = [item]
    while chain[-1].is_link and len(chain) < MAX_NESTING:
        target = items.get(chain[-1].links["LinkedObject"][0])
        if target is None:
            break
        chain.append(target)
    if not chain[-1].file:
        notes[f"link {item.label!r} left out: it leads to no shape of this file"] += 1
        return None
    shape = _read_shape(archive, chain[-1], path)
    for link in reversed(chain[:-1]):
        if link.flags.get("LinkTransform") != "true":
            shape = shape.Located(_location(None))
        shape = shape.Moved(_location(link.placement))
    return shape


def _read_shape(archive: zipfile.ZipFile, item: Item, path: Path) -> Any:
    try:
        data = archive.read(item.file)
    except KeyError as error:
        raise InputError(f"the shape of {item.label!r} ({item.file}) is missing", file=str(path)) from error
    try:
        # the suffix may be .bin, .brp or either with a number behind it: the head tells
        shape = read_binary(data) if is_binary(data) else _text_brep(data)
    except Exception as error:  # the kernel's own exception classes differ between its generations
        raise InputError(f"the shape of {item.label!r} ({item.file}) is damaged: {error}", file=str(path)) from error
    if shape.IsNull():
        raise InputError(f"the shape of {item.label!r} ({item.file}) is damaged", file=str(path),
                         fix="recompute and save the document in FreeCAD")  # fmt: skip
    return shape


def _text_brep(data: bytes) -> Any:
    from OCP.BRep import BRep_Builder
    from OCP.BRepTools import BRepTools
    from OCP.TopoDS import TopoDS_Shape

    shape = TopoDS_Shape()
    BRepTools.Read_s(shape, io.BytesIO(data), BRep_Builder())
    return shape


def _location(placement: tuple[float, ...] | None) -> Any:
    from OCP.gp import gp_Quaternion, gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    if placement is None:
        return TopLoc_Location()
    motion = gp_Trsf()
    motion.SetRotation(gp_Quaternion(*placement[3:]))
    motion.SetTranslationPart(gp_Vec(*placement[:3]))
    return TopLoc_Location(motion)


def _with_faces(shapes: list[tuple[Item, Any]], notes: Counter[str]) -> list[tuple[Item, Any]]:
    """Only the shapes with faces; all of them when none has any (a document of sketches)."""
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    solid = [(i, s) for i, s in shapes if TopExp_Explorer(s, TopAbs_ShapeEnum.TopAbs_FACE).More()]
    if solid:
        for item in [i for i, s in shapes if all(i is not j for j, _ in solid)]:
            notes[f"{item.label!r} left out: it has no face"] += 1
    return solid or shapes


def _compound(shapes: list[Any]) -> Any:
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    if len(shapes) == 1:
        return shapes[0]
    compound, build = TopoDS_Compound(), BRep_Builder()
    build.MakeCompound(compound)
    for shape in shapes:
        build.Add(compound, shape)
    return compound
