"""Random regions of lines, arcs and splines with what breaks meshers, and the outlines of letters.

Every region follows from its seed alone and is valid by ``Region.validate``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fubini.curves import Bezier, BSpline, CircularArc, Curve, Line
from fubini.region import Loop, Region
from regions import TURN, chain, circle, loop


def arc(a, b, sagitta: float) -> Curve:
    """Circular arc from a to b that bulges by ``sagitta`` to the right of the chord."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    half = 0.5 * math.dist(a, b)
    radius = (half * half + sagitta * sagitta) / (2.0 * abs(sagitta))
    along = (b - a) / (2.0 * half)
    right = np.array([along[1], -along[0]])
    center = 0.5 * (a + b) + right * (sagitta - math.copysign(radius, sagitta))
    turn = 4.0 * math.atan(abs(sagitta) / half)
    start = math.atan2(*(a - center)[::-1])
    return CircularArc(tuple(center), radius, start, start + math.copysign(turn, sagitta))


def wavy(rng, a, b, height: float) -> list[Curve]:
    """A cubic spline from a to b through random offsets."""
    along = b - a
    normal = np.array([along[1], -along[0]])
    share = np.linspace(0.0, 1.0, int(rng.integers(4, 9)))[:, None]
    off = rng.uniform(-height, height, len(share))[:, None]
    off[[0, -1]] = 0.0
    poles = a + share * along + off * normal
    knots = np.concatenate([[0.0] * 3, np.linspace(0.0, 1.0, len(poles) - 2), [1.0] * 3])
    return [BSpline(3, knots, poles)]


def tiny_edge(rng, a, b, scale: float) -> list[Curve]:
    """Two lines with an edge between them as short as 1e-5 of the scale."""
    at = a + rng.uniform(0.3, 0.7) * (b - a)
    short = scale * 10.0 ** rng.uniform(-5.0, -2.0)
    to = at + short * np.array([math.cos(w := math.atan2(*(b - a)[::-1]) + rng.uniform(-1.2, 1.2)), math.sin(w)])
    return [Line(a, at), Line(at, to), Line(to, b)]


def notch(rng, a, b, inward: float) -> list[Curve]:
    """A slot into the material, 1 : 20 to 1 : 2,000, with a flat, round or pointed end."""
    along = (b - a) / math.dist(a, b)
    into = np.array([-along[1], along[0]])
    depth = inward * rng.uniform(0.3, 1.0)
    width = depth * 10.0 ** rng.uniform(-3.3, -1.3)
    at = a + rng.uniform(0.3, 0.6) * (b - a)
    p, q = at + depth * into, at + width * along + depth * into
    end: list[Curve] = [[Line(p, q)], [arc(p, q, -0.5 * width)], []][int(rng.integers(3))]
    if not end:
        q = p
    return [Line(a, at), Line(at, p), *end, Line(q, at + width * along), Line(at + width * along, b)]


def cusp(rng, a, b, height: float) -> list[Curve]:
    """Two arcs that leave the chord and meet in a tangential spike, of air or of material."""
    middle = 0.5 * (a + b)
    along = 0.5 * (b - a)
    normal = np.array([along[1], -along[0]]) * height * float(rng.choice([-1.0, 1.0]))
    tip = middle + normal
    foot = 0.3 * normal
    return [
        Bezier(np.array([a, middle - 0.2 * along, tip - foot, tip])),
        Bezier(np.array([tip, tip - foot, middle + 0.2 * along, b])),
    ]


def fillet(a, b, c, radius: float) -> tuple[Curve, np.ndarray, np.ndarray]:
    """Arc of a radius tangent to the lines a-b and b-c, with its ends."""
    u, v = (a - b) / math.dist(a, b), (c - b) / math.dist(b, c)
    angle = math.acos(np.clip(u @ v, -1.0, 1.0))
    cut = radius / math.tan(angle / 2.0)
    p, q = b + cut * u, b + cut * v
    side = math.copysign(1.0, (b - a)[0] * (c - b)[1] - (b - a)[1] * (c - b)[0])
    return arc(p, q, side * radius * (1.0 - math.sin(angle / 2.0))), p, q


def decorated(rng, a, b, scale: float) -> list[Curve]:
    """The way from a to b in one of the styles above, the region on the left."""
    length = math.dist(a, b)
    styles = ["line", "arc", "near line", "wavy", "tiny", "notch", "cusp"]
    kind = rng.choice(styles, p=[0.3, 0.2, 0.1, 0.15, 0.1, 0.1, 0.05])
    if kind == "arc":
        return [arc(a, b, length * rng.uniform(0.03, 0.3) * rng.choice([-1, 1]))]
    if kind == "near line":
        return [arc(a, b, length * 10.0 ** rng.uniform(-6, -2) * rng.choice([-1, 1]))]
    if kind == "wavy":
        return wavy(rng, a, b, 0.12)
    if kind == "tiny":
        return tiny_edge(rng, a, b, scale)
    if kind == "notch":
        return notch(rng, a, b, 0.4 * scale)
    if kind == "cusp":
        return cusp(rng, a, b, 0.4)
    return [Line(a, b)]


