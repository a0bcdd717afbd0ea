"""The optimiser: moves, flips, refinement, the loop (see docs, theory of the optimiser)."""

from fubini.optimise.lengths import shortened
from fubini.optimise.loop import optimise, refine_and_optimise
from fubini.optimise.options import OptimiseOptions, OptimiseOutcome
from fubini.optimise.refine import refine
from fubini.optimise.smooth import even_out, evened, smooth

__all__ = [
    "OptimiseOptions",
    "OptimiseOutcome",
    "even_out",
    "evened",
    "optimise",
    "refine",
    "refine_and_optimise",
    "shortened",
    "smooth",
]
