"""Names of regions, boundaries and points: precedence, automatic names, every triangle named."""

from __future__ import annotations

import numpy as np
import pytest

import fubini
import regions as shapes
from fubini.errors import OptionError
from fubini.naming import Selection, overlap, parse_selection, primary, segment_sides


def two_holes(**options):
    region = shapes.Region.from_loops(
        [shapes.loop([(0, 0), (4, 0), (4, 2), (0, 2)]), shapes.circle(1, 1, 0.4), shapes.circle(3, 1, 0.4)]
    )
    return fubini.mesh(shapes.model_of(region), 0.4, **options)


def lengths(mesh, rows):
    a, b = mesh.points[mesh.segments[rows]].transpose(1, 0, 2)
    return np.linalg.norm(b - a, axis=1).sum()


def test_automatic_names():
    mesh = two_holes()
    assert list(mesh.regions) == ["face_0"]
    np.testing.assert_array_equal(mesh.regions["face_0"], np.arange(len(mesh.triangles)))
    assert list(mesh.boundaries) == ["outer", "hole_1", "hole_2"]
    assert lengths(mesh, mesh.boundaries["outer"]) == pytest.approx(12.0)
    for name in ("hole_1", "hole_2"):
        centre = (1, 1, 0) if mesh.edge_of_segment[mesh.boundaries[name]].max() == 4 else (3, 1, 0)
        ends = mesh.points[mesh.segments[mesh.boundaries[name]]]
        np.testing.assert_allclose(np.linalg.norm(ends - centre, axis=2), 0.4, rtol=1e-12)
    assert sum(map(len, mesh.boundaries.values())) == len(mesh.segments)
    assert not mesh.named_points


def test_names_of_the_user_come_first():
    mesh = two_holes(
        names={
            "plate": "face 0",
            "left": lambda x, y, z: x == 0.0,
            "clamped": "edges 5",
            "corners": "vertices 0, 2",
            "origin": lambda x, y, z: (x == 0) & (y == 0),
        }
    )
    assert list(mesh.regions) == ["plate"]
    assert list(mesh.boundaries) == ["left", "clamped", "outer", "hole_1"]
    assert lengths(mesh, mesh.boundaries["left"]) == pytest.approx(2.0)
    assert lengths(mesh, mesh.boundaries["outer"]) == pytest.approx(10.0)
    assert (mesh.edge_of_segment[mesh.boundaries["clamped"]] == 5).all()
    np.testing.assert_array_equal(mesh.points[mesh.named_points["origin"]], [[0, 0, 0]])
    np.testing.assert_array_equal(sorted(mesh.points[mesh.named_points["corners"]].tolist()), [[0, 0, 0], [4, 2, 0]])


def test_taken_names_are_not_merged_with_automatic_ones():
    mesh = two_holes(names={"outer": lambda x, y, z: x == 0.0, "face_0": "face 0"})
    assert list(mesh.boundaries) == ["outer", "outer_2", "hole_1", "hole_2"]
    assert lengths(mesh, mesh.boundaries["outer"]) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("value", "what"),
    [
        ("edges 99", "none of what it selects is meshed"),
        ("lid", "selects nothing"),
        ("edges 3-x", "selects nothing"),
        (lambda x, y, z: x > 1e9, "meets nothing"),
        (lambda x, y, z: True, "shape"),
    ],
)
def test_selections_that_meet_nothing_are_refused(value, what):
    with pytest.raises(OptionError, match=what) as caught:
        two_holes(names={"wrong": value})
    assert "wrong" in str(caught.value)


@pytest.mark.parametrize("name", ["", "  ", "a\nb", 3])
def test_senseless_names_are_refused(name):
    with pytest.raises(OptionError, match="is no name"):
        two_holes(names={name: "face 0"})


def test_text_of_selections():
    assert parse_selection("faces 0,3-5") == Selection(faces=frozenset({0, 3, 4, 5}))
    assert parse_selection("edge 7") == Selection(edges=frozenset({7}))
    assert parse_selection(" vertices 1 2 ") == Selection(vertices=frozenset({1, 2}))


def test_predicate_names_faces_before_segments():
    square = shapes.square()
    model = shapes.model_of(square, square.transform(np.eye(2), (3.0, 0.0)))
    mesh = fubini.mesh(model, 0.5, names={"right": lambda x, y, z: x > 2})
    assert list(mesh.regions) == ["right", "face_0"]
    assert set(mesh.face_of_triangle[mesh.regions["right"]]) == {1}
    assert list(mesh.boundaries) == ["outer"]


def test_regions_may_overlap_and_the_first_is_primary():
    groups = {"a": np.array([0, 1], np.int32), "b": np.array([1, 2], np.int32), "c": np.array([4], np.int32)}
    assert overlap(groups, 5) == ("a", "b")
    np.testing.assert_array_equal(primary(groups, 5), [0, 0, 1, -1, 2])


def test_sides_lie_on_their_segments():
    mesh = two_holes()
    segment, triangle, side = segment_sides(mesh.triangles, mesh.segments)
    np.testing.assert_array_equal(segment, np.arange(len(mesh.segments)))
    rows = np.arange(len(segment))
    ends = np.stack([mesh.triangles[triangle][rows, (side + k) % 3] for k in (0, 1)], axis=1)
    np.testing.assert_array_equal(np.sort(ends), np.sort(mesh.segments))


def test_sides_at_segments_as_found_one_by_one():
    rng = np.random.default_rng(7)
    for _ in range(40):
        triangles, segments = (rng.integers(0, 12, (k, d)).astype(np.int32) for k, d in ((30, 3), (20, 2)))
        first = {}
        for number, ends in enumerate(segments.tolist()):
            first.setdefault(frozenset(ends), number)
        sides = [
            [first.get(frozenset((t[i - 3], t[i - 2]))), k, i]
            for k, t in enumerate(triangles.tolist())
            for i in range(3)
        ]
        found = np.stack(segment_sides(triangles, segments), axis=1)
        assert found.tolist() == sorted(row for row in sides if row[0] is not None)


def test_names_do_not_depend_on_the_size():
    fine, coarse = two_holes(), fubini.mesh(two_holes().model, 0.9)
    assert list(fine.boundaries) == list(coarse.boundaries)
