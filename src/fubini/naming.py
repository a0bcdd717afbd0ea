"""Names of regions, boundaries and points: from the user, from the source, automatic for the rest.

A region is a set of triangles, a boundary a set of segments, both by index. Names are told apart by
what they name: a region and a boundary may share one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini._jit import readonly
from fubini._kernels_shipped import meet, number_chains
from fubini.errors import OptionError

Float = NDArray[np.float64]
Int = NDArray[np.int32]
Predicate = Callable[[Float, Float, Float], Any]

_KINDS = {"face": "faces", "edge": "edges", "vertex": "vertices", "vertice": "vertices"}


@dataclass(frozen=True)
class Selection:
    """What one name means, as CAD indices."""

    faces: frozenset[int] = frozenset()
    edges: frozenset[int] = frozenset()
    vertices: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Parts:
    """The arrays of a mesh that names refer to; see ``fubini.result.Mesh``.

    ``node_of_vertex``: mesh node at each CAD vertex, by vertex index.
    """

    points: Float
    triangles: Int
    face_of_triangle: Int
    segments: Int
    edge_of_segment: Int
    face_names: Mapping[int, str] = field(default_factory=dict)
    edge_names: Mapping[int, str] = field(default_factory=dict)
    node_of_vertex: Mapping[int, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Names:
    """Name to sorted triangle, segment and node indices."""

    regions: Mapping[str, Int]
    boundaries: Mapping[str, Int]
    points: Mapping[str, Int]


def parse_selection(text: str) -> Selection:
    """The selection that a text such as ``"faces 0,3-5"``, ``"edge 7"`` or ``"vertices 1 2"`` stands for.

    >>> sorted(parse_selection("edges 3-5, 9").edges)
    [3, 4, 5, 9]
    """
    words = re.fullmatch(r"\s*(face|edge|vertex|vertice)s?\s+([\d,\s-]+)", text)
    if words is None:
        raise OptionError(f"{text!r} selects nothing", fix='write "faces 0,3-5", "edges 7" or "vertices 2"')
    numbers: set[int] = set()
    for part in re.split(r"[,\s]+", words[2].strip().strip(",")):
        first, dash, last = part.partition("-")
        if not first.isdigit() or (dash and not last.isdigit()):
            raise OptionError(f"{text!r}: {part!r} is no index or range", fix="write indices such as 0,3-5")
        numbers.update(range(int(first), int(last or first) + 1))
    return Selection(**{_KINDS[words[1]]: frozenset(numbers)})


def name_parts(parts: Parts, wanted: Mapping[str, Selection | Predicate] | None = None) -> Names:
    """Names of all triangles and of all segments where a face ends or meets another region.

    The user's names (``wanted``) come first and may overlap; a name of the source stands on what they
    leave; the rest is named automatically: ``face_<index>`` for regions, ``outer`` and ``hole_1``, ...
    for segments with a triangle on one side only, ``A|B`` between regions A and B, ``edge_<index>`` for
    edges inside a face.

    A predicate ``p(x, y, z) -> bool`` (arrays) names the faces all of whose nodes satisfy it; where
    there is none, the segments both of whose ends do; else the points that do.

    Raises ``OptionError`` where a name of the user meets nothing in the mesh.
    """
    regions: dict[str, list[Int]] = {}
    boundaries: dict[str, list[Int]] = {}
    points: dict[str, Int] = {}
    for name, selection in (wanted or {}).items():
        _check_name(name)
        if isinstance(selection, Selection):
            found = _select(parts, selection)
        else:
            found = _satisfying(parts, selection, name)
        if not any(len(f) for f in found):
            raise OptionError(f"the name {name!r} meets nothing in the mesh", fix="look at the selection or predicate")
        for kind, rows in zip((regions, boundaries), found, strict=False):
            if len(rows):
                kind[name] = [rows]
        if len(found[2]):
            points[name] = found[2]
    _name_rest(regions, parts.face_of_triangle, parts.face_names)
    _name_faces(regions, parts.face_of_triangle)
    _name_rest(boundaries, parts.edge_of_segment, parts.edge_names)
    _name_segments(boundaries, regions, parts)
    return Names(_joined(regions), _joined(boundaries), points)


def primary(groups: Mapping[str, Int], count: int) -> NDArray[np.int64]:
    """Number of the first group that holds each index (count,); -1 where none does."""
    owner = np.full(count, -1)
    for number, rows in reversed(list(enumerate(groups.values()))):
        owner[rows] = number
    return owner


def overlap(groups: Mapping[str, Int], count: int) -> tuple[str, ...]:
    """Names of groups that share an index with another."""
    times = np.zeros(count, np.int64)
    for rows in groups.values():
        times[rows] += 1
    return tuple(name for name, rows in groups.items() if (times[rows] > 1).any())


def segment_sides(triangles: Int, segments: Int) -> tuple[Int, Int, Int]:
    """Where triangles meet segments: segment, triangle and side numbers, sorted by segment, then triangle.

    Side i of a triangle runs from corner i to corner i + 1.
    """
    if not len(segments):
        empty = np.empty(0, np.int32)
        return empty, empty, empty
    ends = np.sort(segments, axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0])).astype(np.uint32)
    low = ends[order, 0]
    first = np.searchsorted(low, np.arange(int(low[-1]) + 2)).astype(np.uint32)
    high = ends[order, 1].astype(np.uint32)
    corners = readonly(triangles, np.int32).view(np.uint32)
    count, found = 3 * len(segments), np.empty((0, 3), np.int32)
    while count > len(found):
        found = np.empty((count, 3), np.int32)
        count = meet(corners, order, first, high, found)
    found = found[:count]
    segment, triangle, side = found[np.argsort(found[:, 0], kind="stable")].T
    return segment, triangle, side


def _check_name(name: object) -> None:
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise OptionError(f"{name!r} is no name", fix="use printable text that is not blank")


def _select(parts: Parts, selection: Selection) -> tuple[Int, Int, Int]:
    """Triangles, segments and nodes of a selection."""
    nodes = [parts.node_of_vertex[v] for v in sorted(selection.vertices) if v in parts.node_of_vertex]
    return (
        _rows(np.isin(parts.face_of_triangle, list(selection.faces))),
        _rows(np.isin(parts.edge_of_segment, list(selection.edges))),
        np.unique(np.array(nodes, np.int32)),
    )


def _satisfying(parts: Parts, predicate: Predicate, name: str) -> tuple[Int, Int, Int]:
    """Triangles of faces, else segments, else nodes, that satisfy a predicate."""
    answer = np.asarray(predicate(*(np.ascontiguousarray(c) for c in parts.points.T)))
    if answer.shape != (len(parts.points),):
        raise OptionError(
            f"the predicate of {name!r} gives shape {answer.shape} for {len(parts.points)} points",
            fix="return one bool a point, as lambda x, y, z: x < 1",
        )
    true: NDArray[np.bool_] = answer.astype(bool)
    none = np.empty(0, np.int32)
    left_out = parts.face_of_triangle[~true[parts.triangles].all(axis=1)]
    triangles = _rows(np.isin(parts.face_of_triangle, left_out, invert=True))
    if len(triangles):
        return triangles, none, none
    first, second = parts.segments.T
    segments = _rows(true[first] & true[second])
    return none, segments, none if len(segments) else _rows(true)


def _rows(mask: NDArray[np.bool_]) -> Int:
    return np.flatnonzero(mask).astype(np.int32)


def _name_rest(groups: dict[str, list[Int]], owner: Int, names: Mapping[int, str]) -> None:
    """Add the source's names where the user gave none."""
    if not names:
        return
    for index, rows in _left(groups, owner):
        if index in names:
            groups.setdefault(names[index], []).append(rows)


