"""Mesh generators on the faces of the comparison; as a program, one generator that takes orders on standard input.

Every generator gets a region and a size and answers with points (n, 2), triangles (m, 3) and the seconds that it
took to make them: CPU and wall time of the mesh generation alone, without building the geometry or reading arrays.
fubini's time is that of its stages boundary, faces and assembly, which end with the arrays of the mesh; ``cpu_all`` is
that of the whole of ``fubini.mesh``, with names and certificate.
"""

from __future__ import annotations

import ctypes
import json
import math
import os
import re
import signal
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "src"))

import fubini
import regions  # of tests/
from fubini.curves import CircularArc, Line
from fubini.quality import areas, aspect_ratios, corner_limit, flawed, skewness
from fubini.region import Loop, Region

TRIANGLE = math.sqrt(3.0) / 4.0
#: The stages of ``fubini.mesh`` that make the mesh.
MESHING = "boundary", "faces", "assemble"
#: Triangles of the two runs that warm a process up: the second reaches code that only large meshes need.
WARM = (200, 20_000)
#: Seconds after which a run is ended.
PATIENCE = 600
#: Generators with threads, which do not live through a fork: they are warmed up behind it.
THREADED = ("netgen",)


def wrench() -> Region:
    """Handle with two round heads, one with a hexagonal hole, one with a round one."""
    a, b = math.asin(0.35 / 1.0), math.asin(0.35 / 0.7)
    p, q = (math.cos(a), 0.35), (6 - 0.7 * math.cos(b), 0.35)
    head = CircularArc((0, 0), 1.0, a, 2 * math.pi - a, start=p, end=(p[0], -0.35))
    foot = CircularArc((6, 0), 0.7, b - math.pi, math.pi - b, start=(q[0], -0.35), end=q)
    outer = Loop((head, Line((p[0], -0.35), (q[0], -0.35)), foot, Line(q, p)))
    corners = [(0.55 * math.cos(k * math.pi / 3), 0.55 * math.sin(k * math.pi / 3)) for k in range(6)]
    return Region.from_loops([outer, regions.loop(corners), regions.circle(6, 0, 0.35)])


FACES: dict[str, Callable[[], Region]] = {
    "quarter disk": regions.quarter_disk, "plate": regions.plate, "gear": regions.gear, "wrench": wrench,
}  # fmt: skip


class Stopwatch:
    """CPU and wall seconds of a block; ``cpu_all`` with what follows the mesh (names, certificate)."""

    def __enter__(self) -> Stopwatch:
        self._start = time.process_time(), time.perf_counter()
        return self

    def __exit__(self, *_: object) -> None:
        self.cpu = self.cpu_all = time.process_time() - self._start[0]
        self.wall = time.perf_counter() - self._start[1]

    def seconds(self) -> dict[str, float]:
        """What was measured, by name."""
        return {"cpu": self.cpu, "cpu_all": self.cpu_all, "wall": self.wall}


