"""What the package promises to those who install it."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from importlib.metadata import entry_points, requires, version
from pathlib import Path

import pytest

import fubini

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
HEAVY = [
    "OCP",
    "build123d",
    "cadquery",
    "numba",
    "matplotlib",
    "trimesh",
    "meshio",
    "scipy",
    "ezdxf",
    "svgelements",
    "click",
]


def run(code):
    return subprocess.check_output([sys.executable, "-c", code], text=True, timeout=120)


def test_import_is_cheap():
    loaded = run(f"import fubini, sys; print([name for name in {HEAVY} if name in sys.modules])")
    assert loaded.strip() == "[]"


def test_help_of_the_command_loads_no_kernel():
    code = (
        "import sys; from click.testing import CliRunner; from fubini.cli import main\n"
        "result = CliRunner().invoke(main, ['--help']); assert result.exit_code == 0, result.output\n"
        f"print([name for name in {HEAVY} if name in sys.modules and name != 'click'])"
    )
    assert run(code).strip() == "[]"


def test_version_is_stated_once():
    assert fubini.__version__ == PROJECT["version"] == version("fubini")
    assert f"## {PROJECT['version']}" in (ROOT / "CHANGELOG.md").read_text()


def test_command_is_installed():
    (script,) = entry_points(group="console_scripts", name="fubini")
    assert script.value == "fubini.cli:main"
    assert callable(script.load())


def test_core_needs_no_cad_kernel():
    core = [line for line in requires("fubini") if "extra ==" not in line]
    assert len(core) == len(PROJECT["dependencies"])
    assert not [line for line in core if any(word in line for word in ("ocp", "cadquery", "build123d"))]


def test_types_are_shipped():
    assert (Path(fubini.__file__).parent / "py.typed").exists()


@pytest.mark.parametrize("extra", ["build123d", "cadquery", "ocp", "dxf", "svg", "plot", "fem", "dev", "all"])
def test_extra_exists(extra):
    assert PROJECT["optional-dependencies"][extra]
