"""Small meshes built by hand, with certificates made by the real code."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fubini.certificate import Outline, certify, certify_face
from fubini.model import Edge, Face, Frame, Model, SkippedFace
from fubini.result import Mesh

FLAT_FRAME = Frame(np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))


class Polygon:
    """Stands in for a region of straight edges: its area, and evaluation of its edges."""

    def __init__(self, corners: Sequence[Sequence[float]]) -> None:
        self.corners = np.array(corners, float)
        x, y = self.corners.T
        self.area = 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())

    def evaluate(self, curve, t):
        a, b = self.corners[curve], np.roll(self.corners, -1, axis=0)[curve]
        return (1 - t)[:, None] * a + t[:, None] * b

    def angles(self):
        back = np.roll(self.corners, 1, axis=0) - self.corners
        ahead = np.roll(self.corners, -1, axis=0) - self.corners
        cross = ahead[:, 0] * back[:, 1] - ahead[:, 1] * back[:, 0]
        return np.degrees(np.arctan2(cross, (ahead * back).sum(1))) % 360.0


def outline_of(polygon: Polygon, plane: np.ndarray, triangles: np.ndarray) -> Outline:
    """The outline of a mesh of the polygon: boundary edges found from the triangles, tied by position."""
    directed = {(int(t[i]), int(t[(i + 1) % 3])) for t in triangles for i in range(3)}
    segments, curves, params = [], [], []
    for a, b in sorted(directed):
        if (b, a) in directed:
            continue
        for k, p in enumerate(polygon.corners):
            d = polygon.corners[(k + 1) % len(polygon.corners)] - p
            t = [float((plane[i] - p) @ d / (d @ d)) for i in (a, b)]
            off = max(math.dist(plane[i], p + s * d) for i, s in zip((a, b), t, strict=True))
            if off < 1e-6 and t[1] > t[0]:
                segments.append((a, b))
                curves.append(k)
                params.append(t)
                break
    corners = [int(np.linalg.norm(plane - c, axis=1).argmin()) for c in polygon.corners]
    return Outline(
        np.array(segments, np.int32).reshape(-1, 2),
        np.array(curves, np.int32),
        np.array(params).reshape(-1, 2),
        np.array(corners, np.int32),
        polygon.angles(),
        edges={k: 10 + k for k in range(len(polygon.corners))},
    )


def one_face(corners, plane, triangles, *, frame=FLAT_FRAME, index=0, name=None, area=None) -> Mesh:
    """A mesh of one polygonal face from plane points (n, 2) and triangles."""
    polygon = Polygon(corners)
    plane, triangles = np.array(plane, float), np.array(triangles, np.int32)
    face = Face(index, polygon, frame, name, polygon.area if area is None else area)
    points = frame.to_space(plane)
    outline = outline_of(polygon, plane, triangles)
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    found = certify_face(face, points, triangles, outline, polygon.evaluate, diagonal=diagonal)
    edges = {10 + k: Edge(10 + k, "line", k, (k + 1) % len(corners)) for k in range(len(corners))}
    vertices = dict(enumerate(frame.to_space(polygon.corners)))
    skipped = (SkippedFace(index + 1, "cylinder", "not planar"),)
    return Mesh(
        points,
        triangles,
        np.full(len(triangles), index, np.int32),
        outline.segments,
        np.array([outline.edges[int(c)] for c in outline.curve], np.int32),
        {index: name} if name else {},
        {},
        certify([found], skipped_faces=1),
        size=1.0,
        seconds={"load": 0.25, "triangulate": 0.5},
        model=Model("handmade", (face,), edges, vertices, skipped, diagonal),
    )


def grid(n: int):
    """Plane points and triangles of the unit square cut n by n, all halves of small squares."""
    x, y = np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n)
    plane = np.stack([x.ravel(), y.ravel()], axis=1)
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    low = np.stack([i, i + 1, i + n + 2], axis=1)
    return plane, np.concatenate([low, np.stack([i, i + n + 2, i + n + 1], axis=1)])


UNIT = [(0, 0), (1, 0), (1, 1), (0, 1)]


def square(n: int = 2, **options) -> Mesh:
    """The unit square, certified."""
    return one_face(UNIT, *grid(n), **options)


def bad_square() -> Mesh:
    """The unit square with its middle node pulled to one side: flawed triangles, none upside down."""
    plane, triangles = grid(2)
    plane[4] = (0.9, 0.6)
    return one_face(UNIT, plane, triangles)


def wedge(angle: float = 15.0, **options) -> Mesh:
    """An isosceles triangle with a sharp tip at the origin, the tip one triangle: that one is unavoidable."""
    half = math.radians(angle / 2)
    h = math.tan(half)
    plane = [(0.0, 0.0), (1.0, -h), (1.0, h)]
    return one_face(plane, plane, [(0, 1, 2)], **options)


def box(n: int = 2) -> Mesh:
    """The surface of the unit cube, every face cut n by n, nodes shared between faces."""
    frames = [
        Frame(np.array(o, float), np.array(x, float), np.array(y, float))
        for o, x, y in [
            ((0, 0, 0), (0, 1, 0), (1, 0, 0)),
            ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
            ((0, 0, 0), (1, 0, 0), (0, 0, 1)),
            ((1, 1, 0), (-1, 0, 0), (0, 0, 1)),
            ((0, 1, 0), (0, -1, 0), (0, 0, 1)),
            ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ]
    ]
    plane, triangles = grid(n)
    places: dict[tuple[float, ...], int] = {}
    all_triangles, outlines, faces = [], [], []
    polygon = Polygon(UNIT)
    for k, frame in enumerate(frames):
        number = np.array(
            [places.setdefault(tuple(np.round(p, 9) + 0.0), len(places)) for p in frame.to_space(plane)],
            np.int32,
        )
        outline = outline_of(polygon, plane, triangles)
        all_triangles.append(number[triangles])
        outlines.append(
            Outline(number[outline.segments], outline.curve, outline.t, number[outline.corners], outline.angles)
        )
        faces.append(Face(k, polygon, frame, "lid" if k == 1 else None, 1.0))
    points = np.array(list(places))
    found = [
        certify_face(f, points, t, o, polygon.evaluate, diagonal=3**0.5)
        for f, t, o in zip(faces, all_triangles, outlines, strict=True)
    ]
    return Mesh(
        points,
        np.concatenate(all_triangles),
        np.repeat(np.arange(6, dtype=np.int32), len(triangles)),
        np.empty((0, 2), np.int32),
        np.empty(0, np.int32),
        {1: "lid"},
        {},
        certify(found),
        size=1 / n,
        model=Model("box", tuple(faces), {}, {}, (), 3**0.5),
    )
