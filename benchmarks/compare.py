"""fubini beside Gmsh, Netgen, Triangle and PythonCDT: quality, time and memory at matched numbers of triangles.

Run in an environment of its own with the peers (``requirements.txt``) beside fubini:

    python benchmarks/compare.py --out benchmarks/compare --counts 200,2000,20000,200000,1000000
    python benchmarks/compare.py --quick          # two faces, up to 20,000 triangles, one minute
    python benchmarks/compare.py --render         # tables and plots again from the files of an earlier run

Each generator has two processes. In forks of the one it makes every mesh once, judged, with the peak of its
memory; in the other it makes it again, all generators taking turns, so that all suffer alike from other load: a
time is the median of five such runs, of three above a second. Above four seconds the first run counts alone. A
generator whose time at the last count, scaled to the next, is beyond ``--limit`` seconds is left out there, but
for those of ``--reach``.

Writes OUT.csv, OUT-skewness.csv (histograms), OUT.md and plots, those and the tables in ``docs`` (``tables.py``).
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import statistics
import subprocess
import sys
import time
from pathlib import Path

import tables

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "benchmarks" / "compare"
#: A size is matched when the number of triangles is within this share of the wanted one; it is searched so often.
MATCHED, SEARCHES = 0.06, 6
#: Seconds up to which a run is repeated four more times, and twice.
FIVE, THREE = 1.0, 4.0


class Worker:
    """One generator in a process of its own, started again when it dies."""

    def __init__(self, tool: str, mode: str) -> None:
        self.command = [sys.executable, str(Path(__file__).with_name("peers.py")), tool, mode]
        self.start()

    def start(self) -> None:
        """Start the process and wait until it is warm."""
        self.process = subprocess.Popen(self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.answer("READY")

    def answer(self, word: str) -> str | None:
        """The rest of the next line that starts with the word; None when the process ends before."""
        for line in self.process.stdout:
            if line.startswith(word):
                return line[len(word) :]
        return None

    def ask(self, face: str, size: float) -> dict:
        """One run."""
        self.process.stdin.write(json.dumps([face, size]) + "\n")
        self.process.stdin.flush()
        text = self.answer("ANSWER ")
        if text is None:
            status = self.process.wait()
            self.start()
            return {"error": f"the process ended with status {status}"}
        return json.loads(text)

    def close(self) -> None:
        self.process.stdin.close()
        self.process.wait(timeout=60)


class Generator:
    """One generator on one face, at rising counts."""

    def __init__(self, tool: str, face: str, area: float, workers: tuple[Worker, Worker]) -> None:
        self.tool, self.face, self.area = tool, face, area
        self.first, self.again = workers
        self.factor = 4.0 / math.sqrt(3.0)  # triangles times size squared over the area

    def match(self, count: int) -> dict:
        """First runs until the number of triangles is about the wanted one; the nearest of them."""
        best: dict = {}
        factor, last = self.factor, 0
        for _ in range(SEARCHES):
            size = math.sqrt(factor * self.area / count)
            row = self.first.ask(self.face, size)
            if "error" in row:
                row = self.first.ask(self.face, size)  # once more: a peer may die by chance
            if "error" in row:
                return row
            off = abs(row["triangles"] / count - 1.0)
            same, last = abs(row["triangles"] - last) < 0.02 * last, row["triangles"]
            if not best or off < best["off"]:
                best = row | {"size": size, "off": off}
            factor = row["triangles"] * size * size / self.area
            if off < MATCHED:
                self.factor = factor
            if off < MATCHED or row["cpu"] > THREE or same:  # the same again: no coarser mesh is to be had
                break
        return best

    def repeat(self, row: dict, turn: int) -> dict | None:
        """Another run of the mesh of this row, where one is due."""
        turns = 5 if row["cpu"] < FIVE else 3 if row["cpu"] < THREE else 0
        return self.again.ask(self.face, row["size"]) if turn < turns else None


def compare(count: int, generators: list[Generator]) -> list[dict]:
    """Rows of one face and count."""
    rows = {g.tool: g.match(count) for g in generators}
    able = [g for g in generators if "error" not in rows[g.tool]]
    times: dict[str, list[dict]] = {g.tool: [] for g in able}
    for turn in range(5):
        for g in able:
            run = g.repeat(rows[g.tool], turn)
            if run and "error" not in run:
                times[g.tool].append(run)
    for tool, runs in times.items():
        for key in ("cpu", "cpu_all", "wall"):
            rows[tool][key] = statistics.median(run[key] for run in runs) if runs else rows[tool][key]
        rows[tool]["runs"] = max(1, len(runs))
    for g in generators:
        rows[g.tool] |= {"face": g.face, "count": count, "tool": g.tool}
    add_ratios(rows)
    return list(rows.values())


def add_ratios(rows: dict[str, dict]) -> None:
    """CPU time a triangle over fubini's, for the mesh alone and with names and certificate."""
    ours = rows.get("fubini", {})
    for row in rows.values():
        for key, ratio in (("cpu", "ratio"), ("cpu_all", "ratio_all")):
            if key in ours and key in row:
                row[ratio] = row["cpu"] / row["triangles"] / (ours[key] / ours["triangles"])


