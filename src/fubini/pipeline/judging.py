"""``certify_faces``: every face judged by the points and triangles of the whole mesh."""

from __future__ import annotations

import threading
from functools import partial
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini import certificate
from fubini._turns import cores
from fubini.measure import numbering
from fubini.model import Model
from fubini.pipeline.assemble import Assembly
from fubini.pipeline.cracks import lips
from fubini.pipeline.faces import FaceResult
from fubini.pipeline.options import MeshOptions
from fubini.result import Certificate, FaceCertificate
from fubini.sampling.boundary import Outline
from fubini.tracks import evaluate

#: Triangles from which on judging a face is worth a thread.
LARGE = 50_000


def certify_faces(
    model: Model,
    outlines: list[Outline],
    whole: Assembly,
    results: list[FaceResult],
    options: MeshOptions,
) -> Certificate:
    """Judge what is shipped: every face by the points and triangles of the whole mesh.

    Large faces are judged beside each other where there are cores for it: they share nothing that changes.
    """
    bounds = {"min_skew": options.min_skew, "max_aspect_ratio": options.max_aspect_ratio}
    counts = [result.mesh.triangle_count for result in results]
    starts = [0, *accumulate(counts)]
    scratch = threading.local()

    def judge(k: int) -> FaceCertificate:
        if not hasattr(scratch, "number"):
            scratch.number = numbering(len(whole.points))
        part = slice(starts[k], starts[k + 1])
        outline, outcome = outlines[k], results[k].outcome
        return certificate.certify_face(
            model.faces[k], whole.points, whole.triangles[part],
            _judged(model, outline, whole, results[k], part, whole.nodes_of_face[k]),
            partial(evaluate, outline.exact), diagonal=model.diagonal, moves=outcome.moves,
            budget_exhausted=outcome.budget_exhausted, number=scratch.number, **bounds,
        )  # fmt: skip

    threads = min(cores(), sum(count > LARGE for count in counts))
    if threads > 1:
        from concurrent.futures import ThreadPoolExecutor  # few models are so large, and it takes time to load

        with ThreadPoolExecutor(threads) as pool:
            faces = list(pool.map(judge, range(len(counts))))
    else:
        faces = [judge(k) for k in range(len(counts))]
    return certificate.certify(faces, skipped_faces=len(model.skipped), notes=model.notes, **bounds)


def _judged(
    model: Model,
    outline: Outline,
    whole: Assembly,
    result: FaceResult,
    part: slice,
    numbers: NDArray[Any],
) -> certificate.Outline:
    """The boundary of a face, whose triangles are this part of the whole, tied to its curves."""
    boundary, edges = result.mesh.boundary, model.numbering.edges[outline.edges].tolist()
    segments = lips(whole, part, numbers[boundary.segments].astype(np.int32))
    first = np.flatnonzero(boundary.t[:, 0] == np.where(outline.forward, 0.0, 1.0)[boundary.track])
    return certificate.Outline(
        segments=segments,
        curve=boundary.track,
        t=boundary.t,
        corners=segments[first, 0],
        angles=outline.angles[boundary.track[first]],
        edges=dict(enumerate(edges)),
        slack=max(model.slack[e] for e in edges),
    )
