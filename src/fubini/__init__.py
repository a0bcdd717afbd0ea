"""Certified triangle meshes of the planar faces of CAD models."""

__version__ = "0.1.0"
