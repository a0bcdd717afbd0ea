"""What a process pays before its first mesh: once compiled code is kept, and the very first time.

    python benchmarks/start.py [--repeat 5] [--cold 2] [--beside build123d]

Every row comes from processes of their own. The time counts from the end of the import of the CAD kernel
(``--beside``) to a mesh of a plate with a hole. Python's own byte code is kept, as it is for an installed package.
A process that finds all kernels compiled does not import numba; a row says so where one does.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

PARTS = ("fubini", "first mesh", "second mesh")
CHILD = """
import importlib, json, math, sys, time
for name in {beside!r}:
    importlib.import_module(name)
laps = [(time.process_time(), time.perf_counter())]
def lap():
    laps.append((time.process_time(), time.perf_counter()))
import fubini.pipeline
from fubini.region import Region
lap()
circle = [(2 + math.cos(a), 1.5 + math.sin(a)) for a in (math.tau * k / 40 for k in range(40))]
region = Region.polygon([(0, 0), (4, 0), (4, 3), (0, 3)], [circle])
for _ in range(2):
    fubini.mesh(region, 0.3)
    lap()
print(json.dumps(["numba" in sys.modules, *([b[i] - a[i] for a, b in zip(laps, laps[1:])] for i in (0, 1))]))
"""


def one_start(beside: list[str], cache: str) -> tuple[bool, list[float], list[float]]:
    """Whether numba was imported, CPU and wall seconds of each part in a new process; compiled code in ``cache``."""
    env = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    env |= {"FUBINI_CACHE_DIR": cache, "PYTHONPYCACHEPREFIX": str(Path(cache) / "bytecode")}
    env["PYTHONPATH"] = str(Path(importlib.util.find_spec("fubini").origin).parent.parent)
    code = CHILD.format(beside=beside)
    done = subprocess.run([sys.executable, "-c", code], env=env, stdout=subprocess.PIPE, text=True, check=True)
    numba, cpu, wall = json.loads(done.stdout)
    return numba, cpu, wall


def row(label: str, runs: list[tuple[bool, list[float], list[float]]]) -> str:
    """Medians of CPU seconds by part and in all, and of wall seconds in all, without the second mesh."""
    cpu = [statistics.median(run[1][k] for run in runs) for k in range(len(PARTS))]
    totals = [statistics.median(sum(run[i][:-1]) for run in runs) for i in (1, 2)]
    told = label + ", numba imported" * any(run[0] for run in runs)
    return f"| {told} | " + " | ".join(f"{x:.3f}" for x in (*cpu, *totals)) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=5, help="warm processes")
    parser.add_argument("--cold", type=int, default=1, help="processes with an empty cache")
    parser.add_argument("--beside", nargs="*", default=["numpy", "OCP", "build123d"], help="imported before")
    asked = parser.parse_args()
    print("| beside | " + " | ".join(PARTS) + " | CPU, s | wall, s |\n" + "|---" * (len(PARTS) + 3) + "|")
    with tempfile.TemporaryDirectory() as folder:
        for k in range(asked.cold):
            print(row("numpy, nothing compiled", [one_start(["numpy"], f"{folder}/{k}")]), flush=True)
        for name in asked.beside:
            if importlib.util.find_spec(name) is None:
                continue
            one_start([name], f"{folder}/0")
            print(row(name, [one_start([name], f"{folder}/0") for _ in range(asked.repeat)]), flush=True)


if __name__ == "__main__":
    main()
