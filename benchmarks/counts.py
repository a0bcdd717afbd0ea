"""Triangles of faces of one size, over the number of equilateral triangles of that size on their area.

    python benchmarks/counts.py               # numpy, scipy, numba, gmsh: a minute
    python benchmarks/counts.py --name slot   # one face alone, every case on a line

The faces of the comparison, squares, rings, slots, random polygons and random outlines of lines and arcs, each at
``COUNTS`` equilateral triangles; of these cases those in which nothing asks for smaller triangles, as ``thinned`` of
``fubini.optimise`` tells. Beside fubini Gmsh's Frontal-Delaunay at the same size. The table goes into the manual.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator
from typing import Any

import peers
import tables

import fubini
import random_regions
import regions  # of tests/
from fubini.curves import CircularArc, Line
from fubini.optimise.thin import most_triangles
from fubini.pipeline import attempts
from fubini.region import Region

COUNTS = (110, 150, 190, 240, 310, 390, 500, 700, 950, 1_300, 1_900, 2_800, 6_000, 20_000)
BINS = ((100, 200), (200, 400), (400, 1_000), (1_000, 3_000), (3_000, math.inf))
#: Random polygons and outlines looked at.
SEEDS = range(40)
#: More than this counts as too many.
MANY = 1.1


def ring() -> Region:
    """A square with a square hole."""
    return regions.polygon([(0, 0), (4, 0), (4, 4), (0, 4)], [(1, 1), (1, 3), (3, 3), (3, 1)])


def all_faces() -> Iterator[tuple[str, Region]]:
    """Every face, by name."""
    for name, face in peers.FACES.items():
        yield name, face()
    yield from (("square", regions.square()), ("quarter ring", regions.annulus_quarter()), ("ring", ring()))
    yield from ((f"slot {width}", regions.slot(width)) for width in (1.0, 2.0))
    for seed in SEEDS:
        yield f"polygon {seed}", regions.random_polygon(seed, 4, 9)
        outline = random_regions.random_region(seed)
        if all(isinstance(curve, Line | CircularArc) for curve in outline.curves):
            yield f"outline {seed}", outline


class Noted:
    """``thinned``, which notes whether one size is wanted on the face that it last was given."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function, self.one_size = function, False

    def __call__(self, outcome: Any, size: float, options: Any, core: Any = (0, 0.0)) -> Any:
        self.one_size = math.isfinite(most_triangles(outcome, core))
        return self.function(outcome, size, options, core)


def measure(name: str) -> list[tuple[str, int, float, float]]:
    """Face, equilateral triangles, and how many times that number fubini and Gmsh make."""
    noted, rows = Noted(attempts.thinned), []
    attempts.thinned = noted
    for face, region in all_faces():
        for count in COUNTS if name in face else ():
            size = math.sqrt(region.area / (peers.TRIANGLE * count))
            number = len(fubini.mesh(regions.model_of(region), size).triangles)
            if noted.one_size:
                rows.append((face, count, number / count, len(peers.TOOLS["gmsh 6"](region, size)[1]) / count))
    return rows


def summary(rows: list[tuple[str, int, float, float]]) -> str:
    """By the number of equilateral triangles."""
    body = []
    for low, high in BINS:
        own = [row for row in rows if low <= row[1] < high]
        cells = [f"{low:,.0f} to {high:,.0f}" if high < math.inf else "above", str(len(own))]
        for tool in (2, 3):
            over = [row[tool] for row in own]
            cells += [f"{sum(over) / len(over):.3f}", f"{max(over):.3f}", str(sum(o > MANY for o in over))]
        body.append(cells)
    head = ("$N_0$", "cases", "fubini: mean", "most", "above 1.10", "Gmsh: mean", "most", "above 1.10")
    return tables.table(head, body)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--name", help="faces whose name holds this text; writes nothing")
    asked = parser.parse_args()
    rows = measure(asked.name or "")
    if asked.name is not None:
        for face, count, own, other in rows:
            print(f"{face:14} {count:6} {own:.3f} {other:.3f}")
        return
    text = summary(rows)
    print(f"{len(rows)} cases of these faces: {', '.join(dict.fromkeys(face for face, *_ in rows))}\n{text}")
    (tables.ROOT / "docs" / "manual" / "counts.table").write_text(text)


if __name__ == "__main__":
    main()
