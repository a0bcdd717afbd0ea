"""What Python calls of a kernel, with a check of the arguments that numba's dispatcher makes otherwise.

A kernel that is loaded without numba (``_load``) has no dispatcher: before numba's wrapper takes the arguments apart,
code of a few nanoseconds an argument compares their types, and hands them to another function where they are not those
that the kernel is compiled for. It does so only once the loader has filled the table of the guard.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.callwrapper import PyCallWrapper
from numba.np import numpy_support

from fubini._load import (
    ALIGNED,
    ARRAY_TYPE,
    BYTE_ORDER,
    CONTIGUOUS,
    DIMENSIONS,
    DTYPE,
    FLAGS,
    FLOAT_TYPE,
    ITEMS,
    LENGTH,
    LETTERS,
    NUMBER,
    OTHERWISE,
    SWAPPED,
    TABLE,
    WRITABLE,
)

#: Pointers and numbers in compiled code.
POINTER, INT, LONG, BYTE = ir.IntType(8).as_pointer(), ir.IntType(32), ir.IntType(64), ir.IntType(8)


def key_of_types(kinds: Iterable[Any]) -> str | None:
    """What ``_load.key_of`` finds for arguments of these types; None where a guard cannot tell them."""
    parts = [_key(kind) for kind in kinds]
    return " ".join(part for part in parts if part) if all(parts) else None


def _key(kind: Any) -> str | None:
    if isinstance(kind, types.Array):
        letter = _dtype(kind).char if isinstance(kind.dtype, types.Number | types.Boolean) else " "
        fit = letter in LETTERS and kind.layout == "C" and kind.aligned
        return f"{letter}{kind.ndim}{'' if kind.mutable else 'r'}" if fit else None
    return {types.int64: "I", types.float64: "F", types.boolean: "B"}.get(kind)


def _dtype(kind: Any) -> np.dtype[Any]:
    """numpy's data type of an array."""
    return np.dtype(numpy_support.as_dtype(kind.dtype))


def table_name(wrapper: str) -> str:
    """The symbol of the table of the guard in a wrapper."""
    return f"{wrapper}.guard"


class GuardedWrapper(PyCallWrapper):
    """numba's wrapper, behind a guard where its types can be told."""

    def build_wrapper(self, api: Any, builder: Any, closure: Any, args: Any, kws: Any) -> None:
        """As numba."""
        if key_of_types(self.fndesc.argtypes) is not None:
            _Guard(self, api, builder, args, kws).write()
        super().build_wrapper(api, builder, closure, args, kws)

    def get_env(self, api: Any, builder: Any) -> Any:
        """As numba; the class of new arrays becomes one of the constants, which numba unpickles at every call."""
        manager, serialize, unserialize = super().get_env(api, builder), api.serialize_object, api.unserialize

        def constant(value: Any) -> Any:
            return manager.read_const(manager.add_const(value)) if value is np.ndarray else unserialize(value)

        api.serialize_object = lambda value: value if value is np.ndarray else serialize(value)
        api.unserialize = constant
        return manager


class _Guard:
    """Writes the check of the arguments."""

    def __init__(self, wrapper: GuardedWrapper, api: Any, builder: Any, args: Any, kws: Any) -> None:
        self._kinds, self._api, self._builder, self._args, self._kws = wrapper.fndesc.argtypes, api, builder, args, kws
        kind = ir.ArrayType(POINTER, TABLE)
        self._table = ir.GlobalVariable(builder.module, kind, table_name(wrapper.fndesc.llvm_cpython_wrapper_name))
        self._table.initializer = ir.Constant(kind, None)

    def write(self) -> None:
        """Everything, in front of what follows."""
        builder = self._builder
        otherwise = self._entry(OTHERWISE)
        with builder.if_then(cgutils.is_not_null(builder, otherwise)):
            self._miss = builder.append_basic_block("guard.miss")
            with builder.goto_block(self._miss):
                call = ir.FunctionType(POINTER, (POINTER, POINTER, POINTER))
                function = cgutils.get_or_insert_function(builder.module, call, "PyObject_Call")
                builder.ret(builder.call(function, (otherwise, self._args, self._kws)))
            self._require(cgutils.is_null(builder, self._kws))
            self._require_equal(self._read(self._args, LENGTH, LONG), len(self._kinds))
            for k, kind in enumerate(self._kinds):
                self._check(self._read(self._args, ITEMS + 8 * k, POINTER), kind)

    def _entry(self, index: int) -> Any:
        return self._builder.load(cgutils.gep_inbounds(self._builder, self._table, 0, index))

    def _read(self, where: Any, offset: int, kind: Any) -> Any:
        return self._builder.load(cgutils.pointer_add(self._builder, where, offset, kind.as_pointer()))

    def _require(self, condition: Any) -> None:
        met = self._builder.append_basic_block("guard.met")
        self._builder.cbranch(condition, met, self._miss)
        self._builder.position_at_end(met)

    def _require_equal(self, value: Any, expected: int) -> None:
        self._require(self._builder.icmp_signed("==", value, ir.Constant(value.type, expected)))

    def _check(self, value: Any, kind: Any) -> None:
        builder, api, of = self._builder, self._api, self._read(value, 8, POINTER)

        def one_of(*expected: Any) -> Any:
            same = [builder.icmp_unsigned("==", of, other) for other in expected]
            return same[0] if len(same) == 1 else builder.or_(*same)

        if isinstance(kind, types.Array):
            self._require(one_of(self._entry(ARRAY_TYPE)))
            self._check_array(value, kind)
        elif kind == types.int64:
            self._require(one_of(api.get_c_object("PyLong_Type")))
        elif kind == types.float64:
            self._require(one_of(api.get_c_object("PyFloat_Type"), self._entry(FLOAT_TYPE)))
        else:
            self._require(one_of(api.get_c_object("PyBool_Type")))

    def _check_array(self, array: Any, kind: Any) -> None:
        needed = CONTIGUOUS | ALIGNED | (WRITABLE if kind.mutable else 0)
        flags = self._builder.and_(self._read(array, FLAGS, INT), ir.Constant(INT, needed))
        self._require_equal(flags, needed)
        self._require_equal(self._read(array, DIMENSIONS, INT), kind.ndim)
        dtype = self._read(array, DTYPE, POINTER)
        self._require_equal(self._read(dtype, NUMBER, INT), _dtype(kind).num)
        order = self._read(dtype, BYTE_ORDER, BYTE)
        self._require(self._builder.icmp_signed("!=", order, ir.Constant(BYTE, SWAPPED)))
