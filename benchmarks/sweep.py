#!/usr/bin/env python3
"""Mesh every CAD file of a corpus that has several planar faces, write it in all solver formats, read it all back.

    python benchmarks/sweep.py [--corpus DIR] [--judge FILE] [--only TEXT] [--share 50] [--gmsh PYTHON]

Every planar face and every CAD edge is given a name of its own, the mesh is made at a share of the diagonal, at first
and second order, and written as .msh (2.2 and 4.1), .inp, .unv, .vtu and .npz, and as .stl at first order. Readers
that know nothing of the package (meshio, NumPy, trimesh, a few lines for .inp and .unv; gmsh for .msh where ``--gmsh``
names an interpreter that has it; FreeCAD for .unv and CalculiX for .inp where they are installed) read them back.
Compared are the number and the area of the triangles of every face, and the number and the length of the segments of
every edge, by name.

Then: no cracks (every mesh edge on a CAD edge is a side of a triangle of each face that has the edge), closed meshes
of the kernel's volume where all faces of a solid are planar, and what the judge of the corpus finds. A file of class
"hostile" may be refused. Exit status 0: every row is clean.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import meshio
import numpy as np
import trimesh
from corpus import match_faces

import fubini
from fubini.errors import FubiniError

ROOT = Path(__file__).resolve().parent.parent
#: Largest relative difference of an area or a length that is read back.
SAME = 1e-9
#: Largest relative difference between the volume of a mesh with straight edges and that of the kernel.
VOLUME = 1e-6

Groups = dict[str, tuple[int, float]]


# ---- figures of what was read ---------------------------------------------------------------------


def area_of(points, cells) -> float:
    """Area of triangles by their corners."""
    a, b, c = (points[cells[:, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def length_of(points, lines) -> float:
    """Length of the chords of lines."""
    return float(np.linalg.norm(points[lines[:, 1]] - points[lines[:, 0]], axis=1).sum())


def figures(points, regions, boundaries) -> tuple[Groups, Groups]:
    """Count and area of every region, count and length of every boundary."""
    return (
        {name: (len(cells), area_of(points, cells)) for name, cells in regions.items()},
        {name: (len(lines), length_of(points, lines)) for name, lines in boundaries.items()},
    )


def expected(mesh) -> tuple[Groups, Groups]:
    """The same figures of the mesh itself."""
    return figures(
        mesh.points,
        {name: mesh.triangles[rows] for name, rows in mesh.regions.items()},
        {name: mesh.segments[rows] for name, rows in mesh.boundaries.items()},
    )


def differs(found: tuple[Groups, Groups], wanted: tuple[Groups, Groups]) -> str:
    """What is not the same, in words; empty when all is."""
    for what, ours, theirs in zip(("face", "edge"), wanted, found, strict=True):
        lost = [name for name in ours if name not in theirs]
        if lost:
            return f"{len(lost)} {what} names lost ({lost[0]})"
        for name, (count, size) in ours.items():
            if theirs[name][0] != count or abs(theirs[name][1] - size) > SAME * max(size, 1e-300):
                return f"{what} {name}: {theirs[name]} for {(count, size)}"
    return ""


# ---- readers --------------------------------------------------------------------------------------


def read_msh(path: Path) -> tuple[Groups, Groups]:
    """By meshio, names as physical groups."""
    found = meshio.read(path)
    groups: list[dict] = [{}, {}]
    for dim, kinds in ((2, ("triangle", "triangle6")), (1, ("line", "line3"))):
        for name, (tag, of) in found.field_data.items():
            rows = [
                block.data[physical == tag]
                for block, physical in zip(found.cells, physical_tags(found), strict=True)
                if block.type in kinds and of == dim
            ]
            if of == dim:
                groups[2 - dim][name] = np.concatenate(rows)
    return figures(found.points, *groups)


def physical_tags(found) -> list:
    """Physical tag of every cell; meshio keeps the first of several in version 4.1."""
    return found.cell_data["gmsh:physical"]


def read_vtu(path: Path) -> tuple[Groups, Groups]:
    """By meshio, names as field data."""
    found = meshio.read(path)
    cells = found.cells[0].data
    regions = {k[7:]: cells[rows] for k, rows in found.field_data.items() if k.startswith("region:")}
    boundaries = {k[9:]: lines for k, lines in found.field_data.items() if k.startswith("boundary:")}
    return figures(found.points, regions, boundaries)


def read_npz(path: Path) -> tuple[Groups, Groups]:
    """By NumPy."""
    found = np.load(path, allow_pickle=False)

    def members(kind, table):
        start, rows = found[f"{kind}_start"], found[f"{kind}_members"]
        return {str(n): table[rows[start[i] : start[i + 1]]] for i, n in enumerate(found[f"{kind}_names"])}

    return figures(found["points"], members("region", found["triangles"]), members("boundary", found["segments"]))


def read_inp(path: Path) -> tuple[Groups, Groups]:
    """ELSETs, and SURFACEs with the nodes of their sides looked up in the NSET of the same name."""
    points, cells, elsets, nsets, surfaces, names = {}, {}, {}, {}, {}, {}
    keyword, options = "", {}
    for line in path.read_text().splitlines():
        if line.startswith("** "):
            safe, _, name = line[3:].partition(": ")
            names[safe] = name.encode().decode("unicode_escape")
        elif line.startswith("*"):
            keyword, *rest = (p.strip() for p in line[1:].split(","))
            options = dict(p.split("=") for p in rest)
        else:
            fields = [f.strip() for f in line.split(",") if f.strip()]
            if keyword == "NODE":
                points[int(fields[0])] = [float(f) for f in fields[1:]]
            elif keyword == "ELEMENT":
                cells[int(fields[0])] = (options["TYPE"], [int(f) for f in fields[1:]])
                elsets.setdefault(options["ELSET"], []).append(int(fields[0]))
            elif keyword == "NSET":
                nsets.setdefault(options["NSET"], set()).update(int(f) for f in fields)
            elif keyword == "SURFACE":
                surfaces.setdefault(options["NAME"], []).append((int(fields[0]), int(fields[1][1:])))
    place = np.array([points[i] for i in sorted(points)])
    first = 3 if next(iter(cells.values()))[0].startswith("S") else 1
    regions = {names.get(s, s): np.array([cells[e][1] for e in rows]) - 1 for s, rows in elsets.items() if s != "EALL"}
    boundaries = {}
    for safe, sides in surfaces.items():
        pairs = [(cells[e][1][s - first], cells[e][1][(s - first + 1) % 3]) for e, s in sides]
        if not {node for pair in pairs for node in pair} <= nsets[safe]:
            raise ValueError(f"the node set of {safe} lacks nodes of its surface")
        boundaries[names.get(safe, safe)] = np.array(pairs) - 1
    return figures(place, regions, boundaries)


def read_unv(path: Path) -> tuple[Groups, Groups]:
    """Groups of elements in the data sets 2411, 2412 and 2467."""
    points, cells, groups = {}, {}, {}
    for kind, body in re.findall(r"^    -1\n +(\d+)\n(.*?)^    -1\n", path.read_text(), flags=re.S | re.M):
        lines = iter(body.splitlines())
        for line in lines:
            head = [int(x) for x in line.split()]
            if kind == "2411":
                points[head[0]] = [float(x) for x in next(lines).split()]
            elif kind == "2412":
                if head[1] in (11, 22):
                    next(lines)
                cells[head[0]] = (head[1], [int(x) for x in next(lines).split()])
            else:
                name, items = next(lines), []
                while len(items) < 4 * head[7]:
                    items += [int(x) for x in next(lines).split()]
                groups[name] = [items[i + 1] for i in range(0, len(items), 4) if items[i] == 8]
    place = np.array([points[i] for i in sorted(points)])
    regions, boundaries = {}, {}
    for name, rows in groups.items():
        kinds = {cells[e][0] for e in rows}
        nodes = np.array([cells[e][1] for e in rows]) - 1
        if kinds <= {41, 42}:
            regions[name] = nodes[:, :: nodes.shape[1] // 3]
        elif kinds <= {11, 22}:
            boundaries[name] = nodes[:, [0, -1]]
    return figures(place, regions, boundaries)


READERS = {".msh": read_msh, ".inp": read_inp, ".unv": read_unv, ".vtu": read_vtu, ".npz": read_npz}

GMSH = """
import json, sys
import gmsh, numpy as np
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
answers = {}
for path in sys.argv[1:]:
    gmsh.open(path)
    tags, places, _ = gmsh.model.mesh.getNodes()
    where = np.zeros((int(tags.max()) + 1, 3))
    where[tags.astype(int)] = places.reshape(-1, 3)
    result = [{}, {}]
    for dim, tag in gmsh.model.getPhysicalGroups():
        if dim == 0:
            continue
        count, size = 0, 0.0
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dim, entity)):
                per = gmsh.model.mesh.getElementProperties(kind)[3]
                p = where[nodes.astype(int).reshape(-1, per)]
                count += len(p)
                if dim == 2:
                    n = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
                    size += 0.5 * float(np.linalg.norm(n, axis=1).sum())
                else:
                    size += float(np.linalg.norm(p[:, 1] - p[:, 0], axis=1).sum())
        result[2 - dim][gmsh.model.getPhysicalName(dim, tag)] = (count, size)
    answers[path] = result
    gmsh.clear()
