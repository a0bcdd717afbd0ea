"""Every error that fubini raises on purpose, and nothing else.

A message names what the reader needs to find the trouble: the file, the face, the edge, the
coordinate, and how to mend it. The parts stay available as attributes.
"""

from __future__ import annotations

from collections.abc import Iterable


class FubiniError(Exception):
    """Base of all errors of this package.

    Parameters
    ----------
    message : what is wrong, without the place.
    file : path or label of the source.
    face, edge : 0-based index in the order of ``TopExp::MapShapes``.
    at : coordinates of the trouble, in model units.
    fix : what the reader can do about it.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        face: int | None = None,
        edge: int | None = None,
        at: Iterable[float] | None = None,
        fix: str | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.file = file
        self.face = face
        self.edge = edge
        self.at = None if at is None else tuple(float(x) for x in at)
        self.fix = fix

    def __str__(self) -> str:
        place = [self.file] if self.file else []
        place += [f"face {self.face}"] if self.face is not None else []
        place += [f"edge {self.edge}"] if self.edge is not None else []
        if self.at is not None:
            place.append("at (" + ", ".join(f"{x:.9g}" for x in self.at) + ")")
        text = ": ".join([*place, self.message])
        return f"{text} ({self.fix})" if self.fix else text


class InputError(FubiniError, ValueError):
    """The source cannot be read, or holds nothing that can be meshed."""


class GeometryError(InputError):
    """The geometry is not a valid region: open, self-crossing, touching, of no area."""


class OptionError(FubiniError, ValueError):
    """An option has a value that makes no sense; the message lists what is allowed."""


class ExportError(FubiniError, OSError):
    """A file could not be written; nothing half-written stays behind."""


class DependencyError(FubiniError, ImportError):
    """An optional package is missing, or two installed packages do not fit together."""
