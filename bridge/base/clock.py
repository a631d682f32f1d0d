"""The clocks of the service. All timing is monotonic; only what leaves the service gets a date."""

from __future__ import annotations

import time


def now() -> float:
    """Monotonic seconds, the same clock as the event loop's and the time stamps of frames."""
    return time.monotonic()


def suspended_s() -> tuple[float, float]:
    """Between these two lies for how many seconds the machine has been suspended since it was booted."""
    before = time.monotonic()
    running_or_not = time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else before
    after = time.monotonic()
    return running_or_not - after, running_or_not - before


def epoch_ns(at: float) -> int:
    """A monotonic time as nanoseconds since 1970 by the wall clock as it is set now."""
    return time.time_ns() - time.monotonic_ns() + round(at * 1e9)
