"""Ratios of lengths at the legs of sharp corners: how fast valid triangles shrink about a node, and what follows.

See docs/theory/corners.md, "Corners beside corners".
"""

from __future__ import annotations

import functools
import math

from fubini.quality import corner_limit

#: Corners below this (degrees) are covered by one triangle: two halves would be too sharp.
SHARP = 50.0
#: Where a leg borders another face too, the next segment there must not be shorter by more than this: five valid
#: triangles about a node on a straight edge span at most a ratio of 16.3.
STEP = 8.0
#: ... and legs much longer than asked are made as long as this needs.
LONG_STEP = 12.0
#: Gaps that the next segment may be long where one side of the corner is beside a wall, and where both are.
MOST_GAPS = (2.8, 1.95)
#: Shares of the exponent that valid triangles about a node can span: what is wanted, and what is enough.
EASE = (0.745, 0.89)
#: Legs of one corner stay equal where next segments of so many gaps are enough for its neighbours ...
EASY_GAPS = 2.0
#: ... and otherwise its triangle keeps this skewness, degrees, if it can be valid.
SKEWED = 47.0


@functools.lru_cache(maxsize=4096)
def least_steps(angle: float, ratio: float = 1.0) -> tuple[float, float, float]:
    """Shortest segments beside a leg, over its length, that a corner of ``angle`` degrees beyond it can do with.

    The first is wanted, the second enough, below the third there is none. In a sharp corner, of which the other leg is
    longer by ``ratio``, triangles shrink from the base of its triangle about the rest of a half turn, in a wide one
    from the leg about all of it.
    """
    if angle >= SHARP:
        return 1.0 / STEP, 1.0 / LONG_STEP, 1.0 / largest_ratio(math.pi)
    along, off = 1.0 - ratio * math.cos(math.radians(angle)), ratio * math.sin(math.radians(angle))
    base, most = math.hypot(along, off), largest_ratio(math.pi - math.atan2(off, along))
    return base / most ** EASE[0], base / most ** EASE[1], base / most


@functools.lru_cache(maxsize=4096)
def best_ratio(angle: float, gap: float, other_gap: float) -> float:
    """Ratio of the other leg to this one, of a sharp corner, that suits both neighbours best, nearest to 1.

    It is 1 where none suits them.

    gap, other_gap : width of the neighbouring corner at the end of either leg, over its length; infinite for none.
    """

    def gaps(ratio: float) -> float:
        here, there = least_steps(angle, ratio), least_steps(angle, 1.0 / ratio)
        return max(here[1] / gap, there[1] / other_gap, EASY_GAPS)

    sharpest = corner_limit(SKEWED)
    if angle < sharpest:
        base = 2.0 * math.sin(math.radians(0.5 * angle))
        ratios = [math.exp(0.1 * k * base) for k in range(-20, 21)]
    else:
        most = largest_ratio(math.radians(angle), 1, SKEWED)
        ratios = [most ** (0.1 * k) for k in range(-10, 11)]
    best = min(ratios, key=lambda ratio: (gaps(ratio), abs(math.log(ratio))))
    return best if gaps(best) <= MOST_GAPS[0] else 1.0


def largest_ratio(turn: float, most: int = 9, skew: float = 45.0) -> float:
    """Ratio of the first to the last edge at a node that up to ``most`` valid triangles there span in ``turn`` rad.

    Their angles at the node are equal. A triangle of skewness s with an angle a between sides 1 and r has
    r^2 - 1 <= 2 r k sin a with k = 1 / tan s, and where its third side is the shortest 2 r (cos a - k sin a) <= 1.
    """
    best, k = 1.0, 1.0 / math.tan(math.radians(skew))
    for count in range(1, min(most, int(turn / math.radians(corner_limit(skew)))) + 1):
        sine, cosine = k * math.sin(turn / count), math.cos(turn / count)
        ratio = sine + math.hypot(sine, 1.0)
        if cosine > sine:
            ratio = min(ratio, 0.5 / (cosine - sine))
        best = max(best, ratio**count)
    return best


def chained(links: list[tuple[tuple[int, int], tuple[int, int], float]]) -> dict[tuple[int, int], float]:
    """Factors of the legs about a vertex whose pairs have these ratios (of the second to the first).

    Empty where ratios contradict each other.
    """
    factors: dict[tuple[int, int], float] = {}
    while len(todo := [link for link in links if not (link[0] in factors and link[1] in factors)]):
        a, b, ratio = next((link for link in todo if link[0] in factors or link[1] in factors), todo[0])
        if a not in factors and b not in factors:
            factors[a] = 1.0
        if a in factors:
            factors[b] = factors[a] * ratio
        else:
            factors[a] = factors[b] / ratio
    closed = all(abs(factors[b] - factors[a] * ratio) < 1e-6 * factors[b] for a, b, ratio in links)
    return factors if closed else {}
