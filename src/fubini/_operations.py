"""Numbers, ranges and new arrays in LLVM's code: what kernels use most, in few instructions (see ``fubini._lowering``).

Every function takes numba's context of the kernel, which knows how types are laid out, and the builder of its code.
"""

from __future__ import annotations

import operator
from functools import reduce
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.registry import cpu_target
from numba.core.types.containers import BaseTuple
from numba.core.types.misc import unliteral
from numba.core.typing.npydecl import parse_dtype
from numba.core.typing.templates import signature

#: Of operators on numbers of one type: what LLVM calls them for signed integers and for floating point numbers. Sums,
#: differences and products of integers are taken to stay within 64 bits, as numba does.
ARITHMETIC = {operator.add: "add", operator.sub: "sub", operator.mul: "mul"}
BITS = {
    operator.and_: "and_", operator.or_: "or_", operator.xor: "xor", operator.lshift: "shl", operator.rshift: "ashr",
}  # fmt: skip
SHIFTS = operator.lshift, operator.rshift
FLOATS = {operator.add: "fadd", operator.sub: "fsub", operator.mul: "fmul", operator.truediv: "fdiv"}
ORDER = {
    operator.lt: "<", operator.le: "<=", operator.gt: ">", operator.ge: ">=", operator.eq: "==", operator.ne: "!=",
}  # fmt: skip

#: Bytes that no allocation gets: an array that would take more, or a negative number, takes so many and is refused.
MOST = 1 << 62

Simple = types.Integer | types.Float


