"""Speed of the constrained Delaunay triangulation, beside Qhull and Triangle.

Run: ``python benchmarks/triangulation.py [largest number of points]``. CPU time in microseconds a point, the best of
a few runs; Triangle (package ``triangle``, whose licence forbids commercial use) where it is installed. Points fill the
unit square: random ones, or a hexagonal lattice, where four points are cocircular all the time.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "src"))

from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.value import Boundary

COLD = """
import time
import numpy, numba
numba.njit(lambda x: x + 1)(1)  # numba's own start
start = time.process_time()
import runpy
runpy.run_path({path!r})["constrained_delaunay"]
bench = runpy.run_path({path!r})
boundary = bench["square"](4)
bench["constrained_delaunay"](boundary.points, boundary)
print(time.process_time() - start)
"""


def square(n):
    """Boundary of the unit square with n edges on each side."""
    t, zero, one = np.arange(n) / n, np.zeros(n), np.ones(n)
    sides = [(t, zero), (one, t), (1 - t, one), (zero, 1 - t)]
    points = np.concatenate([np.stack(side, axis=1) for side in sides])
    nodes = np.arange(4 * n)
    return Boundary(
        points=points,
        kind=np.ones(4 * n, np.uint8),
        size=np.full(4 * n, 1 / n),
        angle=np.full(4 * n, 180.0),
        segments=np.stack([nodes, np.roll(nodes, -1)], axis=1).astype(np.int32),
        track=np.full(4 * n, -1, np.int32),
        t=np.zeros((4 * n, 2)),
        mode=np.zeros(4 * n, np.uint8),
    )


def random_points(n):
    return np.random.default_rng(0).random((n, 2))


def hexagonal_points(n):
    """About n points of a hexagonal lattice, 0.6 spacings from the sides."""
    h = np.sqrt(2 / (np.sqrt(3) * n))
    rows = np.arange(0.6 * h, 1 - 0.6 * h, h * np.sqrt(3) / 2)
    return np.concatenate(
        [
            np.stack(np.broadcast_arrays(np.arange(h * (0.6 + j % 2 / 2), 1 - 0.6 * h, h), y), axis=1)
            for j, y in enumerate(rows)
        ]
    )


def microseconds(function, n):
    """Best CPU time of some runs, for each point."""
    best = np.inf
    for _ in range(max(3, min(50, 200_000 // n))):
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return 1e6 * best / n


def triangulators(points, boundary):
    """Names and functions without arguments that triangulate the square."""
    yield "fubini", lambda: constrained_delaunay(points, boundary)
    yield "qhull", lambda: Delaunay(points)
    try:
        import triangle
    except ImportError:
        return
    data = {"vertices": points, "segments": boundary.segments}
    yield "triangle", lambda: triangle.triangulate(data, "pQ")


def start_up():
    """CPU seconds from nothing to the first triangulation: with an empty cache of compiled kernels, then a full one."""
    with tempfile.TemporaryDirectory() as cache:
        env = {**os.environ, "FUBINI_CACHE_DIR": cache, "PYTHONPATH": os.pathsep.join(sys.path)}
        for name in ("empty cache", "full cache"):
            code = COLD.format(path=os.path.abspath(__file__))
            done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
            print(f"first triangulation, {name}: {float(done.stdout):.2f} CPU s")


def main(largest=1_000_000):
    start_up()
    constrained_delaunay(square(4).points, square(4))
    print(f"{'points':>9} {'kind':>9}   microseconds a point")
    for n in [100, 1_000, 10_000, 100_000, 1_000_000]:
        if n > largest:
            break
        boundary = square(max(2, int(np.sqrt(n))))
        for kind, make in (("random", random_points), ("hexagonal", hexagonal_points)):
            points = np.concatenate([boundary.points, make(n)])
            times = {name: microseconds(run, len(points)) for name, run in triangulators(points, boundary)}
            print(f"{len(points):9} {kind:>9}   " + "  ".join(f"{name} {t:.2f}" for name, t in times.items()))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
