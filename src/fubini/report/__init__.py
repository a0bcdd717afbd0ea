"""What a mesh is like, in words, numbers and pictures."""

from fubini.report.cells import plot_cells
from fubini.report.check import MeshCheck, check, read_triangles
from fubini.report.figures import to_json
from fubini.report.picture import plot
from fubini.report.states import EXCUSED, FLAWED, VALID, triangle_states
from fubini.report.text import check_table, table

__all__ = [
    "EXCUSED",
    "FLAWED",
    "VALID",
    "MeshCheck",
    "check",
    "check_table",
    "plot",
    "plot_cells",
    "read_triangles",
    "table",
    "to_json",
    "triangle_states",
]
