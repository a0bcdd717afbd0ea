"""How many elements buy a digit: integrals by the mesh's own quadrature beside ``fubini.integrate`` of the cells.

Run: ``python benchmarks/fem/digits.py``. The function exp(x) cos(2 y) is integrated over three regions with curved
edges, by Gauss' rule of degree 4 on T3 and on T6 elements (scikit-fem, 6 points each), at sizes that halve; and through
the mapping of the cells with 2 to 10 points across. Printed are the counts at which each digit of the integral is
first reached and kept, interpolated between sizes on logarithmic scales.
"""

from __future__ import annotations

import math

import numpy as np
import skfem

import fubini
from fubini.cells import decompose, integrate
from fubini.curves import CircularArc, EllipticalArc, Line
from fubini.region import Loop, Region

SIZES = [0.4 / 2**k for k in range(7)]
DIGITS = range(1, 11)
RULE = 4


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


def counts(rows: list[tuple[int, float]], exact: float) -> list[float]:
    """The count at which each digit is reached and kept; not a number beyond the last row."""
    found = []
    n = np.array([row[0] for row in rows], float)
    error = np.array([max(abs(row[1] / exact - 1.0), 1e-16) for row in rows])
    error = np.maximum.accumulate(error[::-1])[::-1]  # kept from here on
    for digit in DIGITS:
        goal = 10.0**-digit
        after = np.flatnonzero(error <= goal)
        if not len(after):
            found.append(math.nan)
        elif after[0] == 0:
            found.append(n[0])
        else:
            j = after[0]
            share = math.log(error[j - 1] / goal) / math.log(error[j - 1] / error[j])
            found.append(n[j - 1] * (n[j] / n[j - 1]) ** share)
    return found


def main() -> None:
    """One table for each region."""
    for name, region in regions().items():
        exact = integrate(region, function, order=24)
        ways = {"T3": by_elements(region, 1), "T6": by_elements(region, 2), "cells": by_cells(region)}
        print(f"\n{name}: {exact:.12f}, {len(decompose(region, 'auto'))} cells")
        print("| digits | T3 elements | T6 elements | points in cells |\n|---|---|---|---|")
        columns = [counts(rows, exact) for rows in ways.values()]
        for digit, row in zip(DIGITS, zip(*columns, strict=True), strict=True):
            print(f"| {digit} | " + " | ".join("" if math.isnan(x) else f"{x:,.0f}" for x in row) + " |")


if __name__ == "__main__":
    main()
