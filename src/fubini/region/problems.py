"""What keeps loops from bounding a region: crossings, contacts, loops of no area or out of place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.curves import Line
from fubini.region.contacts import Contact, find_contacts
from fubini.region.loop import Loop
from fubini.region.membership import Membership
from fubini.region.parts import Parts, cut

Float = NDArray[np.float64]

#: Convex polygons of up to so many sides are checked at once.
MOST_SIDES = 64


@dataclass(frozen=True)
class Problem:
    """One fault of a set of loops.

    Attributes
    ----------
    kind : "self-crossing", "self-touching", "repeated vertex" (within one loop), "crossing loops",
        "touching loops", "zero area", "hole outside", "nested hole".
    message : what is wrong, without the place.
    place : coordinates (x, y).
    loops, curves : numbers of the loops, and of the curves within them (one or two).
    edges : their CAD edge indices.
    fix : what the reader can do about it.
    """

    kind: str
    message: str
    place: tuple[float, float]
    loops: tuple[int, ...]
    curves: tuple[int, ...]
    edges: tuple[int, ...]
    fix: str


def find_problems(loops: Sequence[Loop], tolerance: float) -> tuple[Problem, ...]:
    """All faults of loops (the outer one first, then the holes); parts closer than ``tolerance`` touch."""
    if len(loops) == 1 and _is_convex_polygon(loops[0], tolerance):
        return ()
    parts = cut(loops)
    diagonal = float(np.hypot(*(parts.high.max(axis=0) - parts.low.min(axis=0))))
    found: list[Problem] = []
    for contact in find_contacts(parts, tolerance, diagonal):
        problem = _contact_problem(loops, parts, contact, tolerance)
        if not any(_same_place(problem, other, tolerance) for other in found):
            found.append(problem)
    found += _zero_areas(loops, tolerance)
    return tuple(found or _misplaced(loops))


def _is_convex_polygon(loop: Loop, tolerance: float) -> bool:
    """Whether a loop consists of few lines that turn left once around, no corner within ``tolerance`` of another side.

    Sides that do not meet are nearest at a corner, so they stay apart, and neighbours meet in their corner alone.
    """
    if len(loop.curves) > MOST_SIDES or not all(isinstance(curve, Line) for curve in loop.curves):
        return False
    p = np.array([curve.start for curve in loop.curves], float)
    d = np.roll(p, -1, axis=0) - p
    ahead = np.roll(d, -1, axis=0)
    turn = np.arctan2(d[:, 0] * ahead[:, 1] - d[:, 1] * ahead[:, 0], (d * ahead).sum(axis=1))
    if turn.min() <= 0.0 or turn.sum() > 3.0 * np.pi:
        return False
    # corner k is on sides k - 1 and k; of all others it lies to the left, by its distance from their lines at least
    w = p[:, None] - p[None]
    left = (d[:, 0] * w[..., 1] - d[:, 1] * w[..., 0]) / np.hypot(d[:, 0], d[:, 1])
    k = np.arange(len(p))
    left[k, k] = left[k, k - 1] = np.inf
    return bool(left.min() > tolerance)


def _same_place(a: Problem, b: Problem, tolerance: float) -> bool:
    away = max(abs(a.place[0] - b.place[0]), abs(a.place[1] - b.place[1]))
    return a.loops == b.loops and away <= 100.0 * tolerance


def _zero_areas(loops: Sequence[Loop], tolerance: float) -> list[Problem]:
    return [
        Problem(
            "zero area",
            f"loop {k} encloses no area",
            _place(loop.curves[0].start),
            (k,),
            (0,),
            (loop.edges[0],),
            "leave the face or the hole out",
        )
        for k, loop in enumerate(loops)
        if abs(loop.signed_area) <= tolerance * loop.length
    ]


def _contact_problem(loops: Sequence[Loop], parts: Parts, contact: Contact, tolerance: float) -> Problem:
    rows = (contact.a, contact.b)
    owners = tuple(int(parts.loop[r]) for r in rows)
    curves = tuple(int(parts.index[r]) for r in rows)
    edges = tuple(loops[k].edges[i] for k, i in zip(owners, curves, strict=True))
    same = owners[0] == owners[1]
    ends = [_near_end(parts, r, contact.place, 4.0 * tolerance) for r in rows]
    crossing = contact.steep and not any(ends)
    if crossing:
        kind = "self-crossing" if same else "crossing loops"
    elif not same:
        kind = "touching loops"
    else:
        kind = "repeated vertex" if all(ends) else "self-touching"
    which = f"loop {owners[0]}" if same else f"loops {owners[0]} and {owners[1]}"
    verb = "cross" if crossing else "touch"
    if same and curves[0] == curves[1]:
        message = f"{kind}: edge {edges[0]} of {which} {'crosses' if crossing else 'touches'} itself"
    else:
        message = f"{kind}: edges {edges[0]} and {edges[1]} of {which} {verb}"
    fix = "mend the outline in the CAD model" if same else "keep the outlines apart, or fuse them"
    return Problem(kind, message, _place(contact.place), owners, curves, edges, fix)


def _near_end(parts: Parts, row: int, place: Float, reach: float) -> bool:
    curve = parts.curves[parts.curve[row]]
    return min(float(np.hypot(*(end - place))) for end in (curve.start, curve.end)) <= reach


def _misplaced(loops: Sequence[Loop]) -> list[Problem]:
    """Holes outside the outer loop or inside another hole; the loops neither cross nor touch."""
    found = []
    starts = np.array([loop.curves[0].start for loop in loops], dtype=float)
    inside = Membership((loops[0],)).contains(starts, 0.0)
    for k in range(1, len(loops)):
        if not inside[k]:
            found.append(_hole_problem("hole outside", f"hole {k} lies outside the outer loop", loops, k))
    boxes = np.array([loop.bounding_box for loop in loops])
    for k in range(1, len(loops)):
        within = (starts > boxes[k, 0]).all(axis=1) & (starts < boxes[k, 1]).all(axis=1)
        within[[0, k]] = False
        candidates = np.flatnonzero(within)
        if len(candidates):
            ring = loops[k] if loops[k].signed_area > 0.0 else loops[k].reverse()
            for j in candidates[Membership((ring,)).contains(starts[candidates], 0.0)]:
                text = f"hole {j} lies inside hole {k}"
                found.append(_hole_problem("nested hole", text, loops, int(j)))
    return found


def _hole_problem(kind: str, message: str, loops: Sequence[Loop], k: int) -> Problem:
    fix = "give each outer outline its own region"
    return Problem(kind, message, _place(loops[k].curves[0].start), (k,), (0,), (loops[k].edges[0],), fix)


def _place(point: Float) -> tuple[float, float]:
    return float(point[0]), float(point[1])
