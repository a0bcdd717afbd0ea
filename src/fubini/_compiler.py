"""numba's compiler with the passes alone that kernels need, and what it looks up again and again looked up once.

Kernels have no closures, comprehensions, exceptions to rewrite, literals to unroll nor functions to put in before
their types are known: a third of numba's passes look for these in every function, and make up its tables anew after
each; where variables end, only the counting of references asks. And nearly every operator of a kernel has been looked
up for the same types before, among templates for arrays, text, dates and complex numbers. ``min``, ``max`` and
``np.empty`` need no functions of their own. Nothing here changes what comes out, but for indices of entries of arrays:
negative ones, which numba counts from the end after a test of every index, are not allowed in kernels.
"""

from __future__ import annotations

import operator
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from types import BuiltinFunctionType
from typing import Any

from numba.core import ssa, types
from numba.core.analysis import compute_cfg_from_blocks
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_machinery import PassManager, _pass_registry, register_pass
from numba.core.ir_utils import build_definitions, check_and_legalize_ir
from numba.core.lowering import Lower
from numba.core.transforms import canonicalize_cfg
from numba.core.typed_passes import NativeLowering, NoPythonBackend, PreLowerStripPhis
from numba.core.untyped_passes import FixupArgs, ReconstructSSA, TranslateByteCode

from fubini._inference import KernelTypes
from fubini._lowering import KernelLower, resolved


def _single_assignments(blocks: dict[int, Any]) -> dict[int, Any]:
    """numba's ``_run_ssa``: it goes through all blocks for each name, this through those that assign or ask for it."""
    flow = compute_cfg_from_blocks(blocks)
    fronts, names = ssa._iterated_domfronts(flow), ssa._find_defs_violators(blocks, flow)
    variables = ssa._CacheListVars()
    places: dict[str, set[int]] = {name: set() for name in names}
    for label, block in blocks.items():
        for statement in block.body:
            for variable in statement.list_vars():
                if variable.name in places:
                    places[variable.name].add(label)
    for name in names:
        states = {**ssa._make_states(blocks), "varname": name, "defmap": defaultdict(list)}
        part = {label: block for label, block in blocks.items() if label in places[name]}
        part = ssa._run_block_rewrite(part, states, ssa._FreshVarHandler())
        joins = ssa._compute_phi_locations(fronts, states["defmap"])
        states |= {"phimap": defaultdict(list), "cfg": flow, "phi_locations": joins}
        part = ssa._run_block_rewrite(part, states, ssa._FixSSAVars(variables))
        blocks = {label: part.get(label, block) for label, block in blocks.items()}
        for label, joined in states["phimap"].items():
            blocks[label].body = joined + blocks[label].body
    return blocks


@register_pass(mutates_CFG=True, analysis_only=False)
class _SingleAssignment(ReconstructSSA):
    """Every variable assigned once, as numba's ``ReconstructSSA``; no lifetimes, which translation does not ask for."""

    _name = "kernel_single_assignment"

    def run_pass(self, state: Any) -> bool:
        """As numba."""
        state.func_ir.blocks = canonicalize_cfg(state.func_ir.blocks)
        state.func_ir.generator_info = None
        state.func_ir.blocks = _single_assignments(state.func_ir.blocks)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):
    """numba's pass with this translation, and numba's ``PreLowerStripPhis`` and ``IRLegalization`` before it.

    The latter says where each variable ends, for the counting of references: only where these are counted.
    """

    _name = "kernel_lowering"

    @property
    def lowering_class(self) -> type[Lower]:
        return KernelLower

    def run_pass(self, state: Any) -> bool:
        """As numba."""
        state.func_ir = PreLowerStripPhis()._strip_phi_nodes(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        if state.flags.nrt:
            check_and_legalize_ir(state.func_ir, flags=state.flags)
        return bool(super().run_pass(state))


PASSES = (
    TranslateByteCode,
    FixupArgs,
    _SingleAssignment,
    KernelTypes,
    _Lowering,
    NoPythonBackend,
)


class _Passes(PassManager):
    """The passes one after the other, with nothing checked or made up between them."""

    def run(self, state: Any) -> None:
        """As numba."""
        for kind, _ in self.passes:
            step = _pass_registry.get(kind).pass_inst
            step.analysis = self._analysis
            step.run_pass(state)


class _Flags(Flags):
    """numba's flags, which it compares whenever it looks up a function."""

    _unset: dict[str, Any] = {}

    def values(self) -> dict[str, Any]:
        """All flags, set or not."""
        if not self._unset:
            self._unset.update((name, option.default) for name, option in self.options.items())
        return {**self._unset, **self._values}


class _Lookups:
    """A typing context that remembers signatures of numba's own functions, and what attributes are."""

    _attributes: dict[tuple[Any, str], Any] = {}

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def resolve_function_type(self, function: Any, arguments: Any, keywords: Any) -> Any:
        """As numba, once for each function and types of arguments."""
        own = isinstance(function, types.Function | str | BuiltinFunctionType)  # the last ones: operators
        if keywords or not own or not all(a.is_precise() for a in arguments):
            return self._context.resolve_function_type(function, arguments, keywords)
        return resolved(self._context, function, tuple(arguments))

    def resolve_setitem(self, *kinds: Any) -> Any:
        """As numba, once for each types of array, index and value."""
        return self.resolve_function_type(operator.setitem, kinds, {})

    def resolve_getattr(self, kind: Any, name: str) -> Any:
        """As numba, once for each type and name."""
        found = self._attributes.get((kind, name))
        if found is None:
            found = self._attributes[kind, name] = self._context.resolve_getattr(kind, name)
        return found


_sizes: dict[Any, int] = {}


def _size_once(size_of: Callable[[Any], int], kind: Any) -> int:
    """The size of a type: numba writes and parses a module to find it, for every variable."""
    if kind not in _sizes:
        _sizes[kind] = size_of(kind)
    return _sizes[kind]


class KernelCompiler(Compiler):
    """numba's compiler for functions that stay within what ``PASSES`` can do."""

    def __init__(self, *state: Any) -> None:
        super().__init__(*state)
        self.state.typingctx = _Lookups(self.state.typingctx)
        self.state.flags = _Flags(self.state.flags)
        target = self.state.targetctx  # a copy for this function alone
        target.get_abi_sizeof = partial(_size_once, target.get_abi_sizeof)

    def define_pipelines(self) -> list[PassManager]:
        """One manager of the passes above."""
        manager = _Passes("kernel")
        for kind in PASSES:
            manager.add_pass(kind, kind._name)
        manager.finalize()
        return [manager]
