"""The certificate tells the truth about good and about spoiled meshes."""

from __future__ import annotations

import dataclasses
import math
import time

import numpy as np
import pytest

from fubini import quality
from fubini.certificate import Outline, certify_face, closes_up, excuse, triangle_figures
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


def test_figures_agree_with_quality():
    p = np.random.default_rng(5).normal(size=(500, 3, 3))
    found = triangle_figures(p.reshape(-1, 3), np.arange(1500, dtype=np.int32).reshape(-1, 3))
    np.testing.assert_allclose(found.skew, quality.skewness(p), rtol=1e-9)
    np.testing.assert_allclose(found.aspect, quality.aspect_ratios(p), rtol=1e-9)
    np.testing.assert_allclose(found.least, quality.angles(p).min(1), rtol=1e-9)
    np.testing.assert_allclose(found.greatest, quality.angles(p).max(1), rtol=1e-9)


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


def test_speed():
    """A million triangles in about a second, a small face in well under a millisecond."""
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
    assert time.process_time() - begin < 4.0
