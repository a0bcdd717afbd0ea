"""Kernels translated into LLVM's code: as numba does, with a third of the instructions.

numba translates anything, and leaves it to LLVM to find out that most of it is not needed: every name is a place in
memory, every loop counts what is left of any range, every call looks at the ways in which functions may fail, every
array is put together and taken apart. Reading and removing that takes longer than the rest. Here names that are
assigned once are values, loops count by one or back, only functions that make arrays may fail, and indices of entries
of arrays are never negative (numba counts such from the end, after a test of every index).
"""

from __future__ import annotations

import operator
import os
from collections import Counter
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core import ir as statements
from numba.core.datamodel import ArgPacker
from numba.core.lowering import Lower
from numba.core.types import iterators, misc
from numba.core.types.containers import BaseTuple
from numba.core.types.misc import unliteral

from fubini._builder import Builder, sweep
from fubini._operations import (
    ORDER,
    Simple,
    fits,
    following,
    loop,
    operation,
    own_call,
    own_signature,
    range_of,
)
from fubini._operations import field as place_of
from fubini._turns import CHECK

_found: dict[tuple[int, tuple[Any, ...]], tuple[Any, Any]] = {}


def resolved(context: Any, function: Any, arguments: tuple[Any, ...]) -> Any:
    """Signature of a function of numba for arguments of these types, looked up once.

    Constants are numbers as others where all arguments are numbers, or index an array.
    """
    plain = tuple(map(unliteral, arguments))
    numbers = plain[1:] if plain and isinstance(plain[0], types.Array) else plain
    if all(isinstance(kind, types.Number | types.Boolean) for kind in numbers):
        arguments = plain
    key = id(function), arguments
    if key not in _found:
        # kept with the function, so that no other takes its identity
        found = own_signature(function, arguments) or context.resolve_function_type(function, arguments, {})
        _found[key] = function, found
    return _found[key][1]


