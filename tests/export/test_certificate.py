"""The certificate tells the truth about good and about spoiled meshes."""

from __future__ import annotations

import dataclasses
import math
import time
from collections import Counter

import numpy as np
import pytest

from fubini import quality
from fubini.certificate import Outline, certify_face, excuse
from fubini.errors import OptionError
from fubini.measure import closes_up, measure, numbering, triangle_figures
from fubini.model import Face, Frame
from handmade import FLAT_FRAME, UNIT, Polygon, bad_square, box, grid, one_face, outline_of, square, wedge

OBLIQUE = Frame(np.array([3.0, 4, 5]), np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0]))


def disk(n: int, rings: int = 1):
    """A unit disk as a fan of n triangles, bounded by one closed curve."""
    t = np.arange(n + 1) / n
    plane = np.concatenate([[[0.0, 0.0]], np.stack([np.cos(2 * np.pi * t[:-1]), np.sin(2 * np.pi * t[:-1])], 1)])
    ring = 1 + np.arange(n)
    triangles = np.stack([np.zeros(n, int), ring, 1 + (np.arange(n) + 1) % n], 1).astype(np.int32)
    outline = Outline(
        triangles[:, 1:],
        np.zeros(n, np.int32),
        np.stack([t[:-1], t[1:]], 1),
        np.array([1]),
        np.array([180.0]),
    )
    face = Face(7, None, OBLIQUE, "disk", math.pi)
    return face, OBLIQUE.to_space(plane), triangles, outline


def circle(curve, t):
    return np.stack([np.cos(2 * np.pi * t), np.sin(2 * np.pi * t)], 1)


SEGMENTS = np.array([[0, 1]], np.int32)


def assert_close(found, wanted):
    np.testing.assert_allclose(found, wanted, rtol=1e-11, atol=1e-12)


def test_figures_agree_with_quality():
    p = np.random.default_rng(5).normal(size=(500, 3, 3))
    found = triangle_figures(p.reshape(-1, 3), np.arange(1500, dtype=np.int32).reshape(-1, 3))
    np.testing.assert_allclose(found.skew, quality.skewness(p), rtol=1e-9)
    np.testing.assert_allclose(found.aspect, quality.aspect_ratios(p), rtol=1e-9)
    np.testing.assert_allclose(found.least, quality.angles(p).min(1), rtol=1e-9)
    np.testing.assert_allclose(found.greatest, quality.angles(p).max(1), rtol=1e-9)


def test_one_pass_tells_what_the_figures_of_every_triangle_tell():
    rng, plane = np.random.default_rng(3), (np.array([0.1, -0.2, 0.3]), np.array([0.6, 0.0, 0.8]))
    for trial in range(30):
        points = rng.normal(size=(60, 3)) * (1.0, 1.0, 0.01 * trial)
        triangles = rng.integers(0, 60, (40 + 30 * trial, 3)).astype(np.int32)  # some have no area
        each, found = triangle_figures(points, triangles), measure(points, triangles, SEGMENTS, plane, (45.0, 2.0))
        flawed = np.flatnonzero(each.flawed(45.0, 2.0))
        sound = np.setdiff1d(np.arange(len(triangles)), flawed)
        assert found.flawed.tolist() == flawed.tolist()
        assert_close(found.flaws, np.stack([each.skew, each.aspect], axis=1)[flawed])
        assert found.worst_sound[0] == (sound[each.skew[sound].argmin()] if len(sound) else -1)
        assert_close(found.area, 0.5 * (each.normals @ plane[1]).sum())
        assert_close([found.mean_skew, found.worst_skew], [each.skew.mean(), each.skew.min()])
        assert_close([found.least, found.greatest], [each.least.min(), each.greatest.max()])
        assert_close(found.worst_aspect, each.aspect.max())
        upside = np.flatnonzero(each.normals @ plane[1] <= 0.0)
        assert found.inverted == (len(upside), upside[0])
        height = np.abs((points - plane[0]) @ plane[1])
        height[np.setdiff1d(np.arange(60), triangles)] = 0.0
        assert_close(found.height[0], height.max())
        assert found.height[1] == height.argmax()


def test_skewness_near_the_equilateral_triangle():
    """The series of the pass meets the arc tangent on both sides of where it ends."""
    apex = np.array([0.0, 1e-9, 1e-3, 0.0179, 0.0180, 0.0181, 0.0182, 0.05, 0.4])
    points = np.array([(0, 0, 0), (1, 0, 0), *((0.5, 0.75**0.5 * (1 + d), 0) for d in apex)], float)
    for k in range(len(apex)):
        triangles = np.array([[0, 1, 2 + k]], np.int32)
        found = measure(points, triangles, SEGMENTS, (np.zeros(3), np.array([0, 0, 1.0])), (45.0, 2.0))
        assert found.worst_skew == pytest.approx(float(quality.skewness(points[triangles])[0]), rel=4e-16)


