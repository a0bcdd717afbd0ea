"""The size tree: the least over all its boxes exactly, growth limited, balanced, and certified meshes from it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import fubini
import regions
from fubini.errors import OptionError
from fubini.quality import growth_rates
from fubini.sizing import SizeTree


def random_tree(d, seed=0, n=200):
    rng = np.random.default_rng(seed)
    points, sizes = rng.random((n, d)), 10 ** rng.uniform(-2.5, -0.5, n)
    return SizeTree.from_points(points, sizes, largest=0.4), points, sizes


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("n", [1, 8, 200])
def test_evaluation_against_all_points(d, n):
    field, points, sizes = random_tree(d, n, n)
    asked = np.random.default_rng(9).random((1500, d)) * 1.6 - 0.3
    distance = np.linalg.norm(asked[:, None] - points, axis=2)
    expected = np.minimum(0.4, (sizes + field.gradient * distance).min(axis=1))
    np.testing.assert_allclose(field(asked), expected, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(field.evaluate(*asked.T.reshape(d, 30, 50)), field(asked).reshape(30, 50))


@pytest.mark.parametrize("growth", [1.2, 1.5, 2.5])
def test_growth_is_limited_between_any_two_points(growth):
    rng = np.random.default_rng(4)
    field = SizeTree.from_points(rng.random((50, 2)), rng.uniform(0.01, 0.3, 50), largest=0.3, growth=growth)
    a, b = rng.random((2, 4000, 2))
    assert (np.abs(field(a) - field(b)) <= 0.7 * (growth - 1.0) * np.linalg.norm(a - b, axis=1) + 1e-14).all()


@pytest.mark.parametrize("d", [2, 3])
def test_leaves_cover_the_cube_are_fine_enough_and_balanced(d):
    field, *_ = random_tree(d, 1, 20)
    low, width = field.tree.boxes()
    assert (width**d).sum() == pytest.approx(field.tree.width**d, rel=1e-12)
    middle = low + 0.5 * width[:, None]
    assert (width <= field(middle) * (1 + 1e-12)).all()
    np.testing.assert_array_equal(field.tree.locate(middle), np.arange(len(width)))
    reach = 0.5 * width[:, None] * (1 + 1e-6)
    for step in np.stack(np.meshgrid(*[[-1, 0, 1]] * d), axis=-1).reshape(-1, d):
        beside = field.tree.locate(middle + step * reach)
        beside = np.where(beside >= 0, beside, np.arange(len(width)))
        assert (np.maximum(width / width[beside], width[beside] / width) <= 2.0).all()
    assert (field.tree.locate(field.tree.low - np.ones((1, d))) == -1).all()


def test_a_function_is_met_where_it_grows_gently_and_limited_elsewhere():
    def gentle(p):
        return 0.02 + 0.2 * np.hypot(p[:, 0], p[:, 1])

    field = SizeTree.from_function(gentle, (0.0, 0.0), (1.0, 1.0), largest=1.0)
    asked = np.random.default_rng(2).random((3000, 2))
    ratio = field(asked) / gentle(asked)
    assert 0.8 < ratio.min() and ratio.max() <= 1.0 + 1e-12

    def jump(p):
        return np.where(p[:, 0] < 0.5, 0.01, 1.0)

    field = SizeTree.from_function(jump, (0.0, 0.0), (1.0, 1.0), largest=1.0, growth=1.5)
    x = np.linspace(0.51, 0.99, 30)
    np.testing.assert_allclose(field.evaluate(x, 0.3), 0.01 + 0.35 * (x - 0.5), atol=0.35 * 0.02)
    assert field.evaluate(0.2, 0.7) == pytest.approx(0.01)
    assert field.evaluate(0.99, 0.5) < 0.3


def test_far_away_the_size_is_the_largest():
    field = SizeTree.from_points([(0.0, 0.0)], 0.1, largest=1.0)
    assert field([(100.0, -7.0)])[0] == 1.0
    assert SizeTree.from_points([(0.0, 0.0)], 3.0, largest=1.0)([(0.0, 0.0)])[0] == 1.0


def test_meshes_from_a_tree_of_points_are_certified_and_follow_it():
    field = SizeTree.from_points([(0.3, 0.3), (0.8, 0.6)], [0.005, 0.01], largest=0.15)
    mesh = fubini.mesh(regions.square(), 0.15, size_field=field)
    assert mesh.certificate.certified
    corners = mesh.points[mesh.triangles]
    length = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)
    ratio = length / field(corners.mean(axis=1))
    assert np.percentile(ratio, 99) < 1.7
    assert 0.6 < np.median(ratio) < 1.25
    assert growth_rates(mesh.points, mesh.triangles).max() < 1.7


def test_edges_and_points_of_a_model_in_space():
    model = fubini.load(regions.plate(2))
    field = SizeTree.from_model(model, {4: 0.02, "5": 0.05}, {(2.0, 2.5, 0.0): 0.01}, largest=0.4)
    mesh = fubini.mesh(model, 0.4, size_field=field)
    assert mesh.certificate.certified
    ends = mesh.points[mesh.segments]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert length[mesh.edge_of_segment == 4].max() < 0.03
    assert length[mesh.edge_of_segment == 5].max() < 0.075
    assert length.max() > 0.2
    near = np.linalg.norm(mesh.points - (2.0, 2.5, 0.0), axis=1) < 0.03
    assert near.sum() > 8
    assert field(np.array([[2.0, 2.5, 1.0]]))[0] > 0.3


@pytest.mark.parametrize(
    "make",
    [
        lambda: SizeTree.from_points([(0.0, 0.0)], -1.0, largest=1.0),
        lambda: SizeTree.from_points([(0.0, 0.0)], math.nan, largest=1.0),
        lambda: SizeTree.from_points(np.empty((0, 2)), 1.0, largest=1.0),
        lambda: SizeTree.from_points([(0.0,)], 1.0, largest=1.0),
        lambda: SizeTree.from_points([(0.0, 0.0)], 1.0, largest=0.0),
        lambda: SizeTree.from_points([(0.0, 0.0)], 1.0, largest=1.0, growth=1.0),
        lambda: SizeTree.from_function(lambda p: 1.0, (0, 0), (1, 1), largest=1.0),
        lambda: SizeTree.from_function(lambda p: np.ones(len(p)), (0, 0), (0, 1), largest=1.0),
        lambda: SizeTree.from_function(lambda p: -np.ones(len(p)), (0, 0), (1, 1), largest=1.0),
        lambda: SizeTree.from_model(fubini.load(regions.square()), {}, largest=1.0),
        lambda: SizeTree.from_model(fubini.load(regions.square()), {"rim": 0.1}, largest=1.0),
    ],
)
def test_senseless_fields_are_refused(make):
    with pytest.raises(OptionError):
        make()
