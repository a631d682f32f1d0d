"""How ``make bench`` tells its figures: one line each, ratios beside times. The report, which is
``tests/bench/__main__``, gets them by the file that the environment names."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

TOLD: Final = "BENCH_TOLD"
"""The environment's name for the file of what is told, a JSON array a line: file, what, figure, number."""


def show(what: str, figure: str) -> None:
    print(f"  {what:<62} {figure}", flush=True)
    _tell(what, figure, None)


def record(name: str, number: float) -> None:
    """A number that the report works with, under this name."""
    _tell(name, "", number)


def _tell(what: str, figure: str, number: float | None) -> None:
    path = os.environ.get(TOLD)
    if path:
        file = os.environ.get("PYTEST_CURRENT_TEST", "").partition("::")[0]
        with Path(path).open("a", encoding="utf-8") as told:
            told.write(json.dumps([file, what, figure, number]) + "\n")


@contextlib.contextmanager
def as_the_service() -> Iterator[str]:
    """Run with the scheduling of ``systemd/drivebridge.service``; gives what it is, in words."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(10))
    except PermissionError:
        yield "without the service's real-time priority (not allowed here)"
        return
    try:
        yield "with the service's real-time priority"
    finally:
        os.sched_setscheduler(0, *before)


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


def lateness(times: Sequence[float], period_s: float) -> str:
    """How late each of some periodic moments was, against the earliest phase, and how many are missing."""
    phases = sorted((at - times[0]) % period_s for at in times)
    # The phase before the widest empty part of the period is the latest; the one after it is "in time".
    gaps = [(after - before, after) for before, after in itertools.pairwise(phases)]
    gaps.append((phases[0] + period_s - phases[-1], phases[0]))
    first = max(gaps)[1]
    late_us = sorted((phase - first) % period_s * 1e6 for phase in phases)
    missing = round((times[-1] - times[0]) / period_s) + 1 - len(times)
    longest = max(after - before for before, after in itertools.pairwise(times))
    return (
        f"median {statistics.median(late_us):.0f} µs   99 % {late_us[len(late_us) * 99 // 100]:.0f} µs   "
        f"longest pause {longest * 1e3:.2f} ms   {missing} of {len(times) + missing} left out"
    )
