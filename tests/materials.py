"""A plate of two materials side by side, one with a hole, as a model that no CAD kernel made."""

from __future__ import annotations

import numpy as np

from fubini.curves import CircularArc, Line
from fubini.model import Edge, Face, Frame, Model
from fubini.region import Loop, Region
from regions import TURN

PLACES = [(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1), (1.7, 0.5)]
ENDS = [(0, 1), (1, 4), (4, 5), (5, 0), (1, 2), (2, 3), (3, 4), (6, 6)]

FLAT = Frame(np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
TILTED = Frame(np.array([1.0, 2, 3]), np.array([0.6, 0, 0.8]), np.array([0, 1.0, 0]))
BELOW = Frame(np.array([0, 0, 0.5]), np.array([0, 1.0, 0]), np.array([1.0, 0, 0]))

NAMES = {"steel": "face 0", "copper alloy": "face 1", "clamped": "edge 3", "tip": "vertex 3"}


def two_materials(frame: Frame = FLAT) -> Model:
    """Squares [0, 1] x [0, 1] and [1, 2] x [0, 1] with the shared edge 1; edge 7 is a circle in the second."""

    def loop(numbers, forward):
        curves = []
        for e, along in zip(numbers, forward, strict=True):
            line = Line(PLACES[ENDS[e][0]], PLACES[ENDS[e][1]])
            curves.append(line if along else line.reverse())
        return Loop(tuple(curves), tuple(numbers), tuple(forward))

    left = Region(loop([0, 1, 2, 3], [True] * 4))
    hole = Loop((CircularArc((1.5, 0.5), 0.2, 0.0, TURN),), (7,), (True,))
    right = Region(loop([4, 5, 6, 1], [True, True, True, False]), (hole,))
    edges = {i: Edge(i, "circle" if i == 7 else "line", a, b) for i, (a, b) in enumerate(ENDS)}
    vertices = dict(enumerate(frame.to_space(np.array(PLACES, float))))
    return Model("plate", (Face(0, left, frame), Face(1, right, frame)), edges, vertices, diagonal=5**0.5)


CORNERS = [(-1, 0), (-1, -1), (1, -1), (1, 1), (-1, 1)]


def square(*inner, names=()):
    """The square [-1, 1]^2 with a vertex at (-1, 0), and lines inside it; ends in one place are one vertex."""
    places = [tuple(map(float, p)) for p in CORNERS]
    curves = [Line(a, b) for a, b in zip(places, [*places[1:], places[0]], strict=True)]
    edges = {i: Edge(i, "line", i, (i + 1) % 5) for i in range(5)}
    inside = []
    for a, b in inner:
        for p in (a, b):
            if tuple(map(float, p)) not in places:
                places.append(tuple(map(float, p)))
        number = len(edges)
        ends = [places.index(tuple(map(float, p))) for p in (a, b)]
        edges[number] = Edge(number, "line", *ends, name=dict(names).get(number))
        inside.append((Line(a, b), number))
    region = Region(Loop(tuple(curves), tuple(range(5)), (True,) * 5))
    vertices = {i: np.array([*p, 0.0]) for i, p in enumerate(places)}
    face = Face(0, region, FLAT, inner=tuple(inside))
    return Model("cracked", (face,), edges, vertices, diagonal=8**0.5)