def _name_faces(regions: dict[str, list[Int]], owner: Int) -> None:
    for index, rows in _left(regions, owner):
        regions[_fresh(f"face_{index}", regions)] = [rows]


def _left(groups: Mapping[str, list[Int]], owner: Int) -> list[tuple[int, Int]]:
    """The indices that no group holds, by their owner, both rising."""
    rows = np.arange(len(owner), dtype=np.int32)
    if groups:
        rows = rows[_free(groups, len(owner))]
        owner = owner[rows]
    steps = np.diff(owner)
    if (steps < 0).any():
        order = np.argsort(owner, kind="stable")
        rows, owner = rows[order], owner[order]
        steps = np.diff(owner)
    starts = [0, *(np.flatnonzero(steps) + 1).tolist(), len(rows)]
    return [(int(owner[i]), rows[i:j]) for i, j in zip(starts, starts[1:], strict=False) if i < j]


def _name_segments(boundaries: dict[str, list[Int]], regions: dict[str, list[Int]], parts: Parts) -> None:
    """``outer``, holes, interfaces and edges inside a face."""
    segment, triangle, side = segment_sides(parts.triangles, parts.segments)
    sides = np.bincount(segment, minlength=len(parts.segments))
    free = _free(boundaries, len(parts.segments))
    found: dict[str, list[Int]] = {}
    for base, rows in _loops(parts, *(x[sides[segment] == 1] for x in (segment, triangle, side))).items():
        left = rows[free[rows]]
        if len(left):
            found[base] = [left]
    among = (free & (sides > 1))[segment]
    if among.any():
        owner = primary(_joined(regions), len(parts.triangles))
        for base, rows in _between(parts, list(regions), owner, segment[among], triangle[among]):
            found.setdefault(base, []).append(rows)
    for base, more in found.items():
        boundaries[_fresh(base, boundaries)] = more


