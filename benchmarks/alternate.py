"""CPU time of fubini beside Gmsh and Triangle in one process, all taking turns, at matched numbers of triangles.

    python benchmarks/alternate.py --counts 200,2000,20000

As ``compare.py``, in the same environment, but for the times alone and without processes of their own: a mesh of
fubini finds what the interpreter ran just before in the caches of the processor, as in a program that makes many. Every
time is the median of ``--turns`` runs.
"""

from __future__ import annotations

import argparse
import math
import statistics

import peers
from compare import MATCHED, SEARCHES

#: The generators that take turns.
TOOLS = ("fubini", "gmsh 6", "triangle q33")


def matched(tool: str, face: str, count: int) -> tuple[float, int]:
    """A size for which the generator makes about so many triangles, and how many it makes."""
    area = peers.FACES[face]().area
    size = math.sqrt(area / (peers.TRIANGLE * count))
    best = (math.inf, size, 0)
    for _ in range(SEARCHES):
        triangles = len(peers.TOOLS[tool](peers.FACES[face](), size)[1])
        best = min(best, (abs(triangles / count - 1.0), size, triangles))
        if best[0] < MATCHED:
            break
        size *= math.sqrt(triangles / count)
    return best[1], best[2]


def take_turns(face: str, count: int, turns: int) -> dict[str, float]:
    """CPU time a triangle of every generator."""
    asked = {tool: matched(tool, face, count) for tool in TOOLS}
    times: dict[str, list[float]] = {tool: [] for tool in TOOLS}
    for _ in range(turns):
        for tool, (size, _) in asked.items():
            times[tool].append(peers.TOOLS[tool](peers.FACES[face](), size)[2].cpu)
    return {tool: statistics.median(times[tool]) / asked[tool][1] for tool in TOOLS}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--counts", default="200,2000,20000")
    parser.add_argument("--turns", type=int, default=5)
    asked = parser.parse_args()
    print("| triangles | face | fubini, us a triangle | gmsh 6 over fubini | triangle q33 over fubini |")
    print("|---|---|---|---|---|")
    for count in map(int, asked.counts.split(",")):
        for face in peers.FACES:
            found = take_turns(face, count, asked.turns)
            own = found["fubini"]
            ratios = " | ".join(f"{found[tool] / own:.3g}" for tool in TOOLS[1:])
            print(f"| {count:,} | {face} | {1e6 * own:.3g} | {ratios} |", flush=True)


if __name__ == "__main__":
    main()
