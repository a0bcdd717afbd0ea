"""A file appears whole or not at all."""

from __future__ import annotations

import os
import stat

import pytest

from fubini.errors import ExportError
from fubini.export import WRITERS, Transaction, save, save_all
from handmade import square


def half_written(mesh, path):
    path.write_bytes(b"half")
    raise OSError(28, "No space left on device")


def test_failure_leaves_nothing_and_keeps_the_old(tmp_path, monkeypatch):
    monkeypatch.setitem(WRITERS, ".ply", half_written)
    old = tmp_path / "old.ply"
    old.write_bytes(b"precious")
    for path in (old, tmp_path / "new.ply"):
        with pytest.raises(ExportError, match="No space left") as caught:
            save(square(), path)
        assert path.name in str(caught.value)
    assert [p.name for p in tmp_path.iterdir()] == ["old.ply"]
    assert old.read_bytes() == b"precious"


def test_crash_of_a_writer_leaves_nothing(tmp_path, monkeypatch):
    def crash(mesh, path):
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setitem(WRITERS, ".ply", crash)
    with pytest.raises(KeyboardInterrupt):
        save(square(), tmp_path / "new.ply")
    assert not list(tmp_path.iterdir())


def test_second_failure_removes_the_first(tmp_path, monkeypatch):
    monkeypatch.setitem(WRITERS, ".ply", half_written)
    with pytest.raises(ExportError):
        save_all(square(), [tmp_path / "a.stl", tmp_path / "b.ply"])
    assert not list(tmp_path.iterdir())


def test_failed_move_removes_what_was_moved(tmp_path, monkeypatch):
    real, moved = os.replace, []

    def replace(a, b):
        if moved:
            raise PermissionError(1, "Operation not permitted")
        moved.append(b)
        real(a, b)

    monkeypatch.setattr(os, "replace", replace)
    with pytest.raises(ExportError, match=r"b\.obj"):
        save_all(square(), [tmp_path / "a.stl", tmp_path / "b.obj"])
    assert moved
    assert not list(tmp_path.iterdir())


def test_all_appear_together(tmp_path):
    save_all(square(), [tmp_path / "a.stl", tmp_path / "b.obj"])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.stl", "b.obj"]


@pytest.mark.parametrize("where", ["missing/a.stl", "folder.stl"])
def test_bad_target_names_the_file(tmp_path, where):
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(ExportError, match=where):
        save(square(), tmp_path / where)
    assert [p.name for p in tmp_path.iterdir()] == ["folder.stl"]


def test_devices_are_left_alone(tmp_path):
    fifo = tmp_path / "pipe.stl"
    os.mkfifo(fifo)
    with pytest.raises(ExportError, match="not a regular file"):
        save(square(), fifo)
    assert stat.S_ISFIFO(fifo.stat().st_mode)


def test_links_are_followed(tmp_path):
    target = tmp_path / "real.stl"
    target.write_bytes(b"old")
    (tmp_path / "link.stl").symlink_to(target)
    save(square(), tmp_path / "link.stl")
    assert (tmp_path / "link.stl").is_symlink()
    assert target.stat().st_size == 84 + 50 * 8


def test_permissions_follow_the_umask(tmp_path):
    save(square(), tmp_path / "a.obj")
    (tmp_path / "plain").write_text("x")
    assert (tmp_path / "a.obj").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_same_file_twice_is_refused(tmp_path):
    with Transaction() as files:
        files.stage(tmp_path / "a.stl").write_text("x")
        with pytest.raises(ExportError, match="twice"):
            files.stage(tmp_path / "." / "a.stl")
