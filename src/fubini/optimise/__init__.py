"""The optimiser: moves, flips, refinement, the loop (see docs, theory of the optimiser)."""

from fubini.optimise.lengths import shortened
from fubini.optimise.levels import level
from fubini.optimise.loop import optimise, refine_and_optimise
from fubini.optimise.options import OptimiseOptions, OptimiseOutcome
from fubini.optimise.refine import refine
from fubini.optimise.smooth import even_out, smooth
from fubini.optimise.thin import refine_within, thinned

__all__ = [
    "OptimiseOptions",
    "OptimiseOutcome",
    "even_out",
    "level",
    "optimise",
    "refine",
    "refine_and_optimise",
    "refine_within",
    "shortened",
    "smooth",
    "thinned",
]
