"""Kernels compiled in an earlier process, called without numba.

A file of the cache holds one kernel for one list of argument types: its code (``_image``), which addresses this needs
and what it makes arrays of. numba's part in running the code is in three of its extension modules, which are loaded by
themselves. The compiled function checks its arguments (``_guard``), so that arrays of other types never reach the code.

Whatever is not as expected, a damaged file, another processor, a symbol that is missing, an option of numba, is no
error: ``load`` returns None, and numba is imported and compiles.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import importlib.util
import itertools
import marshal
import os
import sys
import threading
from collections.abc import Callable, Iterable
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, FileFinder
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fubini._cache import cache_folder, package_folder, source_digest
from fubini._image import Image, place

#: numpy's letters of the types of arrays: truth values, integers, floating point numbers.
LETTERS = "?bBhHiIlLqQfd"
#: Of numbers.
SCALARS: dict[type, str] = {int: "I", float: "F", np.float64: "F", bool: "B"}

#: What a pointer into numpy's and Python's objects finds: checked before the first kernel is loaded.
DIMENSIONS, DTYPE, FLAGS, BYTE_ORDER, NUMBER = 24, 56, 64, 26, 28
CONTIGUOUS, ALIGNED, WRITABLE = 0x1, 0x100, 0x400
LENGTH, ITEMS = 16, tuple.__basicsize__
SWAPPED = ord(">" if sys.byteorder == "little" else "<")

#: What the table of a guard holds.
OTHERWISE, ARRAY_TYPE, FLOAT_TYPE, TABLE = range(4)

#: Settings of numba that change nothing of the code.
HARMLESS = {"NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS"}
EXTENSIONS = "_helperlib", "_dynfunc", "core.runtime._nrt_python"


def layout_is_known() -> bool:
    """Whether Python and numpy lay out their objects as the guards of kernels expect it."""
    if sys.byteorder != "little" or object.__basicsize__ != 16 or ctypes.sizeof(ctypes.c_void_p) != 8:
        return False
    array = np.zeros((2, 3), np.int32)
    array.flags.writeable = False
    at, dtype, pair = id(array), id(array.dtype), (array, None)
    number = ctypes.c_int.from_address
    return (
        number(at + DIMENSIONS).value == 2
        and ctypes.c_void_p.from_address(at + DTYPE).value == dtype
        and number(at + FLAGS).value & 0xFFF == CONTIGUOUS | ALIGNED | 0x4
        and number(dtype + NUMBER).value == array.dtype.num
        and ctypes.string_at(dtype + BYTE_ORDER - 1, 2) == b"i="
        and ctypes.c_ssize_t.from_address(id(pair) + LENGTH).value == 2
        and ctypes.c_void_p.from_address(id(pair) + ITEMS).value == at
    )


@functools.cache
def host() -> str:
    """What tells processors apart; empty where kernels are not kept in this form."""
    settings = {name for name in os.environ if name.startswith("NUMBA_")} - HARMLESS
    if settings or os.path.exists(".numba_config.yaml") or not layout_is_known():
        return ""
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
            lines = list(itertools.takewhile(str.strip, file))  # of the first core
    except OSError:
        return ""
    told = {name.strip(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
    return "|".join(told.get(name, "") for name in ("vendor_id", "cpu family", "model", "stepping", "flags"))


def key_of(arguments: Iterable[Any]) -> str | None:
    """The types of arguments: of arrays a letter, the dimensions and r if read-only; None for others than these."""
    parts = [_key(argument) for argument in arguments]
    return " ".join(part for part in parts if part) if all(parts) else None


def _key(argument: Any) -> str | None:
    kind = type(argument)
    if kind is np.ndarray:
        flags, dtype = argument.flags, argument.dtype
        if dtype.char not in LETTERS or not (dtype.isnative and flags.c_contiguous and flags.aligned):
            return None
        return f"{dtype.char}{argument.ndim}{'' if flags.writeable else 'r'}"
    return SCALARS.get(kind)


class Kept(NamedTuple):
    """What a file holds.

    identity : digest, kernel, types and processor. image : the code. entry, wrapper, table : places of the
    function, of what Python calls, of the table of the guard. environments : places of what the code finds Python's
    objects by, and the texts of these objects.
    """

    identity: tuple[str, ...]
    image: tuple[Any, ...]
    entry: int
    wrapper: int
    table: int
    environments: tuple[tuple[int, tuple[str, ...]], ...]


def text_of(value: Any) -> str | None:
    """What stands for an object that code needs: that of a data type, none for the class of arrays, None for others."""
    if value is np.ndarray:
        return ""
    return str(value.str) if isinstance(value, np.dtype) and value.char in LETTERS else None


def identity_of(function: Callable[..., Any], key: str) -> tuple[str, ...]:
    """What a file must have been made for."""
    code = function.__code__
    return source_digest(), function.__module__, function.__qualname__, str(code.co_firstlineno), key, host()


def path_of(function: Callable[..., Any], key: str) -> Path:
    """The file of a kernel for these types, on this processor."""
    digest = hashlib.sha256("\0".join(identity_of(function, key)).encode()).hexdigest()[:16]
    return cache_folder() / f"{function.__name__}-{digest}.code"


def save(function: Callable[..., Any], key: str, kept: Kept) -> None:
    """Write a file, at once or not at all; nothing where nothing can be written."""
    path, content = path_of(function, key), marshal.dumps(tuple(kept))
    draft = path.with_suffix(f".{os.getpid()}-{threading.get_ident()}")
    try:
        draft.write_bytes(hashlib.sha256(content).digest() + content)
        os.replace(draft, path)
    except OSError:
        _remove(draft)


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        pass


def read(function: Callable[..., Any], key: str) -> Kept | None:
    """What the file of a kernel holds; a file that holds something else is removed."""
    path = path_of(function, key)
    try:
        content = path.read_bytes()
    except OSError:
        return None
    if hashlib.sha256(content[32:]).digest() == content[:32]:
        kept = Kept(*marshal.loads(content[32:]))
        if kept.identity == identity_of(function, key):
            return kept
    _remove(path)
    return None


@functools.cache
def extensions() -> tuple[Any, ...]:
    """numba's modules in C: those of numba if it is imported, else by themselves."""
    folder = package_folder("numba")
    if folder is None:
        raise ImportError("numba")
    found = []
    for name in EXTENSIONS:
        full = f"numba.{name}"
        module = sys.modules.get(full)
        if module is None:
            inside = folder.joinpath(*name.split(".")[:-1])
            spec = FileFinder(str(inside), (ExtensionFileLoader, EXTENSION_SUFFIXES)).find_spec(full)
            if spec is None or spec.loader is None:
                raise ImportError(full)
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
            # numba itself is not imported: it finds the same module again when it is
            sys.modules.pop(full, None)
        found.append(module)
    return tuple(found)


