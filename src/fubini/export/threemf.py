"""3MF: a zip of XML, double precision, regions as materials of their triangles."""

from __future__ import annotations

import colorsys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from fubini.export.convert import to_trimesh
from fubini.export.layout import Layout, layout

if TYPE_CHECKING:
    from fubini.result import Mesh

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
TYPES = (
    HEAD + '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
)
RELATIONS = (
    HEAD + '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)
#: The date of every part: the least that zip files can hold.
DATE = (1980, 1, 1, 0, 0, 0)


def write(mesh: Mesh, path: Path) -> None:
    """Write ``mesh`` to the new file ``path``, in millimetres.

    Each region is a base material of its name, in a colour of its own, and every triangle has the material of its
    (first) region. The format knows neither boundaries nor named points, nor second order: corners are written.
    """
    solid = to_trimesh(mesh)
    kind = "model" if solid.is_watertight and solid.is_winding_consistent else "surface"
    found = layout(mesh)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in (
            ("[Content_Types].xml", TYPES),
            ("_rels/.rels", RELATIONS),
            ("3D/3dmodel.model", "".join(_model(found, kind))),
        ):
            part = zipfile.ZipInfo(name, DATE)
            part.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(part, text)


def _model(found: Layout, kind: str) -> Iterator[str]:
    yield HEAD
    yield '<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">\n'
    yield '<resources>\n<basematerials id="1">\n'
    for number, name in enumerate(found.regions):
        yield f'<base name={quoteattr(name)} displaycolor="{_colour(number)}"/>\n'
    yield f'</basematerials>\n<object id="2" type="{kind}">\n<mesh>\n<vertices>\n'
    corners = found.cells[:, :3]
    for x, y, z in found.points[: int(corners.max()) + 1].tolist():
        yield f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>\n'
    yield "</vertices>\n<triangles>\n"
    for (a, b, c), region in zip(corners.tolist(), found.region_of_cell.tolist(), strict=True):
        yield f'<triangle v1="{a}" v2="{b}" v3="{c}" pid="1" p1="{region}"/>\n'
    yield '</triangles>\n</mesh>\n</object>\n</resources>\n<build><item objectid="2"/></build>\n</model>\n'


def _colour(number: int) -> str:
    """Colours far apart from their neighbours, as #RRGGBB."""
    red, green, blue = colorsys.hsv_to_rgb((0.58 + 0.618033988749895 * number) % 1.0, 0.5, 0.85)
    return f"#{round(255 * red):02X}{round(255 * green):02X}{round(255 * blue):02X}"
