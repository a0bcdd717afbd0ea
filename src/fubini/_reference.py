"""Tuples of arrays handed to kernels, and from kernel to kernel, by their address.

numba hands a named tuple over field by field, seven numbers or more for each array: a kernel that takes
two tuples of twenty arrays each has three hundred parameters, which are read anew at each call from Python, which all
callers store and which the compiler drags along. Here Python writes these numbers into one array (``words_of``, in
``fubini._packed``); the kernel that it calls copies them into its frame (a ``reader``), and everything below takes one
pointer, and reads fields as before.
"""

from __future__ import annotations

import hashlib
from typing import Any

from numba.core import cgutils, types
from numba.core.datamodel import models, register_default
from numba.core.imputils import impl_ret_borrowed
from numba.core.types.containers import NamedTuple
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic
from numba.np.numpy_support import from_dtype

from fubini._packed import LETTERS, row_of

#: Types that the letters of ``fubini._packed`` stand for.
KINDS = {letter: from_dtype(kind) for letter, kind in LETTERS.items()}


class Reference(types.Type):
    """The address of a named tuple that outlives all uses."""

    def __init__(self, value: Any, rows: tuple[int, ...]) -> None:
        self.value, self.rows = value, rows
        digest = hashlib.sha256(f"{value.name} {rows}".encode()).hexdigest()[:12]
        super().__init__(name=f"{value.instance_class.__name__}_{digest}")


@register_default(Reference)
class _ReferenceModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Reference) -> None:
        super().__init__(manager, kind, manager.lookup(kind.value).get_value_type().as_pointer())


@infer_getattr
class _ReferenceFields(AttributeTemplate):
    key = Reference

    def generic_resolve(self, kind: Reference, field: str) -> Any:
        """The type of a field; None where there is none of this name."""
        fields = kind.value.fields
        return kind.value.types[fields.index(field)] if field in fields else None


@lower_getattr_generic(Reference)
def _lower_field(context: Any, builder: Any, kind: Reference, address: Any, field: str) -> Any:
    index = kind.value.fields.index(field)
    value, array = builder.load(cgutils.gep_inbounds(builder, address, 0, index)), kind.value.types[index]
    if array.ndim > 1:
        # a number in place of one read: rows are then found without multiplying
        shape = context.data_model_manager[array].get_field_position("shape")
        value = builder.insert_value(value, context.get_constant(types.intp, kind.rows[index]), (shape, 1))
    return impl_ret_borrowed(context, builder, array, value)


def reader(kind: type, fields: str) -> Any:
    """What kernels call with the words of a named tuple of this kind: a reference, valid until the kernel returns.

    fields : types of the arrays, as ``words_of`` takes them. Raises ``TypeError`` where numba lays arrays out in
    another way than ``words_of``.
    """
    lengths = tuple(row_of(field) for field in fields.split())
    arrays = tuple(
        types.Array(KINDS[field[0]], 1 + (n > 0), "C") for field, n in zip(fields.split(), lengths, strict=True)
    )
    value = NamedTuple(arrays, kind)
    expected = 8 * sum(5 + 2 * array.ndim for array in arrays)

    @intrinsic
    def read(typing_context: Any, words: Any) -> Any:
        if words != types.Array(types.int64, 1, "C"):
            return None

        def copy(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            stored = context.get_value_type(value)
            if context.get_abi_sizeof(stored) != expected:
                raise TypeError(f"numba lays out {kind.__name__} in another way than fubini")
            given = context.make_array(words)(context, builder, arguments[0]).data
            frame = cgutils.alloca_once(builder, stored)
            cgutils.raw_memcpy(builder, frame, given, context.get_constant(types.intp, expected // 8), 8)
            return frame

        return Reference(value, lengths)(words), copy

    return read
