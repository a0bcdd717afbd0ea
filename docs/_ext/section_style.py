"""Docstrings say ``name : meaning`` in their sections; numpydoc would read the meaning as a type.

This puts the meaning on a line of its own before napoleon looks at the docstring.
"""

from __future__ import annotations

import re

SECTIONS = {"Attributes", "Parameters", "Raises", "Returns"}
ENTRY = re.compile(r"(\S.*?) : (.+)")


def split_entries(lines: list[str]) -> list[str]:
    """The lines of a docstring with each ``name : meaning`` of a section on two lines."""
    out: list[str] = []
    inside = False
    for i, line in enumerate(lines):
        if i + 1 < len(lines) and re.fullmatch(r"-{3,}", lines[i + 1].strip()):
            inside = line.strip() in SECTIONS
        entry = ENTRY.fullmatch(line) if inside else None
        out += [entry[1], "    " + entry[2]] if entry else [line]
    return out


def process(app, what, name, obj, options, lines):
    lines[:] = split_entries(lines)


def setup(app):
    app.connect("autodoc-process-docstring", process, priority=400)
    return {"parallel_read_safe": True}