def test_good_square():
    mesh = square(4, frame=OBLIQUE, index=3, name="top")
    (face,) = mesh.certificate.faces
    assert mesh.certificate.certified
    assert not face.reasons
    assert (face.face, face.name, face.triangles, face.flawed, face.unavoidable) == (3, "top", 32, 0, 0)
    assert face.worst_skew == pytest.approx(math.degrees(math.atan(2.0)))
    assert face.min_angle == pytest.approx(45.0)
    assert face.max_angle == pytest.approx(90.0)
    assert face.area_error < 1e-14
    assert face.boundary_distance < 1e-14
    assert face.chord_error < 1e-14


def test_flawed_triangles_are_counted_and_placed():
    (face,) = bad_square().certificate.faces
    p = bad_square().points[bad_square().triangles]
    assert face.flawed == int(quality.flawed(p).sum()) > 0
    assert face.excess == face.flawed
    assert not face.certified
    worst = p[quality.skewness(p).argmin()].mean(0)
    np.testing.assert_allclose(face.worst_at, worst)
    assert f"{face.flawed} flawed triangle" in face.reasons[0]
    assert "skewness" in face.reasons[0]


def test_one_triangle_in_a_sharp_corner_is_excused():
    (face,) = wedge(15.0).certificate.faces
    assert (face.flawed, face.unavoidable, face.excess) == (1, 1, 0)
    assert face.certified
    assert face.corners[0].angle == pytest.approx(15.0)
    assert face.corners[0].point == (0.0, 0.0, 0.0)
    assert face.corners[0].face == face.face


def test_a_second_one_is_not_excused():
    h = math.tan(math.radians(7.5))
    corners = [(0.0, 0.0), (1.0, -h), (1.0, h)]
    mesh = one_face(corners, [*corners, (1.0, 0.0)], [(0, 1, 3), (0, 3, 2)])
    (face,) = mesh.certificate.faces
    assert (face.flawed, face.unavoidable, face.excess) == (2, 1, 1)
    assert "1 flawed triangle beyond the 1 unavoidable" in face.reasons[0]


def test_a_flawed_triangle_elsewhere_is_not_excused():
    """A wedge cut so that the flawed triangle does not touch the tip's node."""
    assert excuse(np.array([[3, 4, 5]]), np.array([0])).tolist() == []
    assert excuse(np.array([[3, 4, 5], [0, 1, 2]]), np.array([0])).tolist() == [1]


def test_excuse_is_a_maximum_matching():
    # row 0 touches corners 7 and 8, row 1 only 7: both can be excused
    assert excuse(np.array([[7, 8, 1], [7, 1, 2]]), np.array([7, 8])).tolist() == [0, 1]
    assert excuse(np.array([[7, 1, 2], [7, 2, 3]]), np.array([7])).tolist() == [0]
    assert excuse(np.array([[7, 1, 2], [7, 2, 3]]), np.array([7, 7])).tolist() == [0, 1]


def test_corner_limit_follows_min_skew():
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.5)]  # 26.6 degrees
    mesh = one_face(corners, corners, [(0, 1, 2)])
    assert mesh.certificate.faces[0].unavoidable == 0
    polygon, plane, triangles = Polygon(corners), np.array(corners), np.array([(0, 1, 2)], np.int32)
    strict = certify_face(
        mesh.model.faces[0],
        mesh.points,
        triangles,
        outline_of(polygon, plane, triangles),
        polygon.evaluate,
        diagonal=1.0,
        min_skew=60.0,
    )
    assert strict.unavoidable == 1


def test_the_reason_names_a_triangle_that_misses_its_bound():
    """A slim triangle of less skewness that is good enough, and a flat one on its leg whose aspect ratio is not."""
    x, y, rise = math.cos(math.radians(12.25)), math.sin(math.radians(12.25)), 0.5 * math.tan(math.radians(34.9))
    corners = [(0.0, 0.0), (x, -y), (x, y), (x / 2 - rise * y, y / 2 + rise * x)]
    triangles = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    mesh = one_face(corners, corners, triangles)
    polygon, plane = Polygon(corners), np.array(corners)
    skews, ratios = quality.skewness(plane[triangles]), quality.aspect_ratios(plane[triangles])
    bad = int(ratios.argmax())
    assert bad != skews.argmin()
    limit = float(ratios.mean())
    found = certify_face(
        mesh.model.faces[0], mesh.points, triangles, outline_of(polygon, plane, triangles), polygon.evaluate,
        diagonal=1.0, min_skew=float(skews.min()) - 1.0, max_aspect_ratio=limit, budget_exhausted=True,
    )  # fmt: skip
    assert found.excess == 1
    at = ", ".join(f"{x:.6g}" for x in (*plane[triangles[bad]].mean(0), 0.0))
    figures = f"skewness {skews[bad]:.4g}, aspect ratio {ratios[bad]:.4g} (not below {limit:g})"
    assert found.reasons[0] == f"1 flawed triangle, worst at ({at}): {figures}; the budget of moves was spent"


