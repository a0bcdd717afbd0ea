"""Triangle meshes as models: planar patches become faces with straight edges."""

from fubini.patches.build import facet_model
from fubini.patches.grow import Facets, grow, read_facets

__all__ = ["Facets", "facet_model", "grow", "read_facets"]
