"""How ``make bench`` prints its figures: one line each, ratios beside times."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence


def show(what: str, figure: str) -> None:
    print(f"  {what:<62} {figure}", flush=True)


def milliseconds(seconds: Sequence[float]) -> str:
    """Median and worst of some times."""
    return f"median {statistics.median(seconds) * 1e3:7.2f} ms   worst {max(seconds) * 1e3:7.2f} ms"


def cpu_us(work: Callable[[], object], count: int, rounds: int = 5) -> float:
    """CPU microseconds of one of ``count`` units that ``work`` does; the best of some rounds."""
    best = float("inf")
    for _ in range(rounds):
        begin = time.process_time()
        work()
        best = min(best, time.process_time() - begin)
    return best * 1e6 / count
