"""Every real file: planar faces counted, areas against the kernel, loops closed."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fubini.cad import load
from fubini.errors import GeometryError

pytest.importorskip("OCP")


@pytest.fixture(scope="session")
def entries(corpus):
    rows = [json.loads(line) for line in (corpus / "manifest.jsonl").read_text().splitlines()]
    for row in rows:
        name = row.get("derived_brep") or row["file"]
        row["path"] = corpus / name if (corpus / name).exists() else corpus / name.replace("#", "")
    hostile = {
        json.loads(line)["file"]
        for line in (corpus / "faces.jsonl").read_text().splitlines()
        if json.loads(line)["cls"] != "good"
    }
    return [(row, str(row["path"].relative_to(corpus)) in hostile) for row in rows]


def test_every_good_file_loads_with_all_its_planar_faces(entries):
    for row, hostile in entries:
        try:
            model = load(row["path"])
        except GeometryError:
            assert hostile, row["file"]
            continue
        assert len(model.faces) == row["n_planar"], row["file"]
        assert len(model.faces) + len(model.skipped) == row["n_faces"], row["file"]
        # a file's own gaps between curves and vertices shift areas by gap times perimeter
        for face in model.faces:
            loose = max(model.edges[e].tolerance for e in face.region.edges)
            slack = 1e-9 * face.area + (0.1 * loose * face.region.perimeter if loose > 1e-7 else 1e-9 * face.area)
            assert abs(face.region.area - face.area) <= slack, (row["file"], face.index)
            for loop in face.region.loops:
                ends = [(c.point(0.0), c.point(1.0)) for c in loop.curves]
                for (_, end), (start, _) in zip(ends, [*ends[1:], ends[0]], strict=True):
                    assert np.array_equal(end, start)
            assert np.linalg.norm(face.frame.normal) == pytest.approx(1.0, abs=1e-14)


def test_reading_twice_gives_the_same_bits(corpus):
    path = corpus / "SO-ARM100/STEP/SO101/WaveShare_Mounting_Plate_SO101.step"
    a, b = load(path, check=False), load(path, check=False)
    for f, g in zip(a.faces, b.faces, strict=True):
        assert np.array_equal(f.frame.origin, g.frame.origin) and f.region.edges == g.region.edges
        for c, d in zip(f.region.curves, g.region.curves, strict=True):
            t = np.linspace(0, 1, 7)
            assert np.array_equal(c.point(t), d.point(t))
