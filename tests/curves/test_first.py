"""Every kind agrees with its track and returns its stored ends bit for bit."""

import numpy as np

from fubini import tracks
from fubini.curves import Bezier, BSpline, CircularArc, EllipticalArc, Line, track


def test_tracks_agree_with_curves():
    rng = np.random.default_rng(0)
    curves = [
        Line((0, 0), (1, 2)),
        CircularArc((1, 2), 3, 0, 2),
        EllipticalArc((1, 2), (3, 1), (1, -1), 0.3, -4),
        Bezier(rng.random((5, 2)), rng.random(5) + 0.3),
        BSpline(3, [0, 1, 2, 3, 4, 4.5, 6, 7, 8, 9], rng.random((6, 2))),
    ]
    builder = tracks.TrackBuilder()
    numbers = [track(builder, c) for c in curves]
    table = builder.build()
    t = np.linspace(0, 1, 101)
    for k, c in zip(numbers, curves, strict=True):
        p = tracks.evaluate(table, k, t)
        assert np.abs(p - c.point(t)).max() < 2e-15
        assert (p[0] == c.start).all() and (p[-1] == c.end).all()
