"""A free-form outline with one straight side, known only by points along it (the paper's fourth example).

    python cad_examples/free_form.py out

Two ways to a mesh. The first takes coarse straight lines for the outline, meshes those, moves the nodes on them
to the nearest place of the finer outline, and optimises again. The second fits Bezier curves to the points
and meshes the region that they bound.
"""

from __future__ import annotations

from typing import Any

import numpy as np

NAME = "free_form"
SIZE = 0.9
PATTERNS = ("SP13", "SP41")

#: Every so many points one corner of the coarse outline.
COARSE = 4
#: The Bezier curves stay within this of the points.
TOLERANCE = 0.02

#: From the right end of the straight side around to its left end.
POINTS = np.array(
    [
        (10, 0), (10.37, 0.28), (10.69, 0.67), (10.95, 1.13), (11.16, 1.65), (11.29, 2.2), (11.34, 2.75),
        (11.3, 3.28), (11.16, 3.77), (10.92, 4.18), (10.57, 4.5), (10.14, 4.76), (9.67, 4.99), (9.2, 5.22),
        (8.76, 5.5), (8.38, 5.83), (8.05, 6.21), (7.76, 6.63), (7.5, 7.09), (7.25, 7.55), (6.98, 7.99),
        (6.66, 8.35), (6.25, 8.61), (5.77, 8.77), (5.25, 8.83), (4.7, 8.81), (4.16, 8.72), (3.64, 8.57),
        (3.18, 8.34), (2.79, 8.03), (2.5, 7.64), (2.31, 7.18), (2.15, 6.68), (1.99, 6.2), (1.76, 5.75),
        (1.45, 5.36), (1.08, 5), (0.68, 4.66), (0.27, 4.34), (-0.13, 4.01), (-0.49, 3.65), (-0.77, 3.25),
        (-0.95, 2.79), (-1.03, 2.28), (-1, 1.75), (-0.88, 1.24), (-0.67, 0.75), (-0.37, 0.33), (0, 0),
    ]
)  # fmt: skip


def build() -> Any:
    """The face bounded by Bezier curves fitted to the points, and the straight side."""
    from build123d import Bezier, Line, make_face

    import fubini

    fit = fubini.fit_bezier(POINTS, TOLERANCE)
    curves = [Bezier(*(tuple(pole) for pole in curve.poles)) for curve in fit.curves]
    face = make_face([*curves, Line((0, 0), (10, 0))]).face()
    face.label = "free form"
    return face


def build_lines() -> Any:
    """The face bounded by straight lines between every fourth point."""
    from build123d import Polyline, make_face

    corners = [tuple(p) for p in POINTS[::COARSE]]
    return make_face(Polyline(*corners, close=True)).face()


def mesh_by_lines(size: float = SIZE, pattern: str = "auto") -> Any:
    """The first way: the optimised triangulation whose boundary nodes lie on the finer outline."""
    import fubini
    from fubini.optimise import optimise

    coarse = fubini.mesh(build_lines(), size, pattern=pattern)
    moved, tracks = move_to_boundary(coarse, outline())
    return optimise(moved, tracks)


def outline() -> np.ndarray:
    """The finer outline as a closed polygon (n, 2): all the points, and the straight side back to the first."""
    return POINTS


def move_to_boundary(mesh: Any, polygon: np.ndarray) -> tuple[Any, Any]:
    """A mesh of one face with its boundary nodes moved to the nearest places of a polygon.

    Gives a triangulation whose boundary is fixed from now on, and the tracks (its segments) that go with it.
    """
    from fubini.tracks import TrackBuilder
    from fubini.tracks.table import LINE
    from fubini.triangulation.constrained import constrained_delaunay
    from fubini.triangulation.value import CORNER, LOCKED, Boundary

    ring = _ring(mesh.triangles)
    inner = np.setdiff1d(np.arange(len(mesh.points)), ring)
    nodes = nearest_on(polygon, mesh.points[ring, :2])
    n = len(ring)
    segments = np.column_stack([np.arange(n), np.roll(np.arange(n), -1)]).astype(np.int32)
    ahead, back = np.roll(nodes, -1, axis=0) - nodes, np.roll(nodes, 1, axis=0) - nodes
    lengths = np.linalg.norm(ahead, axis=1)
    builder = TrackBuilder()
    for a, b in segments:
        builder.add(LINE, nodes[a], nodes[b])
    turn = np.arctan2(back[:, 1], back[:, 0]) - np.arctan2(ahead[:, 1], ahead[:, 0])
    boundary = Boundary(
        points=nodes,
        kind=np.full(n, CORNER, np.uint8),
        size=(lengths + np.roll(lengths, 1)) / 2,
        angle=np.degrees(turn % (2 * np.pi)),
        segments=segments,
        track=np.arange(n, dtype=np.int32),
        t=np.tile([0.0, 1.0], (n, 1)),
        mode=np.full(n, LOCKED, np.uint8),
    )
    points = np.concatenate([nodes, mesh.points[inner, :2]])
    return constrained_delaunay(points, boundary), builder.build()


def _ring(triangles: np.ndarray) -> np.ndarray:
    """Nodes of the one outline of a mesh, counter-clockwise."""
    sides = {(int(t[i]), int(t[i - 2])) for t in triangles for i in range(3)}
    following = {a: b for a, b in sides if (b, a) not in sides}
    ring = [min(following)]
    while following[ring[-1]] != ring[0]:
        ring.append(following[ring[-1]])
    return np.array(ring)


def nearest_on(polygon: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The nearest places of a closed polygon (n, 2) to points (m, 2)."""
    side = np.roll(polygon, -1, axis=0) - polygon
    apart = points[:, None] - polygon
    share = np.clip((apart * side).sum(axis=2) / (side * side).sum(axis=1), 0, 1)
    places = polygon + share[:, :, None] * side
    nearest = np.argmin(((points[:, None] - places) ** 2).sum(axis=2), axis=1)
    return places[np.arange(len(points)), nearest]


if __name__ == "__main__":
    from example import run

    if run(NAME, build(), SIZE, PATTERNS):
        outcome = mesh_by_lines()
        count = len(outcome.triangulation.triangles)
        print(f"\nby lines moved to the boundary: {count} triangles, {outcome.flawed_after} flawed")
