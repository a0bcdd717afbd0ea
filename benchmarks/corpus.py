#!/usr/bin/env python3
"""Mesh every CAD file of a corpus at several sizes, judge every mesh, print one table.

    python benchmarks/corpus.py [--corpus DIR] [--judge FILE] [--sizes 20,50,150] [--only TEXT]
                                [--fast] [--jobs 2] [--limit 60] [--json rows.json]

A size is a share of the model's diagonal. Without ``--fast`` every row is one run of the command
``fubini mesh FILE -o out.vtu --size H --json -`` in a process of its own, start included; with it
the meshes are made by warm processes through ``fubini.mesh``. The judge is a separate program that
reads the CAD file again. Drawings (DXF, SVG) are judged by the corpus' BREP copy of their faces: these
have another order and may be turned over, so faces are first matched by area and centroid. A copy
that its maker marked as incomplete (loops that he could not close were dropped) judges nothing.

The judge knows corners at the ends of edges. Where the kernel says that an edge has a kink inside, flawed
triangles are granted in the unavoidable corners that the certificate lists beyond his, and the table says so.

A row passes when the mesh is certified and the judge finds nothing amiss; a file of class
"hostile" passes with a clear refusal (exit code 2 and a message) as well. Exit status 0: all rows passed.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import multiprocessing
import queue
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


@dataclass
class Job:
    """One file at one size: ``source`` is meshed, ``model`` is what the judge reads."""

    name: str
    source: str
    model: str
    share: int
    size: float
    hostile: bool
    judged: bool = True


@dataclass
class Row:
    """What came of a job: ``code`` is the exit code (or what it would be), ``short`` what the judge found."""

    name: str
    share: int
    hostile: bool
    code: int | str = "-"
    seconds: float = 0.0
    triangles: int = 0
    flawed: int = 0
    unavoidable: int = 0
    worst_skew: float = 0.0
    worst_aspect_ratio: float = 0.0
    short: list[str] = field(default_factory=list)
    message: str = ""
    granted: int = 0

    @property
    def passed(self) -> bool:
        clean = self.code == 0 and not self.short
        return clean or (self.hostile and self.code == 2 and bool(self.message))


# ---- the work, in child processes ----------------------------------------------------------------


def mesh_by_command(job: Job, out: Path, limit: float) -> tuple[Row, float]:
    """Run ``fubini mesh`` as a user would."""
    row = Row(job.name, job.share, job.hostile)
    command = [sys.executable, "-c", "from fubini.cli import main; main()", "mesh", job.source]
    command += ["-o", str(out), "--size", repr(job.size), "--json", "-"]
    start = time.perf_counter()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        row.code = "timeout"
        return row, limit
    seconds = time.perf_counter() - start
    row.code = done.returncode
    row.message = (done.stderr.strip().splitlines() or [""])[-1]
    if done.stdout.lstrip().startswith("{"):
        fill(row, json.loads(done.stdout))
    return row, seconds


def mesh_in_process(job: Job, out: Path) -> tuple[Row, float]:
    """Call ``fubini.mesh`` in this process, which stays warm."""
    import fubini
    from fubini.errors import FubiniError

    row = Row(job.name, job.share, job.hostile)
    start = time.perf_counter()
    try:
        mesh = fubini.mesh(job.source, size=job.size)
        mesh.save(out)
    except FubiniError as error:
        row.code, row.message = 2, str(error)
        return row, time.perf_counter() - start
    except Exception as error:
        row.code, row.message = "crash", f"{type(error).__name__}: {error}"
        return row, time.perf_counter() - start
    seconds = time.perf_counter() - start
    certificate = mesh.certificate
    row.code = 0 if certificate.certified else 1
    faces = certificate.faces
    row.message = "; ".join(f"face {f.face}: {', '.join(f.reasons)}" for f in faces if f.reasons)[:300]
    fill(
        row,
        {
            "triangles": certificate.triangles,
            "flawed": certificate.flawed,
            "unavoidable": certificate.unavoidable,
            "worst_skew": min(f.worst_skew for f in faces),
            "worst_aspect_ratio": max(f.worst_aspect_ratio for f in faces),
        },
    )
    return row, seconds


def fill(row: Row, figures: dict) -> None:
    """Copy the figures of a report into the row."""
    for key in ("triangles", "flawed", "unavoidable", "worst_skew", "worst_aspect_ratio"):
        setattr(row, key, figures.get(key) or 0)


def match_faces(judge, model: str, out: Path) -> None:
    """Give a drawing's mesh the face numbers and orientations of the BREP copy, by area and centroid."""
    import meshio
    import numpy as np
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_FACE

    from fubini.cad.occ import static

    known, normals = [], []
    for face in judge.mapped(judge.read_shape(model), TopAbs_FACE):
        normals.append(judge.Face(face, judge.Edge).normal)
        props = GProp_GProps()
        static(BRepGProp, "SurfaceProperties")(face, props)
        centre = props.CentreOfMass()
        known.append([centre.X(), centre.Y(), centre.Z(), abs(props.Mass()) ** 0.5])
    known = np.array(known)
    mesh = meshio.read(out)
    names = mesh.cell_data["face"][0]
    triangles = mesh.cells[0].data
    p = mesh.points[triangles]
    normal = 0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    area = np.linalg.norm(normal, axis=1)
    renamed = names.copy()
    for name in np.unique(names):
        own = names == name
        centre = (p[own].mean(1) * area[own, None]).sum(0) / area[own].sum()
        found = np.linalg.norm(known - [*centre, area[own].sum() ** 0.5], axis=1).argmin()
        renamed[own] = found
        if normal[own].sum(0) @ normals[found] < 0:
            triangles[own] = triangles[own][:, ::-1]
    mesh.cell_data["face"][0] = renamed
    mesh.write(out)


