"""Campaigns of invented faces, none of them chosen: does every one come out certified?

    export PYTHONPATH=src:tests
    python benchmarks/robustness.py --polygons 1000 --regions 500 --slender 400 --wedges --letters --touching
    python benchmarks/robustness.py --regions 50 --first 7000 --worst worst.png     # other seeds, ten worst drawn
    python benchmarks/robustness.py --fans 200              # models of many faces that share edges
    python benchmarks/robustness.py --parts 60              # needs build123d

Families: random simple polygons of 10 to 60 corners, a third with a hole; random outlines of lines, arcs and B-splines
with tiny edges, slots, cusps, fillets and nearly touching holes (``tests/random_regions.py``); slender parts, that is
stars of spikes, strips of 1 : 10,000, combs of slots and holes in a row, at three sizes; wedges of every whole degree
from 1 to 120 at three sizes; letters and digits of three fonts; holes that all but touch, lunes and crescents; random
solids of a CAD kernel (``tests/random_parts.py``) at three sizes, one case a solid; models of many faces
(``tests/random_networks.py``): fans of two to six wedges about one vertex, the cells of random lines, and, as
``any fans``, ``pizza`` and ``delaunay``, fans, slices and triangles of any angles, many of which have no valid mesh
with shared nodes.
Prints one line for each family: cases, certified, flawed triangles beyond the unavoidable, faces whose budget ran out,
unavoidable corners, those with no flawed triangle (coarse chords may open wider than the tangents), those with more
than one, those whose triangle is over 5 % worse than the best for the angle, CPU seconds of the slowest case and of
all. Cases that fall short are named, and exit status is 1. Of solids no corners are listed, and none is drawn.
"""

from __future__ import annotations

import argparse
import dataclasses
import string
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import fubini
import random_networks
import random_regions
import regions
from fubini.errors import FubiniError
from fubini.model import Model
from fubini.quality import flawed, skewness
from fubini.region import Region

FONTS = ("DejaVu Serif", "STIXGeneral", "cmr10")


@dataclass(frozen=True)
class Case:
    """One face at one size."""

    family: str
    name: str
    region: Region | Model
    size: float


@dataclass
class Outcome:
    """What came of a case; ``corners`` (angle, flawed triangles there, best skewness over the best possible)."""

    case: Case
    certified: bool = False
    excess: int = 0
    exhausted: bool = False
    seconds: float = 0.0
    triangles: int = 0
    worst_skew: float = 0.0
    corners: list[tuple[float, int, float]] = field(default_factory=list)
    reasons: str = ""

    def corners_with(self, low: int, high: int) -> int:
        """Unavoidable corners that have from ``low`` to ``high`` flawed triangles."""
        return sum(low <= count <= high for _, count, _ in self.corners)

    @property
    def misses(self) -> int:
        """Unavoidable corners whose flawed triangle is more than 5 % worse than the best for the angle."""
        return sum(share < 0.95 for _, _, share in self.corners)


# ---- the families --------------------------------------------------------------------------------


def polygons(count: int, first: int) -> Iterator[Case]:
    for seed in range(first, first + count):
        region = regions.random_polygon(seed)
        yield Case("polygons", f"polygon {seed}", region, region.diagonal / (10, 30, 60)[seed % 3])


def outlines(count: int, first: int) -> Iterator[Case]:
    for seed in range(first, first + count):
        region = random_regions.random_region(seed)
        yield Case("regions", f"region {seed}", region, region.diagonal / (10, 25, 50, 15)[seed % 4])


def slender(count: int, first: int) -> Iterator[Case]:
    for seed in range(first, first + count):
        region = random_regions.slender_region(seed)
        for share in (8, 40, 150):
            yield Case("slender", f"slender {seed}", region, region.diagonal / share)


def wedges() -> Iterator[Case]:
    for degrees in range(1, 121):
        for size in (0.3, 0.1, 0.03):
            yield Case("wedges", f"wedge {degrees}", regions.wedge(degrees), size)


