"""Kernels compiled by numba, in few runs, and kept in the cache of numba and that of ``fubini._load``."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numba
from llvmlite import ir
from llvmlite.binding import Linkage, parse_assembly
from numba.core import sigutils, types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator
from numba.core.codegen import JITCodeLibrary
from numba.core.environment import lookup_environment
from numba.core.runtime import rtsys
from numba.core.types.misc import unliteral

from fubini._cache import cache_folder, source_digest
from fubini._compiler import KernelCompiler
from fubini._guard import GuardedWrapper, key_of_types, table_name
from fubini._image import lay_out
from fubini._load import Kept, host, identity_of, path_of, save, text_of
from fubini._reference import Reference  # noqa: F401  numba is told of references before it compiles
from fubini._turns import turn


class _Locator(_CacheLocator):
    """Tells numba where the compiled form of a function lies and what it depends on."""

    def __init__(self, py_func: Callable[..., Any]) -> None:
        self._line = py_func.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        return str(cache_folder())

    def get_source_stamp(self) -> str:
        return source_digest()

    def get_disambiguator(self) -> str:
        return str(self._line)

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> _Locator:
        return cls(py_func)


class _CacheImpl(CompileResultCacheImpl):
    _locator_classes = [_Locator]

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """As numba, but the object code is kept: numba forgets it once it is in memory."""
        result = super().rebuild(target_context, payload)
        result.library.object_code = payload[0][2][0]
        return result


class _Cache(FunctionCache):
    _impl_class = _CacheImpl

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """As numba, but without reading the tables of all that it can compile: compilation reads them itself."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def _plain(kind: Any) -> Any:
    """The type that an argument is compiled for: constants and all integers become int64."""
    kind = unliteral(kind)
    return types.int64 if isinstance(kind, types.Integer) else kind


class _NoEnvironment:
    """Stands in for the code generator where machine code does not exist."""

    def set_env(self, name: str, env: Any) -> None:
        """Nothing to set: the function lives on in its callers only."""


class _Part(JITCodeLibrary):
    """Code that only other code links in: neither optimised nor turned into machine code by itself.

    numba would optimise a function once by itself and again in each caller, caller's caller and so on.
    """

    codegen = _NoEnvironment()

    def add_ir_module(self, ir_module: Any) -> None:
        """As numba, at once in the form that others link: functions may be there again, and go where not called."""
        for function in ir_module.functions:
            if function.blocks and not function.linkage:
                function.linkage = "linkonce_odr"
        super().add_ir_module(ir_module)
        self._shared_module = self._final_module

    def add_llvm_module(self, ll_module: Any) -> None:
        """The code of one function is the whole module."""
        self._final_module = ll_module

    def finalize(self) -> None:
        """As numba, but what this code calls is left to the whole to link, once."""
        self._raise_if_finalized()
        self._finalize_final_module()

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """None: there is no machine code."""
        return 0


class _Whole(JITCodeLibrary):
    """Code called from Python, optimised once, with everything that it calls."""

    _shared_module: Any

    def _optimize_functions(self, ll_module: Any) -> None:
        """Nothing: the final module is optimised with all that is linked in."""

    def finalize(self) -> None:
        """As numba, with all that is called, directly or not, linked in."""
        needed = list(self._linking_libraries)
        known = set(needed)
        for library in needed:
            for further in getattr(library, "_linking_libraries", ()):
                if further not in known:
                    known.add(further)
                    needed.append(further)
        # last, since of it only what is called by then is taken
        needed.sort(key=lambda library: library is rtsys.library)
        self._linking_libraries[:] = needed
        super().finalize()

    def _optimize_final_module(self) -> None:
        """Optimise once; functions that only this code calls may change their form, and what nothing uses goes."""
        module = self._final_module
        for function in module.functions:
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                function.linkage = "internal"
        # tables for Python errors, one a function: nearly all unused, yet filled whenever the code is loaded
        entries = _entries(module)
        for table in _environments(module):
            if table.name.replace("_ZN08NumbaEnv", "_ZN") not in entries:
                table.linkage = "internal"
        built = self._codegen._module_pass_manager(loop_vectorize=True, slp_vectorize=False)
        if isinstance(built, tuple):
            passes, builder = built
            passes.run(module, builder)
        else:  # numba before 0.62
            built.run(module)
        for table in _environments(module):
            table.linkage = "common"

    def _get_module_for_linking(self) -> Any:
        """Names alone: no code links this one, but the cache keeps this module to tell what is defined."""
        self._ensure_finalized()
        if self._shared_module is None:
            module = self._final_module
            lines = [f'define void @"{name}"() {{ ret void }}' for name in _entries(module)]
            lines += [f'@"{table.name}" = common global i64 0' for table in _environments(module)]
            self._shared_module = parse_assembly("\n".join(lines))
        return self._shared_module


