"""Detection, without a system call, of a process that was stopped for long.

A process can be stopped for any time between reading the clock and what follows: most likely at the end of
the reading itself, where that is a system call (as on many virtual machines). A signal that has become due
meanwhile is delivered before the process executes anything else.
"""

from __future__ import annotations

import signal


class StoodStill(Exception):
    """The process was stopped for longer than its next action may wait."""


class WatchdogTimer:
    """Timer that never rings, for a master that shares its process. ``rang``: the time it was last set to has
    passed. While it ``breaks_in``, ringing raises ``StoodStill`` wherever the process is."""

    rang = False
    breaks_in = False

    def set(self, seconds: float) -> None:
        """Ring after ``seconds``, unless set again before. 0: not at all."""


class SignalAlarm(WatchdogTimer):
    """Timer that takes SIGALRM and the real-time interval timer of the process. Made in its main thread."""

    def __init__(self) -> None:
        signal.signal(signal.SIGALRM, lambda number, frame: self.ring())

    def set(self, seconds: float) -> None:
        self.rang = False
        signal.setitimer(signal.ITIMER_REAL, seconds)

    def ring(self) -> None:
        """Note that the time has passed."""
        self.rang = True
        if self.breaks_in:
            self.breaks_in = False
            raise StoodStill
