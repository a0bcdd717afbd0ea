"""Closed outlines among the loose curves of a drawing.

Ends that lie within the gap tolerance of each other become one node; the curves are then the edges of
a plane graph, and its bounded cells are the outlines. A drawing of plain closed outlines gives one cell
for each; an outline that a curve divides gives one cell a part, and the parts share that curve.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fubini.cad.drawing import Complex, Curve, Line, matching
from fubini.errors import GeometryError


@dataclass(frozen=True)
class Use:
    """One curve of an outline, run from its start (``forward``) or from its end."""

    curve: int
    forward: bool


@dataclass(frozen=True)
class Outline:
    """A closed chain of curves; ``polygon`` (n,) are sample points along it, the first one not repeated."""

    uses: tuple[Use, ...]
    polygon: Complex

    @property
    def area(self) -> float:
        """Signed area of the polygon, positive when counter-clockwise."""
        z = self.polygon - self.polygon.mean()
        return 0.5 * float((z.conj() * np.roll(z, -1)).imag.sum())


@dataclass(frozen=True)
class Group:
    """Outlines that hang together by shared nodes: the cells, counter-clockwise, and their common rim."""

    cells: tuple[Outline, ...]
    rim: Outline


@dataclass(frozen=True)
class Drawing:
    """Curves whose ends meet, the nodes at the ends of those kept, and the groups of outlines they form."""

    curves: tuple[Curve, ...]
    ends: Mapping[int, tuple[int, int]]
    groups: tuple[Group, ...]
    notes: tuple[str, ...]


def find_outlines(curves: Sequence[Curve], gap: float) -> Drawing:
    """All closed outlines among loose curves.

    Parameters
    ----------
    curves : the curves, in any order and direction.
    gap : ends no farther apart than this are joined, by a similarity of the curves (lines give way first).

    Duplicates, curves shorter than the gap, and curves that only join two outlines are left out with a note.

    Raises
    ------
    GeometryError : an outline stays open; the message gives both ends and their distance.
    """
    notes: list[str] = []
    keep = _without_specks(curves, gap, notes)
    keep = _without_duplicates(curves, keep, gap, notes)
    healed, ends = _join_ends(curves, keep, gap, notes)
    _refuse_open_ends(healed, keep, ends, gap)
    while True:
        cycles = _cycles(healed, keep, ends)
        bridges = {u.curve for c in cycles for u in c if Use(u.curve, not u.forward) in set(c)}
        if not bridges:
            break
        notes.append(f"{len(bridges)} curves that bound no area on either side left out")
        keep = [k for k in keep if k not in bridges]
        _refuse_open_ends(healed, keep, ends, gap)
    return Drawing(tuple(healed), ends, _groups(healed, ends, cycles), tuple(notes))


def outline_of(curves: Sequence[Curve], uses: Sequence[Use]) -> Outline:
    """The outline of the given uses, with its sample polygon."""
    runs = [curves[u.curve].points() if u.forward else curves[u.curve].points()[::-1] for u in uses]
    return Outline(tuple(uses), np.concatenate([run[:-1] for run in runs]))


def _without_specks(curves: Sequence[Curve], gap: float, notes: list[str]) -> list[int]:
    extent = [abs(c.points() - c.start).max() for c in curves]
    keep = [k for k, size in enumerate(extent) if size > gap]
    if len(keep) < len(curves):
        notes.append(f"{len(curves) - len(keep)} curves shorter than the gap tolerance {gap:.3g} left out")
    return keep


def _without_duplicates(curves: Sequence[Curve], keep: list[int], gap: float, notes: list[str]) -> list[int]:
    """Drop every curve that runs within the gap tolerance of an earlier one of its kind."""
    from scipy.spatial import cKDTree

    probes = {k: curves[k].points() for k in keep}
    middle = np.array([[p[len(p) // 2].real, p[len(p) // 2].imag] for p in probes.values()])
    dropped: set[int] = set()
    for i, j in sorted(cKDTree(middle).query_pairs(gap)) if len(keep) > 1 else ():
        a, b = probes[keep[i]], probes[keep[j]]
        same = type(curves[keep[i]]) is type(curves[keep[j]]) and len(a) == len(b)
        if same and min(abs(a - b).max(), abs(a - b[::-1]).max()) <= gap and keep[i] not in dropped:
            dropped.add(keep[j])
    if dropped:
        at = probes[min(dropped)]
        where = f"the first near ({at[len(at) // 2].real:.9g}, {at[len(at) // 2].imag:.9g})"
        notes.append(f"{len(dropped)} duplicate curves left out, {where}")
    return [k for k in keep if k not in dropped]


def _join_ends(
    curves: Sequence[Curve], keep: list[int], gap: float, notes: list[str]
) -> tuple[list[Curve], dict[int, tuple[int, int]]]:
    """Curves whose ends meet exactly, and the node numbers of the two ends of each curve kept."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    z = np.array([end for k in keep for end in (curves[k].start, curves[k].end)], complex)
    if not len(z):
        return list(curves), {}
    pairs = cKDTree(np.stack([z.real, z.imag], axis=1)).query_pairs(gap, output_type="ndarray")
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(z), len(z)))
    count, node = connected_components(links, directed=False)
    # a line can follow any movement; a curve would be bent by it, so lines give way to curves
    stiff = np.repeat([not isinstance(curves[k], Line) for k in keep], 2)
    place = np.empty(count, complex)
    order = np.lexsort((np.arange(len(z)), node))
    for members in np.split(order, np.cumsum(np.bincount(node))[:-1]):
        chosen = members[stiff[members]] if stiff[members].any() else members
        place[node[members[0]]] = z[chosen[0]] + (z[chosen] - z[chosen[0]]).mean()
    healed, ends, worst = list(curves), {}, 0.0
    for i, k in enumerate(keep):
        a, b = int(node[2 * i]), int(node[2 * i + 1])
        healed[k] = matching(curves[k], complex(place[a]), complex(place[b]))
        ends[k] = (a, b)
        shift = float(abs(healed[k].points() - curves[k].points()).max())
        worst = max(worst, shift)
        if shift > 3 * gap:
            at = (curves[k].start.real, curves[k].start.imag)
            raise GeometryError(
                f"the gap at an end of this {curves[k].kind} cannot be closed without moving it by {shift:.3g}",
                at=at,
                fix="draw its ends to meet its neighbours",
            )
    if worst > 1e-3 * gap:
        notes.append(f"gaps between ends closed; no curve moved by more than {worst:.3g}")
    return healed, ends


