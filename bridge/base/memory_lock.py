"""Locks the process into memory: a page that has to be read from a disk would delay every drive.

Only for the bus process: a child that executes another program, such as a front, inherits no lock
(mlockall(2)).
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
from collections.abc import Callable
from pathlib import Path
from typing import Final

_CURRENT: Final = 1
_FUTURE: Final = 2
_ONFAULT: Final = 4

MlockAll = Callable[[int], int]
"""mlockall(2): gives 0, or else a number of errno."""


def lock_memory(mlockall: MlockAll | None = None, is_limited: Callable[[], bool] | None = None) -> str:
    """Lock all present and future memory of the process; returns why that was refused, or nothing.

    Future pages are locked when first touched: otherwise the stacks of threads, which are hardly used, would
    take gigabytes. With a limit nothing is locked, because an allocation beyond it would fail.
    """
    if (is_limited or _is_limited)():
        return "the limit for locked memory is not infinity (LimitMEMLOCK= of the unit, ulimit -l)"
    lock = mlockall or _mlockall
    for flags in (_CURRENT, _CURRENT | _FUTURE | _ONFAULT):
        error = lock(flags)
        if error:
            return os.strerror(error)
    return ""


def _mlockall(flags: int) -> int:
    libc = ctypes.CDLL(None, use_errno=True)
    return ctypes.get_errno() if libc.mlockall(flags) else 0


def _is_limited() -> bool:
    soft, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    return soft != resource.RLIM_INFINITY and not _may_exceed_limits()


_IPC_LOCK: Final = 1 << 14
"""CAP_IPC_LOCK of capabilities(7): no limit counts."""


def _may_exceed_limits() -> bool:
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/status").read_text(encoding="ascii", errors="replace").splitlines():
            if line.startswith("CapEff:"):
                return bool(int(line.split()[1], 16) & _IPC_LOCK)
    return False