def take_verdict(judge, verdict: dict, model: str, row: Row) -> None:
    """What the judge found amiss, less flawed triangles in sharp corners inside an edge, which he does not look for."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GeomAbs import GeomAbs_Shape
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopoDS import TopoDS

    from fubini.cad.occ import static

    row.short = list(verdict["falls_short"])
    if "excess_flawed" in row.short and verdict["excess_flawed"] <= row.unavoidable - verdict["unavoidable"]:
        edges = [static(TopoDS, "Edge")(e) for e in judge.mapped(judge.read_shape(model), TopAbs_EDGE)]
        if any(BRepAdaptor_Curve(edge).Continuity() == GeomAbs_Shape.GeomAbs_C0 for edge in edges):
            row.short.remove("excess_flawed")
            row.granted = verdict["excess_flawed"]


def work(connection, options: dict) -> None:
    """Loop of a child process: mesh and judge the jobs that come in."""
    spec = importlib.util.spec_from_file_location("judge", options["judge"])
    judge = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(judge)
    while (job := connection.recv()) is not None:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "out.vtu"
            if options["fast"]:
                row, row.seconds = mesh_in_process(job, out)
            else:
                row, row.seconds = mesh_by_command(job, out, options["limit"])
            connection.send("judging")
            if out.exists() and job.judged:
                try:
                    if job.source != job.model:
                        match_faces(judge, job.model, out)
                    take_verdict(judge, judge.judge(job.model, str(out), job.size), job.model, row)
                except Exception as error:
                    row.short = [f"judge: {type(error).__name__}: {error}"]
            elif row.code in (0, 1) and not out.exists():
                row.short = ["nothing written"]
        connection.send(row)


class Worker(threading.Thread):
    """Feeds one child process, and replaces it when a job takes longer than the limit or kills it."""

    def __init__(self, jobs: queue.Queue, rows: list[Row], options: dict) -> None:
        super().__init__(daemon=True)
        self.jobs, self.rows, self.options = jobs, rows, options

    def run(self) -> None:
        self.child = None
        while True:
            try:
                job = self.jobs.get_nowait()
            except queue.Empty:
                break
            row = self.one(job)
            self.rows.append(row)
            print_row(row)
        if self.child:
            self.connection.send(None)
            self.child.join()

    def one(self, job: Job) -> Row:
        if self.child is None:
            self.start_child()
        row = Row(job.name, job.share, job.hostile)
        try:
            self.connection.send(job)
            # the first job of a warm process pays for imports and compilation
            wait = self.options["limit"] + (240 if self.fresh else 10)
            self.fresh = False
            for limit, stage in ((wait, "mesh"), (600, "judge")):
                if not self.connection.poll(limit):
                    row.code, row.seconds = f"{stage} timeout", limit
                    self.stop_child()
                    return row
                answer = self.connection.recv()
            return answer
        except (EOFError, BrokenPipeError):
            row.code = "died"
            self.stop_child()
            return row

    def start_child(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, other = context.Pipe()
        self.child = context.Process(target=work, args=(other, self.options), daemon=True)
        self.child.start()
        other.close()
        self.fresh = True

    def stop_child(self) -> None:
        self.child.kill()
        self.child.join()
        self.child = None


# ---- the table -----------------------------------------------------------------------------------


def print_row(row: Row) -> None:
    """One line of the table."""
    verdict = "ok" if row.passed else "FAIL"
    extra = ", ".join(row.short) or (row.message if row.code != 0 else "")
    extra += f"{row.granted} flawed in corners inside edges, which the judge counts as excess" if row.granted else ""
    print(
        f"{verdict:4} {row.name[-52:]:52} /{row.share:<4} exit {row.code!s:8} {row.seconds:7.2f} s "
        f"{row.triangles:8d} tri {row.flawed:4d} flawed {row.unavoidable:4d} unavoidable "
        f"skew {row.worst_skew:5.1f}  {extra}",
        flush=True,
    )


def corpus_jobs(corpus: Path, shares: list[int], only: str) -> list[Job]:
    """All jobs of a corpus, coarse sizes first; drawings both as they are and as their BREP copy."""
    jobs = []
    for line in (corpus / "manifest.jsonl").read_text().splitlines():
        entry = json.loads(line)
        source = str(corpus / entry["copy"])
        model = str(corpus / entry["derived_brep"]) if entry.get("derived_brep") else source
        hostile = entry["class"] == "hostile"
        complete = not entry.get("extra", {}).get("dxf_fallback", {}).get("open_wires_dropped")
        for meshed in dict.fromkeys([source, model]):
            name = str(Path(meshed).relative_to(corpus))
            judged = complete or meshed == model
            if only.lower() in name.lower():
                jobs += [Job(name, meshed, model, n, entry["diag"] / n, hostile, judged) for n in shares]
    return sorted(jobs, key=lambda job: job.share)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--corpus", type=Path, default=ROOT.parent / "shared" / "corpus")
    parser.add_argument("--judge", type=Path, default=ROOT.parent / "shared" / "judge" / "judge.py")
    parser.add_argument("--sizes", default="20,50,150", help="diagonal over these numbers")
    parser.add_argument("--only", default="", help="files whose name holds this text")
    parser.add_argument("--fast", action="store_true", help="warm processes instead of one process a run")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--limit", type=float, default=60.0, help="seconds allowed for one run")
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    args = parser.parse_args()

    jobs = corpus_jobs(args.corpus, [int(n) for n in args.sizes.split(",")], args.only)
    todo: queue.Queue = queue.Queue()
    for job in jobs:
        todo.put(job)
    rows: list[Row] = []
    options = {"judge": str(args.judge), "fast": args.fast, "limit": args.limit}
    workers = [Worker(todo, rows, options) for _ in range(max(1, args.jobs))]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    rows.sort(key=lambda row: (row.name, row.share))
    failed = [row for row in rows if not row.passed]
    print(
        f"\n{len(rows)} runs, {len(rows) - len(failed)} passed, {len(failed)} failed, "
        f"slowest {max((row.seconds for row in rows), default=0):.1f} s"
    )
    for row in [*failed, *(row for row in rows if row.passed and row.granted)]:
        print_row(row)
    if args.json:
        args.json.write_text(json.dumps([asdict(row) | {"passed": row.passed} for row in rows], indent=1))
    return 1 if failed or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
