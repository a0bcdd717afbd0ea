"""How fubini compiles: one decorator, one cache that can never run stale code.

numba keys its cache on the file of the compiled function alone, so a change in a file that it
calls would go unseen. Here the key is a digest over every kernel source of the package and the
versions of numba and numpy; the files lie in the user's cache folder, so a read-only install works.
"""

from __future__ import annotations

import functools
import gc
import hashlib
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np
from llvmlite.binding import Linkage, parse_assembly
from numba.core import sigutils, types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator
from numba.core.codegen import JITCodeLibrary
from numba.core.runtime import rtsys
from numba.core.types.misc import unliteral
from numpy.typing import NDArray

from fubini._compiler import KernelCompiler
from fubini._turns import CHECK, turn


@functools.cache
def source_digest() -> str:
    """Digest over all kernel sources of the package and the versions that compile them."""
    root = Path(__file__).parent
    digest = hashlib.sha256(f"{sys.version}|{numba.__version__}|{np.__version__}|{CHECK in os.environ}".encode())
    compiling = (root / f"{name}.py" for name in ("_jit", "_compiler", "_reference"))
    for path in sorted([*root.rglob("_kernels*.py"), *compiling]):
        digest.update(str(path.relative_to(root)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:20]


def cache_folder() -> Path:
    """Folder of the compiled kernels: ``FUBINI_CACHE_DIR``, or the user's cache folder."""
    base = os.environ.get("FUBINI_CACHE_DIR")
    if base is None:
        home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
        base = os.path.join(home, "fubini")
    return Path(base) / source_digest()


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

    def _optimize_functions(self, ll_module: Any) -> None:
        pass

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
        built = self._codegen._module_pass_manager(loop_vectorize=False, slp_vectorize=False)
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
            return super().compile_extra(func)

    return _Compiler


_COMPILERS = {library: _compiler(library) for library in (_Part, _Whole)}


def readonly(array: Any, kind: type) -> NDArray[Any]:
    """A read-only view for kernels that only look: one array type, no copy of what is frozen already."""
    view: NDArray[Any] = np.ascontiguousarray(array, kind).view()
    view.flags.writeable = False
    return view


def kernel(function: Callable[..., Any] | None = None, *, allocates: bool = False, inlined: bool = False) -> Any:
    """Compile on first call, keep on disk. IEEE arithmetic, no ``fastmath``; releases the GIL.

    Integer arguments are always int64 inside: numba by itself compiles a function again for every width and
    for every constant that it is called with. Functions that make arrays must say so (``allocates``): the others are
    compiled without the counting of references, which takes longer to compile than most of what is counted.
    """
    if function is None:
        return partial(kernel, allocates=allocates, inlined=inlined)
    compiled, part = _compile(function, _Whole, _nrt=allocates), inner(function, allocates=allocates, inlined=inlined)
    # other kernels link the part
    compiled.get_call_template, compiled.get_overload = part.get_call_template, part.get_overload
    try:
        cache_folder().mkdir(parents=True, exist_ok=True)
        compiled._cache = _Cache(function)
    except OSError:  # no writable folder: compile in every process
        pass
    return compiled


def inner(function: Callable[..., Any] | None = None, *, allocates: bool = False, inlined: bool = False) -> Any:
    """As ``kernel``, for functions that only other kernels call.

    Nothing is made for calls from Python, nor kept on disk: the code of the caller contains it. ``inlined`` puts it
    into the code of every caller: a call hands an array on as seven numbers, which costs a short function dear. By
    itself the compiler does so only where there is one caller.
    """
    if function is None:
        return partial(inner, allocates=allocates, inlined=inlined)
    return _Inner(function, _nrt=allocates, forceinline=inlined)


class _Inner:
    """A function that only kernels call: numba comes to know it when one of these is compiled, in few runs."""

    def __init__(self, function: Callable[..., Any], **options: bool) -> None:
        self.py_func, self._options = function, options

    @functools.cached_property
    def dispatcher(self) -> Any:
        """What numba makes of the function."""
        return _compile(self.py_func, _Part, no_cpython_wrapper=True, **self._options)

    @property
    def _numba_type_(self) -> Any:
        return self.dispatcher._numba_type_

    def get_call_template(self, arguments: Any, keywords: Any) -> Any:
        """As numba's dispatchers."""
        return self.dispatcher.get_call_template(arguments, keywords)

    def get_overload(self, signature: Any) -> Any:
        """As numba's dispatchers."""
        return self.dispatcher.get_overload(signature)


@contextmanager
def _seldom_collected() -> Iterator[None]:
    """Compiling makes millions of objects that stay: looking through them as usual takes a sixth of the time."""
    usual = gc.get_threshold()
    if usual[0] > 0:
        gc.set_threshold(100_000, 20, 100)
    try:
        yield
    finally:
        gc.set_threshold(*usual)


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
        with _seldom_collected(), turn(Path(kept)) if kept else nullcontext():
            entry = compile_for(arguments)
        made = compiled.overloads[arguments].signature.return_type
        if not options["_nrt"] and any(isinstance(part, types.Array) for part in getattr(made, "types", (made,))):
            raise TypeError(f"{function.__name__} returns an array: declare it with allocates=True")
        return entry

    compiled.compile = compile_plain
    return compiled
