"""Tables and JSON say what the certificate says."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

from fubini.report import EXCUSED, FLAWED, VALID, table, to_json, triangle_states
from handmade import bad_square, box, grid, one_face, square, wedge

TOTAL = {
    "certified", "triangles", "flawed", "unavoidable", "worst_skew", "worst_aspect_ratio", "min_angle", "max_angle",
    "longest_edge", "area_error", "boundary_distance", "chord_error", "seconds", "skipped_faces", "faces",
}  # fmt: skip
PER_FACE = (TOTAL - {"seconds", "skipped_faces", "faces"}) | {"face", "name", "corners", "reasons", "worst_at"}


def test_json_has_the_promised_keys():
    data = to_json(square(2, index=3, name="top"))
    assert set(data) >= TOTAL
    assert set(data["faces"][0]) >= PER_FACE
    assert data["certified"] is True
    assert data["skipped_faces"] == 1
    assert data["skipped"] == [{"face": 4, "name": None, "surface": "cylinder", "reason": "not planar"}]
    assert data["seconds"] == {"load": 0.25, "triangulate": 0.5}
    assert (data["faces"][0]["face"], data["faces"][0]["name"]) == (3, "top")
    assert json.loads(json.dumps(data, allow_nan=False)) == data


def test_json_of_corners_and_reasons():
    (face,) = to_json(wedge(15.0))["faces"]
    assert face["corners"] == [{"point": [0.0, 0.0, 0.0], "angle": pytest.approx(15.0)}]
    assert face["certified"] and not face["reasons"]
    bad = to_json(bad_square())
    assert bad["certified"] is False
    assert bad["flawed"] == bad["faces"][0]["flawed"] > 0
    assert bad["faces"][0]["reasons"]


def test_totals_are_sums_and_worst_cases():
    data = to_json(box(2))
    assert data["triangles"] == sum(f["triangles"] for f in data["faces"]) == 48
    assert data["worst_skew"] == min(f["worst_skew"] for f in data["faces"])


def test_json_is_strict_for_triangles_of_no_area():
    plane, triangles = grid(2)
    plane[4] = (0.75, 0.25)  # onto the line between two of its neighbours
    plane = np.array(plane)
    mesh = one_face([(0, 0), (1, 0), (1, 1), (0, 1)], plane, triangles)
    assert math.isinf(mesh.certificate.worst_aspect_ratio)
    data = json.loads(json.dumps(to_json(mesh), allow_nan=False))
    assert data["worst_aspect_ratio"] is None
    assert data["worst_skew"] == 0.0


def test_table_has_a_line_per_face_and_the_remarks():
    text = table(box(2)).splitlines()
    assert len(text) == 8
    assert text[0].split()[:3] == ["face", "name", "triangles"]
    assert "lid" in text[2]
    assert text[-1].split()[:2] == ["all", "48"]
    bad = table(bad_square())
    assert "NO" in bad
    assert "flawed triangles, worst at" in bad
    assert "1 face skipped: 1 cylinder" in bad
    assert "15.00 degrees" in table(wedge(15.0))


def test_long_tables_show_the_worst():
    faces = [
        dataclasses.replace(square().certificate.faces[0], face=i, avoidable_skew=46.0 + i, name=f"f{i}")
        for i in range(100)
    ]
    faces[77] = dataclasses.replace(faces[77], reasons=("for a test",))
    certificate = dataclasses.replace(square().certificate, faces=tuple(faces))
    text = table(dataclasses.replace(square(), certificate=certificate), rows=5)
    shown = [line.split()[0] for line in text.splitlines()[1:6]]
    assert shown == ["0", "1", "2", "3", "77"]
    assert "95 more faces, all certified" in text
    assert "face 77 (f77): for a test" in text


def test_states():
    assert triangle_states(wedge(15.0)).tolist() == [EXCUSED]
    assert (triangle_states(square()) == VALID).all()
    mesh = bad_square()
    assert (triangle_states(mesh) == FLAWED).sum() == mesh.certificate.flawed
