"""The only code that touches a CAD kernel: files and live objects to models, meshes back to shapes.

Importing this package imports no kernel; the first ``load`` does.
"""

from fubini.cad.loading import attach, load, match, read
from fubini.cad.source import ReadOptions, Source

__all__ = ["ReadOptions", "Source", "attach", "load", "match", "read"]
