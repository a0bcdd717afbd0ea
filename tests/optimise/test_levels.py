"""Neighbours that moving nodes alone leaves too different in size: a few triangles around them are meshed anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fubini
import regions
from fubini.optimise import OptimiseOptions, even_out, levels, optimise, smooth
from fubini.optimise.levels import Uneven, levelled
from fubini.optimise.pocket import Pocket, slides
from fubini.quality import areas, growth_rates, skewness
from fubini.tracks import evaluate
from fubini.triangulation.constrained import constrained_delaunay
from fubini.triangulation.validate import validate
from fubini.triangulation.value import CORNER, FREE, LOCKED, ON_CURVE, Boundary
from optimise.outlines import boundary, polygon

LIMITED = OptimiseOptions(growth=1.35)
SQUARE = [polygon(np.array([(0, 0), (1, 0), (1, 1), (0, 1)]))]


def scattered(seed, count=330):
    """A square of random points, hardly smoothed, without flaws, evened out; its tracks."""
    made, tracks = boundary(SQUARE, 0.05)
    inside = 0.03 + 0.94 * np.random.default_rng(seed).random((count, 2))
    start = smooth(constrained_delaunay(np.concatenate([made.points, inside]), made), rounds=1)
    return even_out(optimise(start, tracks).triangulation, LIMITED), tracks


def uneven(tri, limit=LIMITED.growth):
    return growth_rates(tri.points, tri.triangles) > limit


@pytest.mark.parametrize("seed", range(4))
def test_pairs_left_by_evening_out_are_levelled(seed):
    coarse, tracks = scattered(seed)
    done = levelled(coarse, tracks, LIMITED)
    assert uneven(coarse).sum() >= max(3, 2 * uneven(done).sum())
    assert validate(done) == ()
    np.testing.assert_allclose(areas(done.points[done.triangles]).sum(), 1.0, rtol=1e-13)
    edge = done.boundary
    np.testing.assert_array_equal(done.points[: len(edge.points)], edge.points)
    for end in (0, 1):
        here = evaluate(tracks, edge.track, edge.t[:, end])
        np.testing.assert_allclose(edge.points[edge.segments[:, end]], here, atol=1e-15)
    worst = [skewness(t.points[t.triangles]).min() for t in (coarse, done)]
    assert worst[1] >= min(50.0, worst[0]) - 1e-9
    assert levelled(coarse, tracks, LIMITED).points.tobytes() == done.points.tobytes()
    assert levelled(done, tracks, OptimiseOptions(growth=3.0)) is done


def test_more_pairs_are_looked_at_in_larger_faces(monkeypatch):
    """Many pairs, of which moves leave most: twenty and one for each hundred triangles are tried."""
    tried, best = [], levels._best_trial

    def counted(*args):
        tried.append(args[2])
        return best(*args)

    monkeypatch.setattr(levels, "_best_trial", counted)
    coarse, tracks = scattered(0, 900)
    limit = OptimiseOptions(growth=1.2)
    done = levelled(coarse, tracks, limit)
    assert uneven(coarse, 1.2).sum() > 100
    assert levels.PAIRS < len(tried) <= levels.PAIRS + len(coarse.triangles) // levels.PAIR_EACH
    assert uneven(done, 1.2).sum() < uneven(coarse, 1.2).sum() - levels.PAIRS


@pytest.mark.parametrize("seed", range(2))
def test_pairs_are_kept_up_with_what_changes(seed, monkeypatch):
    """Looking at the whole mesh after every change took most of the time of large faces."""
    after, seen = Uneven.after, []

    def compared(self, mesh, pocket, trial, options):
        found, anew = after(self, mesh, pocket, trial, options), Uneven.of(mesh, options)
        seen.append((trial.slid is None, len(found.ratio)))
        for name in vars(anew):
            np.testing.assert_array_equal(getattr(found, name), getattr(anew, name))
        return found

    monkeypatch.setattr(Uneven, "after", compared)
    coarse, tracks = scattered(seed)
    levelled(coarse, tracks, replace(LIMITED, growth=1.3))
    assert sum(whole for whole, _ in seen) > 3
    assert min(pairs for _, pairs in seen) > 0


def test_what_is_flawed_is_left_alone():
    coarse, tracks = scattered(1)
    strict = OptimiseOptions(min_skew=60.0, growth=1.35)
    skew = skewness(coarse.points[coarse.triangles])
    bad = {tuple(map(tuple, p)) for p in coarse.points[coarse.triangles[skew < 59.9]].tolist()}
    assert bad
    done = levelled(coarse, tracks, strict)
    kept = {tuple(map(tuple, np.roll(p, k, axis=0).tolist())) for p in done.points[done.triangles] for k in range(3)}
    assert bad <= kept


def strip(at, mode=FREE):
    """A strip of height 1 with nodes at x = ``at`` (two tuples) along the bottom and the top."""
    low, high = (np.array(x, float) for x in at)
    corners = np.array([(low[0], 0), (low[-1], 0), (high[-1], 1), (high[0], 1)])
    _, tracks = boundary([polygon(corners)], 10.0)
    points = np.concatenate([np.stack([low, 0 * low], 1), np.stack([high, 1 + 0 * high], 1)[::-1]])
    n, k = len(points), len(low)
    share = [np.interp(x, (x[0], x[-1]), (0.0, 1.0)) for x in (low, high)]
    track = np.concatenate([np.zeros(k - 1), [1], np.full(len(high) - 1, 2), [3]]).astype(np.int32)
    t0 = np.concatenate([share[0][:-1], [0.0], 1.0 - share[1][:0:-1], [0.0]])
    t1 = np.concatenate([share[0][1:], [1.0], 1.0 - share[1][-2::-1], [1.0]])
    kind = np.full(n, ON_CURVE, np.uint8)
    kind[[0, k - 1, k, n - 1]] = CORNER
    made = Boundary(
        points, kind, np.ones(n), np.where(kind == CORNER, 90.0, 180.0),
        np.stack([np.arange(n), np.roll(np.arange(n), -1)], 1).astype(np.int32),
        track, np.stack([t0, t1], 1), np.full(n, mode, np.uint8),
    )  # fmt: skip
    return constrained_delaunay(points, made), tracks


UNEVEN = (0.0, 1.0, 2.15, 2.75, 4.2, 5.2, 6.2), (0.5, 1.5, 2.5, 3.4, 4.7, 5.7)


def test_boundary_nodes_slide_along_their_curves_where_no_node_is_inside():
    start, tracks = strip(UNEVEN)
    options = OptimiseOptions(growth=1.2, max_aspect_ratio=3.0)
    done = levelled(start, tracks, options)
    assert uneven(start, 1.2).sum() > uneven(done, 1.2).sum()
    assert len(done.points) == len(start.points)
    edge = done.boundary
    slid = (edge.points != start.boundary.points).any(axis=1)
    assert slid.any() and not slid[edge.kind == CORNER].any()
    for end in (0, 1):
        here = evaluate(tracks, edge.track, edge.t[:, end])
        np.testing.assert_allclose(edge.points[edge.segments[:, end]], here, atol=1e-14)
    assert validate(done) == ()
    np.testing.assert_array_equal(done.points[: len(edge.points)], edge.points)


def test_shared_edges_stay():
    start, tracks = strip(UNEVEN, LOCKED)
    done = levelled(start, tracks, OptimiseOptions(growth=1.2))
    np.testing.assert_array_equal(done.boundary.points, start.boundary.points)
    np.testing.assert_array_equal(done.boundary.t, start.boundary.t)


@pytest.mark.parametrize("rings", [0, 1, 3, 50])
def test_a_pocket_put_back_as_it_was_changes_nothing(rings):
    whole, _ = scattered(0)
    pocket = Pocket.around(whole, [17], rings, {3})
    assert (3 in pocket.rows) is False and 17 in pocket.rows
    assert (len(pocket.rows) == len(whole.triangles) - 1) is (rings == 50)
    back = pocket.put_back(pocket.triangulation)
    assert validate(back) == ()

    def places(tri):
        corners = tri.points[tri.triangles]
        return sorted(tuple(sorted(map(tuple, c))) for c in corners.tolist())

    assert places(back) == places(whole)
    assert back.boundary is whole.boundary


def test_nodes_of_the_boundary_on_no_segment_stay():
    made, tracks = boundary(SQUARE, 0.1)
    lone = np.array([(0.52, 0.48), (0.3, 0.31)])
    held = replace(
        made, points=np.concatenate([made.points, lone]), kind=np.append(made.kind, [CORNER] * 2).astype(np.uint8),
        size=np.append(made.size, [0.1] * 2), angle=np.append(made.angle, [180.0] * 2),
    )  # fmt: skip
    inside = 0.05 + 0.9 * np.random.default_rng(5).random((70, 2))
    options = OptimiseOptions(growth=1.3)
    start = even_out(smooth(constrained_delaunay(np.concatenate([held.points, inside]), held), rounds=1), options)
    done = levelled(start, tracks, options)
    assert done is not start and validate(done) == ()
    np.testing.assert_array_equal(done.points[len(made.points) : len(made.points) + 2], lone)


def test_a_slide_stays_between_the_neighbours():
    start, tracks = strip(UNEVEN)
    for share, x in ((0.5, 1.575), (-0.5, 0.5), (9.0, 2.035), (-9.0, 0.1)):
        t, place = slides(start.boundary, tracks, 0, 1, share)
        np.testing.assert_allclose(place, [x, 0.0], atol=1e-12)
        np.testing.assert_allclose(evaluate(tracks, 0, t)[0], place)


def test_trials_whose_triangles_have_next_to_no_area_keep_their_nodes_within_reach():
    """Smoothing took a step without end where second derivatives cancelled, and left nodes at infinity."""
    region = regions.random_polygon(400100)
    with np.errstate(invalid="raise", over="raise"):
        mesh = fubini.mesh(regions.model_of(region), region.diagonal / 68.20175711977865)
    assert mesh.certificate.certified
