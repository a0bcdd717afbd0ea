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
import os
from collections.abc import Callable
from functools import partial
from types import BuiltinFunctionType
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_machinery import PassManager, _pass_registry, register_pass
from numba.core.ir_utils import build_definitions, check_and_legalize_ir
from numba.core.lowering import Lower
from numba.core.registry import cpu_target
from numba.core.ssa import reconstruct_ssa
from numba.core.transforms import canonicalize_cfg
from numba.core.typed_passes import NativeLowering, NoPythonBackend, NopythonTypeInference, PreLowerStripPhis
from numba.core.types.containers import BaseTuple
from numba.core.types.misc import unliteral
from numba.core.typing.npydecl import parse_dtype
from numba.core.typing.templates import signature
from numba.core.untyped_passes import FixupArgs, ReconstructSSA, TranslateByteCode
from numba.np.arrayobj import _empty_nd_impl

from fubini._turns import CHECK


def _signature(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Signature of ``min`` and ``max`` of numbers and of ``np.empty``; None for other functions and arguments.

    For each list of types numba would compile a function that calls another one, and put both into the kernel.
    """
    name = getattr(function, "typing_key", None)
    plain = [unliteral(a) for a in arguments]
    if name in (min, max) and len(plain) > 1 and all(isinstance(a, types.Integer | types.Float) for a in plain):
        kind = cpu_target.typing_context.unify_types(*plain)
        return signature(kind, *[kind] * len(plain))
    if name is np.empty and 1 <= len(plain) <= 2:
        kind = parse_dtype(plain[1]) if len(plain) > 1 else types.float64
        sizes = plain[0] if isinstance(plain[0], BaseTuple) else (plain[0],)
        if kind is not None and all(isinstance(size, types.Integer) for size in sizes):
            return signature(types.Array(kind, len(sizes), "C"), *plain)
    return None


_found: dict[tuple[int, tuple[Any, ...]], tuple[Any, Any]] = {}


def _resolved(context: Any, function: Any, arguments: tuple[Any, ...]) -> Any:
    """Signature of a function of numba for arguments of these types, looked up once."""
    key = id(function), arguments
    if key not in _found:
        # kept with the function, so that no other takes its identity
        found = _signature(function, arguments) or context.resolve_function_type(function, arguments, {})
        _found[key] = function, found
    return _found[key][1]


class _Lower(Lower):
    """numba's translation, shorter for some calls and for entries of arrays, whose indices are never negative."""

    def _lower_call_normal(self, function: Any, expr: Any, wanted: Any) -> Any:
        """As numba."""
        if not isinstance(function, types.Function) or _signature(function, wanted.args) != wanted:
            return super()._lower_call_normal(function, expr, wanted)
        values = self.fold_call_args(function, wanted, expr.args, expr.vararg, expr.kws)
        made = wanted.return_type
        if isinstance(made, types.Array):
            return self._empty(made, wanted.args[0], values[0])
        compare = self.builder.fcmp_ordered if isinstance(made, types.Float) else self.builder.icmp_signed
        best = values[0]
        for value in values[1:]:
            best = self.builder.select(compare("<" if function.typing_key is min else ">", value, best), value, best)
        return best

    def _empty(self, made: Any, kind: Any, value: Any) -> Any:
        """A new array of this size."""
        kinds = tuple(kind) if isinstance(kind, BaseTuple) else (kind,)
        parts = cgutils.unpack_tuple(self.builder, value) if isinstance(kind, BaseTuple) else (value,)
        sizes = [self.context.cast(self.builder, p, k, types.intp) for p, k in zip(parts, kinds, strict=True)]
        return _empty_nd_impl(self.context, self.builder, made, sizes)._getvalue()

    def lower_binop(self, resty: Any, expr: Any, op: Any) -> Any:
        """As numba, without looking for code made for one constant, which powers alone have."""
        kinds = self.fndesc.calltypes[expr].args
        plain = all(isinstance(kind, types.Number | types.Boolean) for kind in kinds)
        if not plain or op in (operator.pow, operator.ipow):
            return super().lower_binop(resty, expr, op)
        context, builder = self.context, self.builder
        given = [
            context.cast(builder, self.loadvar(side.name), self.typeof(side.name), kind)
            for side, kind in zip((expr.lhs, expr.rhs), kinds, strict=True)
        ]
        found = _resolved(context.typing_context, op, kinds)
        made = context.get_function(context.typing_context.resolve_value_type(op), found)(builder, given)
        return context.cast(builder, made, found.return_type, resty)

    def lower_getitem(self, resty: Any, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        """As numba."""
        place = self._entry(value, index)
        if place is None:
            return super().lower_getitem(resty, expr, value, index, signature)
        kind = self.typeof(value.name).dtype
        entry = self.context.unpack_value(self.builder, kind, place)
        return self.context.cast(self.builder, entry, kind, resty)

    def lower_setitem(self, target_var: Any, index_var: Any, value_var: Any, signature: Any) -> Any:
        """As numba."""
        place = self._entry(target_var, index_var)
        if place is None:
            return super().lower_setitem(target_var, index_var, value_var, signature)
        kind = self.typeof(target_var.name).dtype
        value = self.context.cast(self.builder, self.loadvar(value_var.name), self.typeof(value_var.name), kind)
        self.context.pack_value(self.builder, kind, value, place)

    def _entry(self, array: Any, index: Any) -> Any:
        """Address of an entry of a contiguous array; None for what is no entry of one."""
        kind, place = self.typeof(array.name), self.typeof(index.name)
        kinds = tuple(place) if isinstance(place, BaseTuple) else (place,)
        if not isinstance(kind, types.Array) or (kind.layout, kind.aligned, kind.ndim) != ("C", True, len(kinds)):
            return None
        if not all(isinstance(k, types.Integer) for k in kinds):
            return None
        if any(isinstance(k, types.IntegerLiteral) and k.literal_value < 0 for k in kinds):
            raise IndexError("kernels count entries from the first, not from the last")
        builder, model = self.builder, self.context.data_model_manager[kind]
        given, at = self.loadvar(array.name), self.loadvar(index.name)
        parts = cgutils.unpack_tuple(builder, at) if isinstance(place, BaseTuple) else (at,)
        parts = [self.context.cast(builder, p, k, types.intp) for p, k in zip(parts, kinds, strict=True)]
        shape = model.get_field_position("shape")
        sizes = [builder.extract_value(given, (shape, axis)) for axis in range(len(parts))]
        if CHECK in os.environ:
            self._check(parts, sizes)
        offset = parts[0]
        for part, size in zip(parts[1:], sizes[1:], strict=True):
            offset = builder.add(builder.mul(offset, size, flags=("nsw",)), part, flags=("nsw",))
        data = builder.extract_value(given, model.get_field_position("data"))
        return builder.gep(data, [offset], inbounds=True)

    def _check(self, parts: list[Any], sizes: list[Any]) -> None:
        """End the process at an index that is negative or no less than the size: what lies there is not the array's."""
        builder = self.builder
        for part, size in zip(parts, sizes, strict=True):
            with builder.if_then(builder.icmp_unsigned(">=", part, size), likely=False):
                kind = ir.FunctionType(ir.VoidType(), [])
                builder.call(cgutils.get_or_insert_function(builder.module, kind, "llvm.trap"), [])


@register_pass(mutates_CFG=True, analysis_only=False)
class _SingleAssignment(ReconstructSSA):
    """Every variable assigned once, as numba's ``ReconstructSSA``; no lifetimes, which translation does not ask for."""

    _name = "kernel_single_assignment"

    def run_pass(self, state: Any) -> bool:
        """As numba."""
        state.func_ir.blocks = canonicalize_cfg(state.func_ir.blocks)
        state.func_ir.generator_info = None
        state.func_ir = reconstruct_ssa(state.func_ir)
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
        return _Lower

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
    NopythonTypeInference,
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
        return _resolved(self._context, function, tuple(arguments))

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