def run(asked: argparse.Namespace) -> None:
    """Compare on all faces, at rising counts; the files are written after every count."""
    from peers import FACES, TOOLS

    tools = asked.tools.split(",") if asked.tools else list(TOOLS)
    counts = [int(c) for c in asked.counts.split(",")]
    workers = {tool: (Worker(tool, "fresh"), Worker(tool, "warm")) for tool in tools}
    rows: list[dict] = []
    started = time.perf_counter()
    for face in asked.faces.split(",") if asked.faces else list(FACES):
        area = FACES[face]().area
        able = [Generator(tool, face, area, workers[tool]) for tool in tools]
        for count, following in zip(counts, [*counts[1:], counts[-1]], strict=True):
            fresh = compare(count, able)
            rows += fresh
            for row in fresh:
                print(f"{time.perf_counter() - started:6.0f} s  {tables.line(row)}", flush=True)
            write(rows, asked.out)
            slow = {r["tool"] for r in fresh if r.get("cpu", math.inf) * following / count > asked.limit}
            able = [g for g in able if g.tool not in slow or f"{g.tool}:{face}" in asked.reach or g.tool in asked.reach]
    for pair in workers.values():
        for worker in pair:
            worker.close()


def write(rows: list[dict], out: str) -> None:
    """OUT.csv with all digits, OUT-skewness.csv with the histograms."""
    tables.write_rows(Path(out + ".csv"), tables.COLUMNS, rows)
    with open(out + "-skewness.csv", "w", newline="") as file:
        histogram = csv.writer(file, lineterminator="\n")
        histogram.writerow(["face", "count", "tool", *(f"{k} to {k + 1}" for k in range(90))])
        for row in rows:
            if row["count"] == tables.HISTOGRAM and "histogram" in row:
                histogram.writerow([row["face"], row["count"], row["tool"], *row["histogram"]])


def main() -> None:
    """Measure, then render."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default=str(OUT), help="other places leave the documentation as it is")
    parser.add_argument("--counts", default="200,2000,20000,200000,1000000")
    parser.add_argument("--faces", default="")
    parser.add_argument("--tools", default="")
    parser.add_argument("--limit", type=float, default=12.0, help="CPU seconds of one mesh")
    parser.add_argument("--reach", default="gmsh 6", help="generators that are run beyond the limit, TOOL or TOOL:FACE")
    parser.add_argument("--quick", action="store_true", help="two faces, up to 20,000 triangles, to compare-quick.*")
    parser.add_argument("--render", action="store_true", help="no measuring: tables and plots from the files")
    asked = parser.parse_args()
    if asked.quick:
        asked.out += "-quick"
        asked.counts, asked.faces, asked.limit, asked.reach = "200,2000,20000", "quarter disk,wrench", 3.0, ""
    asked.reach = asked.reach.split(",")
    if not asked.render:
        run(asked)
    tables.render(Path(asked.out), docs=Path(asked.out).resolve() == OUT)


if __name__ == "__main__":
    main()
