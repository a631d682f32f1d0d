"""Bursts in the kernel's broadcast manager, and what to do when it refuses them. Sans-IO except for the
message to the manager."""

from __future__ import annotations

import errno
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, Protocol

from bridge.can import bcm
from bridge.can.burstend import SHORTEST, Burst, sequence
from bridge.can.softbursts import SoftBursts
from bridge.canopen.frame import Frame

_RETRY_S: Final = 0.001
_PATIENCE_S: Final = 0.01
_ON_ITS_WAY_S: Final = 0.001
"""A message that took longer than this to reach the kernel has too many frames before the deadline."""
_ENDED: Final = float("-inf")
_NOTHING: Final = Burst((), 0.0, 0)
_LINK_IS_GONE: Final = (errno.ENETDOWN, errno.ENODEV, errno.ENXIO, errno.ENOTCONN)


class Manager(Protocol):
    """A connected socket of the broadcast manager. Closing it ends all of its bursts."""

    def send(self, message: bytes, /) -> int: ...

    def close(self) -> None: ...


@dataclass(slots=True)
class _Wish:
    """Burst that the kernel is to send. Without frames the burst is to end."""

    burst: Burst
    at_once: bool
    since: float


@dataclass(slots=True)
class _KernelBurst:
    """Burst that the kernel has taken; it surely runs until ``until``."""

    wish: _Wish
    until: float


class _Sent(NamedTuple):
    frames: int
    """Frames that the kernel has got."""
    until: float
    """The burst surely runs so long."""
    is_fresh: bool
    """True if it was started, and not refilled."""