def own_signature(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Signature of what ``own_call`` translates; None for other functions and arguments.

    For each list of types numba would compile a function that calls another one, and put both into the kernel.
    """
    name = getattr(function, "typing_key", None)
    plain = [unliteral(a) for a in arguments]
    if name in (min, max) and len(plain) > 1 and all(isinstance(a, Simple) for a in plain):
        kind = cpu_target.typing_context.unify_types(*plain)
        return signature(kind, *[kind] * len(plain))
    if name is int and len(plain) == 1 and isinstance(plain[0], Simple):
        return signature(types.intp if isinstance(plain[0], types.Float) else plain[0], *plain)
    if name is bool and plain == [types.boolean]:
        return signature(types.boolean, *plain)
    if name in (np.empty, np.zeros) and 1 <= len(plain) <= 2:
        kind = parse_dtype(plain[1]) if len(plain) > 1 else types.float64
        sizes = plain[0] if isinstance(plain[0], BaseTuple) else (plain[0],)
        if kind is not None and all(isinstance(size, types.Integer) for size in sizes):
            return signature(types.Array(kind, len(sizes), "C"), *plain)
    return None


def own_call(context: Any, builder: Any, name: Any, wanted: Any, values: list[Any]) -> Any:
    """``min``, ``max``, ``int`` and ``bool`` of numbers, ``np.empty`` and ``np.zeros``."""
    made = wanted.return_type
    if isinstance(made, types.Array):
        return new_array(context, builder, made, wanted.args[0], values[0], zeros=name is np.zeros)
    if name in (int, bool):
        return context.cast(builder, values[0], wanted.args[0], made)
    compare = builder.fcmp_ordered if isinstance(made, types.Float) else builder.icmp_signed
    best = values[0]
    for value in values[1:]:
        best = builder.select(compare("<" if name is min else ">", value, best), value, best)
    return best


def field(context: Any, kind: Any, name: str) -> int:
    """The place of a part of a value."""
    place: int = context.data_model_manager[kind].get_field_position(name)
    return place


def fits(kinds: tuple[Any, ...], op: Any) -> bool:
    """Whether ``operation`` may know an operator on numbers of these types."""
    return isinstance(kinds[0], Simple) and kinds[1] in (kinds[0], types.uint64 if op in SHIFTS else kinds[0])


def operation(builder: Any, kind: Any, op: Any, left: Any, right: Any) -> Any:
    """What an operator makes of two numbers of one type; None for what is left to numba."""
    if isinstance(kind, types.Float):
        if op in ORDER:
            compare = builder.fcmp_unordered if op is operator.ne else builder.fcmp_ordered
            return compare(ORDER[op], left, right)
        return getattr(builder, FLOATS[op])(left, right) if op in FLOATS else None
    if not kind.signed or kind.bitwidth < 64:
        return None
    if op in ORDER:
        return builder.icmp_signed(ORDER[op], left, right)
    if op in ARITHMETIC:
        return getattr(builder, ARITHMETIC[op])(left, right, flags=("nsw",))
    if op in BITS:
        return getattr(builder, BITS[op])(left, right)
    if op in (operator.mod, operator.floordiv) and isinstance(right, ir.Constant) and right.constant > 0:
        # towards less, as Python: LLVM divides towards zero
        rest = builder.srem(left, right)
        below = builder.icmp_signed("<", rest, ir.Constant(rest.type, 0))
        if op is operator.mod:
            return builder.select(below, builder.add(rest, right), rest)
        share = builder.sdiv(left, right)
        return builder.select(below, builder.sub(share, ir.Constant(rest.type, 1)), share)
    return None


def range_of(context: Any, builder: Any, kind: Any, values: list[Any]) -> Any:
    """A range from what it was called with."""
    none, one = (ir.Constant(values[0].type, n) for n in (0, 1))
    limits = {1: (none, *values, one), 2: (*values, one), 3: tuple(values)}[len(values)]
    made = ir.Constant(context.get_value_type(kind), ir.Undefined)
    for place, value in enumerate(limits):
        made = builder.insert_value(made, value, place)
    return made


def _is_one(step: Any) -> bool:
    """Whether a step is known to be 1 or -1."""
    return isinstance(step, ir.Constant) and step.constant in (1, -1)


def loop(context: Any, builder: Any, kind: Any, limits: Any) -> Any:
    """What a range by 1 or -1 counts with, as numba's loops have it; None for other ranges."""
    first, stop, step = (builder.extract_value(limits, field(context, kind, n)) for n in ("start", "stop", "step"))
    if not _is_one(step):
        return None
    left = builder.sub(stop, first) if step.constant == 1 else builder.sub(first, stop)
    none = ir.Constant(left.type, 0)
    left = builder.select(builder.icmp_signed(">", left, none), left, none)
    at, count = builder.slot(first.type), builder.slot(left.type)
    builder.store(first, at)
    builder.store(left, count)
    made = ir.Constant(context.get_value_type(kind.iterator_type), ir.Undefined)
    for name, value in (("iter", at), ("stop", stop), ("step", step), ("count", count)):
        made = builder.insert_value(made, value, field(context, kind.iterator_type, name))
    return made


def following(context: Any, builder: Any, kind: Any, counted: Any, pair: Any) -> Any:
    """A pair of the next number and whether there is one; None where the step is not known here."""
    slot, stop, step = (builder.extract_value(counted, field(context, kind, n)) for n in ("iter", "stop", "step"))
    if not _is_one(step):
        return None
    at = builder.load(slot)
    inside = builder.icmp_signed("<" if step.constant == 1 else ">", at, stop)
    builder.store(builder.add(at, step, flags=("nsw",)), slot)
    made = ir.Constant(context.get_value_type(pair), ir.Undefined)
    return builder.insert_value(builder.insert_value(made, at, 0), inside, 1)


def new_array(context: Any, builder: Any, made: Any, kind: Any, value: Any, zeros: bool) -> Any:
    """A new array of this size."""
    kinds = tuple(kind) if isinstance(kind, BaseTuple) else (kind,)
    parts = cgutils.unpack_tuple(builder, value) if isinstance(kind, BaseTuple) else (value,)
    sizes = [context.cast(builder, p, k, types.intp) for p, k in zip(parts, kinds, strict=True)]
    entry = context.get_data_type(made.dtype)
    item = context.get_constant(types.intp, context.get_abi_sizeof(entry))
    strides, wide = [item], []
    for size in sizes[::-1]:
        product = builder.umul_with_overflow(strides[0], size)
        strides.insert(0, builder.extract_value(product, 0))
        wide.append(builder.extract_value(product, 1))
    most = ir.Constant(item.type, MOST)
    wide.append(builder.icmp_unsigned(">", strides[0], most))
    size = builder.select(reduce(builder.or_, wide), most, strides.pop(0))
    owner = context.nrt.meminfo_alloc_aligned(builder, size, context.get_preferred_array_alignment(made.dtype))
    data = context.nrt.meminfo_data(builder, owner)
    if zeros:
        cgutils.memset(builder, data, size, 0)
    array = ir.Constant(context.get_value_type(made), None)
    whole = {
        "meminfo": owner, "nitems": reduce(builder.mul, sizes), "itemsize": item,
        "data": builder.bitcast(data, entry.as_pointer()),
    }  # fmt: skip
    for name, part in whole.items():
        array = builder.insert_value(array, part, field(context, made, name))
    for axis, both in enumerate(zip(sizes, strides, strict=True)):
        for name, part in zip(("shape", "strides"), both, strict=True):
            array = builder.insert_value(array, part, (field(context, made, name), axis))
    return array
