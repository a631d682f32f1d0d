"""Memory is locked where that is permitted, and not at all where it would only be limited."""

from __future__ import annotations

import errno
import resource
import subprocess
import sys

from bridge.base.memory_lock import lock_memory

UNLIMITED = """
import re, sys
from pathlib import Path
from bridge.base.memory_lock import lock_memory
why = lock_memory()
locked = re.search(r"VmLck:\\s+(\\d+)", Path("/proc/self/status").read_text())
print(why or "locked", int(locked[1]) > 1000)
"""


def test_all_that_is_there_is_locked_first_and_then_what_comes() -> None:
    said: list[int] = []

    def mlockall(flags: int) -> int:
        said.append(flags)
        return 0

    assert lock_memory(mlockall, lambda: False) == ""
    assert said == [1, 1 | 2 | 4]


def test_a_refusal_is_told() -> None:
    assert lock_memory(lambda flags: errno.EPERM, lambda: False) == "Operation not permitted"


def test_with_a_limit_nothing_is_locked_because_allocations_would_fail_later() -> None:
    said: list[int] = []
    assert "LimitMEMLOCK" in lock_memory(lambda flags: said.append(flags) or 0, lambda: True)
    assert not said


def test_what_it_says_is_what_the_kernel_has() -> None:
    done = subprocess.run([sys.executable, "-c", UNLIMITED], capture_output=True, text=True, check=True)
    why, _, is_locked = done.stdout.strip().rpartition(" ")
    if resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY:
        assert why == "locked"
    assert (why == "locked") == (is_locked == "True")
