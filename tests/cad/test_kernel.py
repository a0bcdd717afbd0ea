"""The CAD kernel: imported late, checked for packages that do not fit together."""

from __future__ import annotations

import subprocess
import sys

import pytest

from fubini.cad import kernel
from fubini.errors import DependencyError


def run(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True).stdout


def test_importing_the_package_imports_no_kernel():
    code = "import sys, fubini, fubini.cad; print([m for m in sys.modules if m.split('.')[0] in ('OCP', 'build123d')])"
    assert run(code).strip() == "[]"


def test_a_missing_kernel_is_explained():
    code = (
        "import sys; sys.modules['OCP'] = None\n"
        "from importlib import metadata\n"
        "from fubini.cad import kernel; kernel._version = lambda name: None\n"
        "from fubini.cad import load\n"
        "from fubini.errors import DependencyError\n"
        "try: load([])\n"
        "except DependencyError as error: print(error)"
    )
    assert "pip install 'fubini[build123d]'" in run(code)


def test_two_generations_of_the_kernel_are_refused(monkeypatch):
    versions = {"cadquery-ocp": "7.8.1.1", "cadquery-ocp-novtk": "8.0.1.1"}
    monkeypatch.setattr(kernel, "_version", versions.get)
    with pytest.raises(DependencyError) as caught:
        kernel.require_kernel()
    text = str(caught.value)
    assert "cadquery-ocp 7.8.1.1, cadquery-ocp-novtk 8.0.1.1" in text
    assert "pip uninstall -y cadquery-ocp cadquery-ocp-novtk && pip install" in text


def test_files_of_another_version_are_noticed(monkeypatch):
    ocp = pytest.importorskip("OCP")
    monkeypatch.setattr(kernel, "_version", {"cadquery-ocp": "7.7.2"}.get)
    with pytest.raises(DependencyError, match=f"cadquery-ocp 7.7.2, OCP itself {ocp.__version__}"):
        kernel.require_kernel()


def test_an_incomplete_kernel_is_no_missing_one(monkeypatch):
    def fail(name: str):
        raise ModuleNotFoundError("No module named 'OCP.TopoDS'", name="OCP.TopoDS")

    monkeypatch.setattr(kernel, "_version", lambda name: None)
    monkeypatch.setattr(kernel.importlib, "import_module", fail)
    with pytest.raises(DependencyError, match="incomplete"):
        kernel.require_kernel()


def test_the_last_digits_of_a_wheel_do_not_count():
    assert kernel.mismatch([("cadquery-ocp", "7.9.3.1.1"), ("OCP itself", "7.9.3.1")]) is None
    assert kernel.mismatch([]) is None
