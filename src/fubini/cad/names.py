"""Names from the source, brought to the sub-shapes that they mean."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from fubini.cad import occ


def resolve(shapes: occ.ShapeMap, named: Iterable[tuple[Any, str]]) -> dict[int, str]:
    """Number of sub-shape to name.

    Each pair names the sub-shapes of the right kind within its shape: the same ones (``IsSame``), else
    all with the same geometry in another place (``IsPartner``). The first name stands. Names become printable.
    """
    names: dict[int, str] = {}
    partners: dict[int, list[int]] | None = None
    for shape, raw in named:
        name = printable(raw)
        if not name:
            continue
        for part in occ.ShapeMap(shape, shapes.kind):
            index = shapes.index(part)
            if index >= 0:
                names.setdefault(index, name)
                continue
            if partners is None:
                bare, partners = _partners(shapes)
            for index in partners.get(bare.index(occ.unplaced(part)), ()):
                names.setdefault(index, name)
    return names


def printable(name: str) -> str:
    """The name on one line: single blanks in place of everything that does not print."""
    return " ".join("".join(c if c.isprintable() else " " for c in name).split())


def _partners(shapes: occ.ShapeMap) -> tuple[occ.ShapeMap, dict[int, list[int]]]:
    """The sub-shapes without placement, and which ones each stands for."""
    bare = occ.ShapeMap(occ.compound(occ.unplaced(s) for s in shapes), shapes.kind)
    groups: dict[int, list[int]] = {}
    for index, shape in enumerate(shapes):
        groups.setdefault(bare.index(occ.unplaced(shape)), []).append(index)
    return bare, groups
