"""Age of telegrams: fresh means recent, not just read.

A telegram may wait in buffers, the network's, its sender's and ours, and be read long after the controller
has hung. So each carries the earliest time at which it can have arrived. Its drive's timer runs from that
time, and a telegram that can have waited for longer than ``BOUND_MS`` does not count at all.

The rule for one connection:

- What is read has arrived since the connection was last seen empty.
- A client that has more under way than one that waits for answers may have filled the buffers on the way,
  also those that we cannot see. From then on nothing of it counts until it has been calm: too few arrivals,
  for long enough, to be a backlog that drains at full speed.

Pure: times are monotonic seconds, given from outside.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from bridge.command.messages.request import STOP_ACTIONS, Action, Request

GRAIN_MS: Final = 25
"""Shortest wait in ms that can be told from none. A telegram can be this much older than assumed: it is the
way through the bridge's buffers in ``worst_case_stop_ms``."""

NOW_S: Final = 0.001
"""Time in seconds from reading to handling that counts as none; part of the grain."""

BOUND_MS: Final = 500
"""Longest wait in ms with which a telegram counts. A busy machine delays a request, and an OPC UA server may
take half a second over a large subscription. The owner gains no time by the wait: its drive's timer runs from
when the request can have arrived."""

_GRAIN_S: Final = GRAIN_MS / 1000 - NOW_S

CALM_S: Final = 0.1
_CALM_MOST: Final = 32
"""Arrivals in ``CALM_S`` below which there is no backlog: one drains at more than a thousand a second."""


HANG_MS: Final = 100
"""Shortest hang of the event loop in ms, a time without a turn. Where the connections cannot be seen, a
shorter one is not noticed."""
_SEEN: Final = frozenset(("opcua", "modbus"))
"""Protocols whose connections are seen; with a lease it may be any."""


def way_ms(control: str) -> int:
    """Longest time in ms by which a telegram of the drive's controller may be older than assumed."""
    if control == "none":
        return 0
    return GRAIN_MS if control in _SEEN else GRAIN_MS + HANG_MS


NEVER: Final = float("-inf")
"""Time of a telegram that may have waited for any time."""
TAKEN_LATE: Final = STOP_ACTIONS | {Action.WRITE, Action.RELEASE_CONTROL}
"""Actions that are taken however late: nothing is too old to stop a drive. Whether a write stops one is seen
when it has been decoded."""


_AFTER_HANG_S: Final = 1.0
"""Time in seconds after a hang in which a first request may have been sent before it."""


def arrival_of(request: Request, now: float) -> float:
    """Earliest time at which ``request`` can have arrived; one that was made in this process arrives now."""
    return now if request.received_at is None else min(request.received_at, now)


def limit_ms_of(request: Request, timeout_ms: int) -> int:
    """Longest wait in ms with which it counts for a drive with this time-out (0: none)."""
    return min(BOUND_MS, timeout_ms) if timeout_ms else BOUND_MS


def is_stale(request: Request, now: float, timeout_ms: int) -> bool:
    """Whether it can have waited too long to count."""
    received_at = request.received_at
    return received_at is not None and now - received_at > limit_ms_of(request, timeout_ms) / 1000


class LoopPulse(NamedTuple):
    """Knowledge of the event loop about itself (``bridge.northbound.pulse`` keeps it).

    ``at``: it has looked at every open connection since, and has read what it found, except what it is about
    to read. ``steady_since``: when it last went on after a hang or a stop of its process.
    """

    at: float
    steady_since: float


class Inflow:
    """Age of what arrives through one connection.

    ``is_hidden``: the connections cannot be seen, and this is everything from one asker. What arrives after a
    hang may have waited somewhere, and cannot be told from what has not.
    """

    def __init__(self, now: float, look: LoopPulse, *, is_hidden: bool = False) -> None:
        # What comes first may have waited in the listening socket.
        self._empty_at = look.at
        self._open_since = now
        self._is_hidden = is_hidden
        self.is_open = True
        """Whether it is read from, as far as this was told."""
        self._is_crowded = False
        self._calm_since = now
        self._steady_since = look.steady_since
        self._came = 0
        if is_hidden and now - look.steady_since < _AFTER_HANG_S:
            self._crowd(now)

    def shut(self, now: float) -> None:
        """Note that nothing more is read for now, so that buffers on the way may fill."""
        if self.is_open:
            self.is_open = False
            self._crowd(now)

    def reopen(self, now: float) -> None:
        if not self.is_open:
            self.is_open = True
            self._open_since = now
            self._crowd(now)

    def _crowd(self, now: float) -> None:
        self._is_crowded = True
        self._calm_since = now
        self._came = 0

    def arrive(self, now: float, look: LoopPulse, *, crowded: bool = False) -> float:
        """Note that something was read; gives the earliest time at which it can have arrived, or ``NEVER``.

        ``crowded``: more may be left, or more is under way than there should be.
        """
        since = max(self._empty_at, look.at) if look.at > self._open_since else self._empty_at
        if crowded:
            self._open_since = now
            self._crowd(now)
            return NEVER
        self._empty_at = now
        if self._is_hidden and look.steady_since > self._steady_since:
            self._crowd(now)
        self._steady_since = look.steady_since
        if self._is_crowded and not self._has_calmed(look):
            return NEVER
        return now if now - since <= _GRAIN_S else since

    def _has_calmed(self, look: LoopPulse) -> bool:
        """Judge one span of ``CALM_S`` after the other, in which the loop has hung at no time."""
        begin = max(self._calm_since, look.steady_since)
        if look.at - begin < CALM_S:
            self._came = self._came + 1 if begin == self._calm_since else 1
            self._calm_since = begin
            return False
        self._is_crowded = self._came >= _CALM_MOST
        self._calm_since = look.at
        self._came = 1
        return not self._is_crowded
