"""Tuples of arrays handed from kernel to kernel by their address.

numba hands a named tuple over field by field, seven numbers or more for each array: a kernel that takes
two tuples of twenty arrays each has three hundred parameters, which all its callers store and which the compiler drags
along. ``by_reference`` stores the tuple once, in the frame of the kernel that Python calls; everything below it
takes one pointer, and reads fields as before.
"""

from __future__ import annotations

import hashlib
from typing import Any

from numba.core import cgutils, types
from numba.core.datamodel import models, register_default
from numba.core.imputils import impl_ret_borrowed
from numba.core.types.containers import NamedTuple, NamedUniTuple
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic


class Reference(types.Type):
    """The address of a named tuple that outlives all uses."""

    def __init__(self, value: Any) -> None:
        self.value = value
        digest = hashlib.sha256(value.name.encode()).hexdigest()[:12]
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
    value = builder.load(cgutils.gep_inbounds(builder, address, 0, index))
    return impl_ret_borrowed(context, builder, kind.value.types[index], value)


@intrinsic
def by_reference(typing_context: Any, value: Any) -> Any:
    """The address of a named tuple, valid until the kernel that asks for it returns."""
    if not isinstance(value, NamedTuple | NamedUniTuple):
        return None

    def store(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return cgutils.alloca_once_value(builder, arguments[0])

    return Reference(value)(value), store
