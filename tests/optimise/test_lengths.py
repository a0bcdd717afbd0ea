"""Edges much longer than the size asked are cut, wherever they come from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fubini.optimise import OptimiseOptions, optimise, shortened
from fubini.optimise.lengths import long_edges, split_in_middle
from fubini.optimise.options import LONGEST
from fubini.quality import squared_lengths
from fubini.tracks import evaluate
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.value import FREE, LOCKED, SPLIT_ONLY
from optimise.outlines import arc, boundary, certify, line, polygon

SQUARE = [polygon(np.array([(0, 0), (1, 0), (1, 1), (0, 1)]))]
ROUND = [[line((0, 0), (1, 0)), arc((0, 0), 1.0, 0.0, np.pi / 2), line((0, 1), (0, 0))]]


def sparse(loops, cut, spacing, mode=FREE):
    """A certified mesh of segments of length ``cut`` and a square lattice of this spacing inside; 0.1 is asked."""
    made, tracks = boundary(loops, cut, mode)
    made = replace(made, size=np.minimum(made.size, 0.1))
    x, y = np.meshgrid(*2 * [np.arange(spacing, 0.75, spacing)])
    start = constrained_delaunay(np.concatenate([made.points, np.stack([x, y], -1).reshape(-1, 2)]), made)
    return start, optimise(start, tracks, OptimiseOptions()), tracks


def longest(triangulation):
    return np.sqrt(squared_lengths(triangulation.points[triangulation.triangles])).max()


@pytest.mark.parametrize("loops", [SQUARE, ROUND])
@pytest.mark.parametrize("cut", [0.1, 0.2])
def test_edges_that_are_too_long_are_cut_inside_and_on_the_boundary(loops, cut):
    start, coarse, tracks = sparse(loops, cut, 0.2)
    assert coarse.excess == 0 and longest(coarse.triangulation) > LONGEST * 0.1
    done = shortened(coarse, tracks, 0.1, OptimiseOptions())
    assert longest(done.triangulation) <= LONGEST * 0.1
    assert done.excess == 0
    assert done.flawed_before == coarse.flawed_before
    certify(done, start, tracks)
    assert shortened(done, tracks, 0.1, OptimiseOptions()) is done


def test_what_no_cut_can_shorten_stays_as_good_as_it_was():
    start, coarse, tracks = sparse(SQUARE, 0.2, 0.2, LOCKED)
    done = shortened(coarse, tracks, 0.1, OptimiseOptions())
    assert done.excess == 0
    assert longest(done.triangulation) == pytest.approx(0.2, rel=0.1)  # the segments
    certify(done, start, tracks)
    np.testing.assert_array_equal(done.triangulation.boundary.points, start.boundary.points)


def test_cuts_of_shared_segments_are_told():
    start, coarse, tracks = sparse(SQUARE, 0.2, 0.2, SPLIT_ONLY)
    done = shortened(coarse, tracks, 0.1, OptimiseOptions())
    certify(done, start, tracks)
    places = {tuple(evaluate(tracks, j, t)[0].round(9)) for j, t in done.splits}
    before, after = ({tuple(p.round(9)) for p in d.triangulation.boundary.points} for d in (coarse, done))
    assert len(places) >= 20 and after - before == places


def test_edges_and_fields_ask_for_their_own_sizes():
    start, coarse, tracks = sparse(SQUARE, 0.1, 0.1)
    asked = np.array([0.05, np.inf, np.inf, np.inf])
    along = shortened(coarse, tracks, 0.1, OptimiseOptions(), along=asked)
    certify(along, start, tracks)
    edge = along.triangulation.boundary
    length = np.hypot(*(edge.points[edge.segments[:, 1]] - edge.points[edge.segments[:, 0]]).T)
    assert length[edge.track == 0].max() <= LONGEST * 0.05 < length[edge.track != 0].max()

    def field(p):
        return 0.04 + 0.15 * p[:, 0]

    graded = shortened(coarse, tracks, 0.1, OptimiseOptions(), field)
    certify(graded, start, tracks)
    before, after = (long_edges(d.triangulation, 0.1, field).max() for d in (coarse, graded))
    assert after <= 1.0 < before


def test_a_locked_long_node_size_stands_for_all():
    start, coarse, tracks = sparse(SQUARE, 0.1, 0.2)
    large = replace(coarse.triangulation.boundary, size=np.full(len(coarse.triangulation.boundary.size), 0.3))
    meant = replace(coarse, triangulation=replace(coarse.triangulation, boundary=large))
    assert shortened(meant, tracks, 0.1, OptimiseOptions()) is meant


def test_segments_are_split_on_their_curves():
    made, tracks = boundary(ROUND, 0.3)
    few = np.flatnonzero(made.track == 1)[:2]
    finer = split_in_middle(made, tracks, few)
    n = len(made.points)
    assert len(finer.points) == n + 2 and len(finer.segments) == len(made.segments) + 2
    np.testing.assert_allclose(np.hypot(*finer.points[n:].T), 1.0, rtol=1e-15)
    np.testing.assert_array_equal(finer.segments[few, 1], [n, n + 1])
    for end in (0, 1):
        here = evaluate(tracks, finer.track, finer.t[:, end])
        np.testing.assert_allclose(finer.points[finer.segments[:, end]], here, atol=1e-15)
    assert split_in_middle(made, tracks, few[:0]) is made
