"""How fubini compiles: one decorator, one cache that can never run stale code.

numba keys its cache on the file of the compiled function alone, so a change in a file that it
calls would go unseen. Here the key is a digest over every kernel source of the package and the
versions of numba and numpy; the files lie in the user's cache folder, so a read-only install works.
"""

from __future__ import annotations

import functools
import hashlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import sigutils, types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator
from numba.core.types.misc import unliteral


@functools.cache
def source_digest() -> str:
    """Digest over all kernel sources of the package and the versions that compile them."""
    root = Path(__file__).parent
    digest = hashlib.sha256(f"{sys.version}|{numba.__version__}|{np.__version__}".encode())
    for path in sorted([*root.rglob("_kernels*.py"), root / "_jit.py"]):
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


def _plain(kind: Any) -> Any:
    """The type that an argument is compiled for: constants and all integers become int64."""
    kind = unliteral(kind)
    return types.int64 if isinstance(kind, types.Integer) else kind


def kernel(function: Callable[..., Any]) -> Any:
    """Compile on first call, keep on disk. IEEE arithmetic, no ``fastmath``; releases the GIL.

    Integer arguments are always int64 inside: numba by itself compiles a function again for every width and
    for every constant that it is called with.
    """
    compiled = _compile(function)
    try:
        cache_folder().mkdir(parents=True, exist_ok=True)
        compiled._cache = _Cache(function)
    except OSError:  # no writable folder: compile in every process
        pass
    return compiled


def inner(function: Callable[..., Any]) -> Any:
    """As ``kernel``, for functions that only other kernels call.

    Nothing is made for calls from Python, nor kept on disk: the code of the caller contains it.
    """
    return _compile(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def _compile(function: Callable[..., Any], **options: bool) -> Any:
    compiled = numba.njit(nogil=True, error_model="numpy", **options)(function)
    compile_for = compiled.compile

    def compile_plain(signature: Any) -> Any:
        arguments, _ = sigutils.normalize_signature(signature)
        return compile_for(tuple(_plain(a) for a in arguments))

    compiled.compile = compile_plain
    return compiled