class KernelLower(Lower):
    """numba's translation of a function, shorter."""

    #: Names of functions that return nothing but success.
    _sure: set[str] = set()
    _counts: dict[Any, bool] = {}
    _packers: dict[Any, ArgPacker] = {}

    _singly_assigned_vars: set[str]
    _blk_local_varmap: dict[str, Any]

    # Names: values where they are assigned once, since numba has given every name of several values several names.

    def _counted(self, kind: Any) -> bool:
        """Whether a value of this type holds references that are counted."""
        if not self.context.enable_nrt:
            return False
        if kind not in self._counts:
            self._counts[kind] = self.context.data_model_manager[kind].contains_nrt_meminfo()
        return self._counts[kind]

    def _find_singly_assigned_variable(self) -> None:
        kept: set[str] = set()
        if self.context.enable_nrt:
            super()._find_singly_assigned_variable()
            kept = {name for name in self._singly_assigned_vars if self._counted(self.typeof(name))}
        times = Counter(
            s.target.name for block in self.blocks.values() for s in block.body if type(s) is statements.Assign
        )
        once = {name for name, n in times.items() if n == 1 and not self._counted(self.typeof(name))}
        self._singly_assigned_vars, self._blk_local_varmap = once | kept, {}

    def alloca(self, name: str, type: Any) -> Any:
        """As numba, but zeros are written only where references are counted."""
        if self._counted(type):
            return super().alloca(name, type)
        return self.builder.slot(self.context.get_value_type(type))

    def loadvar(self, name: str) -> Any:
        """As numba."""
        found = self._blk_local_varmap.get(name)
        return self.builder.load(self.getvar(name)) if found is None else found

    def storevar(self, value: Any, name: str, argidx: int | None = None) -> None:
        """As numba; nothing is read before."""
        if self._counted(self.typeof(name)):
            super().storevar(value, name, argidx)
        elif name in self._singly_assigned_vars:
            self._blk_local_varmap[name] = value
        else:
            self.builder.store(value, self.getvar(name))

    def delvar(self, name: str) -> None:
        """As numba."""
        if self._counted(self.typeof(name)):
            super().delvar(name)

    def incref(self, typ: Any, val: Any) -> None:
        """As numba."""
        if self._counted(typ):
            super().incref(typ, val)

    def decref(self, typ: Any, val: Any) -> None:
        """As numba."""
        if self._counted(typ):
            super().decref(typ, val)

    # Functions, blocks, statements.

    def setup_function(self, fndesc: Any) -> None:
        """As numba."""
        super().setup_function(fndesc)
        self.builder = Builder(self.entry_block)
        self.call_helper = self.call_conv.init_call_helper(self.builder)
        self._linked: set[Any] = set()

    def lower_normal_function(self, fndesc: Any) -> None:
        """As numba, without what nothing uses."""
        super().lower_normal_function(fndesc)
        sweep(self.function)
        ends = (block.terminator for block in self.function.blocks)
        codes = [end.operands[0] for end in ends if end.opname == "ret"]
        if all(isinstance(code, ir.Constant) and code.constant == 0 for code in codes):
            self._sure.add(fndesc.mangled_name)

    def _ordered(self) -> list[int]:
        """The blocks, each one behind all that every way to it passes."""
        last, seen = [], {self.firstblk}
        ways = [(self.firstblk, iter(self.blocks[self.firstblk].terminator.get_targets()))]
        while ways:
            block, targets = ways[-1]
            target = next((t for t in targets if t not in seen), None)
            if target is None:
                last.append(block)
                ways.pop()
            else:
                seen.add(target)
                ways.append((target, iter(self.blocks[target].terminator.get_targets())))
        return last[::-1] + [block for block in self.blocks if block not in seen]

    def lower_function_body(self) -> Any:
        """As numba."""
        for offset in self.blocks:
            self.blkmap[offset] = self.function.append_basic_block(f"B{offset}")
        self.pre_lower()
        start = self.builder.basic_block
        for offset in self._ordered():
            self.builder.position_at_end(self.blkmap[offset])
            self.lower_block(self.blocks[offset])
        self.post_lower()
        return start

    def lower_block(self, block: Any) -> None:
        """As numba."""
        self._cur_ir_block = block
        for statement in block.body:
            self.loc = statement.loc
            self.lower_inst(statement)

    def lower_inst(self, inst: Any) -> None:
        """As numba."""
        if type(inst) is not statements.Assign:
            super().lower_inst(inst)
            return
        name, value = inst.target.name, inst.value
        made = self.lower_assign(self.typeof(name), inst)
        self.storevar(made, name, value.index + 1 if isinstance(value, statements.Arg) else None)

    def lower_assign(self, ty: Any, inst: Any) -> Any:
        """As numba."""
        value = inst.value
        if isinstance(value, statements.Const | statements.Global | statements.FreeVar):
            if isinstance(ty, Simple):
                return self.context.get_value_type(ty)(value.value)
            if isinstance(ty, types.Function | types.Dispatcher | misc.Module):
                return self.context.get_dummy_value()
        return super().lower_assign(ty, inst)

    # Expressions.

    def lower_expr(self, resty: Any, expr: Any) -> Any:
        """As numba."""
        made = self._short(resty, expr) if expr.op in SHORT else None
        return super().lower_expr(resty, expr) if made is None else made

    def _short(self, resty: Any, expr: Any) -> Any:
        """Parts of pairs, loops over ranges, shapes of arrays, contents of modules; None for what is none of these."""
        builder, op, kind = self.builder, expr.op, self.typeof(expr.value.name)
        if op == "getattr" and isinstance(kind, misc.Module):
            return self.context.get_dummy_value() if isinstance(resty, types.Dummy) else None
        value = self.loadvar(expr.value.name)
        if op in ("pair_first", "pair_second") and not self._counted(resty):
            return builder.extract_value(value, int(op == "pair_second"))
        if op == "getattr" and expr.attr == "shape" and isinstance(kind, types.Array):
            return builder.extract_value(value, place_of(self.context, kind, "shape"))
        if op == "getiter" and isinstance(kind, iterators.RangeType):
            return loop(self.context, builder, kind, value)
        if op == "iternext" and isinstance(kind, iterators.RangeIteratorType):
            return following(self.context, builder, kind, value, resty)
        return None

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
        found = operation(builder, kinds[0], op, *given) if fits(kinds, op) else None
        if found is not None:
            return context.cast(builder, found, types.boolean if op in ORDER else kinds[0], resty)
        wanted = resolved(context.typing_context, op, kinds)
        made = context.get_function(context.typing_context.resolve_value_type(op), wanted)(builder, given)
        return context.cast(builder, made, wanted.return_type, resty)

    # Calls.

    def _lower_call_normal(self, function: Any, expr: Any, wanted: Any) -> Any:
        """As numba."""
        made = None
        if isinstance(function, types.Dispatcher):
            made = self._call(function.dispatcher.overloads.get(tuple(wanted.args)), expr, wanted)
        elif isinstance(function, types.Function) and not expr.kws:
            name = function.typing_key
            ranged = name is range
            if ranged or own_signature(function, wanted.args) == wanted:
                values = self.fold_call_args(function, wanted, expr.args, expr.vararg, expr.kws)
                if ranged:
                    return range_of(self.context, self.builder, wanted.return_type, values)
                return own_call(self.context, self.builder, name, wanted, values)
        return super()._lower_call_normal(function, expr, wanted) if made is None else made

    def _call(self, found: Any, expr: Any, wanted: Any) -> Any:
        """A call of a compiled function; None for calls that are left to numba.

        What fails in there is told to the caller of this function at the same place.
        """
        if found is None or expr.kws or expr.vararg or len(expr.args) != len(wanted.args):
            return None
        described, builder = found.fndesc, self.builder
        if described.argtypes != tuple(wanted.args) or isinstance(described.restype, misc.Optional):
            return None
        given = [self._cast_var(variable, kind) for variable, kind in zip(expr.args, wanted.args, strict=True)]
        if found.library not in self._linked:
            self._linked.add(found.library)
            self.library.add_linking_library(found.library)
        called = self.module.globals.get(described.mangled_name)
        if called is None:
            called = self.context.declare_function(self.module, described)
        packer = self._packers.get(described.argtypes)
        if packer is None:
            packer = ArgPacker(self.context.data_model_manager, described.argtypes)
            self._packers[described.argtypes] = packer
        slot = builder.slot(self.call_conv.get_return_type(described.restype).pointee)
        code = builder.call(called, [slot, self.function.args[1], *packer.as_arguments(builder, given)])
        if described.mangled_name not in self._sure:
            with builder.if_then(builder.icmp_signed("!=", code, ir.Constant(code.type, 0)), likely=False):
                builder.ret(code)
        return self.context.get_returned_value(builder, described.restype, builder.load(slot))

    # Entries of arrays and tuples.

    def lower_getitem(self, resty: Any, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        """As numba."""
        kind, place = self.typeof(value.name), self.typeof(index.name)
        if isinstance(kind, BaseTuple) and isinstance(place, types.IntegerLiteral) and not self._counted(resty):
            which = place.literal_value % len(kind)
            part = self.builder.extract_value(self.loadvar(value.name), which)
            return self.context.cast(self.builder, part, kind[which], resty)
        address = self._entry(value, index)
        if address is None:
            return super().lower_getitem(resty, expr, value, index, signature)
        entry = self.context.unpack_value(self.builder, kind.dtype, address)
        return self.context.cast(self.builder, entry, kind.dtype, resty)

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
        builder, shape = self.builder, place_of(self.context, kind, "shape")
        given, at = self.loadvar(array.name), self.loadvar(index.name)
        parts = cgutils.unpack_tuple(builder, at) if isinstance(place, BaseTuple) else (at,)
        parts = [self.context.cast(builder, p, k, types.intp) for p, k in zip(parts, kinds, strict=True)]
        if CHECK in os.environ:
            self._check(parts, [builder.extract_value(given, (shape, axis)) for axis in range(len(parts))])
        offset = parts[0]
        for axis, part in enumerate(parts[1:], 1):
            size = builder.extract_value(given, (shape, axis))
            offset = builder.add(builder.mul(offset, size, flags=("nsw",)), part, flags=("nsw",))
        return builder.gep(builder.extract_value(given, place_of(self.context, kind, "data")), [offset], inbounds=True)

    def _check(self, parts: list[Any], sizes: list[Any]) -> None:
        """End the process at an index that is negative or no less than the size: what lies there is not the array's."""
        builder = self.builder
        for part, size in zip(parts, sizes, strict=True):
            with builder.if_then(builder.icmp_unsigned(">=", part, size), likely=False):
                kind = ir.FunctionType(ir.VoidType(), [])
                builder.call(cgutils.get_or_insert_function(builder.module, kind, "llvm.trap"), [])


#: Expressions of which ``KernelLower`` knows a short form.
SHORT = frozenset(("pair_first", "pair_second", "getattr", "getiter", "iternext"))
