"""How many elements buy a digit: integrals by the mesh's own quadrature beside ``fubini.integrate`` of the cells.

Run: ``python benchmarks/fem/digits.py``. The function exp(x) cos(2 y) is integrated over three regions with curved
edges, by Gauss' rule of degree 4 on T3 and on T6 elements (scikit-fem, 6 points each), at sizes that halve; and through
the mapping of the cells with 2 to 10 points across. Printed are the counts at which each digit of the integral is
first reached and kept, interpolated between sizes on logarithmic scales; a part of them makes the table of the docs,
theory of cells.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import skfem

sys.path.insert(0, str(Path(__file__).parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "src"))

import tables

import fubini
from fubini.cells import decompose, integrate
from fubini.curves import CircularArc, EllipticalArc, Line
from fubini.region import Loop, Region

SIZES = [0.4 / 2**k for k in range(7)]
DIGITS = range(1, 11)
RULE = 4
#: Regions and digits of the table in the docs.
SHOWN, EVERY = ("quarter disk", "ellipse with hole"), 2


def regions() -> dict[str, Region]:
    """The quarter disk, the quarter plate with a hole of the stress tables, an ellipse with a hole."""
    half = math.pi / 2
    disk = Loop.closed((Line((0, 0), (1, 0)), CircularArc((0, 0), 1.0, 0.0, half), Line((0, 1), (0, 0))), 1e-9)
    plate = Loop.closed(
        (Line((1, 0), (4, 0)), Line((4, 0), (4, 4)), Line((4, 4), (0, 4)), Line((0, 4), (0, 1)),
         CircularArc((0, 0), 1.0, half, 0.0)), 1e-9,
    )  # fmt: skip
    ellipse = Loop.closed((EllipticalArc((0, 0), (2, 0), (0, 1), 0.0, 4 * half),), 1e-9)
    hole = Loop.closed((CircularArc((0.3, 0.1), 0.4, 0.0, -4 * half),), 1e-9)
    holed = Region(ellipse, (hole,))
    return {"quarter disk": Region(disk), "plate with hole": Region(plate), "ellipse with hole": holed}


def function(p):
    """The integrand at points (n, 2)."""
    return np.exp(p[:, 0]) * np.cos(2 * p[:, 1])


def by_elements(region: Region, order: int) -> list[tuple[int, float]]:
    """Number of elements and integral at every size."""
    rows = []
    for size in SIZES:
        mesh = fubini.mesh(region, size, order=order).to_skfem()
        basis = skfem.Basis(mesh, skfem.ElementTriP1(), intorder=RULE)
        total = skfem.Functional(lambda w: np.exp(w.x[0]) * np.cos(2 * w.x[1])).assemble(basis)
        rows.append((mesh.nelements, float(total)))
    return rows


def by_cells(region: Region) -> list[tuple[int, float]]:
    """Number of points and integral with 2, 3, ... points across each cell."""
    rows, cells = [], decompose(region, "auto")
    for order in range(2, 11):
        seen = [0]

        def counted(p, seen=seen):
            seen[0] += len(p)
            return function(p)

        total = integrate(cells, counted, order=order)
        rows.append((seen[0], total))
    return rows


def counts(rows: list[tuple[int, float]], exact: float) -> list[str]:
    """The count at which each digit is reached and kept; more than the last row has, said once, beyond that."""
    found = []
    n = np.array([row[0] for row in rows], float)
    error = np.array([max(abs(row[1] / exact - 1.0), 1e-16) for row in rows])
    error = np.maximum.accumulate(error[::-1])[::-1]  # kept from here on
    for digit in DIGITS:
        goal = 10.0**-digit
        after = np.flatnonzero(error <= goal)
        if not len(after):
            found.append("" if found and not found[-1][:1].isdigit() else f"over {n[-1]:,.0f}")
        elif after[0] == 0:
            found.append(f"{n[0]:,.0f}")
        else:
            j = after[0]
            share = math.log(error[j - 1] / goal) / math.log(error[j - 1] / error[j])
            found.append(f"{n[j - 1] * (n[j] / n[j - 1]) ** share:,.0f}")
    return found


def main() -> None:
    """Print one table for each region, and write that of the docs."""
    head, body = ["correct digits"], [[str(digit)] for digit in DIGITS]
    for name, region in regions().items():
        exact, cells = integrate(region, function, order=24), len(decompose(region, "auto"))
        columns = [counts(rows, exact) for rows in (by_elements(region, 1), by_elements(region, 2), by_cells(region))]
        titles = [f"{name}: T3", "T6", f"points in {cells} cell{'s' if cells > 1 else ''}"]
        rows = [list(row) for row in zip(*columns, strict=True)]
        print(f"\n{name}: {exact:.12f}")
        print(tables.table(["digits", *titles], [[str(d), *row] for d, row in zip(DIGITS, rows, strict=True)]))
        if name in SHOWN:
            head += titles
            body = [[*old, *new] for old, new in zip(body, rows, strict=True)]
    (tables.ROOT / "docs" / "theory" / "digits.table").write_text(tables.table(head, body[EVERY - 1 :: EVERY]))


if __name__ == "__main__":
    main()
