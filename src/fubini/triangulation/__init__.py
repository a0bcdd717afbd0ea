"""Triangulation of a region: the value, the constrained Delaunay construction, the local operations."""
