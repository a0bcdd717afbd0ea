"""``remesh``: an existing triangle mesh, patch by planar patch."""

from __future__ import annotations

from typing import Any

from fubini.pipeline.run import mesh
from fubini.result import Mesh


def remesh(
    source: Any, size: float | None = None, *, tolerance: float | None = None, angle: float = 1.0, **options: Any
) -> Mesh:
    """Mesh a surface of triangles anew: same surface, certified triangles, conforming along all borders.

    Triangles that lie in one plane form a patch; its outline keeps its corners, and where two patches meet
    they share one edge and its nodes. Facets of curved parts are patches of their own. What was watertight
    is so again.

    Parameters
    ----------
    source : a path (.stl, .obj, .ply, .off, .glb, .3mf), a ``trimesh.Trimesh``, or points (n, 3) and
        triangles (m, 3). Corners in one place are joined.
    size : wanted edge length in model units; None picks one.
    tolerance : how far corners may lie off the plane of their patch and off straight edges, model units.
    angle : largest lean of a triangle against its patch, degrees.
    options : as for ``fubini.mesh``.

    Raises
    ------
    InputError, GeometryError : no triangles, or a patch that bounds no region, with its place.

    Example
    -------
    >>> import fubini
    >>> mesh = fubini.remesh("exported.stl", 2.0)      # doctest: +SKIP
    >>> mesh.save("better.stl")                        # doctest: +SKIP
    """
    from fubini.patches import facet_model, read_facets  # loads scipy, which no other way to a mesh needs

    return mesh(facet_model(read_facets(source), tolerance=tolerance, angle=angle), size, **options)
