"""The only place where the stages meet: from a source to a mesh."""

from fubini.pipeline.remeshing import remesh
from fubini.pipeline.run import load, mesh

__all__ = ["load", "mesh", "remesh"]
