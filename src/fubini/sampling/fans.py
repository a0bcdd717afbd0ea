"""Points about boundary nodes where a long segment meets a much shorter one.

Beside a cusp of another face the corner's long leg is followed by short segments. Triangles about the node between
them must shrink from the one length to the other within half a turn, by more than growth allows anywhere else: sectors
of 45 degrees whose rays shrink geometrically do, up to a ratio of 13, and of 36 degrees up to 16.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fubini.sampling._kernels_boundary import LONG_SEGMENT
from fubini.triangulation.value import Boundary

Float = NDArray[np.float64]

#: Neighbouring segments that differ by more than this get a fan ...
STEEP = 4.0
#: ... and by more than this where one of them is much longer than asked ...
STEEP_AT_LONG = 1.3
#: ... or the base of a corner that is cut off: the turn beside it is less.
STEEP_AT_BASE = 2.0
#: Angle of a sector, radians ...
SECTOR = math.pi / 4.0
#: ... and where the segments differ by more than the second number: five in half a turn go furthest, up to 16.3.
NARROW_SECTOR, FAR = math.pi / 5.0, 12.0
#: A point keeps this share of its ray from every segment that does not end at the node ...
CLEAR = 0.3
#: ... and other points this share from it.
ALONE = 0.5
#: Ends of segments where there are none.
NO_SEGMENTS: Float = np.empty((0, 2, 2))
#: Segments much longer than asked keep the lattice away by this times the excess: right-angled triangles shrink to the
#: size over that distance.
ROOM = 1.2


def long_segments(boundary: Boundary, size: float) -> Float:
    """Ends (k, 2, 2) of the segments that are much longer than ``size``; the nodes there are larger than asked, too."""
    if np.maximum.reduce(boundary.size) <= size:
        return NO_SEGMENTS
    ends = boundary.points[boundary.segments]
    return ends[np.hypot(*(ends[:, 1] - ends[:, 0]).T) > LONG_SEGMENT * size]


def clear_of_segments(inner: Float, long: Float, size: float) -> Float:
    """The interior points (n, 2) without those where triangles shrink to ``size`` from ``long`` segments (k, 2, 2)."""
    for ends in long:
        reach = ROOM * (math.dist(*ends) - size)
        inner = inner[_distances(inner, ends[None]) > reach]
    return inner


def with_fans(inner: Float, boundary: Boundary, size: float) -> tuple[Float, Float]:
    """The interior points (n, 2) with those of all fans, which replace what lies close to them; sizes wanted there.

    Sizes (n,) are the length of the ray in a fan, else ``size``. A point may lie outside the region where it is thin.
    """
    wanted = np.full(len(inner), size)
    points, segments = boundary.points, boundary.segments
    a, b = segments.T
    length = np.hypot(*(points[b] - points[a]).T)
    leaving = np.empty(len(points), np.intp)
    leaving[a] = np.arange(len(a))
    following = leaving[b]
    ratio = length[following] / length
    steep = np.where(np.maximum(length[following], length) > LONG_SEGMENT * size, STEEP_AT_LONG, STEEP)
    steep = np.where((boundary.track < 0) | (boundary.track[following] < 0), np.minimum(steep, STEEP_AT_BASE), steep)
    for k in np.flatnonzero((ratio > steep) | (ratio < 1.0 / steep)):
        fan, ray = _fan(boundary, int(b[k]), points[b[following[k]]], points[a[k]])
        if len(fan):
            distance = np.linalg.norm(inner[:, None] - fan, axis=2)
            apart = (distance > ALONE * ray).all(axis=1)
            inner, wanted = np.concatenate([inner[apart], fan]), np.concatenate([wanted[apart], ray])
    return inner, wanted


def _fan(boundary: Boundary, node: int, ahead: Float, behind: Float) -> tuple[Float, Float]:
    """Ends (r, 2) and lengths (r,) of the rays about ``node``, from the segment to ``ahead`` to that to ``behind``."""
    at = boundary.points[node]
    u, v = ahead - at, behind - at
    first, last = float(np.hypot(*u)), float(np.hypot(*v))
    turn = math.atan2(u[0] * v[1] - u[1] * v[0], float(u @ v)) % (2.0 * math.pi)
    count = round(turn / (SECTOR if max(first, last) < FAR * min(first, last) else NARROW_SECTOR))
    if count < 2:
        return np.empty((0, 2)), np.empty(0)
    share = np.arange(1, count) / count
    direction = math.atan2(u[1], u[0]) + share * turn
    ray = first ** (1.0 - share) * last**share
    points = at + ray[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
    away = (boundary.segments != node).all(axis=1)
    keep = _distances(points, boundary.points[boundary.segments[away]]) > CLEAR * ray
    return points[keep], ray[keep]


def _distances(points: Float, ends: Float) -> Float:
    """Distance (n,) of points (n, 2) from the nearest of the segments with ``ends`` (k, 2, 2)."""
    p, d = ends[:, 0], ends[:, 1] - ends[:, 0]
    w = points[:, None] - p
    along = np.clip((w * d).sum(axis=2) / np.maximum((d * d).sum(axis=1), 1e-300), 0.0, 1.0)
    off = w - along[..., None] * d
    return np.hypot(off[..., 0], off[..., 1]).min(axis=1, initial=np.inf)
