"""Large faces judged beside each other: the same certificate, and errors reach the caller."""

from __future__ import annotations

import threading

import numpy as np
import pytest

import fubini
import regions
from fubini import certificate
from fubini.pipeline import judging


@pytest.fixture
def two_squares():
    left = np.array([(0, 0), (1, 0), (1, 1), (0, 1.0)])
    return [regions.polygon(left), regions.polygon(left + (1.0, 0.0))]


@pytest.mark.parametrize(("least", "threads"), [(10, True), (10_000, False)])
def test_threads_change_no_certificate_and_serve_large_faces_only(two_squares, least, threads, monkeypatch):
    used = []
    certify_face = certificate.certify_face

    def noted(*arguments, **options):
        used.append(threading.current_thread() is not threading.main_thread())
        return certify_face(*arguments, **options)

    monkeypatch.setattr(certificate, "certify_face", noted)
    monkeypatch.setattr(judging, "LARGE", least)
    found = []
    for cores in (1, 2):
        used.clear()
        monkeypatch.setattr(judging, "cores", lambda cores=cores: cores)
        found.append(fubini.mesh(two_squares, 0.1).certificate)
        assert used == [threads and cores == 2] * 2
    assert found[0] == found[1]
    assert found[0].certified


def test_errors_of_threads_reach_the_caller(two_squares, monkeypatch):
    def failing(*arguments, **options):
        raise RuntimeError("no verdict")

    monkeypatch.setattr(certificate, "certify_face", failing)
    monkeypatch.setattr(judging, "LARGE", 10)
    monkeypatch.setattr(judging, "cores", lambda: 2)
    with pytest.raises(RuntimeError, match="no verdict"):
        fubini.mesh(two_squares, 0.1)
