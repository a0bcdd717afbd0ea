"""The optimiser: moves, flips, refinement, the loop (see docs, theory of the optimiser)."""

from fubini.optimise.loop import optimise, refine_and_optimise
from fubini.optimise.options import OptimiseOptions, OptimiseOutcome
from fubini.optimise.refine import refine

__all__ = ["OptimiseOptions", "OptimiseOutcome", "optimise", "refine", "refine_and_optimise"]
