"""``load`` and ``mesh``: the stages in their order."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini.errors import FubiniError, GeometryError, OptionError
from fubini.model import Model
from fubini.naming import Names
from fubini.pipeline.assemble import Assembly, assemble
from fubini.pipeline.cracks import crack_edges, open_cracks, with_segments
from fubini.pipeline.faces import FaceMesher
from fubini.pipeline.judging import certify_faces
from fubini.pipeline.names import name_mesh, resolve_names
from fubini.pipeline.options import MeshOptions, Progress, check_count, pick_size
from fubini.pipeline.pattern import PatternPoints, pattern_points
from fubini.pipeline.plane import plane_model
from fubini.pipeline.points import with_points
from fubini.pipeline.selection import select_faces, without_inner_edges
from fubini.pipeline.sizes import face_sizes, size_options
from fubini.region import Region
from fubini.result import Certificate, Mesh
from fubini.sampling.boundary import BoundarySizing, Outline
from fubini.sampling.network import Network


def load(source: Any, **reading: Any) -> Model:
    """Read the planar faces of a source.

    Parameters
    ----------
    source : a path to .step, .stp, .brep, .iges, .igs, .dxf, .svg or .FCStd; a live build123d or
        CadQuery object; a ``TopoDS_Shape``; a ``Region`` or a list of them, which needs no CAD kernel (see
        ``fubini.pipeline.plane``); or a ``Model``, which is returned as it is.
    reading : options of ``fubini.cad.load``: ``groups`` (names for live sub-shapes), ``gap`` (tolerance
        between ends of loose entities in drawings), ``check`` (whether outlines are validated), ``sew``
        (distance within which edges of different faces are joined), ``imprint`` (whether parts that touch
        or overlap are cut at each other).

    Raises
    ------
    InputError : nothing can be read, or no face is planar.
    GeometryError : a face is not a valid region.
    DependencyError : the CAD kernel or a reader is not installed.
    """
    if isinstance(source, Model):
        if reading.get("imprint") or reading.get("sew") is not None:
            raise OptionError("a model that is read already cannot be sewn or imprinted", fix="say so in load")
        return source
    if isinstance(source, Region) or _are_regions(source):
        return _load_regions(source, **reading)
    from fubini.cad import load as read

    return read(source, **reading)


def _are_regions(source: Any) -> bool:
    return isinstance(source, list | tuple) and len(source) > 0 and all(isinstance(s, Region) for s in source)


def _load_regions(source: Any, check: bool = True, **reading: Any) -> Model:
    """Plane regions, with the only option of reading that concerns them."""
    asked = sorted(name for name, value in reading.items() if value)
    if asked:
        raise OptionError(f"{asked[0]} does not apply to plane regions", fix="leave it out")
    return plane_model(source, check)


def mesh(
    source: Any,
    size: float | None = None,
    *,
    faces: Iterable[int] | None = None,
    select: str | None = None,
    names: Mapping[str, Any] | None = None,
    order: int = 1,
    imprint: bool = False,
    sew: float | None = None,
    cracks: Any = None,
    points: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Mesh:
    """Mesh the planar faces of a source with triangles that are all valid, and certify it.

    Parameters
    ----------
    source : whatever ``load`` takes.
    size : wanted edge length in model units; None picks one. A size larger than the model gives the
        coarsest valid mesh.
    faces : CAD face indices to mesh; all planar faces by default.
    select : mesh only the faces of this name.
    names : name to what it names: live faces, edges or vertices of the source (build123d, CadQuery,
        ``TopoDS_Shape``, or a list of them), text such as ``"faces 0,3-5"`` or ``"edges 7"``, or a
        predicate ``p(x, y, z) -> bool`` on arrays of coordinates (see ``fubini.naming.name_parts``).
        These come before names of the source; the rest is named automatically.
    order : 1 for triangles of 3 nodes, 2 for triangles of 6 with mid-side nodes on the true curves.
    imprint : cut faces and solids where they touch or overlap, so that the mesh conforms there; what two
        names A and B cover is named ``A|B``.
    sew : join edges of different faces within this distance (model units).
    cracks : edges inside a face or between two, along which the mesh is parted, with nodes of its own on either lip:
        an index, a name, text such as ``"edges 3,5"``, a predicate, or a list of these. Boundaries along them become
        ``NAME+`` and ``NAME-``.
    points : name to place (x, y, z) inside a face: it becomes a node, and a named point.
    progress : called as ``progress(stage, done, total)``.
    options : fields of ``fubini.pipeline.options.MeshOptions``: ``pattern``, ``min_skew``,
        ``max_aspect_ratio``, ``growth``, ``turn``, ``edge_size``, ``size_field``, ...

    Returns
    -------
    Mesh : ``mesh.certificate.certified`` tells whether no triangle is flawed but the unavoidable.

    Raises
    ------
    OptionError, InputError, GeometryError, DependencyError : see ``load`` and ``MeshOptions``.

    Example
    -------
    >>> import fubini
    >>> mesh = fubini.mesh("bracket.step", 2.0)        # doctest: +SKIP
    >>> mesh.save("bracket.stl")                       # doctest: +SKIP
    """
    checked = _options(size, options)
    if order not in (1, 2):
        raise OptionError(f"order is {order!r}", fix="use 1 or 2")
    clock = _Clock()
    model = select_faces(load(source, imprint=imprint, sew=sew), faces, select)
    if checked.pattern != "auto":
        if points:
            raise OptionError(f"pattern {checked.pattern} follows no points", fix="use pattern auto")
        model = without_inner_edges(model, checked.pattern)
    model, placed = with_points(model, points)
    wanted = resolve_names(model, names) | placed
    parting = crack_edges(model, cracks, wanted)
    if parting:
        checked = replace(checked, edge_segments=with_segments(checked.edge_segments, parting))
    outlines = outline_faces(model)
    network = Network.of(outlines, model.numbering.ends)
    clock.lap("load")  # what follows depends on the size
    length = min(checked.size, model.diagonal) if checked.size is not None else pick_size(model)
    check_count(model, length)
    lengths = face_sizes(model, length, checked, wanted)
    asked = size_options(model, outlines, length, lengths, checked, wanted)
    sizing = BoundarySizing(network, asked)
    try:
        pattern = lay_pattern(model, outlines, checked)
        inside = {f: np.array([p for _, p in face.points]) for f, face in enumerate(model.faces) if face.points}
        mesher = FaceMesher(sizing, lengths, checked, pattern, inside)
        clock.lap("boundary")
        results = mesher.run(progress)
    except GeometryError as error:
        put_in_model_terms(model, error)
        raise
    clock.lap("faces")
    whole = assemble(model, network, results)
    clock.lap("assemble")
    whole, named = open_cracks(whole, name_mesh(model, whole, wanted), parting)
    clock.lap("names")
    verdict = certify_faces(model, outlines, whole, results, checked)
    clock.lap("certificate")
    result = _mesh_value(model, whole, named, verdict, length, clock)
    if order == 2:
        result = result.elevate()
        clock.lap("second order")
    return result


def put_in_model_terms(model: Model, error: GeometryError) -> None:
    """Errors of the stages name running numbers and plane coordinates: turn them into those of the model, in place."""
    if error.face is None or error.file is not None:
        return
    face = model.faces[error.face]
    error.file, error.face = model.source, face.index
    error.at = None if error.at is None else tuple(face.frame.to_space(error.at)[0].tolist())
    error.edge = None if error.edge is None else int(model.numbering.edges[error.edge])


def _options(size: float | None, options: dict[str, Any]) -> MeshOptions:
    """Options from keywords, with the valid names in the message when one is not known."""
    known = MeshOptions.__dataclass_fields__.keys()
    unknown = sorted(options.keys() - known)
    if unknown:
        raise OptionError(f"unknown option {unknown[0]!r}", fix="options are " + ", ".join(sorted(known - {"size"})))
    given = {"size": size, **options}
    return MeshOptions(**{k: v.item() if isinstance(v, np.generic) else v for k, v in given.items()})


def outline_faces(model: Model) -> list[Outline]:
    """Outlines of all faces; their edges and vertices go by the running numbers of ``model.numbering``."""
    outlines = []
    for face in model.faces_cut:
        try:
            outlines.append(Outline.of(face.region, model.numbering.number.__getitem__, face.inner))
        except FubiniError as error:
            error.file, error.face = error.file or model.source, face.index
            raise
    return outlines


def lay_pattern(model: Model, outlines: list[Outline], options: MeshOptions) -> list[PatternPoints] | None:
    """Mapped points of every face by one of the paper's reference sets; None for "auto"."""
    if options.pattern == "auto":
        return None
    how = options.pattern, options.pattern_direction, options.pattern_turn // 90
    return [pattern_points(f.region, o, *how) for f, o in zip(model.faces_cut, outlines, strict=True)]