def parts(count: int, first: int) -> Iterator[Case]:
    import random_parts

    for seed in range(first, first + count):
        model = fubini.load(random_parts.random_part(seed))
        for share in (10, 30, 100):
            yield Case("parts", f"part {seed}", model, model.diagonal / share)


def fans(count: int, first: int) -> Iterator[Case]:
    families = (
        ("fans", random_networks.neighbourly_fan), ("arrangements", random_networks.arrangement),
        ("any fans", random_networks.random_fan), ("pizza", random_networks.pizza),
        ("delaunay", random_networks.delaunay),
    )  # fmt: skip
    for family, make in families:
        for seed in range(first, first + (count if family in ("fans", "arrangements") else count // 10)):
            yield Case(family, f"{family} {seed}", fubini.load(make(seed)), (1 / 10, 1 / 20, 1 / 50)[seed % 3])


def letters() -> Iterator[Case]:
    for font in FONTS:
        for character in string.ascii_letters + string.digits:
            for k, region in enumerate(random_regions.glyph(character, font)):
                yield Case("letters", f"{font} {character} {k}", region, region.diagonal / 25)


def touching() -> Iterator[Case]:
    for name, region in random_regions.touching_regions():
        for share in (8, 20, 60):
            yield Case("touching", name, region, region.diagonal / share)


# ---- one case ------------------------------------------------------------------------------------


def run(case: Case, min_skew: float = 45.0) -> Outcome:
    """Mesh a case and measure what the certificate does not say."""
    out = Outcome(case)
    start = time.process_time()
    try:
        mesh = fubini.mesh(model_of(case), case.size, min_skew=min_skew)
    except FubiniError as error:
        out.reasons, out.seconds = f"{type(error).__name__}: {error}", time.process_time() - start
        return out
    out.seconds = time.process_time() - start
    faces = mesh.certificate.faces
    out.certified, out.triangles = mesh.certificate.certified, len(mesh.triangles)
    out.excess, out.exhausted = sum(f.excess for f in faces), any(f.budget_exhausted for f in faces)
    out.worst_skew = min(f.avoidable_skew for f in faces)
    out.reasons = "; ".join(f"face {f.face}: {reason}" for f in faces for reason in f.reasons)
    if isinstance(case.region, Model):
        return out
    face = faces[0]
    p = mesh.points[mesh.triangles][:, :, :2]
    bad = np.flatnonzero(flawed(p, min_skew))
    for corner in face.corners:
        node = np.linalg.norm(mesh.points - corner.point, axis=1).argmin()
        here = bad[(mesh.triangles[bad] == node).any(axis=1)]
        best = max(skewness(p[here]), default=90.0)
        out.corners.append((corner.angle, len(here), best / best_skew(corner.angle)))
    return out


def model_of(case: Case) -> Model:
    """The model of a case: of a region, its only face."""
    return case.region if isinstance(case.region, Model) else regions.model_of(case.region)


def best_skew(angle: float) -> float:
    """Skewness in degrees of the isosceles triangle with this apex, a cusp taken for a very small one."""
    a = np.radians(max(angle, 1e-6))
    return float(np.degrees(np.arctan2(2.0, 1.0 / np.tan(a) - np.tan(a / 2.0))))


# ---- the table -----------------------------------------------------------------------------------


def table(outcomes: list[Outcome]) -> str:
    """One line for each family, as Markdown."""
    lines = [
        "| family | cases | certified | excess flawed | budgets spent | unavoidable corners | none flawed "
        "| more than one | over 5 % off | slowest, s | all, s |",
        "|" + "---|" * 11,
    ]
    for family in dict.fromkeys(o.case.family for o in outcomes):
        of = [o for o in outcomes if o.case.family == family]
        slowest = max(of, key=lambda o: o.seconds)
        figures = [
            family, len(of), sum(o.certified for o in of), sum(o.excess for o in of), sum(o.exhausted for o in of),
            sum(len(o.corners) for o in of), sum(o.corners_with(0, 0) for o in of),
            sum(o.corners_with(2, 99) for o in of), sum(o.misses for o in of),
            f"{slowest.seconds:.2f} ({slowest.case.name})", f"{sum(o.seconds for o in of):.0f}",
        ]  # fmt: skip
        lines.append("| " + " | ".join(map(str, figures)) + " |")
    return "\n".join(lines)


def draw(outcomes: list[Outcome], path: Path) -> None:
    """The ten worst faces on one sheet: those that fall short, then those of least skewness; flawed red."""
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    meshed = [o for o in outcomes if o.triangles and isinstance(o.case.region, Region)]
    worst = sorted(meshed, key=lambda o: (o.certified, -o.excess, o.worst_skew))[:10]
    figure = Figure((25, 11), dpi=100)
    for k, outcome in enumerate(worst):
        axes = figure.add_subplot(2, 5, k + 1)
        mesh = fubini.mesh(regions.model_of(outcome.case.region), outcome.case.size)
        p = mesh.points[mesh.triangles][:, :, :2]
        bad = flawed(p)
        colours = np.where(bad[:, None], [0.9, 0.1, 0.1], [0.87, 0.92, 0.97])
        axes.add_collection(PolyCollection(p, facecolors=colours, edgecolors="0.3", linewidths=0.3))
        axes.plot(*p[bad].mean(axis=1).T, "o", mfc="none", mec="red", ms=12)
        axes.autoscale()
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.set_title(f"{outcome.case.name}\nexcess {outcome.excess}, else >= {outcome.worst_skew:.1f} deg", size=9)
    figure.tight_layout()
    figure.savefig(path)


def warm() -> None:
    """Compile what the first cases would otherwise pay for."""
    for seed in range(3):
        run(Case("", "", random_regions.random_region(seed), 0.1))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--polygons", type=int, default=0, metavar="N", help="so many random polygons")
    parser.add_argument("--regions", type=int, default=0, metavar="N", help="so many random outlines of curves")
    parser.add_argument("--slender", type=int, default=0, metavar="N", help="so many slender parts, three sizes")
    parser.add_argument("--parts", type=int, default=0, metavar="N", help="so many random solids, three sizes")
    parser.add_argument("--fans", type=int, default=0, metavar="N", help="so many models of faces that share edges")
    parser.add_argument("--wedges", action="store_true", help="1 to 120 degrees, three sizes")
    parser.add_argument("--letters", action="store_true", help="letters and digits of three fonts")
    parser.add_argument("--touching", action="store_true", help="holes that all but touch, lunes and crescents")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--min-skew", type=float, default=45.0, help="bound on the skewness, degrees")
    parser.add_argument("--scale", type=float, default=1.0, help="scale of all coordinates")
    parser.add_argument("--offset", type=float, default=0.0, help="distance from the origin over the size")
    parser.add_argument("--worst", type=Path, help="draw the ten worst faces to this PNG")
    args = parser.parse_args()

    count, first = (args.polygons, args.regions, args.slender, args.parts, args.fans), args.first
    families = polygons, outlines, slender, parts, fans
    cases = [case for family, n in zip(families, count, strict=True) for case in family(n, first)]
    for wanted, family in ((args.wedges, wedges), (args.letters, letters), (args.touching, touching)):
        cases += family() if wanted else ()
    warm()
    outcomes = []
    for case in cases:
        if (args.scale != 1.0 or args.offset) and isinstance(case.region, Region):
            at = np.array([1.0, -0.7]) * args.offset * args.scale
            moved = case.region.transform(np.eye(2) * args.scale, tuple(at))
            case = dataclasses.replace(case, region=moved, size=case.size * args.scale)
        out = run(case, args.min_skew)
        outcomes.append(out)
        if not out.certified or out.exhausted or out.corners_with(2, 99) or out.misses:
            odd = [f"{a:.3g} deg: {n} flawed, {s:.2f} of the best" for a, n, s in out.corners if n > 1 or s < 0.95]
            print(f"{case.name}, size {case.size:.4g}, {out.seconds:.2f} s: {out.reasons} {'; '.join(odd)}", flush=True)
    print("\n" + table(outcomes))
    if args.worst:
        draw(outcomes, args.worst)
    return 0 if outcomes and all(o.certified and not o.exhausted for o in outcomes) else 1


if __name__ == "__main__":
    sys.exit(main())
