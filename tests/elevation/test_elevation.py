"""Second order: nodes on the true curves, Jacobians proved positive, folds found, mended or reported."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import fubini
import regions
from fubini import elevation
from fubini.elevation import GAP, curve_midpoints, elevate, jacobian_bounds
from fubini.errors import InputError, OptionError
from fubini.measure import closes_up
from handmade import square


def mesh_of(region, size, **options):
    return fubini.mesh(regions.model_of(region), size, order=2, **options)


def shapes(u, v):
    """Shape functions (6,) of the 6-node triangle and their derivatives (6, 2) at u, v."""
    a, b, c = 1 - u - v, u, v
    value = np.array([a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a])
    by = np.array(
        [[1 - 4 * a, 1 - 4 * a], [4 * b - 1, 0], [0, 4 * c - 1],
         [4 * (a - b), -4 * b], [4 * c, 4 * b], [-4 * c, 4 * (a - c)]]
    )  # fmt: skip
    return value, by


def sampled(nodes, n=24):
    """Scaled Jacobians (m, samples) of elements (m, 6, 3) in the xy plane on a fine lattice."""
    straight = np.cross(nodes[:, 1] - nodes[:, 0], nodes[:, 2] - nodes[:, 0])[:, 2]
    found = []
    for i in range(n + 1):
        for j in range(n + 1 - i):
            x = np.einsum("mkd,kj->mdj", nodes[..., :2], shapes(i / n, j / n)[1])
            found.append(np.linalg.det(x) / straight)
    return np.stack(found, axis=1)


def area(mesh):
    """Area of the curved elements by a rule of degree 2, exact for their Jacobians."""
    nodes = mesh.points[mesh.nodes]
    total = 0.0
    for u, v in ((1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3)):
        total += np.linalg.det(np.einsum("mkd,kj->mdj", nodes[..., :2], shapes(u, v)[1])).sum() / 6
    return total


@pytest.mark.parametrize(
    ("make", "size"),
    [(regions.quarter_disk, 0.3), (regions.plate, 0.4), (regions.blob, 0.2), (regions.slot, 1.0)],
)
def test_middle_nodes_lie_on_their_curves(make, size):
    mesh = mesh_of(make(), size)
    assert mesh.order == 2
    assert mesh.certificate.certified
    region = mesh.model.faces[0].region
    for curve, edge in zip(region.curves, region.edges, strict=True):
        rows = mesh.edge_of_segment == edge
        middle = mesh.points[mesh.segment_midsides[rows]]
        assert curve.closest(middle[:, :2])[1].max() < 1e-13 * region.diagonal
        a, b = mesh.points[mesh.segments[rows]].transpose(1, 0, 2)
        to_a, to_b = np.linalg.norm(middle - a, axis=1), np.linalg.norm(middle - b, axis=1)
        np.testing.assert_allclose(to_a, to_b, rtol=1e-9)


def test_nodes_are_shared_and_in_order():
    mesh = mesh_of(regions.quarter_disk(), 0.3)
    first = fubini.mesh(mesh.model, 0.3)
    np.testing.assert_array_equal(mesh.points[: len(first.points)], first.points)
    np.testing.assert_array_equal(mesh.triangles, first.triangles)
    used, times = np.unique(mesh.midsides, return_counts=True)
    np.testing.assert_array_equal(used, np.arange(len(first.points), len(mesh.points)))
    assert set(times) == {1, 2}
    assert (times == 1).sum() == len(mesh.segments)
    bent = np.linalg.norm(mesh.points[mesh.segments].mean(axis=1) - mesh.points[mesh.segment_midsides], axis=1)
    inner = np.setdiff1d(mesh.midsides, mesh.segment_midsides)
    sides = np.roll(np.repeat(mesh.triangles[:, :, None], 2, axis=2), 0)
    sides[..., 1] = np.roll(mesh.triangles, -1, axis=1)
    straight = mesh.points[sides].mean(axis=2)
    is_inner = np.isin(mesh.midsides, inner)
    np.testing.assert_array_equal(mesh.points[mesh.midsides][is_inner], straight[is_inner])
    assert (bent[mesh.edge_of_segment == 1] > 1e-3).all()
    assert (bent[mesh.edge_of_segment != 1] == 0.0).all()


def test_area_converges_as_the_fourth_power():
    errors = [abs(area(mesh_of(regions.quarter_disk(), h)) - math.pi / 4) for h in (0.3, 0.15)]
    assert errors[0] < 1e-4
    assert errors[0] / errors[1] > 10


def test_bounds_hold_and_are_sharp():
    rng = np.random.default_rng(4)
    corners = np.array([[0, 0, 0], [1, 0, 0], [0.4, 0.9, 0]])
    middle = 0.5 * (corners + np.roll(corners, -1, axis=0))
    nodes = np.repeat(np.concatenate([corners, middle])[None], 300, axis=0)
    nodes[:, 3:, :2] += rng.normal(0, 0.12, (300, 3, 2))
    bounds = jacobian_bounds(nodes)
    least = sampled(nodes).min(axis=1)
    assert (bounds <= least + 1e-12).all()
    assert (bounds > least - GAP - 0.02).all()
    assert (bounds > 0).any() and (bounds <= 0).any()


def test_straight_elements_have_one():
    nodes = np.array([[[0, 0, 0], [2, 0, 1], [0, 1, 0], [1, 0, 0.5], [1, 0.5, 0.5], [0, 0.5, 0]]])
    np.testing.assert_allclose(jacobian_bounds(nodes), 1.0, rtol=1e-14)


def test_certificate_bounds_what_is_shipped():
    mesh = mesh_of(regions.plate(), 0.4)
    least = sampled(mesh.points[mesh.nodes]).min()
    assert mesh.certificate.min_scaled_jacobian <= least + 1e-12
    assert mesh.certificate.min_scaled_jacobian > max(0.3, least - GAP - 0.01)
    assert fubini.mesh(mesh.model, 0.4).certificate.min_scaled_jacobian is None


@pytest.mark.parametrize("degrees", [1, 7, 30])
def test_sharp_wedges_do_not_fold(degrees):
    mesh = mesh_of(regions.wedge(degrees), 0.1)
    assert mesh.certificate.certified
    assert sampled(mesh.points[mesh.nodes]).min() > 0.0


def lens(gap):
    """Two flat arcs between the same two corners, bulging the same way: a thin crescent."""

    def arc(rise):
        radius = (1 + rise * rise) / (2 * rise)
        half = math.atan2(1, radius - rise)
        return (0.0, rise - radius), radius, half

    (c0, r0, h0), (c1, r1, h1) = arc(0.3), arc(0.3 + gap)
    low = regions.CircularArc(c0, r0, math.pi / 2 + h0, math.pi / 2 - h0)
    high = regions.CircularArc(c1, r1, math.pi / 2 - h1, math.pi / 2 + h1)
    return regions.chain(low, high)


def test_crescent_is_proved_or_reported():
    mesh = mesh_of(lens(0.1), 0.2)
    folded = sampled(mesh.points[mesh.nodes]).min() <= 0.0
    assert folded == any("fold" in r for f in mesh.certificate.faces for r in f.reasons)


@pytest.mark.parametrize(
    ("depth", "straight_folds", "folds"), [(0.05, False, False), (0.15, True, False), (0.6, True, True)]
)
def test_folds_are_mended_or_reported(monkeypatch, depth, straight_folds, folds):
    """A boundary side pushed into its element: the inner sides give way where that helps."""
    mesh = square(2)
    middle = mesh.points[mesh.segments].mean(axis=1)
    pushed = int(np.flatnonzero((middle == [0.25, 0, 0]).all(axis=1))[0])
    middle[pushed, 1] += depth
    curved = np.arange(len(middle)) == pushed
    monkeypatch.setattr(elevation, "curve_midpoints", lambda mesh: (middle, curved))
    raised = elevate(mesh)
    np.testing.assert_array_equal(raised.points[raised.segment_midsides[pushed]], middle[pushed])
    nodes = raised.points[raised.nodes]
    row = np.flatnonzero((raised.midsides == raised.segment_midsides[pushed]).any(axis=1))
    bare = mesh.points[mesh.triangles[row]]
    bare = np.concatenate([bare, 0.5 * (bare + np.roll(bare, -1, axis=1))], axis=1)
    bare[0, 3 + int(np.flatnonzero(raised.midsides[row[0]] == raised.segment_midsides[pushed])[0])] = middle[pushed]
    assert (jacobian_bounds(bare).min() <= 0.0) == straight_folds
    assert (sampled(nodes).min() <= 0.0) == folds
    reasons = raised.certificate.faces[0].reasons
    assert any("fold" in r for r in reasons) == folds
    assert raised.certificate.faces[0].min_scaled_jacobian == pytest.approx(sampled(nodes).min(), abs=0.05)


def test_shared_edges_get_one_middle_node():
    bd = pytest.importorskip("build123d")
    mesh = fubini.mesh(bd.extrude(bd.Circle(1) - bd.Rectangle(0.4, 0.4), 1), 0.4, order=2)
    assert mesh.certificate.certified
    assert closes_up(mesh.triangles, np.empty((0, 2), int), len(mesh.points)) is False  # the mantle is missing
    bent = mesh.points[mesh.segment_midsides]
    round_ = np.linalg.norm(mesh.points[mesh.segments], axis=2).max(axis=1) > 0.99
    on_rim = np.isclose(np.hypot(*mesh.points[mesh.segments][..., :2].transpose(2, 0, 1)), 1.0).all(axis=1)
    assert (round_ & on_rim).any()
    np.testing.assert_allclose(np.hypot(bent[on_rim, 0], bent[on_rim, 1]), 1.0, rtol=1e-14)


def test_refusals():
    model = regions.model_of(regions.quarter_disk())
    with pytest.raises(OptionError, match="order is 3"):
        fubini.mesh(model, 0.3, order=3)
    mesh = fubini.mesh(model, 0.3)
    assert mesh.elevate(1) is mesh
    with pytest.raises(OptionError, match="already"):
        mesh.elevate().elevate(1)
    with pytest.raises(InputError, match="where its segments lie"):
        curve_midpoints(square(2))


def test_edges_inside_a_face_are_followed():
    bd = pytest.importorskip("build123d")
    from fubini.curves import CircularArc
    from fubini.model import Edge

    model = fubini.load(bd.Rectangle(4, 4).face())
    face = model.faces[0]
    arc = CircularArc((0.0, 0.0), 1.0, 0.3, 2.5)
    ends = face.frame.to_space([arc.start, arc.end])
    model = dataclasses.replace(
        model,
        faces=(dataclasses.replace(face, inner=((arc, 4),)),),
        edges=model.edges | {4: Edge(4, "circle", 4, 5)},
        vertices=model.vertices | {4: ends[0], 5: ends[1]},
    )
    mesh = fubini.mesh(model, 0.5, order=2)
    assert mesh.certificate.certified
    assert list(mesh.boundaries) == ["outer", "edge_4"]
    rows = mesh.boundaries["edge_4"]
    assert (mesh.edge_of_segment[rows] == 4).all()
    middle = face.frame.to_plane(mesh.points[mesh.segment_midsides[rows]])
    np.testing.assert_allclose(np.hypot(*middle.T), 1.0, rtol=1e-13)
    assert np.isin(mesh.midsides, mesh.segment_midsides[rows]).sum() == 2 * len(rows)
