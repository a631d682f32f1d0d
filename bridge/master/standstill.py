"""Whether the process was stopped for long, told without asking anybody.

A process can be stopped for any time between a look at the clock and what follows it: most likely at the end
of the look itself, where that is a system call (the clock of many virtual machines is). A signal that has
become due meanwhile is delivered before anything else of the process is executed.
"""

from __future__ import annotations

import signal


class Alarm:
    """``rang`` after the time it was last set to. This one never rings: for a master that is not alone in its
    process."""

    rang = False

    def set(self, seconds: float) -> None:
        """Ring then, unless set again before. 0: not at all."""


class SignalAlarm(Alarm):
    """Takes SIGALRM and the real-time interval timer of the process. Made in its main thread."""

    def __init__(self) -> None:
        signal.signal(signal.SIGALRM, lambda number, frame: self._ring())

    def set(self, seconds: float) -> None:
        self.rang = False
        signal.setitimer(signal.ITIMER_REAL, seconds)

    def _ring(self) -> None:
        self.rang = True
