"""Size fields for ``fubini.mesh(..., size_field=...)``: a background quadtree, or octree in space."""

from fubini.sizing.field import SizeTree

__all__ = ["SizeTree"]
