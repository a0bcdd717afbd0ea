"""Compiled part of the core: what is known of a lattice without a triangulator.

Nodes are *cells* of a table with an empty rim, numbered row by row; ``columns`` cells make a row, and odd rows lie half
a step further right. *Runs* are the cells ``low[r] <= cell < high[r]``, those of row j with
``first[j] <= r < first[j + 1]``: with them the work is in proportion to the boundary, not to the area.

Two triangles stand on cell f: number 2 f, (f, right, upper right), and number 2 f + 1, (f, upper right, upper left).
"""

from __future__ import annotations

import numpy as np

from fubini._jit import inner
from fubini.sampling._kernels_interior import ROW

#: What a lattice node is: none, outside the core, on its rim, of it alone.
NONE, OUTSIDE, RIM, INNER = 0, 1, 2, 3


@inner(allocates=True)
def runs_of(ends, columns, rows):
    """first (rows + 1,), low and high (r,) of the runs, whose cells lie behind ends (2 r,), pair by pair."""
    count = ends.shape[0] // 2
    first, low, high = np.empty(rows + 1, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    row = 0
    for r in range(count):
        low[r], high[r] = ends[2 * r] + 1, ends[2 * r + 1] + 1
        while row * columns <= low[r]:
            first[row] = r
            row += 1
    while row <= rows:
        first[row] = count
        row += 1
    return first, low, high


@inner(allocates=True)
def eroded(first, low, high, columns):
    """The runs of the cells whose six neighbours are all in runs; as ``runs_of``."""
    rows = first.shape[0] - 1
    out, start, stop = np.empty(rows + 1, np.int64), np.empty(3 * len(low), np.int64), np.empty(3 * len(low), np.int64)
    count = 0
    for row in range(rows):
        out[row] = count
        if first[row] == first[row + 1]:
            continue
        odd = row & 1
        # what lies in a run above or below, moved so that cells lie beside their two neighbours there
        up, down = first[row + 1], first[row - 1]
        last_up, last_down = first[row + 2], first[row]
        for r in range(first[row], first[row + 1]):
            a, b = low[r] + 1, high[r] - 1
            while a < b:
                while up < last_up and high[up] - columns - odd <= a:
                    up += 1
                while down < last_down and high[down] + columns - odd <= a:
                    down += 1
                if up == last_up or down == last_down:
                    break
                c = max(a, low[up] - columns + 1 - odd, low[down] + columns + 1 - odd)
                a = min(high[up] - columns - odd, high[down] + columns - odd)
                if c < min(a, b):
                    start[count], stop[count] = c, min(a, b)
                    count += 1
    out[rows] = count
    return out, start[:count], stop[:count]


@inner
def fill(role, low, high, value):
    """Write a value into the cells of runs; how many they are."""
    count = 0
    for r in range(low.shape[0]):
        count += high[r] - low[r]
        for cell in range(low[r], high[r]):
            role[cell] = value
    return count


@inner
def neighbour(cell, way, columns, odd):
    """One of the six neighbours of a cell, counter-clockwise from the right: ways 0 to 5, and 6 again."""
    if way == 0 or way == 6:
        return cell + 1
    if way == 3:
        return cell - 1
    if way < 3:
        return cell + columns + odd + 1 - way
    return cell - columns + odd + way - 5


@inner(allocates=True)
def without(low, high, gap_low, gap_high):
    """The cells of runs that lie in no gap; gaps are runs too, each inside one of the others."""
    count = 0
    for r in range(low.shape[0]):
        count += high[r] - low[r]
    for g in range(gap_low.shape[0]):
        count -= gap_high[g] - gap_low[g]
    cells = np.empty(count, np.int64)
    count, g = 0, 0
    for r in range(low.shape[0]):
        cell = low[r]
        while cell < high[r]:
            if g < gap_low.shape[0] and cell == gap_low[g]:
                cell = gap_high[g]
                g += 1
                continue
            cells[count] = cell
            count += 1
            cell += 1
    return cells


@inner(allocates=True)
def mark_core(role, first, low, high, columns, least):
    """Enter the core into the table of roles (cells,), all OUTSIDE so far in the runs of nodes.

    Returns how many triangles it has and the runs of its INNER nodes; none where there are fewer than ``least``
    triangles, and the table stays as it is.
    """
    deep_first, deep_low, deep_high = eroded(first, low, high, columns)
    _, inner_low, inner_high = eroded(deep_first, deep_low, deep_high, columns)
    fill(role, deep_low, deep_high, RIM)
    nodes = fill(role, inner_low, inner_high, INNER)
    corners = 0
    row = 0
    for cell in without(deep_low, deep_high, inner_low, inner_high):
        while cell >= (row + 1) * columns:
            row += 1
        odd, some = row & 1, 0
        for way in range(6):
            if role[neighbour(cell, way, columns, odd)] >= RIM and role[neighbour(cell, way + 1, columns, odd)] >= RIM:
                some += 1
        if some == 0:
            role[cell] = OUTSIDE
        corners += some
    # each has three corners, and a node of the core alone has six triangles
    triangles = 2 * nodes + corners // 3
    if triangles < max(least, 1):
        fill(role, deep_low, deep_high, OUTSIDE)
        return 0, inner_low[:0], inner_high[:0]
    return triangles, inner_low, inner_high


@inner
def corners_of(triangle, columns, odd):
    """The three cells of a triangle; ``odd`` is the parity of its row."""
    cell = triangle >> 1
    above = cell + columns + odd
    return (cell, cell + 1, above) if triangle & 1 == 0 else (cell, above, above - 1)


@inner
def across(triangle, side, columns, odd):
    """The triangle on the other side of an edge, and the parity of its row."""
    cell = triangle >> 1
    if triangle & 1 == 0:
        if side == 2:
            return 2 * (cell - columns + odd) + 1, 1 - odd
        return 2 * (cell + 1) + 1 if side == 0 else triangle + 1, odd
    if side == 0:
        return 2 * (cell + columns + odd - 1), 1 - odd
    return 2 * (cell - 1) if side == 1 else triangle - 1, odd


@inner
def least_role(role, triangle, columns, odd):
    """The least role of the corners of a triangle."""
    a, b, c = corners_of(triangle, columns, odd)
    return min(role[a], role[b], role[c])


@inner(allocates=True)
def place_nodes(role, cells, columns, place, fixed, number):
    """Positions of the nodes OUTSIDE and on the RIM, and the OUTSIDE ones that lack a neighbour, by number.

    Numbers, written into number (n,) for the n cells, go from ``fixed`` on: the rim first. place : x0, y0 and step of
    the lattice in axes turned by the cosine and sine that follow.
    """
    rim = 0
    for cell in cells:
        rim += role[cell] == RIM
    outside, on_rim = np.empty((cells.shape[0] - rim, 2)), np.empty((rim, 2))
    bare = np.empty(cells.shape[0] - rim, np.int32)
    x0, y0, h, c, s = place[0], place[1], place[2], place[3], place[4]
    a, b, lacking, row = 0, 0, 0, 0
    for i in range(cells.shape[0]):
        cell = cells[i]
        while cell >= (row + 1) * columns:
            row += 1
        odd = row & 1
        x, y = (x0 + 0.5 * h if odd else x0) + (cell - row * columns) * h, y0 + row * (h * ROW)
        if role[cell] == RIM:
            on_rim[b, 0], on_rim[b, 1] = c * x - s * y, s * x + c * y
            number[i] = fixed + b
            b += 1
            continue
        outside[a, 0], outside[a, 1] = c * x - s * y, s * x + c * y
        number[i] = fixed + rim + a
        a += 1
        for way in range(6):
            if role[neighbour(cell, way, columns, odd)] == NONE:
                bare[lacking] = number[i]
                lacking += 1
                break
    return outside, on_rim, bare[:lacking]


@inner(allocates=True)
def known_triangles(role, cells, columns):
    """The triangles (m,) of nodes that are not of the core alone, and where those of all n cells stand (2 n,)."""
    n = cells.shape[0]
    found, place_of, count, row = np.empty(2 * n, np.int64), np.empty(2 * n, np.int32), 0, 0
    for i in range(n):
        cell = cells[i]
        while cell >= (row + 1) * columns:
            row += 1
        for k in range(2):
            if least_role(role, 2 * cell + k, columns, row & 1) == OUTSIDE:
                found[count] = 2 * cell + k
                place_of[2 * i + k] = count
                count += 1
    return found[:count], place_of


@inner(allocates=True)
def hanging_edges(role, cells, columns, number, rank, among, before, fixed):
    """Edges (h, 2) of the lattice with no triangle on either side, each both ways, by place as in ``divide``."""
    ends, count, row = np.empty((6 * among.shape[0], 2), np.int32), 0, 0
    for i in range(cells.shape[0]):
        cell = cells[i]
        while cell >= (row + 1) * columns:
            row += 1
        odd = row & 1
        for way in range(3 if role[cell] == OUTSIDE else 0):
            other = neighbour(cell, way, columns, odd)
            if (
                role[other] == OUTSIDE
                and role[neighbour(cell, way + 1, columns, odd)] == NONE
                and role[neighbour(cell, (way + 5) % 6, columns, odd)] == NONE
            ):
                a, b = among[number[i] - before], among[number[rank[other]] - before]
                ends[count, 0], ends[count, 1], ends[count + 1, 0], ends[count + 1, 1] = a, b, b, a
                count += 2
    return ends[:count]


@inner(allocates=True)
def divide(role, columns, ends, least, fixed, segments, place):
    """Core of a lattice with at least so many triangles, and the triangles between it and what is not known.

    role : (cells,), OUTSIDE in the cells of nodes, which lie behind ``ends`` (2 r,), pair by pair; gets the core.
    fixed, segments : how many nodes and segments come before those of the rim. place : see ``place_nodes``.
    Returns how many triangles and INNER nodes the core has; positions of nodes OUTSIDE and on the RIM; edges (k, 2) of
    the rim by place there, the core on the left; then triangles (m, 3) and neighbours (m, 3), half-edges (e,) beyond
    which nothing is known, nodes (z,) with less than six triangles, and ends (e, 2) of those edges, the unknown
    on the left: below ``fixed + z``, by place in z behind the fixed ones; edges (h, 2) with no triangle on either side,
    each both ways, one behind the other.
    """
    rows = role.shape[0] // columns
    first, low, high = runs_of(ends, columns, rows)
    core, nodes, inner_low, inner_high = 0, 0, low[:0], high[:0]
    for r in range(low.shape[0]):
        nodes += high[r] - low[r]
    if 2 * nodes >= least:
        core, inner_low, inner_high = mark_core(role, first, low, high, columns, least)
    cells = without(low, high, inner_low, inner_high)
    number, rank = np.empty(cells.shape[0], np.int32), np.empty(role.shape[0], np.int32)
    for i in range(cells.shape[0]):
        rank[cells[i]] = i
    outside, on_rim, bare = place_nodes(role, cells, columns, place, fixed, number)
    found, place_of = known_triangles(role, cells, columns)
    m, before = found.shape[0], fixed + on_rim.shape[0]
    triangles, neighbours = np.empty((m, 3), np.int32), np.empty((m, 3), np.int32)
    rim, half_edges, edges = np.empty((3 * m, 2), np.int32), np.empty(3 * m, np.int32), np.empty((3 * m, 2), np.int32)
    among = np.empty(outside.shape[0], np.int32)
    for z in range(bare.shape[0]):
        among[bare[z] - before] = fixed + z
    k, e, row = 0, 0, 0
    for t in range(m):
        while found[t] >= 2 * (row + 1) * columns:
            row += 1
        odd = row & 1
        a, b, c = corners_of(found[t], columns, odd)
        triangles[t, 0], triangles[t, 1], triangles[t, 2] = number[rank[a]], number[rank[b]], number[rank[c]]
        for i in range(3):
            v, w = triangles[t, (i + 1) % 3], triangles[t, (i + 2) % 3]
            other, parity = across(found[t], i, columns, odd)
            kind = least_role(role, other, columns, parity)
            if kind == OUTSIDE:
                neighbours[t, i] = place_of[2 * rank[other >> 1] + (other & 1)]
            elif kind == NONE:
                neighbours[t, i] = -1
                half_edges[e] = 3 * t + i
                edges[e, 0], edges[e, 1] = among[w - before], among[v - before]
                e += 1
            else:
                neighbours[t, i] = -1 - segments - k
                rim[k, 0], rim[k, 1] = w - fixed, v - fixed
                k += 1
    return (
        core, nodes - cells.shape[0], outside, on_rim, rim[:k],
        triangles, neighbours, half_edges[:e], bare, edges[:e],
        hanging_edges(role, cells, columns, number, rank, among, before, fixed),
    )  # fmt: skip
