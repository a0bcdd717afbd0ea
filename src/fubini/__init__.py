"""Certified triangle meshes of the planar faces of CAD models.

>>> import fubini
>>> mesh = fubini.mesh("part.step", size=2.0)     # doctest: +SKIP
>>> mesh.certificate.certified                    # doctest: +SKIP
True
>>> mesh.save("part.stl")                         # doctest: +SKIP

Importing this package loads neither a CAD kernel nor a compiler; they come with the first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from fubini.cells import decompose, integrate
    from fubini.curves import fit_bezier
    from fubini.model import Model
    from fubini.pipeline import load, mesh, remesh
    from fubini.result import Mesh

__all__ = ["Mesh", "Model", "decompose", "fit_bezier", "integrate", "load", "mesh", "remesh"]

_HOME = {
    "Mesh": "fubini.result",
    "Model": "fubini.model",
    "decompose": "fubini.cells",
    "fit_bezier": "fubini.curves",
    "integrate": "fubini.cells",
    "load": "fubini.pipeline",
    "mesh": "fubini.pipeline",
    "remesh": "fubini.pipeline",
}


def __getattr__(name: str) -> Any:
    """Load the public names on first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'fubini' has no attribute {name!r}")
    import importlib

    value = globals()[name] = getattr(importlib.import_module(_HOME[name]), name)
    return value
