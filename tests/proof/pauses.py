"""How long the machine itself stood still: a process that only sleeps 5 ms, ahead of all others.

``python -m tests.proof.pauses FILE`` appends a line ``begin end`` for each sleep that took over ``FROM_S``
too long: from when it was due until it ended, in seconds of the monotonic clock.
"""

from __future__ import annotations

import os
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Final

FROM_S: Final = 0.002
_SLEEP_S: Final = 0.005
_PRIORITY: Final = 90


def watch(path: Path) -> None:
    with suppress(OSError):  # without the right to do so it counts the waiting for others, too
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    with path.open("a", encoding="ascii", buffering=1) as log:
        before = time.monotonic()
        while True:
            time.sleep(_SLEEP_S)
            now = time.monotonic()
            due = before + _SLEEP_S
            if now - due > FROM_S:
                log.write(f"{due:.6f} {now:.6f}\n")
            before = now


def paused_ms(path: Path, begin: float, end: float) -> float:
    """The pauses within this time, in ms."""
    total = 0.0
    for line in reversed(path.read_text(encoding="ascii").splitlines(keepends=True)):
        if not line.endswith("\n"):  # it is being written
            continue
        first, last = (float(word) for word in line.split())
        if last < begin:
            break
        total += max(0.0, min(last, end) - max(first, begin))
    return total * 1000


if __name__ == "__main__":
    watch(Path(sys.argv[1]))
