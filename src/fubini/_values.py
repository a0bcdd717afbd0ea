"""Frozen dataclasses that are made fast.

``dataclasses`` fills a frozen object by one call of ``object.__setattr__`` for each field. A mesh of some hundred
triangles takes a few tenths of a millisecond, of which a twentieth went there.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as value
else:

    def value(*, frozen: bool) -> Callable[[type], type]:
        """``dataclass(frozen=True)`` with an ``__init__`` that writes into the ``__dict__`` of the new object."""
        return functools.partial(_decorate, frozen=frozen)


def _decorate(cls: type, frozen: bool) -> type:
    """The class as a dataclass, its ``__init__`` exchanged."""
    made: Any = dataclasses.dataclass(frozen=frozen)(cls)
    usual = made.__init__
    names: dict[str, Any] = {}
    parameters, lines = [], ["into_self = self.__dict__"]
    for field in dataclasses.fields(made):
        name, filled = field.name, field.name
        if field.default is not dataclasses.MISSING:
            names[f"default_{name}"] = field.default
            name += f"=default_{name}"
        elif field.default_factory is not dataclasses.MISSING:
            names |= {f"make_{name}": field.default_factory, "missing": dataclasses.MISSING}
            filled = f"make_{name}() if {name} is missing else {name}"
            name += "=missing"
        parameters.append(name)
        lines.append(f"into_self[{field.name!r}] = {filled}")
    if hasattr(made, "__post_init__"):
        lines.append("self.__post_init__()")
    exec(f"def __init__(self, {', '.join(parameters)}):\n " + "\n ".join(lines), names)
    made.__init__ = functools.wraps(usual)(names["__init__"])
    return cls


__all__ = ["value"]
