"""Interior angles where two curves of a loop meet."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fubini.curves import CircularArc, Curve, Line

Float = NDArray[np.float64]

#: A derivative shorter than this times the extent of the curve gives no direction.
_NO_DIRECTION = 1e-7

#: Within this many degrees of a cusp the side of the material is read off the curves themselves.
_CUSP = 0.3

#: Curves that leave a joint in one direction are told apart where they are further apart than this times their
#: length: short of that, ends that run into a cusp may cross within the accuracy of CAD data.
_APART = 1e-6


@dataclass(frozen=True)
class Corner:
    """The joint before curve ``index`` of loop ``loop``: place (2,) and interior angle.

    ``angle`` is in degrees in [0, 360]: 180 where the joint is smooth, 0 for a tangential cusp
    filled with material, 360 for one filled with air.
    """

    loop: int
    index: int
    point: tuple[float, float]
    angle: float


def start_direction(curve: Curve) -> Float:
    """Unit tangent (2,) at the start, also where the derivative vanishes there."""
    return np.array(_tangent(curve, 0.0))


def end_direction(curve: Curve) -> Float:
    """Unit tangent (2,) at the end, in the direction of travel."""
    return np.array(_tangent(curve, 1.0))


def _tangent(curve: Curve, t: float) -> tuple[float, float]:
    """Unit tangent at t = 0 or 1: of lines and circles, which most corners join, without arrays."""
    if isinstance(curve, Line):
        (ax, ay), (bx, by) = curve.start.tolist(), curve.end.tolist()
        x, y = bx - ax, by - ay
        length = math.hypot(x, y)
        return x / length, y / length
    if isinstance(curve, CircularArc):
        sense = math.copysign(1.0, curve.angle1 - curve.angle0)
        u = curve.angle1 if t == 1.0 else curve.angle0
        return -sense * math.sin(u), sense * math.cos(u)
    x, y = _direction(curve, t).tolist()
    return x, y


def _direction(curve: Curve, t: float) -> Float:
    """Unit tangent of any curve."""
    first = np.asarray(curve.derivative(np.array([t])), float)[0]
    sign = 1.0 if t == 0.0 else -1.0
    low, high = np.asarray(curve.bounding_box(), float)
    extent = float(np.hypot(*(high - low)))
    if np.hypot(*first) > _NO_DIRECTION * extent:
        return first / np.hypot(*first)
    # Taylor at the end: point(t) - end = second / 2 (t - end)^2 + ...
    second = sign * np.asarray(curve.second_derivative(np.array([t])), float)[0]
    if np.hypot(*second) > _NO_DIRECTION * extent:
        return second / np.hypot(*second)
    p = np.asarray(curve.point(np.array([t, t + sign * 1e-3])), float)
    secant = sign * (p[1] - p[0])
    length = float(np.hypot(*secant))
    return secant / length if length > 0.0 else np.array([1.0, 0.0])


def interior_angle(before: Curve, after: Curve) -> float:
    """Angle in degrees in [0, 360] of the material (on the left) where ``before`` meets ``after``."""
    incoming, outgoing = _tangent(before, 1.0), _tangent(after, 0.0)
    back = math.atan2(-incoming[1], -incoming[0])
    angle = math.degrees(back - math.atan2(outgoing[1], outgoing[0])) % 360.0
    if min(angle, 360.0 - angle) > _CUSP:
        return angle
    if material_in_cusp(before, after, np.array(outgoing)):
        return angle if angle < 180.0 else 0.0
    return angle if angle > 180.0 else 360.0


def material_in_cusp(before: Curve, after: Curve, direction: Float) -> bool:
    """Whether the sliver between two curves that leave a point in one direction is material.

    It is when the curve that arrives lies to the left of the curve that leaves; read off at a few
    small distances along the common direction, the smallest that shows a difference deciding.
    """
    vertex = np.asarray(after.start, float)
    normal = np.array([-direction[1], direction[0]])
    leaving, arriving = after, before.reverse()
    size = min(_reach(leaving, vertex, direction), _reach(arriving, vertex, direction))
    for part in (1e-3, 1e-2, 1e-1, 0.5, 1.0):
        a = _offset(leaving, vertex, direction, normal, part * size)
        b = _offset(arriving, vertex, direction, normal, part * size)
        if abs(b - a) > _APART * size:
            return b > a
    return True


def _profile(curve: Curve, vertex: Float, direction: Float) -> tuple[Float, Float]:
    """Parameters and how far along ``direction`` the curve has come, up to where it turns back."""
    t = np.concatenate([[0.0], np.geomspace(1e-7, 1.0, 141)])
    along = (np.asarray(curve.point(t), float) - vertex) @ direction
    falls = np.flatnonzero(np.diff(along) < 0.0)
    stop = int(falls[0]) + 1 if len(falls) else len(t)
    return t[:stop], along[:stop]


def _reach(curve: Curve, vertex: Float, direction: Float) -> float:
    return float(_profile(curve, vertex, direction)[1][-1])


def _offset(curve: Curve, vertex: Float, direction: Float, normal: Float, distance: float) -> float:
    """Height over ``direction`` of the curve where it has come ``distance`` along it."""
    t, along = _profile(curve, vertex, direction)
    k = int(np.clip(np.searchsorted(along, distance), 1, len(t) - 1)) if len(t) > 1 else 0
    low, high = float(t[max(k - 1, 0)]), float(t[k])
    for _ in range(60):
        middle = 0.5 * (low + high)
        if (np.asarray(curve.point(np.array([middle])), float)[0] - vertex) @ direction < distance:
            low = middle
        else:
            high = middle
    return float((np.asarray(curve.point(np.array([high])), float)[0] - vertex) @ normal)
