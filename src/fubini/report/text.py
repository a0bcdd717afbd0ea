"""Quality tables for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fubini.report.check import MeshCheck
    from fubini.result import Certificate, FaceCertificate, Mesh

HEAD = (
    "face",
    "name",
    "triangles",
    "flawed",
    "unavoidable",
    "worst skew",
    "worst AR",
    "angles",
    "area error",
    "off boundary",
    "chord error",
    "certified",
)


def table(mesh: Mesh, rows: int = 40) -> str:
    """Quality of each face and of the mesh, then why faces are not certified and what was skipped.

    Of more than ``rows`` faces the worst are listed: those not certified, then those of least skewness.
    """
    certificate = mesh.certificate
    ranked = sorted(certificate.faces, key=lambda f: (f.certified, f.avoidable_skew, f.face))
    shown = sorted(ranked[:rows], key=lambda f: f.face)
    lines = [HEAD, *(_row(str(f.face), f.name or "", f) for f in shown), _row("all", "", certificate)]
    text = _align(lines)
    hidden = ranked[rows:]
    if hidden:
        what = "all certified" if all(f.certified for f in hidden) else "not all certified"
        text.insert(-1, f"... {_count(len(hidden), 'more face')}, {what}")
    return "\n".join([*text, *_remarks(mesh, rows)])


def check_table(found: MeshCheck) -> str:
    """The figures of ``check`` as text."""
    at = ", ".join(f"{x:.6g}" for x in found.worst_at)
    loops = _count(found.boundary_loops, "boundary loop") if found.boundary_loops else "closed"
    lines = [
        f"{found.source}: {found.triangles} triangles, {found.points} points, area {found.area:.9g}",
        f"flawed          {found.flawed} ({found.unavoidable} unavoidable, {found.excess} beyond them)",
        f"worst skewness  {found.worst_skew:.4f} at ({at}); mean {found.mean_skew:.4f}",
        f"worst AR        {found.worst_aspect_ratio:.4f}",
        f"angles          {found.min_angle:.4f} to {found.max_angle:.4f}",
        f"edges           {loops}, {found.nonmanifold_edges} non-manifold, {found.misoriented_edges} misoriented",
        f"triangles       {found.degenerate_triangles} of no area, {found.duplicate_triangles} duplicate; "
        f"{_count(found.duplicate_points, 'duplicate point')}",
        "valid" if found.valid else "NOT valid",
    ]
    return "\n".join(lines)


def _row(face: str, name: str, figures: FaceCertificate | Certificate) -> tuple[str, ...]:
    return (
        face,
        name,
        str(figures.triangles),
        str(figures.flawed),
        str(figures.unavoidable),
        f"{figures.worst_skew:.3f}",
        f"{figures.worst_aspect_ratio:.3f}",
        f"{figures.min_angle:.1f}..{figures.max_angle:.1f}",
        f"{figures.area_error:.1e}",
        f"{figures.boundary_distance:.1e}",
        f"{figures.chord_error:.1e}",
        "yes" if figures.certified else "NO",
    )


def _align(lines: Sequence[Sequence[str]]) -> list[str]:
    """Columns of equal width, names to the left and figures to the right; no column without content."""
    keep = [i for i in range(len(HEAD)) if any(row[i] for row in lines[1:])]
    width = {i: max(len(row[i]) for row in lines) for i in keep}
    return [
        "  ".join(row[i].ljust(width[i]) if HEAD[i] == "name" else row[i].rjust(width[i]) for i in keep)
        for row in lines
    ]


def _remarks(mesh: Mesh, rows: int) -> list[str]:
    certificate = mesh.certificate
    broken = [f for f in certificate.faces if not f.certified]
    lines = [
        f"face {f.face}{f' ({f.name})' if f.name else ''}: {reason}" for f in broken[:rows] for reason in f.reasons
    ]
    lines += [f"... {_count(len(broken) - rows, 'more face')} not certified"] if len(broken) > rows else []
    corners = [c for f in certificate.faces for c in f.corners]
    if corners:
        least = min(c.angle for c in corners)
        lines.append(
            f"{_count(len(corners), 'sharp corner')}, each unavoidably with a flawed triangle, from {least:.2f} degrees"
        )
    if certificate.skipped_faces:
        skipped = mesh.model.skipped if mesh.model is not None else ()
        kinds = ", ".join(f"{n} {kind}" for kind, n in sorted(Counter(s.surface for s in skipped).items()))
        lines.append(_count(certificate.skipped_faces, "face") + " skipped" + (f": {kinds}" if kinds else ""))
    lines += [f"note: {note}" for note in certificate.notes]
    return lines


def _count(number: int, noun: str) -> str:
    """The number with its noun, as in "1 face" and "2 faces"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
