"""Many small faces in one model: CPU time a face, by stage.

A sheet of square cells with a round hole each, every edge between two cells shared, and slotted plates side by side
that share nothing; at sizes that make about 200 triangles a face.

    PYTHONPATH=src:tests python benchmarks/many.py --faces 1000 --repeat 3
"""

from __future__ import annotations

import argparse
import math
import statistics

import numpy as np

import fubini
import regions  # of tests/
from fubini.curves import CircularArc, Line
from fubini.model import Edge, Face, Frame, Model
from fubini.region import Loop, Region

PLANE = Frame(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))


def sheet(count: int) -> Model:
    """At least ``count`` unit cells in a near square, each with a hole of radius 0.2."""
    columns = math.ceil(math.sqrt(count))
    rows = math.ceil(count / columns)
    edges: dict[int, Edge] = {}
    vertices = {i * (columns + 1) + j: np.array([j, i, 0.0]) for i in range(rows + 1) for j in range(columns + 1)}
    number: dict[tuple[int, int], int] = {}

    def edge(a: int, b: int) -> tuple[Line, int, bool]:
        """The line from vertex a to b, the number of its edge and whether it runs along it."""
        e = number.setdefault((min(a, b), max(a, b)), len(number))
        edges[e] = Edge(e, "line", min(a, b), max(a, b))
        return Line(vertices[a][:2], vertices[b][:2]), e, a < b

    cells = []
    for i in range(rows):
        for j in range(columns):
            a = i * (columns + 1) + j
            ring = (a, a + 1, a + columns + 2, a + columns + 1)
            cells.append((i, j, [edge(p, q) for p, q in zip(ring, ring[1:] + ring[:1], strict=True)]))
    faces = []
    for i, j, sides in cells[:count]:
        e, v = len(edges), len(vertices)
        hole = regions.circle(j + 0.5, i + 0.5, 0.2).curves
        edges[e], vertices[v] = Edge(e, "circle", v, v), np.array([*hole[0].start, 0.0])
        outer = Loop(*(tuple(part) for part in zip(*sides, strict=True)))
        faces.append(Face(len(faces), Region(outer, (Loop(hole, (e,), (True,)),)), PLANE))
    used = {e for face in faces for e in face.region.edges}
    kept = {e: edge for e, edge in edges.items() if e in used}
    return Model("sheet", tuple(faces), kept, vertices, diagonal=math.hypot(rows, columns))


def plates(count: int) -> Model:
    """Rectangles of 2 by 1 with a slot of round ends, ``count`` of them in rows of 50."""
    parts = []
    for k in range(count):
        x, y = 2.5 * (k % 50), 1.5 * (k // 50)
        ends = [(x + 0.6, y + 0.4), (x + 0.6, y + 0.6), (x + 1.4, y + 0.6), (x + 1.4, y + 0.4)]
        left = CircularArc((x + 0.6, y + 0.5), 0.1, 1.5 * math.pi, 0.5 * math.pi, start=ends[0], end=ends[1])
        right = CircularArc((x + 1.4, y + 0.5), 0.1, 0.5 * math.pi, -0.5 * math.pi, start=ends[2], end=ends[3])
        slot = Loop((left, Line(ends[1], ends[2]), right, Line(ends[3], ends[0])))
        outer = regions.loop([(x, y), (x + 2.0, y), (x + 2.0, y + 1.0), (x, y + 1.0)])
        parts.append(Region.from_loops([outer, slot]))
    return regions.model_of(*parts)


def measure(name: str, model: Model, size: float, repeat: int) -> None:
    """Print the median CPU milliseconds a face, of all and by stage, and the figures of the certificate."""
    fubini.mesh(model, size)
    runs = [fubini.mesh(model, size) for _ in range(repeat)]
    faces, last = len(model.faces), runs[-1].certificate
    whole = statistics.median(sum(run.cpu_seconds.values()) for run in runs)
    print(
        f"{name}: {faces} faces, {last.triangles / faces:.0f} triangles each, "
        f"{'certified' if last.certified else 'NOT certified'}, worst skewness {last.worst_skew:.1f}, "
        f"mean {last.mean_skew:.1f}; {1e3 * whole / faces:.2f} ms of CPU a face"
    )
    for stage in runs[0].cpu_seconds:
        part = statistics.median(run.cpu_seconds[stage] for run in runs)
        print(f"    {stage:12s} {1e3 * part / faces:7.3f}")


def main() -> None:
    """Measure both models."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--faces", type=int, default=1000)
    parser.add_argument("--repeat", type=int, default=3)
    given = parser.parse_args()
    measure("sheet", sheet(given.faces), 0.1, given.repeat)
    measure("slotted plates", plates(given.faces), 0.15, given.repeat)


if __name__ == "__main__":
    main()