def _entries(module: Any) -> list[str]:
    """Names of the functions of a module that are called from outside."""
    return [f.name for f in module.functions if not f.is_declaration and f.linkage == Linkage.external]


def _environments(module: Any) -> list[Any]:
    """The variables of a module that numba finds the environments of functions by."""
    return [v for v in module.global_variables if v.name.startswith("_ZN08NumbaEnv") and not v.is_declaration]


def _compiler(library: type[JITCodeLibrary]) -> type[KernelCompiler]:
    """numba's compiler with code libraries of this kind."""

    class _Compiler(KernelCompiler):
        def compile_extra(self, func: Callable[..., Any]) -> Any:
            self.state.library = library(self.state.targetctx.codegen(), func.__qualname__)
            self.state.library.enable_object_caching()
            self.state.targetctx.create_cpython_wrapper = partial(_create_wrapper, self.state.targetctx)
            return super().compile_extra(func)

    return _Compiler


_COMPILERS = {library: _compiler(library) for library in (_Part, _Whole)}


def _create_wrapper(
    context: Any, library: Any, description: Any, environment: Any, call_helper: Any, release_gil: bool = False
) -> None:
    """As numba, with a guard in front."""
    module = context.create_module("wrapper")
    kind = context.call_conv.get_function_type(description.restype, description.argtypes)
    called = ir.Function(module, kind, description.llvm_func_name)
    GuardedWrapper(context, module, called, description, environment, call_helper, release_gil).build()
    library.add_ir_module(module)


def whole(function: Callable[..., Any], part: Any, allocates: bool) -> Any:
    """numba's dispatcher of a kernel, whose callers link ``part``."""
    compiled = _compile(function, _Whole, _nrt=allocates)
    compiled.get_call_template, compiled.get_overload = part.get_call_template, part.get_overload
    try:
        cache_folder().mkdir(parents=True, exist_ok=True)
        compiled._cache = _Cache(function)
    except OSError:  # no writable folder: compile in every process
        pass
    return compiled


def part(function: Callable[..., Any], allocates: bool, inlined: bool) -> Any:
    """numba's dispatcher of a function that only kernels call."""
    return _compile(function, _Part, _nrt=allocates, forceinline=inlined, no_cpython_wrapper=True)


@contextmanager
def _collected_at_the_end() -> Iterator[None]:
    """Compiling makes millions of objects, most of which go by themselves: looking through them before takes longer."""
    if not gc.isenabled():  # within another function, or the user's wish
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def _compile(function: Callable[..., Any], library: type[JITCodeLibrary], **options: bool) -> Any:
    compiled = numba.njit(
        nogil=True, error_model="numpy", no_cfunc_wrapper=True, no_rewrites=True,
        pipeline_class=_COMPILERS[library], **options,
    )(function)  # fmt: skip
    compile_for = compiled.compile

    def compile_plain(signature: Any) -> Any:
        given, _ = sigutils.normalize_signature(signature)
        arguments = tuple(_plain(a) for a in given)
        kept = getattr(getattr(compiled._cache, "_cache_file", None), "_index_path", None)
        with _collected_at_the_end(), turn(Path(kept)) if kept else nullcontext():
            entry = compile_for(arguments)
        if library is _Whole:
            _keep(function, arguments, compiled.overloads[arguments])
        made = compiled.overloads[arguments].signature.return_type
        if not options["_nrt"] and any(isinstance(part, types.Array) for part in getattr(made, "types", (made,))):
            raise TypeError(f"{function.__name__} returns an array: declare it with allocates=True")
        return entry

    compiled.compile = compile_plain
    return compiled


def _keep(function: Callable[..., Any], kinds: tuple[Any, ...], result: Any) -> None:
    """Write what ``_load`` needs, unless it is written or has something that ``_load`` knows nothing of."""
    key = key_of_types(kinds)
    if key is None or not host() or path_of(function, key).exists():
        return
    library = result.library
    code = getattr(library, "object_code", None) or library._get_compiled_object()
    image, names = lay_out(code), result.fndesc
    if image is None:
        return
    environments = []
    for name, place in image.names.items():
        found = lookup_environment(name) if name.startswith("_ZN08NumbaEnv") else None
        if found is not None:
            texts = [text_of(value) for value in found.consts]
            if None in texts:
                return
            environments.append((place, tuple(text or "" for text in texts)))
    wrapper = names.llvm_cpython_wrapper_name
    if environments and {wrapper, table_name(wrapper), names.llvm_func_name} <= image.names.keys():
        entry, called, table = (image.names[name] for name in (names.llvm_func_name, wrapper, table_name(wrapper)))
        identity = identity_of(function, key)
        save(function, key, Kept(identity, tuple(image), entry, called, table, tuple(environments)))
