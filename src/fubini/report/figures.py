"""The certificate as one JSON object."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fubini.result import Certificate, FaceCertificate, Mesh

#: Figures that the whole mesh and each face have in common.
FIGURES = (
    "certified",
    "triangles",
    "flawed",
    "unavoidable",
    "excess",
    "worst_skew",
    "avoidable_skew",
    "mean_skew",
    "worst_aspect_ratio",
    "min_angle",
    "max_angle",
    "longest_edge",
    "area_error",
    "boundary_distance",
    "chord_error",
    "min_scaled_jacobian",
)


def to_json(mesh: Mesh) -> dict[str, Any]:
    """The figures of a mesh as values that strict JSON can hold.

    Keys: ``source``; those of ``FIGURES``; ``points``, ``size``, ``min_skew``, ``max_aspect_ratio`` (the bounds),
    ``seconds`` by stage, ``skipped_faces`` (number), ``skipped`` (index, name, surface, reason of each),
    ``notes``, and ``faces``: per face ``face``, ``name``, the same figures, ``corners`` (unavoidable:
    ``point`` and ``angle``), ``worst_at``, ``reasons``, ``moves``, ``budget_exhausted``.
    A figure that is not finite (the aspect ratio of a triangle of no area) is null.
    """
    certificate = mesh.certificate
    skipped = mesh.model.skipped if mesh.model is not None else ()
    result: dict[str, Any] = {
        "source": mesh.model.source if mesh.model is not None else None,
        **_figures(certificate),
        "points": len(mesh.points),
        "size": mesh.size,
        "min_skew": certificate.min_skew,
        "max_aspect_ratio": certificate.max_aspect_ratio,
        "seconds": dict(mesh.seconds),
        "skipped_faces": certificate.skipped_faces,
        "skipped": [{"face": s.index, "name": s.name, "surface": s.surface, "reason": s.reason} for s in skipped],
        "notes": list(certificate.notes),
        "faces": [_face(f) for f in certificate.faces],
    }
    plain: dict[str, Any] = strict(result)
    return plain


def strict(value: Any) -> Any:
    """The value with numbers that JSON has no word for as None, numpy numbers as plain ones."""
    if isinstance(value, dict):
        return {str(k): strict(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [strict(v) for v in value]
    if isinstance(value, (str, bool)) or value is None:
        return value
    if hasattr(value, "item"):
        return strict(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _figures(source: Certificate | FaceCertificate) -> dict[str, Any]:
    return {key: getattr(source, key) for key in FIGURES}


def _face(face: FaceCertificate) -> dict[str, Any]:
    return {
        "face": face.face,
        "name": face.name,
        **_figures(face),
        "corners": [{"point": list(c.point), "angle": c.angle} for c in face.corners],
        "worst_at": list(face.worst_at),
        "reasons": list(face.reasons),
        "moves": dict(face.moves),
        "budget_exhausted": face.budget_exhausted,
    }
