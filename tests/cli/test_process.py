"""True processes: start-up time, clean standard output, exit codes as a shell sees them."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
import time

import pytest

from handmade import bad_square, square

START = [sys.executable, "-c", "from fubini.cli import main; main()"]


def run(*arguments, **options):
    return subprocess.run([*START, *map(str, arguments)], capture_output=True, text=True, timeout=120, **options)


def test_help_is_quick_and_imports_little():
    code = (
        "import sys; from click.testing import CliRunner; from fubini.cli import main\n"
        "assert CliRunner().invoke(main, ['--help']).exit_code == 0\n"
        "print([m for m in ('numba', 'matplotlib', 'OCP', 'trimesh', 'meshio', 'scipy', 'numpy') if m in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert found.stdout.strip() == "[]"
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        result = run("--help")
        times.append(time.perf_counter() - begin)
    assert result.returncode == 0
    assert all(command in result.stdout for command in ("mesh", "check", "cells", "info"))
    assert min(times) < 1.0  # 0.1 s on an idle machine


def test_version_and_bad_usage():
    assert run("--nonsense").returncode == 2
    assert run("nonsense").returncode == 2
    assert run("mesh").returncode == 2


def test_check_as_a_process(tmp_path):
    square(3).save(tmp_path / "good.stl")
    bad_square().save(tmp_path / "bad.stl")
    good, bad = run("check", tmp_path / "good.stl", "--json", "-"), run("check", tmp_path / "bad.stl")
    assert (good.returncode, bad.returncode) == (0, 1)
    assert json.loads(good.stdout)["valid"] is True
    assert good.stderr == ""


def test_mesh_as_a_process(box_file, tmp_path):
    result = run("mesh", box_file, "-o", "a.stl", "--size", 0.5, "--json", "-", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["certified"] is True
    assert "\r" not in result.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["a.stl"]


def test_stdout_of_compiled_code_is_kept_out(tmp_path):
    """What C code prints while the work runs lands on stderr, also when its buffer is flushed late."""
    code = (
        "import ctypes, sys\n"
        "from fubini.cli.common import stdout_to_stderr\n"
        "libc = ctypes.CDLL(None)\n"
        "with stdout_to_stderr(True):\n"
        "    libc.printf(b'noise ')\n"
        "    print('chatter')\n"
        "print('{}')\n"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert found.stdout == "{}\n"
    assert "noise" in found.stderr
    assert "chatter" in found.stderr


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_only_on_a_terminal(terminal):
    code = (
        "import time\n"
        "from fubini.cli import common\n"
        "common.PATIENCE = 0.0\n"
        "with common.Progress() as p:\n"
        "    p('faces', 1, 40)\n"
        "    time.sleep(0.15)\n"
        "    p('faces', 2, 40)\n"
    )
    if not terminal:
        found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
        assert (found.stdout, found.stderr) == ("", "")
        return
    master, slave = pty.openpty()
    subprocess.run([sys.executable, "-c", code], stderr=slave, timeout=60, check=True)
    os.close(slave)
    said = os.read(master, 10_000).decode()
    os.close(master)
    assert "faces 1/40" in said
    assert "faces 2/40" in said
    assert said.endswith("\r" + " " * len("faces 2/40") + "\r")


def test_python_m_fubini_is_the_command_line():
    found = subprocess.run([sys.executable, "-m", "fubini", "--help"], capture_output=True, text=True, timeout=60)
    assert found.returncode == 0, found.stderr
    assert "check" in found.stdout
