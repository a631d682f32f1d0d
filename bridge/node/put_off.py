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
"""NMT commands that leave Operational with drives that may go on as they were told."""
_ROUND_S: Final = 0.001
"""Delay in seconds to the next round: a SYNC that is due in this one goes out at its end."""
_LATE_S: Final = 0.02
"""Delay in seconds beyond which a late process may have sent no SYNC meanwhile."""


class PutOff:
    """At most one delayed NMT command. Times are monotonic seconds."""

    def __init__(self) -> None:
        self.command: NmtCommand | None = None
        self._at = 0.0
        self._wait_s = 0.0
        self._is_last = False

    def begin(self, command: NmtCommand, now: float, wait_s: float) -> None:
        """Delay ``command`` by ``wait_s``, or until the one that waits already would have gone out: repeated
        requests do not put it off for ever."""
        if self.command is None:
            self._at, self._wait_s, self._is_last = now + wait_s, wait_s, False
        self.command = command

    def clear(self) -> None:
        self.command = None

    def on_time(self, now: float) -> NmtCommand | None:
        """The command, if it is to go out now. A late process waits once more, and only once."""
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