def _refuse_open_ends(curves: Sequence[Curve], keep: list[int], ends: dict[int, tuple[int, int]], gap: float) -> None:
    """Raise for the narrowest gap between two ends that meet nothing."""
    from scipy.spatial import cKDTree

    degree: dict[int, list[complex]] = {}
    for k in keep:
        for node, z in zip(ends[k], (curves[k].start, curves[k].end), strict=True):
            degree.setdefault(node, []).append(z)
    loose = np.array([z[0] for z in degree.values() if len(z) == 1], complex)
    if not len(loose):
        return
    if len(loose) == 1:
        raise _open(loose[0], loose[0], gap)
    points = np.stack([loose.real, loose.imag], axis=1)
    distance, other = cKDTree(points).query(points, k=2)
    i = int(np.argmin(distance[:, 1]))
    raise _open(loose[i], loose[other[i, 1]], gap)


def _open(a: complex, b: complex, gap: float) -> GeometryError:
    if a == b:
        message = "an outline ends here and meets nothing"
    else:
        message = f"an outline is open: its next open end is {abs(a - b):.6g} away, at ({b.real:.9g}, {b.imag:.9g})"
    fix = f"close it, or raise the gap tolerance (now {gap:.3g}), or leave its layer out"
    return GeometryError(message, at=(a.real, a.imag), fix=fix)


def _cycles(curves: Sequence[Curve], keep: list[int], ends: dict[int, tuple[int, int]]) -> list[tuple[Use, ...]]:
    """All cycles of the plane graph, each with its cell on the left."""
    leaving: dict[int, list[Use]] = {}
    for k in keep:
        leaving.setdefault(ends[k][0], []).append(Use(k, True))
        leaving.setdefault(ends[k][1], []).append(Use(k, False))
    after: dict[Use, Use] = {}
    for uses in leaving.values():
        ring = uses if len(uses) < 3 else [uses[i] for i in np.argsort(_headings(curves, uses), kind="stable")]
        for i, use in enumerate(ring):
            # who arrives against `use` goes on with the next one clockwise: the cell stays on the left
            after[Use(use.curve, not use.forward)] = ring[i - 1]
    cycles, seen = [], set()
    for k in keep:
        for first in (Use(k, True), Use(k, False)):
            if first in seen:
                continue
            cycle, use = [], first
            while use not in seen:
                seen.add(use)
                cycle.append(use)
                use = after[use]
            cycles.append(tuple(cycle))
    return cycles


def _headings(curves: Sequence[Curve], uses: list[Use]) -> list[float]:
    """Direction of every curve where it crosses one small circle about their common node."""
    runs = [curves[u.curve].points(64) if u.forward else curves[u.curve].points(64)[::-1] for u in uses]
    radius = 0.05 * min(float(abs(run - run[0]).max()) for run in runs)
    headings = []
    for run in runs:
        distance = abs(run - run[0])
        i = int(np.argmax(distance > radius))
        share = (radius - distance[i - 1]) / (distance[i] - distance[i - 1])
        step = run[i - 1] + share * (run[i] - run[i - 1]) - run[0]
        headings.append(math.atan2(step.imag, step.real))
    return headings


def _groups(
    curves: Sequence[Curve], ends: dict[int, tuple[int, int]], cycles: list[tuple[Use, ...]]
) -> tuple[Group, ...]:
    """Cells by connected part of the graph; the one clockwise cycle of a part is its rim."""
    outlines = [outline_of(curves, c) for c in cycles]
    part = _parts(ends, cycles)
    groups = []
    for p in sorted(set(part)):
        mine = [o for o, q in zip(outlines, part, strict=True) if q == p]
        rim = min(mine, key=lambda o: o.area)
        cells = tuple(o for o in mine if o is not rim)
        if rim.area >= 0 or any(c.area <= 0 for c in cells):
            at = mine[0].polygon[0]
            raise GeometryError("an outline encloses no area or crosses itself", at=(at.real, at.imag))
        groups.append(Group(cells, rim))
    return tuple(groups)


def _parts(ends: dict[int, tuple[int, int]], cycles: list[tuple[Use, ...]]) -> list[int]:
    """Number of the connected part of the graph that each cycle belongs to."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    if not cycles:
        return []
    pairs = np.array([ends[u.curve] for c in cycles for u in c])
    size = int(pairs.max()) + 1
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size))
    label = connected_components(links, directed=False)[1]
    first_seen: dict[int, int] = {}
    return [first_seen.setdefault(int(label[ends[c[0].curve][0]]), len(first_seen)) for c in cycles]