def polyline(region: Region, size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points on the curves at equal steps, segments, and a point in each hole (for generators that know no curves)."""
    points, segments, holes = [], [], []
    for number, loop in enumerate(region.loops):
        part = []
        for curve in loop.curves:
            least = 1 if isinstance(curve, Line) else math.ceil(abs(curve.angle1 - curve.angle0) / 0.75)
            n = max(least, round(curve.length() / size))
            part.append(curve.point(np.arange(n) / n))
        nodes, start = np.concatenate(part), sum(map(len, points))
        count = np.arange(len(nodes))
        segments.append(start + np.column_stack([count, np.roll(count, -1)]))
        points.append(nodes)
        if number:
            holes.append(nodes.mean(axis=0))  # all holes here are convex
    return np.concatenate(points), np.concatenate(segments), np.array(holes)


def run_fubini(region: Region, size: float):
    """fubini: the seconds of its mesh generation, and those with names and certificate."""
    model = regions.model_of(region)
    with Stopwatch() as watch:
        mesh = fubini.mesh(model, size)
    watch.cpu, watch.wall = (sum(s[stage] for stage in MESHING) for s in (mesh.cpu_seconds, mesh.seconds))
    return mesh.points[:, :2], mesh.triangles, watch


def gmsh_geometry(region: Region) -> None:
    """The exact region as one plane surface of Gmsh's CAD kernel."""
    import gmsh

    occ, tags = gmsh.model.occ, []
    for loop in region.loops:
        n, curves = len(loop.curves), []
        corners = [occ.addPoint(*curve.start, 0.0) for curve in loop.curves]
        for i, curve in enumerate(loop.curves):
            ends = corners[i], corners[(i + 1) % n]
            if isinstance(curve, Line):
                curves.append(occ.addLine(*ends))
            elif n == 1:
                curves.append(occ.addCircle(*curve.center, 0.0, curve.radius))
            else:
                curves.append(occ.addCircleArc(ends[0], occ.addPoint(*curve.point(0.5), 0.0), ends[1], center=False))
        tags.append(occ.addCurveLoop(curves))
    occ.addPlaneSurface(tags)
    occ.synchronize()


def prepare_gmsh(region: Region, size: float, algorithm: int) -> None:
    """Gmsh with the region, its options set, and no mesh."""
    import gmsh

    if not gmsh.isInitialized():
        gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Verbosity", 0)
    gmsh.clear()
    settings = {
        "General.NumThreads": 1, "Mesh.Algorithm": algorithm, "Mesh.MeshSizeMin": size, "Mesh.MeshSizeMax": size,
        "Mesh.MeshSizeExtendFromBoundary": 0, "Mesh.MeshSizeFromPoints": 0,
    }  # fmt: skip
    for name, value in settings.items():
        gmsh.option.setNumber(name, value)
    gmsh_geometry(region)


def mesh_of_gmsh(order: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) and triangles (m, 3 or 6) of Gmsh's mesh."""
    import gmsh

    tags, points, _ = gmsh.model.mesh.getNodes()
    number = np.zeros(int(tags.max()) + 1, np.int64)
    number[tags] = np.arange(len(tags))
    _, corners = gmsh.model.mesh.getElementsByType((2, 9)[order - 1])
    return points.reshape(-1, 3)[:, :2], number[corners].reshape(-1, 3 * order)


def run_gmsh(algorithm: int, optimise: bool):
    """Gmsh's algorithm of this number (5 Delaunay, 6 Frontal-Delaunay), with or without Laplace2D."""

    def run(region: Region, size: float):
        import gmsh

        prepare_gmsh(region, size, algorithm)
        with Stopwatch() as watch:
            gmsh.model.mesh.generate(2)
            if optimise:
                gmsh.model.mesh.optimize("Laplace2D")
        return *mesh_of_gmsh(), watch

    return run


def run_netgen(region: Region, size: float):
    """Netgen on the exact region, its own grading."""
    from netgen import occ

    faces = []
    for loop in region.loops:
        edges = []
        for curve in loop.curves:
            a, m, b = (occ.Pnt(*curve.point(t), 0) for t in (0.0, 0.5, 1.0))
            if isinstance(curve, Line):
                edges.append(occ.Segment(a, b))
            elif len(loop.curves) == 1:
                edges.append(occ.Circle(occ.Pnt(*curve.center, 0), occ.Z, curve.radius))
            else:
                edges.append(occ.ArcOfCircle(a, m, b))
        faces.append(occ.Face(occ.Wire(edges)))
    shape = faces[0]
    for hole in faces[1:]:
        shape = shape - hole
    geometry = occ.OCCGeometry(shape, dim=2)
    with Stopwatch() as watch:
        mesh = geometry.GenerateMesh(maxh=size)
    table = mesh.Elements2D().NumPy()
    triangles = table["nodes"][:, :3].astype(np.int64) - 1
    points = np.array(mesh.Coordinates())[:, :2]  # a copy: the array is a view of what goes with the mesh
    return points, triangles, watch


def run_triangle(angle: int):
    """Triangle with this smallest angle, a largest area, and our polyline as its boundary."""

    def run(region: Region, size: float):
        import triangle

        points, segments, holes = polyline(region, size)
        data = {"vertices": points, "segments": segments}
        if len(holes):
            data["holes"] = holes
        options = f"pq{angle}a{1.5 * TRIANGLE * size * size:.17f}"
        with Stopwatch() as watch:
            mesh = triangle.triangulate(data, options)
        return mesh["vertices"], mesh["triangles"], watch

    return run


def run_cdt(region: Region, size: float):
    """PythonCDT refined to 33 degrees, on our polyline."""
    import pythoncdt as cdt

    points, segments, _ = polyline(region, size)
    area, most = 1.5 * TRIANGLE * size * size, 100_000_000
    with Stopwatch() as watch:
        mesh = cdt.Triangulation(cdt.VertexInsertionOrder.AUTO, cdt.IntersectingConstraintEdges.NOT_ALLOWED, 0.0)
        mesh.insert_vertices(np.ascontiguousarray(points))
        mesh.insert_edges(np.ascontiguousarray(segments, np.uint32))
        outside = mesh.collect_outer_triangles_and_holes()
        mesh.refine_triangles(most, cdt.RefinementCriterion.LARGEST_AREA, area, outside)
        mesh.refine_triangles(most, cdt.RefinementCriterion.SMALLEST_ANGLE, math.radians(33), outside)
        mesh.finalize_triangulation(outside)
    vertices = mesh.vertices_array()
    return np.column_stack([vertices["x"], vertices["y"]]), np.asarray(mesh.triangles_array()["vertices"]), watch


TOOLS = {
    "fubini": run_fubini,
    "gmsh 6": run_gmsh(6, False),
    "gmsh 6 + Laplace2D": run_gmsh(6, True),
    "gmsh 5": run_gmsh(5, False),
    "gmsh 5 + Laplace2D": run_gmsh(5, True),
    "netgen": run_netgen,
    "triangle q30": run_triangle(30),
    "triangle q33": run_triangle(33),
    "PythonCDT 33": run_cdt,
}


def judge(region: Region, points: np.ndarray, triangles: np.ndarray) -> dict:
    """Figures of a mesh from its arrays, against the exact region; the histogram has a bin a degree of skewness."""
    p = points[triangles]
    turned = areas(p) < 0.0
    p[turned] = p[turned][:, ::-1]
    ends = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).astype(np.int64)
    key, count = np.unique(ends[:, 0] * len(points) + ends[:, 1], return_counts=True)
    rim = points[np.unique(np.concatenate([key[count == 1] // len(points), key[count == 1] % len(points)]))]
    off = np.min([curve.closest(rim)[1] for curve in region.curves], axis=0)
    skew, aspect, area = skewness(p), aspect_ratios(p), region.area
    return {
        "triangles": len(triangles), "flawed": int(flawed(p).sum()),
        "unavoidable": sum(c.angle < corner_limit() for c in region.corners()),
        "worst_skew": float(skew.min()), "mean_skew": float(skew.mean()),
        "worst_ar": float(aspect.max()), "mean_ar": float(aspect.mean()),
        "boundary_distance": float(off.max()) / region.diagonal, "area_error": abs(float(areas(p).sum()) - area) / area,
        "histogram": np.histogram(skew, 90, (0.0, 90.0))[0].tolist(),
    }  # fmt: skip


def memory_of(key: str) -> int:
    """A size in bytes of /proc/self/status: VmRSS is the memory held now, VmHWM its peak."""
    return 1024 * int(re.search(key + r":\s+(\d+)", Path("/proc/self/status").read_text())[1])


def forked(work: Callable[[], dict]) -> dict:
    """What ``work`` answers in a child process, or the signal that killed it."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        try:
            answer = work()
        except Exception as error:  # a peer that fails is a result, too
            answer = {"error": f"{type(error).__name__}: {error}"[:200]}
        with os.fdopen(write, "w") as pipe:
            pipe.write(json.dumps(answer))
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        text = pipe.read()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return json.loads(text) if text else {"error": f"the process ended with status {status}"}


def warm_up(run: Callable) -> None:
    """Small runs, whose memory is given back."""
    disk = FACES["quarter disk"]()
    for count in WARM:
        run(disk, math.sqrt(disk.area / count / TRIANGLE))
    ctypes.CDLL(None).malloc_trim(0)


def measure(tool: str, face: str, size: float) -> dict:
    """One run, with its peak of memory above what the process held before, and the figures of its mesh."""
    run, region = TOOLS[tool], FACES[face]()
    signal.alarm(PATIENCE)
    if tool in THREADED:
        warm_up(run)
    before = memory_of("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # a new peak
    points, triangles, watch = run(region, size)
    memory = max(0, memory_of("VmHWM") - before)
    return watch.seconds() | {"memory": memory} | judge(region, points, triangles)


def again(tool: str, face: str, size: float) -> dict:
    """One run in this process, timed alone."""
    signal.alarm(PATIENCE)
    try:
        return TOOLS[tool](FACES[face](), size)[2].seconds()
    finally:
        signal.alarm(0)


def serve(tool: str, fresh: bool) -> None:
    """Answer orders ``[face, size]``, a line of JSON each, with figures in a line of JSON.

    Fresh runs happen in forks of this process, which has run nothing but the warming up: nothing
    that an earlier mesh left can be used again, so the peak of memory is that of the run.
    """
    if not (fresh and tool in THREADED):
        warm_up(TOOLS[tool])
    print("READY", flush=True)
    for line in sys.stdin:
        face, size = json.loads(line)
        answer = forked(partial(measure, tool, face, size)) if fresh else again(tool, face, size)
        print("ANSWER " + json.dumps(answer), flush=True)


if __name__ == "__main__":
    serve(sys.argv[1], fresh="fresh" in sys.argv[2:])