print(json.dumps(answers))
"""


def read_by_gmsh(python: str, paths: list[Path]) -> dict[str, tuple[Groups, Groups]]:
    """What gmsh finds in these files, by path."""
    command = [python, "-c", GMSH, *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=True)
    return json.loads(done.stdout.splitlines()[-1])


FREECAD = """
import json, os, sys
answer = None
try:
    import Fem
    mesh = Fem.read(os.environ["FUBINI_MESH"])
    place = {i: (v.x, v.y, v.z) for i, v in mesh.Nodes.items()}
    groups = [{}, {}]
    for g in mesh.Groups:
        kind = mesh.getGroupElementType(g)
        if kind in ("Face", "Edge"):
            corners = 3 - (kind == "Edge")
            nodes = [mesh.getElementNodes(e)[:corners] for e in mesh.getGroupElements(g)]
            groups[kind == "Edge"][mesh.getGroupName(g)] = [[place[i] for i in n] for n in nodes]
    answer = groups
finally:
    print("ANSWER " + json.dumps(answer))
    sys.stdout.flush()
    os._exit(0)
"""


def read_by_freecad(path: Path) -> tuple[Groups, Groups]:
    """What FreeCAD finds in a universal file."""
    script = path.with_name("read.py")
    script.write_text(FREECAD)
    home = path.with_name("freecad")
    home.mkdir(exist_ok=True)
    surroundings = os.environ | {"FUBINI_MESH": str(path), "FREECAD_USER_HOME": str(home)}
    done = subprocess.run(
        ["freecadcmd", script], capture_output=True, text=True, timeout=300, check=False, env=surroundings
    )
    answer = re.search(r"^ANSWER (.*)$", done.stdout, flags=re.M)
    regions, boundaries = json.loads(answer[1])
    return tuple(
        {name: (len(p), size(np.reshape(p, (-1, 3)), np.arange(len(p) * n).reshape(-1, n))) for name, p in kind.items()}
        for kind, n, size in ((regions, 3, area_of), (boundaries, 2, length_of))
    )


def refused_by_calculix(path: Path) -> str:
    """What CalculiX says against a deck of this mesh with all nodes held; empty when it takes it."""
    text = path.read_text()
    kind = re.search(r"TYPE=(S|CPS)", text)[1]
    section = "*SHELL SECTION" if kind == "S" else "*SOLID SECTION"
    surfaces = re.findall(r"^\*SURFACE, NAME=([^,]+),", text, flags=re.M)
    deck = (
        f"*INCLUDE, INPUT={path.name}\n*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n{section}, ELSET=EALL, MATERIAL=M\n"
        "0.1\n*BOUNDARY\nNALL, 1, 3\n" + "".join(f"{name}, 1, 1\n" for name in surfaces) + "*STEP\n*STATIC\n"
        "*DSLOAD\n" + "".join(f"{name}, P, 1.\n" for name in surfaces) + "*END STEP\n"
    )
    path.with_name("check.inp").write_text(deck)
    done = subprocess.run(["ccx", "check"], cwd=path.parent, capture_output=True, text=True, timeout=300, check=False)
    complaint = re.search(r"\*(?:ERROR|WARNING)[^\n]*\n?[^\n]*", done.stdout)
    return " ".join(complaint[0].split()) if complaint else ("" if done.returncode == 0 else "ccx fails")


# ---- what must hold --------------------------------------------------------------------------------


def cracks(mesh) -> int:
    """Mesh edges on CAD edges that are no side of a triangle of one of the faces that have the edge."""
    sides: dict[tuple[int, int], Counter] = {}
    for face, nodes in zip(mesh.face_of_triangle.tolist(), mesh.triangles.tolist(), strict=True):
        for i in range(3):
            sides.setdefault(tuple(sorted((nodes[i], nodes[i - 1]))), Counter())[face] += 1
    faces_of: dict[int, Counter] = {}
    for face in mesh.model.faces:
        for edge in (*face.region.edges, *(e for _, e in face.inner for _ in range(2))):
            faces_of.setdefault(edge, Counter())[face.index] += 1
    return sum(
        sides.get(tuple(sorted(ends)), Counter()) != faces_of[edge]
        for edge, ends in zip(mesh.edge_of_segment.tolist(), mesh.segments.tolist(), strict=True)
    )


def kernel_volume(shape) -> float:
    """Volume of all solids by the CAD kernel."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    from fubini.cad import occ

    total = 0.0
    for solid in occ.ShapeMap(shape, occ.SOLID):
        properties = GProp_GProps()
        occ.static(BRepGProp, "VolumeProperties")(solid, properties)
        total += abs(properties.Mass())
    return total


