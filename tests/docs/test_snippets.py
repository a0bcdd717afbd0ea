"""The Python of the README, the tutorials and pages of the manual runs as printed, page by page."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = sorted(str(p.relative_to(ROOT)) for p in (ROOT / "docs" / "tutorials").glob("*.md"))
PAGES = ["README.md", *(f"docs/manual/{name}.md" for name in ("conforming", "sizes", "sources")), *TUTORIALS]


@pytest.fixture(scope="module")
def bracket(tmp_path_factory):
    """Folder with the STEP file that pages read."""
    folder = tmp_path_factory.mktemp("pages")
    subprocess.run([sys.executable, ROOT / "cad_examples" / "bracket.py", folder], check=True, timeout=120)
    assert (folder / "bracket.step").exists()
    return folder


@pytest.mark.parametrize("page", PAGES)
def test_page_runs(page, bracket):
    pytest.importorskip("build123d")
    text = (ROOT / page).read_text()
    code = "\n".join(re.findall(r"^```python\n(.*?)^```", text, flags=re.S | re.M))
    assert "fubini.mesh(" in code
    if "cadquery" in code:
        pytest.importorskip("cadquery")
    if "skfem" in code:
        pytest.importorskip("skfem")
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=bracket, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
