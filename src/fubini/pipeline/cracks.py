"""Cracks: edges along which the mesh is parted, with nodes of its own on either lip."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini.errors import OptionError
from fubini.model import Model
from fubini.naming import Names, segment_sides
from fubini.pipeline.assemble import Assembly
from fubini.pipeline.names import Wanted
from fubini.pipeline.parts import by_part

Int = NDArray[np.int32]
Long = NDArray[np.int64]

#: Segments that a crack has at least: the node between them is what opens.
SEGMENTS = 2


def crack_edges(model: Model, cracks: Any, wanted: Wanted) -> frozenset[int]:
    """CAD indices of the edges that ``cracks`` means: a selection as ``edge_size`` takes it, or a list of such.

    Raises ``OptionError`` for an edge that has not two sides of faces beside it.
    """
    if cracks is None:
        return frozenset()
    keys = cracks if isinstance(cracks, list | tuple | set | frozenset) else [cracks]
    edges = frozenset(by_part(model, "cracks", "edge", dict.fromkeys(keys, 1.0), wanted))
    sides = dict.fromkeys(edges, 0)
    for face in model.faces:
        for edge in (*face.region.edges, *(e for _, e in face.inner), *(e for _, e in face.inner)):
            if edge in sides:
                sides[edge] += 1
    for edge, count in sorted(sides.items()):
        if count != 2:
            raise OptionError(
                f"cracks: {count} sides of faces meet at this edge, and a crack parts two",
                file=model.source, edge=edge, fix="choose edges inside a face, or between two faces",
            )  # fmt: skip
    return edges


def with_segments(asked: Mapping[Any, float], edges: frozenset[int]) -> dict[Any, float]:
    """``edge_segments`` that give every crack a node to open."""
    least: dict[Any, float] = dict.fromkeys(sorted(edges), SEGMENTS)
    return least | {key: max(count, least.get(key, count)) for key, count in asked.items()}


def open_cracks(whole: Assembly, named: Names, edges: frozenset[int]) -> tuple[Assembly, Names]:
    """The mesh parted along these CAD edges, and its names with ``NAME+`` and ``NAME-`` for the two lips.

    A node on a crack is made as many times as there are runs of triangles about it that the cracks keep apart: twice
    along a crack and where one ends at the outline, once at a tip inside. ``NAME+`` lies on the left of the
    CAD edge, seen from outside. The first run keeps the number of the node, the others follow after all nodes.
    """
    if not edges:
        return whole, named
    triangles, points, copies = _parted(whole, np.isin(whole.edge_of_segment, list(edges)))
    segment, triangle, side = segment_sides(whole.triangles, whole.segments)
    rows = np.arange(len(segment))
    ends = np.stack([triangles[triangle, side], triangles[triangle, (side + 1) % 3]], axis=1)
    against = whole.triangles[triangle, side] != whole.segments[segment, 0]
    ends[against] = ends[against][:, ::-1]
    order = np.lexsort((rows, against, segment))  # the triangle on the left comes first
    first = order[np.flatnonzero(np.diff(segment[order], prepend=-1))]
    cracked = np.flatnonzero(np.isin(whole.edge_of_segment, list(edges)))
    last = order[np.flatnonzero(np.diff(segment[order], append=-1))][cracked]
    more = np.concatenate([np.arange(len(whole.segments)), cracked])
    opened = replace(
        whole,
        points=np.concatenate([whole.points, points]),
        triangles=triangles,
        segments=np.concatenate([ends[first], ends[last]]).astype(np.int32),
        edge_of_segment=whole.edge_of_segment[more],
        t_of_segment=whole.t_of_segment[more],
        closed=whole.triangles,
    )
    return opened, _with_lips(named, cracked, len(whole.segments), copies)


def lips(whole: Assembly, part: slice, segments: Int) -> Int:
    """Nodes (k, 2) in the opened mesh of directed sides of triangles ``part`` as they were before."""
    if whole.closed is None:
        return segments
    n = len(whole.points)
    around = [[0, 1], [1, 2], [2, 0]]
    before = whole.closed[part][:, around].reshape(-1, 2).astype(np.int64)
    after = whole.triangles[part][:, around].reshape(-1, 2)
    keys = before[:, 0] * n + before[:, 1]
    order = np.argsort(keys)
    wanted = segments[:, 0].astype(np.int64) * n + segments[:, 1]
    at = order[np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)]
    found = keys[at] == wanted
    return np.where(found[:, None], after[at], segments)


def _parted(whole: Assembly, cracked: NDArray[np.bool_]) -> tuple[Int, NDArray[np.float64], dict[int, list[int]]]:
    """Triangles with the new nodes, the places of these, and the copies of every node that has some."""
    n, triangles = len(whole.points), whole.triangles.astype(np.int64)
    on_crack = np.zeros(n, bool)
    on_crack[whole.segments[cracked]] = True
    corner = np.flatnonzero(on_crack[triangles.ravel()])
    node = triangles.ravel()[corner]
    joined = _fans(triangles, on_crack, None)
    apart = _fans(triangles, on_crack, np.sort(whole.segments[cracked].astype(np.int64), axis=1))
    # runs that were apart before, where faces touch in a point, stay on the one node that they have in common
    order = np.lexsort((corner, node, joined[corner]))
    seen: dict[int, int] = {}
    kept: set[int] = set()
    places: list[int] = []
    copies: dict[int, list[int]] = {}
    flat = triangles.ravel().copy()
    for c, v in zip(corner[order].tolist(), node[order].tolist(), strict=True):
        fan = int(apart[c])
        if fan not in seen:
            whole_fan = int(joined[c])
            if whole_fan in kept:
                seen[fan] = n + len(places)
                places.append(v)
                copies.setdefault(v, []).append(seen[fan])
            else:
                kept.add(whole_fan)
                seen[fan] = v
        flat[c] = seen[fan]
    return flat.reshape(-1, 3).astype(np.int32), whole.points[places], copies


def _fans(triangles: Long, chosen: NDArray[np.bool_], parting: Long | None) -> Int:
    """Label (3 m,) of the run of triangles about its node that every corner belongs to.

    Triangles are joined across their sides at ``chosen`` nodes, but not across the sides ``parting`` (k, 2), which are
    given by their sorted ends.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n, corners = len(chosen), triangles.size
    number = np.arange(corners).reshape(-1, 3)
    a, b = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    at_a, at_b = number.ravel(), np.roll(number, -1, axis=1).ravel()
    swap = a > b
    at_a, at_b = np.where(swap, at_b, at_a), np.where(swap, at_a, at_b)
    key = np.minimum(a, b) * n + np.maximum(a, b)
    order = np.argsort(key, kind="stable")
    same = key[order][1:] == key[order][:-1]
    if parting is not None:
        same &= ~np.isin(key[order][1:], parting[:, 0] * n + parting[:, 1])
    one, two = order[:-1][same], order[1:][same]
    pairs = np.concatenate([np.stack([at_a[one], at_a[two]]), np.stack([at_b[one], at_b[two]])], axis=1)
    pairs = pairs[:, chosen[triangles.ravel()[pairs[0]]]]
    links = coo_array((np.ones(pairs.shape[1]), (pairs[0], pairs[1])), shape=(corners, corners))
    label: Int = connected_components(links, directed=False)[1]
    return label


def _with_lips(named: Names, cracked: NDArray[np.intp], count: int, copies: Mapping[int, list[int]]) -> Names:
    """Names of the opened mesh; the second lips are the segments from ``count`` on."""
    other = np.full(count, -1)
    other[cracked] = count + np.arange(len(cracked))
    boundaries: dict[str, Int] = {}
    taken = set(named.boundaries)
    for name, rows in named.boundaries.items():
        whole, parted = rows[other[rows] < 0], rows[other[rows] >= 0]
        if len(whole) or not len(parted):
            boundaries[name] = whole
        if len(parted):
            for sign, members in (("+", parted), ("-", np.sort(other[parted]))):
                title, k = name + sign, 2
                while title in taken:
                    title, k = f"{name}_{k}{sign}", k + 1
                taken.add(title)
                boundaries[title] = members.astype(np.int32)
    points = {
        name: np.unique([v for node in rows.tolist() for v in (node, *copies.get(node, ()))]).astype(np.int32)
        for name, rows in named.points.items()
    }
    return Names(named.regions, boundaries, points)