def outline(rng, scale: float) -> Loop:
    """One closed chain around the origin."""
    n = int(rng.integers(3, 13))
    turn = (np.arange(n) + rng.uniform(0.1, 0.9, n)) * TURN / n
    p = (scale * rng.uniform(0.25, 1.0, n) * np.array([np.cos(turn), np.sin(turn)])).T
    rounds = [None] * n
    for i in range(n):
        if rng.random() < 0.25:
            rounds[i] = fillet(p[i - 1], p[i], p[(i + 1) % n], scale * 10.0 ** rng.uniform(-3.0, -1.3))
    curves: list[Curve] = []
    for i in range(n):
        j = (i + 1) % n
        a = p[i] if rounds[i] is None else rounds[i][2]
        b = p[j] if rounds[j] is None else rounds[j][1]
        curves += [Line(a, b)] if rounds[i] or rounds[j] else decorated(rng, a, b, scale)
        if rounds[j]:
            curves.append(rounds[j][0])
    return Loop.closed(tuple(curves), 1e-9 * scale)


def holes(rng, outer: Region, scale: float) -> list[Loop]:
    """Up to three round holes; they may nearly touch each other and the outline, at 1 : 2,000 of their size."""
    spots = rng.uniform(-scale, scale, (100, 2))
    spots = spots[outer.contains(spots)]
    out: list[tuple[np.ndarray, float]] = []
    for spot in spots[: int(rng.integers(0, 4))]:
        room = min(float(c.closest(spot[None])[1][0]) for c in outer.curves)
        room = min([room, *(math.dist(spot, q) - r for q, r in out)])
        if room > 0.02 * scale:
            gap = 10.0 ** rng.uniform(-3.3, -0.3)
            out.append((spot, room * (1.0 - gap)))
    return [circle(*q, r) for q, r in out]


def random_region(seed: int) -> Region:
    """A valid random region of lines, arcs and splines; the same for the same seed."""
    rng = np.random.default_rng([seed, 7])
    for _ in range(200):
        try:
            loop = outline(rng, 1.0)
            outer = Region.from_loops([loop])
            if outer.area < 0.02 or outer.validate():
                continue
            region = Region.from_loops([loop, *holes(rng, outer, 1.0)])
        except ValueError:
            continue
        if not region.validate():
            return region
    raise AssertionError(f"seed {seed} gives no valid region")


def slender_region(seed: int) -> Region:
    """By turns a star of spikes, a long thin rectangle, a comb of slots, and round holes in a row."""
    rng = np.random.default_rng([seed, 11])
    for _ in range(200):
        region = (_spikes, _strip, _comb, _row)[seed % 4](rng)
        if not region.validate():
            return region
    raise AssertionError(f"seed {seed} gives no valid region")


def _spikes(rng) -> Region:
    """A star whose tips are 0.3 to 16 degrees wide."""
    n, points = int(rng.integers(3, 9)), []
    for k in range(n):
        at, reach = TURN * (k + rng.uniform(-0.2, 0.2)) / n, rng.uniform(1.0, 3.0)
        half = math.radians(10.0 ** rng.uniform(-0.5, 1.2)) / 2.0
        foot = min(math.atan((reach - 0.5) * math.tan(half) / 0.5), 0.35 * math.pi / n)
        for r, a in ((0.5, at - foot), (reach, at), (0.5, at + foot)):
            points.append((r * math.cos(a), r * math.sin(a)))
    return Region(loop(points))


def _strip(rng) -> Region:
    """A rectangle of 1 : 100 to 1 : 10,000, turned."""
    height, turn = 10.0 ** rng.uniform(-4.0, -2.0), rng.uniform(0.0, TURN)
    c, s = math.cos(turn), math.sin(turn)
    return Region(loop(np.array([(0, 0), (1, 0), (1, height), (0, height)]) @ np.array([[c, s], [-s, c]])))


def _comb(rng) -> Region:
    """A plate with slots down to 1 : 800, straight or one-sided wedges."""
    width, points = 10.0 ** rng.uniform(-3.3, -2.0), [(0, 0), (1, 0), (1, 0.4)]
    for x in np.sort(rng.uniform(0.05, 0.95, int(rng.integers(2, 8))))[::-1]:
        floor = 0.4 - rng.uniform(0.1, 0.39)
        points += [(x + width, 0.4), (x + width * rng.choice([1.0, 0.5]), floor), (x, floor), (x, 0.4)]
    return Region(loop([*points, (0, 0.4)]))


