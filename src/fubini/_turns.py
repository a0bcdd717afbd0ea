"""Who compiles what: no kernel twice at the same time, and two processes where nothing is compiled yet.

A process claims a kernel by a file beside the kernel's place in the cache; another one that needs the same waits, and
loads what the first has made. At its first claim a process starts a helper, ``fubini._helper``, that goes through the
kernels in another order.
"""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

#: Seconds after which the claim of a process is void, whether it lives or not.
LONGEST = 120.0
#: Set in the environment of a helper, which starts no other; or by those who want none.
ALONE = "FUBINI_COMPILE_ALONE"
#: Set in the environment of a process, its kernels check every index (see ``fubini._compiler``).
CHECK = "FUBINI_CHECK_INDICES"

_started: list[subprocess.Popen[bytes] | None] = []


@contextmanager
def turn(index: Path) -> Iterator[None]:
    """Hold the claim on the kernel whose cache index this is, unless it is compiled; wait for another holder."""
    claim = index.with_suffix(".claim")
    held = False
    if claim.exists() or not index.exists():
        if not _started:
            _begin(index.parent)
        held = _take(claim, index)
    try:
        yield
    finally:
        if held:
            claim.unlink(missing_ok=True)


def _take(claim: Path, index: Path) -> bool:
    """Claim a kernel; False when another process has compiled it meanwhile, or nothing can be written."""
    until = time.monotonic() + LONGEST
    while time.monotonic() < until:
        try:
            with claim.open("x") as file:
                file.write(str(os.getpid()))
            return True
        except FileExistsError:
            if _is_void(claim):
                claim.unlink(missing_ok=True)
                continue
        except OSError:
            return False
        time.sleep(0.02)
        if index.exists() and not claim.exists():
            return False
    return False


def _is_void(claim: Path) -> bool:
    """Whether the process that made a claim has ended without taking it back, or takes too long."""
    try:
        if time.time() - claim.stat().st_mtime > LONGEST:
            return True
        owner = claim.read_text()
        if os.name == "posix" and owner:
            os.kill(int(owner), 0)
    except ProcessLookupError:
        return True
    except (OSError, ValueError):
        pass  # taken back at this moment, or of another user
    return False


def _begin(folder: Path) -> None:
    """Say that the first run compiles, and start the helper where there is a core for it."""
    _started.append(None)
    if ALONE in os.environ:
        return
    if sys.stderr is not None and not any(folder.glob("*.nbi")):
        sys.stderr.write("fubini: first run, compiling for about 15 seconds, once\n")
        sys.stderr.flush()
    if cores() < 2 or not Path(sys.executable).name.lower().startswith("python"):
        return
    root = str(Path(__file__).parent.parent)
    code = f"import sys; sys.path.append({root!r}); from fubini import _helper; _helper.main({__file__!r})"
    try:
        helper = subprocess.Popen(
            [sys.executable, "-c", code],
            env={**os.environ, ALONE: "1"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except OSError:
        return
    _started.append(helper)
    atexit.register(_end, helper)


def cores() -> int:
    """Processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _end(helper: subprocess.Popen[bytes]) -> None:
    """Do not leave the helper behind: what it has not compiled yet, nobody may need."""
    if helper.poll() is None:
        helper.terminate()
        helper.wait(10.0)
