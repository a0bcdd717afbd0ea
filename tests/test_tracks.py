"""Tracks: exact ends, and the same points as the textbook formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fubini.tracks import TrackBuilder, evaluate
from fubini.tracks.table import CONIC, LINE, RATIONAL

T = np.linspace(0, 1, 101)


def bezier(control, t):
    """Point of a rational Bezier curve by the Bernstein sum; control (n, 3) holds x, y, w."""
    n = len(control) - 1
    basis = np.array([math.comb(n, i) * t**i * (1 - t) ** (n - i) for i in range(n + 1)])
    w = basis.T @ control[:, 2]
    return (basis.T @ (control[:, :2] * control[:, 2:])) / w[:, None]


def homogeneous(control):
    """w x, w y, w of control points x, y, w."""
    return np.c_[control[:, :2] * control[:, 2:], control[:, 2]]


def test_ends_come_back_bit_for_bit():
    builder = TrackBuilder()
    ends = [((0.1, 0.2), (0.3, 0.7)), ((1 / 3, 2 / 3), (0.1 + 0.2, 1e-17)), ((5.5, -1 / 7), (math.pi, math.e))]
    builder.add(LINE, *ends[0])
    builder.add(CONIC, *ends[1], [0, 0, 1, 0, 0, 1, 0.3, 2.0])
    builder.add(RATIONAL, *ends[2], [1, 1], [0, 1], [5.5, 0, 1, 3, 3, 1])
    tracks = builder.build()
    for k, (start, end) in enumerate(ends):
        assert evaluate(tracks, k, [0.0, 1.0]).tolist() == [list(start), list(end)]
        assert evaluate(tracks, k, [-0.5, 1.5]).tolist() == [list(start), list(end)]


def test_line_and_ellipse():
    builder = TrackBuilder()
    builder.add(LINE, (1, 2), (4, -2))
    u = 0.25 + T * 5.0
    points = np.stack([3 + 2 * np.cos(u) - 0.5 * np.sin(u), 1 + 0.3 * np.cos(u) + np.sin(u)], axis=1)
    builder.add(CONIC, points[0], points[-1], [3, 1], [2, 0.3], [-0.5, 1], [0.25, 5.25])
    tracks = builder.build()
    assert len(builder) == 2
    assert evaluate(tracks, 0, T) == pytest.approx(np.stack([1 + 3 * T, 2 - 4 * T], axis=1), abs=1e-15)
    assert evaluate(tracks, 1, T) == pytest.approx(points, abs=1e-14)


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 9])
def test_rational_bezier_chain(degree):
    random = np.random.default_rng(degree)
    pieces = [np.c_[random.normal(size=(degree + 1, 2)), random.uniform(0.5, 2, degree + 1)] for _ in range(3)]
    breaks = [0.0, 0.2, 0.65, 1.0]
    builder = TrackBuilder()
    builder.add(LINE, (0, 0), (1, 1))
    chain = builder.add(RATIONAL, pieces[0][0, :2], pieces[-1][-1, :2], [3, degree], breaks, *map(homogeneous, pieces))
    t = np.setdiff1d(T, breaks)
    piece = np.searchsorted(breaks, t, side="right") - 1
    low, high = np.array(breaks)[piece], np.array(breaks)[piece + 1]
    wanted = np.concatenate([bezier(pieces[k], u[None])[0:1] for k, u in zip(piece, (t - low) / (high - low))])
    assert evaluate(builder.build(), chain, t) == pytest.approx(wanted, abs=1e-12)


def test_quarter_circle_as_rational_quadratic_stays_on_the_circle():
    control = np.array([[1, 0, 1], [1, 1, math.sqrt(0.5)], [0, 1, 1]])
    builder = TrackBuilder()
    builder.add(RATIONAL, (1, 0), (0, 1), [1, 2], [0, 1], homogeneous(control))
    assert np.hypot(*evaluate(builder.build(), 0, T).T) == pytest.approx(np.ones(T.size), abs=1e-15)


def test_many_tracks_at_once():
    builder = TrackBuilder()
    for k in range(4):
        builder.add(LINE, (k, 0), (k, 1))
    out = evaluate(builder.build(), [3, 1, 0], [0.5, 0.25, 1.0])
    assert out.tolist() == [[3, 0.5], [1, 0.25], [0, 1]]


def test_rounding_keeps_dimensionless_data_at_any_scale():
    from fubini.tracks import rounded

    for scale in (1.0, 2.0**20, 2.0**-20):
        builder = TrackBuilder()
        builder.add(1, (scale, 0), (0, scale), (0, 0), (scale, 0), (0, scale), (0.0, math.pi / 2))
        s = math.sqrt(0.5)
        poles = [[scale, 0, 1], [s * scale, s * scale, s], [0, scale, 1]]
        builder.add(2, (scale, 0), (0, scale), [1, 2], [0, 1], poles)
        tracks = builder.build()
        near = rounded(tracks, scale, 32)
        assert np.abs(near.data[10:12] - tracks.data[10:12]).max() < 2e-10
        gap = evaluate(near, [0, 1], [0.3, 0.3]) - evaluate(tracks, [0, 1], [0.3, 0.3])
        assert 0 < np.abs(gap).max() < 1e-9 * scale
