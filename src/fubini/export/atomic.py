"""Files that appear whole or not at all, one by one or several together."""

from __future__ import annotations

import os
import secrets
from pathlib import Path
from types import TracebackType
from typing import Self

from fubini.errors import ExportError


def check_target(path: str | Path) -> Path:
    """The real path behind ``path`` where a file can be written; follows links.

    Raises
    ------
    ExportError : the folder is missing or not writable, or the path is not that of a regular file.
    """
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        raise ExportError("the folder does not exist", file=str(path), fix=f"create {target.parent} first")
    if target.exists() and not target.is_file():
        kind = "a folder" if target.is_dir() else "not a regular file"
        raise ExportError(f"cannot be written: it is {kind}", file=str(path))
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise ExportError("the folder is not writable", file=str(path))
    if target.exists() and not os.access(target, os.W_OK):
        raise ExportError("the file is write-protected", file=str(path))
    return target


class Transaction:
    """Several files that appear together at the end of a ``with`` block, or not at all.

    ``stage`` hands out a temporary path in the folder of the target; a clean end of the block moves
    every temporary file onto its target, and an exception removes them. Should a move fail, the
    targets that this transaction has created are removed again; a file that was there before and has
    been replaced already stays replaced.
    """

    def __init__(self) -> None:
        self._staged: list[tuple[str | Path, Path, Path]] = []

    def stage(self, path: str | Path) -> Path:
        """A temporary path beside the target, of the same suffix; the file does not exist yet."""
        target = check_target(path)
        if any(target == other for _, other, _ in self._staged):
            raise ExportError("the same file is to be written twice", file=str(path))
        temporary = target.with_name(f".{target.stem[:80]}-{secrets.token_hex(6)}{target.suffix}")
        self._staged.append((path, target, temporary))
        return temporary

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if error is None:
                self._commit()
        finally:
            for _, _, temporary in self._staged:
                temporary.unlink(missing_ok=True)
        if isinstance(error, OSError) and not isinstance(error, ExportError):
            paths = ", ".join(str(path) for path, _, _ in self._staged)
            raise ExportError(f"cannot be written: {error.strerror or error}", file=paths) from error

    def _commit(self) -> None:
        created: list[Path] = []
        for path, target, temporary in self._staged:
            new = not target.exists()
            try:
                os.replace(temporary, target)
            except OSError as error:
                for other in created:
                    other.unlink(missing_ok=True)
                reason = error.strerror or str(error)
                raise ExportError(f"cannot be written: {reason}", file=str(path)) from error
            created += [target] if new else []
