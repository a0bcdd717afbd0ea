"""Is there a CAD kernel, and do its installed packages fit together?

Several distributions put their files into the one folder ``OCP``; pip does not see that the last
one installed overwrites the others. Their versions are therefore compared before the first use.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from importlib import metadata

from fubini.errors import DependencyError

#: Distributions that install the module ``OCP``.
WHEELS = ("cadquery-ocp", "cadquery-ocp-novtk", "cadquery-ocp-proxy")

_INSTALL = "pip install 'fubini[build123d]' (or 'fubini[cadquery]')"
_MEND = "pip install --force-reinstall 'build123d<0.13' 'cadquery>=2.8,<2.9'"


def require_kernel() -> None:
    """Raise ``DependencyError`` with the command that mends it unless OCP can be used."""
    installed = {name: version for name in WHEELS if (version := _version(name))}
    problem = mismatch(installed.items())
    if problem:
        raise DependencyError(problem, fix=_mend(installed))
    try:
        module = importlib.import_module("OCP")
        importlib.import_module("OCP.TopoDS")
    except ModuleNotFoundError as error:
        if error.name != "OCP":
            raise DependencyError(f"the CAD kernel OCP is incomplete: {error}", fix=_mend(installed)) from error
        raise DependencyError("reading CAD needs the CAD kernel OCP, which is not installed", fix=_INSTALL) from error
    except ImportError as error:
        raise DependencyError(f"the CAD kernel OCP cannot be imported: {error}", fix=_mend(installed)) from error
    loaded = getattr(module, "__version__", "")
    problem = mismatch([*installed.items(), ("OCP itself", loaded)]) if loaded else None
    if problem:
        raise DependencyError(problem, fix=_mend(installed))


def mismatch(versions: Iterable[tuple[str, str]]) -> str | None:
    """What is wrong with these (package, version) pairs of one OCP, or None when they agree.

    >>> mismatch([("cadquery-ocp", "7.9.3.1.1"), ("OCP itself", "7.9.3.1")])
    >>> mismatch([("cadquery-ocp", "7.8.1.1"), ("cadquery-ocp-novtk", "8.0.1.1")])
    'the installed packages of the CAD kernel differ: cadquery-ocp 7.8.1.1, cadquery-ocp-novtk 8.0.1.1'
    """
    pairs = list(versions)
    if len({tuple(version.split(".")[:3]) for _, version in pairs}) <= 1:
        return None
    return "the installed packages of the CAD kernel differ: " + ", ".join(f"{n} {v}" for n, v in pairs)


def _mend(installed: Mapping[str, str]) -> str:
    """The command that puts one kernel in place of the packages found."""
    remove = "pip uninstall -y " + " ".join(installed) + " && " if installed else ""
    return f"run: {remove}{_MEND}"


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None
