"""How long the bridge and the drives waited for the CPU, which they share here with their owners.

The kernel's own account (``/proc/PID/schedstat``: ns that the main thread was ready and another ran), looked
at every few ms. On a user-mode kernel it goes by ticks of 10 ms.
"""

from __future__ import annotations

import threading
import time
from bisect import bisect_left
from collections import deque
from pathlib import Path
from typing import Final

_LOOK_S: Final = 0.01
_MOST: Final = 12_000


class Waits:
    """Of one process, whose number may change: a bridge is killed and started anew."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self._seen: deque[tuple[float, float]] = deque(maxlen=_MOST)
        """When, and what was waited until then, both in seconds."""

    def look(self, now: float) -> None:
        try:
            words = Path(f"/proc/{self.pid}/schedstat").read_text(encoding="ascii").split()
        except OSError:
            return
        if len(words) > 1:
            self._seen.append((now, int(words[1]) / 1e9))

    def between(self, begin: float, end: float) -> float:
        """Seconds of waiting from ``begin`` to ``end``; what stands at their edges is left out."""
        seen = list(self._seen)
        first, last = bisect_left(seen, (begin, 0.0)), bisect_left(seen, (end, float("inf"))) - 1
        if first >= last:
            return 0.0
        # A new process begins its account at nothing.
        steps = zip(seen[first:last], seen[first + 1 : last + 1], strict=True)
        return sum(max(0.0, after[1] - before[1]) for before, after in steps)


class Watch:
    """Looks at several of them from a thread."""

    def __init__(self, *waits: Waits) -> None:
        self._waits = waits
        self._running = True
        self._thread = threading.Thread(target=self._run, daemon=True, name="waits")
        self._thread.start()

    def _run(self) -> None:
        while self._running:
            now = time.monotonic()
            for waits in self._waits:
                waits.look(now)
            time.sleep(_LOOK_S)

    def close(self) -> None:
        self._running = False
        self._thread.join(1.0)
