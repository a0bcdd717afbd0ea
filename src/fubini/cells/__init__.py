"""Fubini cells: decomposition of regions, and exact integration over them."""

from fubini.cells.cell import Cell
from fubini.cells.chain import Chain
from fubini.cells.check import CellCheck, check_cells
from fubini.cells.decompose import decompose
from fubini.cells.integrate import integrate

__all__ = ["Cell", "CellCheck", "Chain", "check_cells", "decompose", "integrate"]