def test_chord_error_of_a_disk():
    face, points, triangles, outline = disk(12)
    found = certify_face(face, points, triangles, outline, circle, diagonal=3.0)
    assert found.chord_error == pytest.approx(1 - math.cos(math.pi / 12), rel=1e-12)
    assert found.area_error == pytest.approx(1 - 6 * math.sin(math.pi / 6) / math.pi, rel=1e-12)
    assert found.boundary_distance < 1e-14
    assert found.certified == (found.flawed == 0)
    assert [r for r in found.reasons if "flawed" not in r] == []


def test_node_off_its_edge():
    face, points, triangles, outline = disk(12)
    points = points.copy()
    points[4] += 1e-5 * (points[4] - points[0])
    found = certify_face(face, points, triangles, dataclasses.replace(outline, edges={0: 31}), circle, diagonal=3.0)
    assert found.boundary_distance == pytest.approx(1e-5, rel=1e-6)
    assert any("boundary node 1e-05 from edge 31" in r for r in found.reasons)
    relaxed = dataclasses.replace(outline, slack=1e-4)
    quiet = certify_face(face, points, triangles, relaxed, circle, diagonal=3.0)
    assert not any("boundary node" in r for r in quiet.reasons)


def test_wrong_area_is_told():
    mesh = square(2, area=1.5)
    assert any("area differs by -0.33" in r for r in mesh.certificate.faces[0].reasons)


def certify_square(plane, triangles, spoil=lambda points: points):
    polygon = Polygon(UNIT)
    plane, triangles = np.array(plane, float), np.array(triangles, np.int32)
    outline = outline_of(polygon, *grid(2))
    return certify_face(
        Face(0, polygon, FLAT_FRAME, None, 1.0),
        spoil(FLAT_FRAME.to_space(plane)),
        triangles,
        outline,
        polygon.evaluate,
        diagonal=1.5,
    )


def test_spoiled_topology_is_told():
    plane, triangles = grid(2)
    assert certify_square(plane, triangles).certified
    flipped = triangles.copy()
    flipped[0] = flipped[0][[0, 2, 1]]
    reasons = " ".join(certify_square(plane, flipped).reasons)
    assert "upside down" in reasons
    assert "fit together" in reasons
    assert "area differs" in reasons
    missing = " ".join(certify_square(plane, triangles[1:]).reasons)
    assert "fit together" in missing
    assert "area differs" in missing
    doubled = " ".join(certify_square(plane, np.concatenate([triangles, triangles[:1]])).reasons)
    assert "fit together" in doubled


def test_uncovered_edge_is_told():
    polygon, (plane, triangles) = Polygon(UNIT), grid(2)
    outline = outline_of(polygon, plane, triangles)
    t = outline.t.copy()
    t[outline.curve == 2] *= 0.5
    found = certify_face(
        Face(0, polygon, FLAT_FRAME, None, 1.0),
        FLAT_FRAME.to_space(plane),
        triangles,
        dataclasses.replace(outline, t=t, slack=9.0),
        polygon.evaluate,
        diagonal=1.5,
    )
    assert any("edge 12 is covered" in r for r in found.reasons)


def test_node_off_the_plane():
    def lift(points):
        points = points.copy()
        points[4, 2] = 1e-3
        return points

    assert any("off the plane" in r for r in certify_square(*grid(2), spoil=lift).reasons)


def test_segments_without_curve_are_allowed():
    polygon, (plane, triangles) = Polygon(UNIT), grid(2)
    outline = outline_of(polygon, plane, triangles)
    loose = dataclasses.replace(outline, curve=np.where(outline.curve == 1, -1, outline.curve))
    found = certify_face(
        Face(0, polygon, FLAT_FRAME, None, 1.0),
        FLAT_FRAME.to_space(plane),
        triangles,
        loose,
        polygon.evaluate,
        diagonal=1.5,
    )
    assert found.certified
    assert found.boundary_distance == 0.0


def test_box_totals():
    certificate = box(3).certificate
    assert certificate.certified
    assert certificate.triangles == 108
    assert certificate.worst_skew == pytest.approx(63.4349488)
    assert certificate.mean_skew == pytest.approx(63.4349488)
    assert certificate.area_error < 1e-14


def test_a_face_without_triangles_is_not_certified():
    found = certify_square(np.empty((0, 2)), np.empty((0, 3)))
    assert not found.certified
    assert found.reasons == ("the face has no triangle",)


def test_no_faces_is_not_certified():
    assert not dataclasses.replace(box(1).certificate, faces=()).certified


