"""How fubini compiles: two decorators, one cache that can never run stale code.

A kernel compiled in an earlier process is loaded without numba (``fubini._load``), which takes longer to import than
everything else here; numba is imported when something is to be compiled (``fubini._build``).
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fubini._load import key_of, load


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
        return functools.partial(kernel, allocates=allocates, inlined=inlined)
    return Kernel(function, allocates, inlined)


def inner(function: Callable[..., Any] | None = None, *, allocates: bool = False, inlined: bool = False) -> Any:
    """As ``kernel``, for functions that only other kernels call.

    Nothing is made for calls from Python, nor kept on disk: the code of the caller contains it. ``inlined`` puts it
    into the code of every caller: a call hands an array on as seven numbers, which costs a short function dear. By
    itself the compiler does so only where there is one caller.
    """
    if function is None:
        return functools.partial(inner, allocates=allocates, inlined=inlined)
    return Inner(function, allocates, inlined)


class Inner:
    """A function that only kernels call: numba comes to know it when one of these is compiled, in few runs."""

    def __init__(self, function: Callable[..., Any], allocates: bool, inlined: bool) -> None:
        self.py_func, self._allocates, self._inlined = function, allocates, inlined

    @functools.cached_property
    def dispatcher(self) -> Any:
        """What numba makes of the function."""
        from fubini._build import part

        return part(self.py_func, self._allocates, self._inlined)

    @property
    def _numba_type_(self) -> Any:
        return self.dispatcher._numba_type_

    def get_call_template(self, arguments: Any, keywords: Any) -> Any:
        """As numba's dispatchers."""
        return self.dispatcher.get_call_template(arguments, keywords)

    def get_overload(self, signature: Any) -> Any:
        """As numba's dispatchers."""
        return self.dispatcher.get_overload(signature)


class Deferred:
    """What kernels call, made by numba when one of them is compiled."""

    def __init__(self, make: Callable[[], Any]) -> None:
        self._make = make

    @functools.cached_property
    def _numba_type_(self) -> Any:
        from numba.core.registry import cpu_target

        made = self._make()
        cpu_target.typing_context.refresh()
        return cpu_target.typing_context.resolve_value_type(made)


def reader(kind: type, fields: str) -> Deferred:
    """What kernels read a named tuple of arrays with, from its words: see ``fubini._reference``."""

    def make() -> Any:
        from fubini._reference import reader as read

        return read(kind, fields)

    return Deferred(make)


_loading = threading.RLock()


class Kernel(functools.partial[Any]):
    """A function that Python and kernels call.

    What it calls in turn changes: first ``_first``, then what is loaded for the types of the arguments, which calls
    what was there before for other types; and for good numba's dispatcher, once something is to be compiled.
    """

    py_func: Callable[..., Any]
    loaded: dict[str, Any]  # what calls the code that needs no numba, by types of arguments
    _options: tuple[bool, bool]
    _part: Inner
    _asking: set[int]  # threads in a first call
    _kept: tuple[Any, ...]

    def __new__(cls, function: Callable[..., Any], allocates: bool, inlined: bool) -> Kernel:
        self = super().__new__(cls, function)
        functools.update_wrapper(self, function)
        self.py_func, self._options = function, (allocates, inlined)
        self._part = Inner(function, allocates, inlined)
        self.loaded, self._asking = {}, set()
        self._calls(self._first)
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """What it is made of: numba asks for it of a kernel within a closure."""
        return Kernel, (self.py_func, *self._options)

    def _calls(self, target: Callable[..., Any]) -> None:
        self._kept = self.func, target  # a call of the other may go on
        self.__setstate__((target, (), {}, self.__dict__))  # type: ignore[attr-defined]

    @property
    def _numba_type_(self) -> Any:
        return self._part._numba_type_

    @functools.cached_property
    def dispatcher(self) -> Any:
        """What numba makes of the function."""
        from fubini._build import whole

        return whole(self.py_func, self._part, self._options[0])

    def compile(self, kinds: tuple[Any, ...]) -> None:
        """Compile for arguments of these types of numba, unless that is kept."""
        self.dispatcher.compile(kinds)

    @property
    def keys(self) -> set[str]:
        """What it has been loaded or compiled for, as ``key_of`` tells types."""
        if "dispatcher" not in self.__dict__:
            return set(self.loaded)
        from fubini._guard import key_of_types

        return {*self.loaded, *(key_of_types(kinds) or str(kinds) for kinds in self.dispatcher.overloads)}

    def _first(self, *arguments: Any, **named: Any) -> Any:
        """A call with types of arguments that nothing was loaded for."""
        plain = [int(a) if isinstance(a, np.integer) else a for a in arguments]
        key, thread = None if named else key_of(plain), threading.get_ident()
        loaded = self._load(key) if key is not None and thread not in self._asking else None
        if loaded is None:
            with _loading:
                self._calls(self.dispatcher)
            return self.dispatcher(*arguments, **named)
        # code that refuses these arguments too calls this function again
        self._asking.add(thread)
        try:
            return loaded(*plain)
        finally:
            self._asking.discard(thread)

    def _load(self, key: str) -> Any:
        """What calls the kernel for these types; None where it is not kept."""
        with _loading:
            if key not in self.loaded:
                loaded = load(self.py_func, key, self.func)
                if loaded is None:
                    return None
                self.loaded[key] = loaded
                self._calls(loaded)
            return self.loaded[key]
