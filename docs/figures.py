#!/usr/bin/env python3
"""Pictures and tables of the documentation, from the examples: ``make figures``.

Writes ``docs/images/NAME.png`` (first triangulation and optimised mesh for each reference set, and the
default mesh), ``docs/examples/NAME.table`` (the same in figures), and ``docs/images/bracket.png``,
``size_tree.png`` and ``turned_pattern.png``.
"""

from __future__ import annotations

import importlib
import io
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent / "cad_examples"))

import fubini  # noqa: E402
from fubini.quality import aspect_ratios, skewness  # noqa: E402

#: Direction of the cells that the paper lays its reference sets into.
DIRECTION = {"quarter_disk": "y", "hollow_cylinder_quarter": "x", "wrench": "x", "free_form": "x"}
HEAD = ("points", "stage", "triangles", "flawed", "worst skewness", "worst aspect ratio", "certified")
FILL, EDGE, FLAWED = "#dce6ee", "#41617f", "#d9483b"


def save(figure: Figure, path: Path) -> None:
    """Write a picture with few colours: small, and the same bytes for the same picture."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110, bbox_inches="tight", facecolor="white")
    Image.open(buffer).convert("RGB").quantize(48, dither=Image.Dither.NONE).save(path, optimize=True)


def draw(axes, points, triangles, title) -> None:
    """One triangulation, flawed triangles red."""
    corners = points[triangles]
    bad = (skewness(corners) <= 45) | (aspect_ratios(corners) >= 2)
    for chosen, colour in ((~bad, FILL), (bad, FLAWED)):
        if chosen.any():
            axes.add_collection(_patches(points, triangles[chosen], colour))
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(f"{title}: {len(triangles)} triangles, {bad.sum()} flawed", fontsize=8)


def _patches(points, triangles, colour):
    from matplotlib.collections import PolyCollection

    return PolyCollection(points[triangles][:, :, :2], facecolors=colour, edgecolors=EDGE, linewidths=0.5)


def row(name, stage, points, triangles, certified=None):
    """One line of the table."""
    corners = points[triangles]
    skew, ratio = skewness(corners), aspect_ratios(corners)
    worst = f"{ratio.max():.3f}" if ratio.max() < 1e4 else "no area"
    flawed = int(((skew <= 45) | (ratio >= 2)).sum())
    verdict = "" if certified is None else ("yes" if certified else "no")
    return (name, stage, len(triangles), flawed, f"{skew.min():.2f}", worst, verdict)


def example(name: str) -> None:
    """Picture and table of one example."""
    module, paper = importlib.import_module(name), importlib.import_module("paper")
    shape = module.build()
    sets = [*module.PATTERNS, "auto"]
    low, high = np.ptp(fubini.load(shape).faces[0].region.bounding_box, axis=0)
    wide = high < 0.5 * low
    figure = Figure(figsize=(9, len(sets) * (18.0 if wide else 4.5) * high / low))
    grid = figure.subplots(2 * len(sets) if wide else len(sets), 1 if wide else 2).reshape(-1, 2)
    rows = []
    for axes, pattern in zip(grid, sets):
        mesh = fubini.mesh(shape, module.SIZE, pattern=pattern)
        label = "default" if pattern == "auto" else pattern
        if pattern == "auto":
            axes[1].set_axis_off()
        else:
            first = paper.first_mesh(shape, pattern, DIRECTION[name])
            draw(axes[0], first.points, first.triangles, f"{label}, first triangulation")
            rows.append(row(label, "first triangulation", first.points, first.triangles))
        draw(axes[int(pattern != "auto")], mesh.points, mesh.triangles, f"{label}, optimised")
        rows.append(row(label, "optimised", mesh.points, mesh.triangles, mesh.certificate.certified))
    save(figure, DOCS / "images" / f"{name}.png")
    lines = [HEAD, ("---",) * len(HEAD), *rows]
    text = "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)
    (DOCS / "examples" / f"{name}.table").write_text(text + "\n")


def bracket() -> None:
    """The picture of the README."""
    module = importlib.import_module("bracket")
    mesh = fubini.mesh(module.build(), module.SIZE)
    save(mesh.plot(width=9.0, title="bracket.step"), DOCS / "images" / "bracket.png")


def size_tree() -> None:
    """A size tree around a slanted line and a point, and the mesh made with it."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Rectangle

    from fubini.region import Region
    from fubini.sizing import SizeTree

    line = np.column_stack([np.linspace(1.0, 4.0, 200), np.linspace(1.0, 2.2, 200)])
    field = SizeTree.from_points(np.vstack([line, [(5.0, 0.8)]]), [0.04] * 200 + [0.01], largest=0.6)
    mesh = fubini.mesh(Region.polygon([(0, 0), (6, 0), (6, 3), (0, 3)]), 0.6, size_field=field)
    figure = Figure(figsize=(9, 2.6))
    left, right = figure.subplots(1, 2)
    cells = [Rectangle(low, width, width) for low, width in zip(*field.tree.boxes(), strict=True)]
    left.add_collection(PatchCollection(cells, facecolor=FILL, edgecolor=EDGE, linewidth=0.4))
    left.set(xlim=(0, 6), ylim=(0, 3), aspect="equal")
    left.set_axis_off()
    left.set_title(f"{len(cells)} leaves", fontsize=8)
    draw(right, mesh.points, mesh.triangles, "mesh")
    save(figure, DOCS / "images" / "size_tree.png")


def turned_pattern() -> None:
    """ASP48 on a quarter of a ring, turned."""
    import math

    from fubini.curves import CircularArc, Line
    from fubini.region import Loop, Region

    arcs = CircularArc((0, 0), 1.0, 0.0, math.pi / 2), CircularArc((0, 0), 0.4, math.pi / 2, 0.0)
    ring = Region(Loop.closed([Line((0.4, 0), (1, 0)), arcs[0], Line((0, 1), (0, 0.4)), arcs[1]], 1e-12))
    figure = Figure(figsize=(9, 2.4))
    for axes, degrees in zip(figure.subplots(1, 4), (0, 90, 180, 270), strict=True):
        mesh = fubini.mesh(ring, pattern="ASP48", pattern_direction="x", pattern_turn=degrees)
        draw(axes, mesh.points, mesh.triangles, f"{degrees}")
    save(figure, DOCS / "images" / "turned_pattern.png")


def main() -> None:
    (DOCS / "images").mkdir(exist_ok=True)
    for name in DIRECTION:
        example(name)
    bracket()
    size_tree()
    turned_pattern()


if __name__ == "__main__":
    main()
