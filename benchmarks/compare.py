"""fubini beside Gmsh, Netgen, Triangle and PythonCDT: quality, time and memory at matched numbers of triangles.

Run in an environment of its own with the peers (``requirements.txt``) beside fubini:

    python benchmarks/compare.py --out compare --counts 200,2000,20000,200000 --limit 30

Every generator lives in a process of its own; the processes take turns, so that all suffer alike from other load. A
time is the median of five runs, of three where one takes more than two seconds. A generator whose time at the last
count, scaled to the next, is beyond ``--limit`` seconds is left out there. Writes OUT.csv and OUT.md.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

from peers import FACES, TOOLS

COLUMNS = (
    "face", "count", "tool", "triangles", "flawed", "unavoidable", "worst_skew", "mean_skew", "worst_ar", "mean_ar",
    "boundary_distance", "area_error", "cpu", "cpu_all", "wall", "memory", "ratio", "error",
)  # fmt: skip


class Worker:
    """One generator in its own process."""

    def __init__(self, tool: str) -> None:
        command = [sys.executable, str(Path(__file__).with_name("peers.py")), tool]
        root = Path(__file__).parent.parent
        paths = {**os.environ, "PYTHONPATH": os.pathsep.join([str(root / "src"), str(root / "tests")])}
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=paths
        )

    def ask(self, face: str, count: int, size: float | None) -> dict:
        """One run; the first of a face and count (size None) searches the size."""
        self.process.stdin.write(json.dumps([face, count, size]) + "\n")
        self.process.stdin.flush()
        for line in self.process.stdout:
            if line.startswith("ANSWER "):
                return json.loads(line[7:])
        return {"error": "the process died"}

    def close(self) -> None:
        self.process.stdin.close()
        self.process.wait(timeout=60)


def compare(face: str, count: int, workers: dict[str, Worker]) -> list[dict]:
    """Rows of one face and count."""
    rows = {tool: worker.ask(face, count, None) for tool, worker in workers.items()}
    times = {tool: [row] for tool, row in rows.items() if "error" not in row}
    for turn in range(1, 5):
        for tool, done in times.items():
            if turn < 3 or done[0]["cpu"] < 2.0:
                done.append(workers[tool].ask(face, count, rows[tool]["size"]))
    for tool, done in times.items():
        for key in ("cpu", "cpu_all", "wall", "memory"):
            rows[tool][key] = statistics.median(row[key] for row in done)
    ours = rows.get("fubini", {}).get("cpu")
    for tool, row in rows.items():
        row |= {"face": face, "count": count, "tool": tool}
        if ours and "cpu" in row:  # CPU time a triangle over ours
            row["ratio"] = row["cpu"] / row["triangles"] / (ours / rows["fubini"]["triangles"])
    return list(rows.values())


def write_tables(rows: list[dict], out: str) -> None:
    """OUT.csv with all digits, OUT.md to read."""
    with open(out + ".csv", "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, extrasaction="ignore", restval="")
        table.writeheader()
        table.writerows(rows)
    head = (
        "face", "tool", "triangles", "flawed (unavoidable)", "worst, mean skewness", "worst, mean aspect ratio",
        "boundary distance", "area error", "CPU s", "wall s", "MB", "time / ours",
    )  # fmt: skip
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for row in rows:
        if "error" in row:
            lines.append(f"| {row['face']} | {row['tool']} | {row['count']:,} wanted: {row['error']} |" + " |" * 9)
            continue
        lines.append(
            "| {face} | {tool} | {triangles:,} | {flawed} ({unavoidable}) | {worst_skew:.1f}, {mean_skew:.1f} "
            "| {worst_ar:.2f}, {mean_ar:.3f} | {boundary_distance:.1e} | {area_error:.1e} | {cpu:.4f} | {wall:.4f} "
            "| {megabytes:.1f} | {ratio:.2f} |".format(**{"ratio": float("nan"), **row}, megabytes=row["memory"] / 1e6)
        )
    Path(out + ".md").write_text("\n".join(lines) + "\n")


def main() -> None:
    """Compare on all faces, at rising counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default="compare")
    parser.add_argument("--counts", default="200,2000,20000,200000")
    parser.add_argument("--faces", default=",".join(FACES))
    parser.add_argument("--tools", default=",".join(TOOLS))
    parser.add_argument("--limit", type=float, default=30.0)
    asked = parser.parse_args()
    workers = {tool: Worker(tool) for tool in asked.tools.split(",")}
    rows: list[dict] = []
    for face in asked.faces.split(","):
        able = dict(workers)
        counts = [int(c) for c in asked.counts.split(",")]
        for count, following in zip(counts, [*counts[1:], counts[-1]], strict=True):
            fresh = compare(face, count, able)
            for row in fresh:
                print(json.dumps(row), flush=True)
            rows += fresh
            write_tables(rows, asked.out)
            slow = {r["tool"] for r in fresh if r.get("cpu", 1e9) * following / count > asked.limit}
            able = {tool: worker for tool, worker in able.items() if tool not in slow}
    for worker in workers.values():
        worker.close()


if __name__ == "__main__":
    main()
