"""How long bridge and drives waited for the CPU, which they share here with their owners; and how long the
machine itself stood still.

``python -m tests.proof.waits FOLDER NAME ...`` is a process that only sleeps 5 ms at a time, ahead of all
others. To ``FOLDER/pauses`` it appends ``begin end`` for each sleep that took over ``FROM_S`` too long: from
when it was due until it ended. ``FOLDER/NAME.pid`` is a link to the folder of a process in /proc; to
``FOLDER/NAME.waits`` it appends ``begin end waited`` where from one look to the next, ``LOOK_S`` later or
more, the kernel's account of its main thread's waiting (``schedstat``: ready while another ran) has grown.
All in seconds of the monotonic clock; the account of a user-mode kernel goes by ticks of 10 ms.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

FROM_S: Final = 0.002
SLEEP_S: Final = 0.005
LOOK_S: Final = 0.05
"""A look at the accounts takes a millisecond from everybody else, and is no pause of the machine."""
_PRIORITY: Final = 90


def watch(folder: Path, names: list[str]) -> None:
    with suppress(OSError):  # without the right to do so it counts the waiting for others, too
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    accounts = [Account(folder, name) for name in names]
    with (folder / "pauses").open("a", encoding="ascii", buffering=1) as pauses:
        before = look_at = time.monotonic()
        while True:
            time.sleep(SLEEP_S)
            now = time.monotonic()
            due = before + SLEEP_S
            if now - due > FROM_S:
                pauses.write(f"{due:.6f} {now:.6f}\n")
            if now >= look_at:
                look_at = now + LOOK_S
                for account in accounts:
                    account.look(now)
            before = time.monotonic()


class Account:
    """Of one process, whose number may change: a bridge is killed and started anew."""

    def __init__(self, folder: Path, name: str) -> None:
        self._link = folder / f"{name}.pid"
        self._path = folder / f"{name}.waits"
        self._path.touch()
        self._before = 0.0
        self._looked = float("-inf")
        self._process = ""
        self._file = -1
        """Stays open: to find it anew each time would take ten times as long."""

    def look(self, now: float) -> None:
        try:
            words = self._read().split()
        except OSError:
            return
        begin, self._looked = self._looked, now
        waited = int(words[1]) / 1e9 if len(words) > 1 else 0.0
        if waited != self._before:
            # A new process begins its account at nothing; a wait is added when it is over.
            grown, self._before = max(0.0, waited - self._before), waited
            with self._path.open("a", encoding="ascii") as log:
                log.write(f"{min(begin, now - grown):.6f} {now:.6f} {grown:.6f}\n")

    def _read(self) -> bytes:
        """Raises OSError where there is no such process."""
        process = str(self._link.readlink())
        if process != self._process:
            if self._file >= 0:
                os.close(self._file)
            self._process, self._file = "", -1
            self._file = os.open(self._link / "schedstat", os.O_RDONLY)
            self._process = process
        return os.pread(self._file, 100, 0)


def follow(folder: Path, name: str, pid: int) -> None:
    """The process ``name`` is this one from now on."""
    fresh = folder / f"{name}.new"
    fresh.symlink_to(f"/proc/{pid}")
    fresh.replace(folder / f"{name}.pid")


def waited_ms(folder: Path, name: str, begin: float, end: float) -> float:
    """What this process can have waited from ``begin`` to ``end``, in ms."""
    found = 0.0
    for first, last, waited in _lines(folder / f"{name}.waits", begin):
        found += min(waited, max(0.0, min(last, end) - max(first, begin)))
    return found * 1000


def longest_wait_ms(folder: Path, name: str, begin: float, end: float) -> float:
    """The longest that this process can have waited at a stretch from ``begin`` to ``end``, in ms."""
    waits = _lines(folder / f"{name}.waits", begin)
    return max((waited for first, last, waited in waits if last > begin and first < end), default=0.0) * 1000


def most_waited_ms(folder: Path, name: str, begin: float, end: float, within_s: float) -> float:
    """The most that this process waited within so many seconds, from ``begin`` to ``end``, in ms."""
    lines = _lines(folder / f"{name}.waits", begin)
    return _most_ms(
        [(last, waited) for first, last, waited in lines if first < end and last > begin], within_s
    )


def most_paused_ms(folder: Path, begin: float, end: float, within_s: float) -> float:
    """The most that the machine stood still within so many seconds, from ``begin`` to ``end``, in ms."""
    lines = _lines(folder / "pauses", begin)
    return _most_ms([(last, last - first) for first, last in lines if first < end and last > begin], within_s)


def _most_ms(spans: list[tuple[float, float]], within_s: float) -> float:
    """``spans`` are ends and lengths in seconds."""
    sums = [sum(other for at, other in spans if last - within_s < at <= last) for last, _ in spans]
    return max(sums, default=0.0) * 1000


def paused_ms(folder: Path, begin: float, end: float) -> float:
    """The pauses within this time, in ms."""
    pauses = _lines(folder / "pauses", begin)
    return sum(max(0.0, min(last, end) - max(first, begin)) for first, last in pauses) * 1000


def _lines(path: Path, since: float) -> Iterator[list[float]]:
    """The numbers of each line, the youngest first, back to one that begins before ``since``."""
    for line in reversed(path.read_text(encoding="ascii").splitlines(keepends=True)):
        if not line.endswith("\n"):  # it is being written
            continue
        numbers = [float(word) for word in line.split()]
        yield numbers
        if numbers[0] < since:
            return


if __name__ == "__main__":
    watch(Path(sys.argv[1]), sys.argv[2:])
