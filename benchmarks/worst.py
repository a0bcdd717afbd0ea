"""The worst faces of a corpus, drawn: the whole face, and the neighbourhood of its worst triangle.

    python benchmarks/worst.py worst.png --corpus ../shared/corpus --shares 20,50,150

A corpus is a folder as ``corpus.py`` reads it; files of class "hostile" are left out. Every planar face of every file
is meshed at these shares of the diagonal. Worst are faces with flawed triangles that no sharp corner excuses, most
first, then those of the lowest skewness among the triangles that none excuses; of a face the worst size is drawn.
Needs a CAD kernel and matplotlib.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parent))

from corpus import ROOT, corpus_jobs

import fubini
from fubini.errors import FubiniError
from fubini.quality import skewness
from fubini.report.canvas import EDGE, EXCUSED_COLOUR, FILL, FLAWED_COLOUR
from fubini.report.states import triangle_states

#: Seconds that one file may take.
LIMIT = 90
COLOURS = np.array([FILL, EXCUSED_COLOUR, FLAWED_COLOUR])


@dataclass
class Found:
    """One meshed face, in the coordinates of its plane."""

    name: str
    share: int
    face: int
    triangles: int
    excess: int
    skew: float
    corners: np.ndarray
    states: np.ndarray
    worst: np.ndarray

    @property
    def badness(self) -> tuple[int, float]:
        return -self.excess, self.skew


def faces_of(mesh, name: str, share: int) -> list[Found]:
    """The faces of a mesh."""
    states, found = triangle_states(mesh), []
    frames = {face.index: face.frame for face in mesh.model.faces}
    for c in mesh.certificate.faces:
        rows = mesh.face_of_triangle == c.face
        frame = frames[c.face]
        corners = frame.to_plane(mesh.points[mesh.triangles[rows]].reshape(-1, 3)).reshape(-1, 3, 2)
        worst = frame.to_plane(c.worst_at)[0]
        found.append(Found(name, share, c.face, c.triangles, c.excess, c.avoidable_skew, corners, states[rows], worst))
    return found


def collect(corpus: Path, shares: list[int], only: str, count: int) -> tuple[list[Found], int, list[str]]:
    """The worst faces, the number of all, and files that gave no mesh."""
    worst: list[Found] = []
    total, failed = 0, []
    for job in corpus_jobs(corpus, shares, only):
        if job.hostile or job.source != job.model:
            continue
        signal.alarm(LIMIT)
        try:
            mesh = fubini.mesh(job.source, size=job.size)
        except (FubiniError, TimeoutError) as error:
            failed.append(f"{job.name} /{job.share}: {error}")
            continue
        finally:
            signal.alarm(0)
        found = faces_of(mesh, job.name, job.share)
        total += len(found)
        alike = {(f.name, f.face): f for f in sorted([*worst, *found], key=lambda f: f.badness, reverse=True)}
        worst = sorted(alike.values(), key=lambda f: f.badness)[:count]
    return worst, total, failed


def draw(axes, found: Found, near: bool) -> None:
    """The face, or what lies near its worst triangle."""
    centre = found.worst
    own = np.argmin(np.linalg.norm(found.corners.mean(axis=1) - centre, axis=1))
    reach = 4.0 * np.ptp(found.corners[own], axis=0).max()
    style = {"edgecolors": EDGE, "linewidths": 0.6 if near else 0.3}
    axes.add_collection(PolyCollection(found.corners, facecolors=COLOURS[found.states], **style))
    axes.add_collection(PolyCollection(found.corners[[own]], facecolors="none", edgecolors="#c2321f", linewidths=1.2))
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_axis_off()
    if near:
        axes.set_xlim(centre[0] - reach, centre[0] + reach)
        axes.set_ylim(centre[1] - reach, centre[1] + reach)
        axes.set_title(f"skewness {skewness(found.corners[[own]])[0]:.1f}", fontsize=7)
    else:
        name = Path(found.name).name[:34]
        title = f"{name}\nface {found.face} at /{found.share}: {found.triangles} triangles, excess {found.excess}"
        axes.set_title(title, fontsize=7)


def sheet(worst: list[Found], path: Path) -> None:
    """Two faces a row, each with its close-up."""
    rows = (len(worst) + 1) // 2
    figure = Figure(figsize=(12, 3.1 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(rows, 4, squeeze=False)
    for axes in grid.ravel():
        axes.set_axis_off()
    for axes, found in zip(grid.reshape(-1, 2), worst):
        draw(axes[0], found, near=False)
        draw(axes[1], found, near=True)
    figure.savefig(path, dpi=100, facecolor="white")


def out_of_time(*_: object) -> None:
    raise TimeoutError(f"not done in {LIMIT} s")


def main() -> None:
    """Collect, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("picture", type=Path)
    parser.add_argument("--corpus", type=Path, default=ROOT.parent / "shared" / "corpus")
    parser.add_argument("--shares", default="20,50,150", help="diagonal over these numbers")
    parser.add_argument("--only", default="", help="files whose name holds this text")
    parser.add_argument("--count", type=int, default=10)
    asked = parser.parse_args()
    signal.signal(signal.SIGALRM, out_of_time)
    worst, total, failed = collect(asked.corpus, [int(n) for n in asked.shares.split(",")], asked.only, asked.count)
    print(f"{total} faces; files without a mesh: {len(failed)}")
    for line in failed:
        print(" ", line)
    for f in worst:
        figures = {"name": f.name, "share": f.share, "face": f.face, "triangles": f.triangles}
        print(json.dumps(figures | {"excess": f.excess, "skewness": round(f.skew, 2)}))
    sheet(worst, asked.picture)


if __name__ == "__main__":
    main()
