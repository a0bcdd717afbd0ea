"""Where compiled kernels are kept, and what they depend on.

numba keys its cache on the file of the compiled function alone, so a change in a file that it
calls would go unseen. Here the key is a digest over every kernel source of the package and the
versions of numba and numpy; the files lie in the user's cache folder, so a read-only install works.
"""

from __future__ import annotations

import functools
import hashlib
import importlib
import os
import sys
from importlib.machinery import PathFinder
from pathlib import Path

import numpy as np

from fubini._turns import CHECK

#: Modules that compile, link and load kernels, or lay out what these take.
COMPILING = (
    "_build", "_builder", "_cache", "_compiler", "_guard", "_image", "_inference", "_jit", "_load", "_lowering",
    "_operations", "_packed", "_reference",
)  # fmt: skip


def package_folder(name: str) -> Path | None:
    """Folder of an installed package, without importing it; None where that cannot be told."""
    found = getattr(sys.modules[name], "__spec__", None) if name in sys.modules else PathFinder.find_spec(name)
    return Path(found.origin).parent if found is not None and found.origin else None


def _version(name: str) -> bytes:
    """What tells the version of a package apart: its file of this, which is read in a tenth of a millisecond."""
    folder = package_folder(name)
    try:
        if folder is not None:
            return (folder / "_version.py").read_bytes()
    except OSError:
        pass
    return str(importlib.import_module(name).__version__).encode()


@functools.cache
def source_digest() -> str:
    """Digest over all kernel sources of the package and the versions that compile them."""
    root = Path(__file__).parent
    digest = hashlib.sha256(f"{sys.version}|{np.__version__}|{CHECK in os.environ}|".encode())
    digest.update(_version("numba") + _version("llvmlite"))
    compiling = (root / f"{name}.py" for name in COMPILING)
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
