"""Fixtures for all tests."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
CORPUS = ROOT.parent / "shared" / "corpus"


@pytest.fixture(scope="session")
def corpus() -> Path:
    """Folder of real CAD files beside the project; tests that need it skip where it is missing."""
    if not CORPUS.is_dir():
        pytest.skip(f"no corpus of CAD files at {CORPUS}")
    return CORPUS