def test_closes_up():
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    rim = np.array([[0, 1], [1, 2], [2, 3], [3, 0]], np.int32)
    assert closes_up(triangles, rim, 4)
    assert not closes_up(triangles, rim[:3], 4)
    assert not closes_up(triangles, rim[:, ::-1], 4)


def closes_up_slowly(triangles, segments) -> bool:
    """The rule of ``closes_up``, edge by edge."""
    times = Counter((a, b) for t in triangles.tolist() for a, b in zip(t, t[1:] + t[:1], strict=True))
    surplus = Counter()
    for (a, b), count in times.items():
        surplus[min(a, b), max(a, b)] += count * (-1 if a > b else 1)
    for a, b in segments.tolist():
        surplus[min(a, b), max(a, b)] -= -1 if a > b else 1
    return max(times.values()) == 1 and not any(surplus.values())


def test_closes_up_as_found_edge_by_edge():
    rng, verdicts = np.random.default_rng(11), Counter()
    for _ in range(600):
        plane, triangles = grid(int(rng.integers(1, 5)))
        triangles = np.roll(triangles, rng.integers(3), axis=1)[rng.permutation(len(triangles))].astype(np.int32)
        edges = {(a, b) for t in triangles.tolist() for a, b in zip(t, t[1:] + t[:1], strict=True)}
        segments = np.array([e for e in edges if e[::-1] not in edges], np.int32)
        row, other = rng.integers(len(triangles)), rng.integers(0, len(plane), 3)
        match rng.integers(9):
            case 0:
                triangles = np.delete(triangles, row, 0)
            case 1:
                triangles = np.concatenate([triangles, triangles[row : row + 1]])
            case 2:
                triangles[row] = triangles[row, [0, 2, 1]]
            case 3:
                triangles[row] = other
            case 4:
                segments = segments[1:]
            case 5:
                segments = np.concatenate([segments, [other[:2]]])
            case 6:  # there and back: it changes nothing
                segments = np.concatenate([segments, [other[:2], other[1::-1]]])
        if len(triangles):
            verdict = closes_up(triangles, segments, len(plane))
            assert verdict == closes_up_slowly(triangles, segments)
            verdicts[verdict] += 1
    assert min(verdicts.values()) > 100


def test_a_hub_of_many_edges_takes_linear_time():
    n = 200_000
    ring = 1 + np.arange(n, dtype=np.int32)
    fan = np.stack([np.zeros(n, np.int32), ring, np.roll(ring, -1)], 1)
    begin = time.process_time()
    assert closes_up(fan, fan[:, 1:], n + 1)
    assert time.process_time() - begin < 2.0


def test_nodes_that_do_not_exist_are_told():
    triangles = np.array([[0, 1, 2]], np.int32)
    for wrong in (3, -1):
        with pytest.raises(OptionError, match="a triangle names a point"):
            closes_up(np.array([[0, 1, wrong]], np.int32), triangles[:, :2], 3)
        with pytest.raises(OptionError, match="a segment names a point"):
            closes_up(triangles, np.array([[0, wrong]], np.int32), 3)
        with pytest.raises(OptionError, match="a triangle names a point"):
            measure(np.eye(3), np.array([[0, 1, wrong]]), SEGMENTS, (np.zeros(3), np.ones(3)), (45.0, 2.0))


def test_scratch_space_is_left_as_it_was():
    for points in (4, 400):
        number = numbering(points)
        measure(np.eye(points, 3), np.array([[0, 1, 2]]), SEGMENTS, (np.zeros(3), np.ones(3)), (45.0, 2.0), number)
        assert (number == numbering(points)).all()


def test_speed():
    """A million triangles take about 0.05 seconds, ten times that on a busy machine."""
    plane, triangles = grid(700)
    side = np.arange(700)
    low = np.stack([side, side + 1], 1)
    top = np.stack([side + 1, side], 1) + 701 * 700
    left = np.stack([side + 1, side], 1) * 701
    right = np.stack([side, side + 1], 1) * 701 + 700
    t = np.stack([side, side + 1], 1) / 700
    outline = Outline(
        np.concatenate([low, right, top[::-1], left[::-1]]).astype(np.int32),
        np.repeat(np.arange(4, dtype=np.int32), 700),
        np.concatenate([t] * 4),
        np.array([0, 700, 701 * 701 - 1, 701 * 700]),
        np.full(4, 90.0),
    )
    polygon = Polygon(UNIT)
    face, points = Face(0, polygon, FLAT_FRAME, None, 1.0), FLAT_FRAME.to_space(plane)
    begin = time.process_time()
    found = certify_face(face, points, triangles.astype(np.int32), outline, polygon.evaluate, diagonal=1.5)
    assert found.certified, found.reasons
    assert time.process_time() - begin < 0.6