def open_or_wrong_volume(mesh) -> str:
    """Whether a solid with planar faces alone is closed and has its volume; in words, "-" for other models."""
    from fubini.cad import occ

    shape = mesh.model.native
    solids = len(occ.ShapeMap(shape, occ.SOLID))
    if mesh.model.skipped or not solids:
        return "-"
    solid = trimesh.Trimesh(mesh.points, mesh.triangles, process=False)
    if not (solid.is_watertight and solid.is_winding_consistent):
        return "open"
    volume = kernel_volume(shape)
    return "" if abs(solid.volume - volume) <= VOLUME * volume else f"volume {solid.volume:.9g} for {volume:.9g}"


def written(mesh, folder: Path, gmsh: str | None) -> list[str]:
    """Write a mesh in every format, read it back; what is amiss."""
    wanted, found = expected(mesh), []
    for version in ("2.2", "4.1"):
        mesh.save(folder / f"mesh{version}.msh", version=version)
    for suffix in (".inp", ".unv", ".vtu", ".npz"):
        mesh.save(folder / f"mesh{suffix}")
    for path in sorted(folder.glob("mesh*")):
        try:
            difference = differs(READERS[path.suffix](path), wanted)
        except (ValueError, KeyError, IndexError, meshio.ReadError) as error:
            difference = f"{type(error).__name__}: {error}"
        found += [f"{path.name}: {difference}"] if difference else []
    if gmsh:
        for path, groups in read_by_gmsh(gmsh, sorted(folder.glob("mesh*.msh"))).items():
            difference = differs(groups, wanted)
            found += [f"{Path(path).name} in gmsh: {difference}"] if difference else []
    if shutil.which("freecadcmd"):
        difference = differs(read_by_freecad(folder / "mesh.unv"), wanted)
        found += [f"mesh.unv in FreeCAD: {difference}"] if difference else []
    if shutil.which("ccx"):
        complaint = refused_by_calculix(folder / "mesh.inp")
        found += [f"ccx: {complaint}"] if complaint else []
    if mesh.order == 1:
        mesh.save(folder / "mesh.stl")
        facets = len(trimesh.load(folder / "mesh.stl", process=False).faces)
        found += [] if facets == len(mesh.triangles) else [f"stl: {facets} facets"]
    return found


