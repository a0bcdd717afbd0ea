"""numba's compiler with the passes alone that kernels need, and what it looks up again and again looked up once.

Kernels have no closures, comprehensions, exceptions to rewrite, literals to unroll nor functions to put in before
their types are known: a third of numba's passes look for these in every function, and make up its tables anew after
each. And nearly every operator of a kernel has been looked up for the same types before, among templates for arrays,
text, dates and complex numbers. Nothing here changes what comes out.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from numba.core import types
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_machinery import PassManager, _pass_registry
from numba.core.typed_passes import (
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.untyped_passes import FixupArgs, IRProcessing, ReconstructSSA, TranslateByteCode

PASSES = (
    TranslateByteCode,
    FixupArgs,
    IRProcessing,
    ReconstructSSA,
    NopythonTypeInference,
    PreLowerStripPhis,
    IRLegalization,
    NativeLowering,
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
    """A typing context that remembers the signatures of numba's own functions."""

    _found: dict[tuple[int, tuple[Any, ...]], tuple[Any, Any]] = {}

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def resolve_function_type(self, function: Any, arguments: Any, keywords: Any) -> Any:
        """As numba, once for each function and types of arguments."""
        if keywords or not isinstance(function, types.Function) or not all(a.is_precise() for a in arguments):
            return self._context.resolve_function_type(function, arguments, keywords)
        key = id(function), tuple(arguments)
        if key not in self._found:
            # kept with the function, so that no other takes its identity
            self._found[key] = function, self._context.resolve_function_type(function, arguments, keywords)
        return self._found[key][1]


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
