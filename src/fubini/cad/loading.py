"""One function that takes every kind of CAD source."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from fubini.cad.source import ReadOptions, Source, reader_for
from fubini.errors import InputError
from fubini.model import Model


def load(source: Any, *, check: bool = True, gap: float | None = None) -> Model:
    """The planar faces of a CAD source."""
    from fubini.cad.build import build_model

    return build_model(read(source, gap=gap), check)


def read(source: Any, *, gap: float | None = None) -> Source:
    """The CAD shape and the names of a source, before any face is looked at."""
    if isinstance(source, str | os.PathLike):
        return _read_file(Path(source), ReadOptions(gap))
    raise InputError(f"cannot load a {type(source).__name__}")


def _read_file(path: Path, options: ReadOptions) -> Source:
    reader = reader_for(path)
    if path.is_dir():
        raise InputError("this is a folder, not a file", file=str(path))
    if not path.is_file():
        raise InputError("no such file", file=str(path), fix="check the path")
    if path.stat().st_size == 0:
        raise InputError("the file is empty", file=str(path))
    return reader(path, options)