@functools.cache
def address_of(name: str) -> int | None:
    """The address of a symbol that compiled code needs, where numba finds it."""
    helpers, _, runtime = extensions()
    for prefix, module in (("", helpers), ("numba_", helpers), ("NRT_", runtime)):
        if name.startswith(prefix) and name[len(prefix) :] in module.c_helpers:
            found: int = module.c_helpers[name[len(prefix) :]]
            return found
    for library in (None, "libm.so.6"):
        try:
            return ctypes.addressof(ctypes.c_char.in_dll(ctypes.CDLL(library), name))
        except (ValueError, OSError):
            pass
    return None


def load(function: Callable[..., Any], key: str, otherwise: Callable[..., Any]) -> Any:
    """What calls the kernel with arguments of these types, and ``otherwise`` with others; None where it is not kept."""
    kept = read(function, key) if host() else None
    if kept is None:
        return None
    try:
        _, make, _ = extensions()
    except ImportError:
        return None
    base = place(Image(*kept.image), address_of)
    if base is None:
        return None
    entries = [otherwise, np.ndarray, np.float64]
    table = (ctypes.c_void_p * TABLE).from_address(base + kept.table)
    table[:] = [id(entry) for entry in entries]
    environments = []
    for at, texts in kept.environments:
        environment = make.Environment(function.__globals__)
        environment.consts.extend(np.dtype(text) if text else np.ndarray for text in texts)
        ctypes.c_void_p.from_address(base + at).value = id(environment)
        environments.append(environment)
    return make.make_function(
        sys.modules[function.__module__], function.__name__, function.__doc__ or "", base + kept.wrapper,
        environments[0], (entries, environments),
    )  # fmt: skip
