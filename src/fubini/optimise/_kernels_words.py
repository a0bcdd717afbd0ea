"""What kernels read ``State`` and ``Work`` with, from the words that Python hands them."""

from __future__ import annotations

from fubini._jit import reader
from fubini.optimise._kernels_state import STATE_FIELDS, WORK_FIELDS, StateArrays, WorkArrays

state_of = reader(StateArrays, STATE_FIELDS)
work_of = reader(WorkArrays, WORK_FIELDS)