def named_mesh(source: str, size: float):
    """The mesh of a file with a name for every planar face and for every edge of one."""
    model = fubini.load(source)
    names = {f"face {f.index}": f"faces {f.index}" for f in model.faces}
    names |= {f"edge {e}": f"edges {e}" for e in model.edges}
    return fubini.mesh(model, size, names=names)


def rows_of(entry: dict, corpus: Path, judge, share: int, gmsh: str | None) -> list[str]:
    """One line of the table for each order of a file; a line that begins with "FAIL" is one that fails."""
    source = str(corpus / entry["copy"])
    model = str(corpus / entry["derived_brep"]) if entry.get("derived_brep") else source
    label = entry["copy"][-46:]
    try:
        mesh = named_mesh(source, entry["diag"] / share)
    except FubiniError as error:
        return [f"{'ok' if entry['class'] == 'hostile' else 'FAIL':4} {label:46} refused: {error}"]
    rows = []
    for order in (1, 2):
        mesh = mesh.elevate(order)
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            amiss = written(mesh, folder, gmsh)
            if source != model:
                match_faces(judge, model, folder / "mesh.vtu")
            amiss += [f"judge: {what}" for what in judge.judge(model, str(folder / "mesh.vtu"))["falls_short"]]
        torn, closed = cracks(mesh), open_or_wrong_volume(mesh)
        amiss += [f"{torn} cracks"] if torn else []
        amiss += [closed] if closed not in ("", "-") else []
        amiss += [] if mesh.certificate.certified else ["not certified"]
        jacobian = mesh.certificate.min_scaled_jacobian
        rows.append(
            f"{'FAIL' if amiss else 'ok':4} {label:46} T{3 * order} {len(mesh.certificate.faces):4d} faces "
            f"{len(mesh.model.edges):5d} edges {len(mesh.triangles):7d} triangles  {'closed' if not closed else '-':6} "
            f"{'' if jacobian is None else f'J {jacobian:.3f} '}{'; '.join(amiss)}"
        )
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--corpus", type=Path, default=ROOT.parent / "shared" / "corpus")
    parser.add_argument("--judge", type=Path, default=ROOT.parent / "shared" / "judge" / "judge.py")
    parser.add_argument("--only", default="", help="files whose name holds this text")
    parser.add_argument("--share", type=int, default=50, help="size: the diagonal over this number")
    parser.add_argument("--gmsh", help="a Python interpreter that has the package gmsh")
    args = parser.parse_args()
    spec = importlib.util.spec_from_file_location("judge", args.judge)
    judge = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(judge)
    rows: list[str] = []
    for line in (args.corpus / "manifest.jsonl").read_text().splitlines():
        entry = json.loads(line)
        if entry["n_planar"] >= 2 and args.only.lower() in entry["copy"].lower():
            for row in rows_of(entry, args.corpus, judge, args.share, args.gmsh):
                print(row, flush=True)
                rows.append(row)
    failed = sum(row.startswith("FAIL") for row in rows)
    print(f"\n{len(rows)} rows, {failed} failed")
    return 1 if failed or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