class KernelBursts:
    """Finite bursts by COB-ID. Times are monotonic seconds; ``clock`` tells how late a message went out.

    A message that the manager refuses (no memory, no room) leaves the old data on the bus, so it is repeated
    every millisecond. After ten attempts the bursts are given up: closing the manager ends all of them for
    certain, and a timer of ours continues them until ``open`` gives another manager.

    ``start``, ``end``, ``end_all`` and ``on_time`` raise OSError where the interface is gone or down.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self.refusal = ""
        """Reason why the bursts have been given up; empty while the kernel takes them."""
        self._manager: Manager | None = None
        self._jobs: dict[int, _KernelBurst] = {}
        self._held: set[int] = set()
        """Identifiers of the bursts that the kernel holds, whether they still run or not."""
        self._wishes: dict[int, _Wish] = {}
        self._retry_at: float | None = None
        self._soft = SoftBursts()
        self._first: list[Frame] = []

    def open(self, manager: Manager) -> None:
        self._manager = manager
        self.refusal = ""

    def close(self) -> None:
        """End every burst."""
        self._forget_manager()
        self._soft.clear()
        self._first.clear()
        self.refusal = ""

    def _forget_manager(self) -> None:
        self._jobs.clear()
        self._held.clear()
        self._wishes.clear()
        self._retry_at = None
        if self._manager:
            self._manager.close()
            self._manager = None

    def start(self, burst: Burst, now: float, *, at_once: bool) -> Frame | None:
        """Start or renew a burst; returns the frame that the caller has to send now, if any."""
        # The kernel counts the first frame of a burst, so one of a frame or two ends before it can be
        # renewed. What is that slow needs no kernel: a round sends it.
        if self._manager is None or burst.total < SHORTEST:
            return self._soft.start(burst, now, at_once=at_once)
        waiting = self._wishes.get(burst.can_id)
        wish = _Wish(burst, at_once, now)
        if waiting:
            wish.at_once, wish.since = at_once or waiting.at_once, waiting.since
        if not self._try(burst.can_id, wish, now) and burst.can_id in self._soft:
            return self._soft.start(burst, now, at_once=at_once)
        return None

    def end(self, can_id: int, now: float) -> None:
        """End the burst of this identifier."""
        self._soft.end(can_id)
        waiting = self._wishes.get(can_id)
        if can_id in self._jobs or waiting:
            self._try(can_id, _Wish(_NOTHING, False, waiting.since if waiting else now), now)

    def end_all(self, now: float) -> None:
        self._soft.clear()
        for can_id in {**self._jobs, **self._wishes}:
            self.end(can_id, now)

    def next_deadline(self) -> float | None:
        times = (self._retry_at, self._soft.next_deadline())
        return min((time for time in times if time is not None), default=None)

    def on_time(self, now: float) -> list[Frame]:
        """Try again what the kernel has refused; gives the frames to be sent now."""
        if self._retry_at is not None and now >= self._retry_at:
            for can_id, wish in list(self._wishes.items()):
                self._try(can_id, wish, now)
        first, self._first = self._first, []
        return first + self._soft.due(now)

    def _try(self, can_id: int, wish: _Wish, now: float) -> bool:
        """Tell the kernel; False where it does not take it now."""
        if self._manager is None:
            return False
        try:
            count = self._hand_over(can_id, wish, now)
        except OSError as error:
            if error.errno in _LINK_IS_GONE:
                raise
            self._wishes[can_id] = wish
            self._retry_at = now + _RETRY_S
            if now >= wish.since + _PATIENCE_S:
                self._give_up(error, now)
            return False
        self._wishes.pop(can_id, None)
        if not self._wishes:
            self._retry_at = None
        self._soft.end(can_id)
        if count:
            # The last frame of a burst comes up to a period before its count of periods is over.
            self._jobs[can_id] = _KernelBurst(wish, now + (count - 2) * wish.burst.period_s)
        else:
            self._jobs.pop(can_id, None)
        return True

    def _hand_over(self, can_id: int, wish: _Wish, now: float) -> int:
        """Give the kernel a burst, or end it; how many frames it has got.

        The kernel counts frames but has to keep a time: after a slow hand-over it gets a second message with
        fewer frames. Refilling keeps the phase of a running burst but cannot wake one that has ended, and
        this process may be stopped at any line: a burst that may have ended is started anew, or no renewal
        would ever wake it.
        """
        job = self._jobs.get(can_id)
        runs = job is not None and job.wish.burst.period_s == wish.burst.period_s and now < job.until
        until = job.until if job and runs else _ENDED
        ending = wish.burst.ending
        stale_at = now + wish.burst.total * wish.burst.period_s
        asked, at = wish, max(now, self._clock()) if ending else now
        while True:
            count, until, is_fresh = self._send(can_id, asked, at, until)
            if not count or not (runs or ending):
                return count
            after = self._clock()
            if after >= stale_at:
                # After deadman_ms the old data must not be restarted. The next round renews it.
                return self._end(can_id)
            if after >= until and not is_fresh:
                asked = wish
            elif ending and after - at > _ON_ITS_WAY_S:
                asked = replace(wish, at_once=False)
            else:
                return count
            at = after

    def _send(self, can_id: int, wish: _Wish, now: float, until: float) -> _Sent:
        """Start the burst, or refill the one that surely runs until ``until``."""
        assert self._manager is not None
        start = until <= now
        frames, count, head = sequence(wish.burst, now, extra=int(wish.at_once and not start))
        period_s = wish.burst.period_s
        if not count:
            return _Sent(self._end(can_id), _ENDED, is_fresh=False)
        if start:
            # What runs might send one of the new frames before it goes back to their beginning.
            self._end(can_id)
            until = now + (count - 1) * period_s
        elif head:
            # The kernel takes the new frames before it goes back to their beginning, and may send one
            # between the two. So it goes back first, with frames that are all alike; with one more, so that
            # it cannot come to their end before the next message is there.
            alike = (frames[0],) * len(frames)
            message = bcm.setup(alike, period_s, head + 1, start=False, at_once=False, anew=True)
            self._manager.send(message)
            until = min(until, now + head * period_s)
        at_once, anew = wish.at_once, bool(head)
        self._manager.send(bcm.setup(frames, period_s, count, start=start, at_once=at_once, anew=anew))
        self._held.add(can_id)
        return _Sent(count, until, is_fresh=start)

    def _end(self, can_id: int) -> int:
        """The kernel refuses to delete a burst that it does not have."""
        assert self._manager is not None
        if can_id in self._held:
            # Before the message: who is interrupted right after it must not delete the burst twice.
            self._held.remove(can_id)
            try:
                self._manager.send(bcm.delete(can_id))
            except OSError:
                self._held.add(can_id)
                raise
        return 0

    def _give_up(self, error: OSError, now: float) -> None:
        going = {can_id: job.wish for can_id, job in self._jobs.items()} | self._wishes
        self._forget_manager()
        self.refusal = error.strerror or str(error)
        for wish in going.values():
            if wish.burst.frames:
                first = self._soft.start(wish.burst, now, at_once=True)
                self._first += [first] if first else []