def _row(rng) -> Region:
    """Holes of 0.02 to 0.2, as little as 1e-4 from each other."""
    gap, x, row = 10.0 ** rng.uniform(-4.0, -1.5), 0.1, []
    while x < 1.8:
        r = rng.uniform(0.02, 0.2)
        row.append(circle(x + r, 0.5 + rng.uniform(-0.05, 0.05), r))
        x += 2.0 * r + gap
    return Region.from_loops([loop([(0, 0), (x + 0.1, 0), (x + 0.1, 1), (0, 1)]), *row])


def glyph(character: str, family: str = "DejaVu Sans") -> list[Region]:
    """The regions of one character of a font, an em being 1 high."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.path import Path
    from matplotlib.textpath import TextPath

    path = TextPath((0, 0), character, 1.0, prop=FontProperties(family=family))
    loops, curves = [], []
    start = at = np.zeros(2)
    for vertices, code in path.iter_segments(curves=True, simplify=False):
        p = np.asarray(vertices, float).reshape(-1, 2)
        if code == Path.MOVETO:
            start = at = p[0]
            continue
        if code == Path.CLOSEPOLY:
            p = start[None]
        poles = np.concatenate([at[None], p])
        if math.dist(poles[0], poles[-1]) > 1e-9:
            curves.append(Line(*poles) if len(poles) == 2 else Bezier(poles))
        at = p[-1]
        if code == Path.CLOSEPOLY and curves:
            loops.append(Loop.closed(tuple(curves), 1e-9))
            curves = []
    return assembled(loops)


def assembled(loops: list[Loop]) -> list[Region]:
    """Outer loops with the loops inside them as holes; TrueType outlines turn clockwise."""
    outer = [x for x in loops if x.signed_area < 0.0]
    inner = [x for x in loops if x.signed_area > 0.0]
    regions = []
    for o in outer:
        inside = Region.from_loops([o])
        regions.append(Region.from_loops([o, *(i for i in inner if inside.contains(i.curves[0].start[None])[0])]))
    return regions


def touching_regions() -> Iterator[tuple[str, Region]]:
    """Round holes that all but touch the outline, a corner or each other, and what is left between touching circles."""
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    diagonal = math.sqrt(2.0)
    for gap in (1e-3, 1e-4, 1e-5):
        d = gap * diagonal
        yield f"hole {gap:g} from a side", Region.from_loops([loop(square), circle(0.5, 0.3 + d, 0.3)])
        yield f"hole {gap:g} from two sides", Region.from_loops([loop(square), circle(0.3 + d, 0.3 + d, 0.3)])
        pair = [circle(0.3, 0.5, 0.2), circle(0.7 + d, 0.5, 0.2)]
        yield f"holes {gap:g} apart", Region.from_loops([loop(square), *pair])
        yield f"ring with a hole {gap:g} off", Region.from_loops([circle(0, 0, 1), circle(0.4 - 2 * d, 0, 0.6)])
    for inner in (0.3, 0.6, 0.9):
        yield f"crescent {inner:g}", crescent(inner)
    for radius in (0.6, 1.0, 5.0):
        yield f"lune {radius:g}", lune(radius)
    third = math.pi / 3.0
    spots = [(0.0, 0.0), (2.0, 0.0), (1.0, math.sqrt(3.0))]
    arcs = [CircularArc(c, 1.0, s, s - third) for c, s in zip(spots, (third, math.pi, 5 * third), strict=True)]
    yield "between three circles", chain(arcs[0], arcs[1], arcs[2])


def crescent(inner: float) -> Region:
    """Half the region between a circle of radius 1 and one inside that touches it: one end is a cusp."""
    return chain(
        CircularArc((0, 0), 1.0, 0.0, math.pi),
        Line((-1, 0), (1 - 2 * inner, 0)),
        CircularArc((1 - inner, 0), inner, math.pi, 0.0),
    )


def lune(radius: float) -> Region:
    """Between a half circle of radius 1 and an arc of another radius through its ends, bulging the same way."""
    if radius < 1.0:
        # two splines that leave either end in one direction: a cusp at both
        low = Bezier(np.array([(1.0, 0.0), (1.0, radius), (-1.0, radius), (-1.0, 0.0)]))
        high = Bezier(np.array([(1.0, 0.0), (1.0, 2.0 * radius), (-1.0, 2.0 * radius), (-1.0, 0.0)]))
        return chain(high, low.reverse())
    if radius == 1.0:
        low = Bezier(np.array([(1.0, 0.0), (1.0, 0.3), (-1.0, 0.3), (-1.0, 0.0)]))
        return chain(CircularArc((0, 0), 1.0, 0.0, math.pi), low.reverse())
    half = math.asin(1.0 / radius)
    low = CircularArc((0.0, -math.cos(half) * radius), radius, math.pi / 2 + half, math.pi / 2 - half)
    return chain(CircularArc((0, 0), 1.0, 0.0, math.pi), low)
