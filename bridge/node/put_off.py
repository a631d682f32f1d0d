"""An NMT command that takes a node out of Operational, put off until its drives have taken over their stopped
words. Sans-IO.

An RPDO of transmission type 0…240 takes effect with the next SYNC, and in Operational alone (CiA 301
§7.3.2.2.1, §7.5.2.35): a command right behind the stopped words would cancel them.
"""

from __future__ import annotations

from typing import Final

from bridge.canopen.nmt import NmtCommand

CANCELS_WORDS: Final = (
    NmtCommand.STOP,
    NmtCommand.ENTER_PRE_OPERATIONAL,
    NmtCommand.RESET_COMMUNICATION,
)
"""What leaves Operational with drives that may go on as they were told."""
_ROUND_S: Final = 0.001
"""SYNC that is due in this round goes out at its end: the command follows in the next one."""
_LATE_S: Final = 0.02
"""A process that is later than this may have sent no SYNC meanwhile."""


class PutOff:
    """At most one command. Times are monotonic seconds."""

    def __init__(self) -> None:
        self.command: NmtCommand | None = None
        self._at = 0.0
        self._wait_s = 0.0
        self._is_last = False

    def begin(self, command: NmtCommand, now: float, wait_s: float) -> None:
        """``command`` in ``wait_s``, or when the one that waits already would have gone out: who asks
        again and again does not put it off for ever."""
        if self.command is None:
            self._at, self._wait_s, self._is_last = now + wait_s, wait_s, False
        self.command = command

    def clear(self) -> None:
        self.command = None

    def on_time(self, now: float) -> NmtCommand | None:
        """The command, if it is to go out now. A process that comes late waits once more, and only once."""
        if self.command is None or now < self._at:
            return None
        if not self._is_last:
            self._is_last = True
            self._at = now + (self._wait_s if now - self._at > _LATE_S else _ROUND_S)
            return None
        command, self.command = self.command, None
        return command

    def next_deadline(self) -> float | None:
        return None if self.command is None else self._at