def _between(
    parts: Parts, names: list[str], owner: NDArray[np.int64], segment: Int, triangle: Int
) -> list[tuple[str, Int]]:
    """Names of segments with several triangles: the regions that meet there, or the edge inside one face.

    ``segment`` and ``triangle`` are pairs as ``segment_sides`` gives them. Segments of the same regions, faces and edge
    are looked at once.
    """
    start = np.flatnonzero(np.diff(segment, prepend=-1))
    faces = parts.face_of_triangle[triangle]
    ends = [f(x, start) for x in (owner[triangle], faces) for f in (np.minimum.reduceat, np.maximum.reduceat)]
    total = np.add.reduceat(owner[triangle], start)
    keys = np.column_stack([parts.edge_of_segment[segment[start]], *ends, total, np.diff(start, append=len(segment))])
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    found = []
    order = np.argsort(group.ravel(), kind="stable")
    stops = np.cumsum(np.bincount(group.ravel()))
    for k, rows in zip(first.tolist(), np.split(order, stops[:-1]), strict=True):
        low, high = start[k], start[k + 1] if k + 1 < len(start) else len(segment)
        beside = np.unique(owner[triangle[low:high]]).tolist()
        members = segment[start[rows]].astype(np.int32)
        if len(beside) > 1:
            parted = dict.fromkeys(part for number in beside for part in names[number].split("|"))
            found.append(("|".join(parted), members))
        elif (faces[low:high] == faces[low]).all():
            found.append((f"edge_{parts.edge_of_segment[members[0]]}", members))
    return sorted(found, key=lambda item: int(item[1][0]))


def _loops(parts: Parts, segment: Int, triangle: Int, side: Int) -> dict[str, Int]:
    """Segments of one triangle each, by ``outer`` and ``hole_<k>``; holes in order of their least CAD edge.

    A connected chain is a hole when it runs clockwise about the normals of its triangles.
    """
    if not len(segment):
        return {}
    corners = parts.triangles[triangle]
    rows = np.arange(len(segment))
    a, b = corners[rows, side], corners[rows, (side + 1) % 3]
    ends = np.unique(np.concatenate([a, b]), return_inverse=True)[1].reshape(2, -1).astype(np.uint32)
    loop = np.empty(len(a), np.int32)
    count = number_chains(ends, np.empty((2, int(ends.max()) + 1), np.uint32), loop)
    p, q, r = (parts.points[corners[:, k]].T for k in range(3))
    first = np.empty(count, np.intp)
    first[loop[::-1]] = rows[::-1]
    origin = parts.points[a[first]][loop].T
    # the area that a chain sweeps, against the normals of its triangles
    turning = np.zeros(count)
    swept = _cross(parts.points[a].T - origin, parts.points[b].T - origin)
    for area, normal in zip(swept, _cross(q - p, r - p), strict=True):
        turning += np.bincount(loop, area) * np.bincount(loop, normal)
    is_hole = turning < 0.0
    if not is_hole.any():
        return {"outer": np.sort(segment).astype(np.int32)}
    result = {"outer": np.sort(segment[~is_hole[loop]]).astype(np.int32)}
    order = np.argsort(loop, kind="stable")
    chains = np.split(segment[order], np.cumsum(np.bincount(loop))[:-1])
    holes = [chains[k] for k in np.flatnonzero(is_hole)]
    holes.sort(key=lambda s: int(parts.edge_of_segment[s].min()))
    return result | {f"hole_{k}": np.sort(s).astype(np.int32) for k, s in enumerate(holes, start=1)}


def _cross(u: NDArray[np.float64], v: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Components of the cross products of vectors, the components of these in rows (3, n)."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


def _free(groups: Mapping[str, list[Int]], count: int) -> NDArray[np.bool_]:
    free = np.ones(count, bool)
    for pieces in groups.values():
        for rows in pieces:
            free[rows] = False
    return free


def _fresh(base: str, taken: Iterable[str]) -> str:
    """``base``, or with the least number behind it that is not taken."""
    name, k = base, 2
    while name in taken:
        name, k = f"{base}_{k}", k + 1
    return name


def _joined(groups: Mapping[str, list[Int]]) -> dict[str, Int]:
    return {name: _union(pieces) for name, pieces in groups.items()}


def _union(pieces: list[Int]) -> Int:
    """Indices of all pieces, each sorted and without doubles, sorted, each once."""
    if len(pieces) == 1:
        return pieces[0]
    rows = np.sort(np.concatenate(pieces))
    return rows[np.diff(rows, prepend=-1) > 0].astype(np.int32)