def _mesh_value(model: Model, whole: Assembly, named: Names, verdict: Certificate, size: float, clock: _Clock) -> Mesh:
    """The finished mesh with read-only arrays."""
    arrays: list[NDArray[Any]] = [whole.points, whole.triangles, whole.face_of_triangle]
    arrays += [whole.segments, whole.edge_of_segment, whole.t_of_segment]
    for groups in (named.regions, named.boundaries, named.points):
        arrays += groups.values()
    for array in arrays:
        array.setflags(write=False)
    return Mesh(
        points=whole.points,
        triangles=whole.triangles,
        face_of_triangle=whole.face_of_triangle,
        segments=whole.segments,
        edge_of_segment=whole.edge_of_segment,
        face_names={f.index: f.name for f in model.faces if f.name},
        edge_names={i: e.name for i, e in model.edges.items() if e.name},
        certificate=verdict,
        size=size,
        seconds=clock.seconds,
        cpu_seconds=clock.cpu_seconds,
        model=model,
        t_of_segment=whole.t_of_segment,
        regions=named.regions,
        boundaries=named.boundaries,
        named_points=named.points,
    )


class _Clock:
    """Wall and CPU seconds by stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.cpu_seconds: dict[str, float] = {}
        self._last = time.perf_counter(), time.process_time()

    def lap(self, stage: str) -> None:
        now = time.perf_counter(), time.process_time()
        self.seconds[stage], self.cpu_seconds[stage] = now[0] - self._last[0], now[1] - self._last[1]
        self._last = now
