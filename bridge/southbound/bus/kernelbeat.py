"""Bursts in the kernel's broadcast manager, and what is done where it does not take them. Sans-I/O but for
the message to the manager."""

from __future__ import annotations

import errno
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from bridge.southbound.bus import bcm
from bridge.southbound.bus.frame import Frame
from bridge.southbound.bus.softbeat import SoftBeat

_SHORTEST: Final = 4
_RETRY_S: Final = 0.001
_PATIENCE_S: Final = 0.01
_LINK_IS_GONE: Final = (errno.ENETDOWN, errno.ENODEV, errno.ENXIO, errno.ENOTCONN)


class Manager(Protocol):
    """A connected socket of the broadcast manager. Closing it ends all of its bursts."""

    def send(self, message: bytes, /) -> int: ...

    def close(self) -> None: ...


@dataclass(slots=True)
class _Job:
    """What the kernel has taken; it surely runs until ``until``."""

    frames: tuple[Frame, ...]
    period_s: float
    count: int
    until: float


@dataclass(slots=True)
class _Wish:
    """What the kernel has not taken yet. Without ``frames`` its burst is to end."""

    frames: tuple[Frame, ...]
    period_s: float
    count: int
    at_once: bool
    since: float


class KernelBeat:
    """Finite bursts by COB-ID. Times are monotonic seconds; ``clock`` tells how late a message went out.

    A message that the manager refuses (no memory, no room) leaves the old data on the bus, so it is sent
    again every millisecond. After ten the bursts are given up: the manager is closed, which ends all of
    them for certain, and a timer of ours goes on with them until ``open`` gives another manager.

    ``beat``, ``silence``, ``silence_all`` and ``on_time`` raise OSError where the interface is gone or down.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self.refusal = ""
        """Why the bursts have been given up; empty while the kernel takes them."""
        self._manager: Manager | None = None
        self._jobs: dict[int, _Job] = {}
        self._wishes: dict[int, _Wish] = {}
        self._retry_at: float | None = None
        self._soft = SoftBeat()
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
        self._wishes.clear()
        self._retry_at = None
        if self._manager:
            self._manager.close()
            self._manager = None

    def beat(
        self, frames: tuple[Frame, ...], now: float, period_s: float, count: int, *, at_once: bool
    ) -> Frame | None:
        """Start or renew a burst; gives the frame that whoever calls has to send now, if any."""
        can_id = frames[0].can_id
        # The kernel counts the first frame of a burst, so one of a frame or two ends before it can be
        # renewed. What is that slow needs no kernel: a round sends it.
        if self._manager is None or count < _SHORTEST:
            return self._soft.beat(frames, now, period_s, count, at_once=at_once)
        waiting = self._wishes.get(can_id)
        wish = _Wish(frames, period_s, count, at_once, now)
        if waiting:
            wish.at_once, wish.since = at_once or waiting.at_once, waiting.since
        if not self._try(can_id, wish, now) and can_id in self._soft:
            return self._soft.beat(frames, now, period_s, count, at_once=at_once)
        return None

    def silence(self, can_id: int, now: float) -> None:
        """End the burst of this identifier."""
        self._soft.silence(can_id)
        waiting = self._wishes.get(can_id)
        if can_id in self._jobs or waiting:
            self._try(can_id, _Wish((), 0.0, 0, False, waiting.since if waiting else now), now)

    def silence_all(self, now: float) -> None:
        self._soft.clear()
        for can_id in {**self._jobs, **self._wishes}:
            self.silence(can_id, now)

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
        job = self._jobs.get(can_id)
        # Refilling keeps the phase of a burst that runs and cannot wake one that has ended.
        runs = job is not None and job.period_s == wish.period_s and now < job.until
        try:
            self._manager.send(_message(can_id, wish, start=not runs))
            if job is not None and runs and job.until <= self._clock() < now + wish.count * wish.period_s:
                # It may have ended between ``now`` and the refill. After a longer time nothing that was right
                # then may go on.
                self._manager.send(_message(can_id, wish, start=True))
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
        self._soft.silence(can_id)
        if wish.frames:
            # The last frame of a burst comes up to a period before its count of periods is over.
            until = now + (wish.count - 2) * wish.period_s
            self._jobs[can_id] = _Job(wish.frames, wish.period_s, wish.count, until)
        else:
            self._jobs.pop(can_id, None)
        return True

    def _give_up(self, error: OSError, now: float) -> None:
        going = {can_id: (job.frames, job.period_s, job.count) for can_id, job in self._jobs.items()}
        going |= {can_id: (wish.frames, wish.period_s, wish.count) for can_id, wish in self._wishes.items()}
        self._forget_manager()
        self.refusal = error.strerror or str(error)
        for frames, period_s, count in going.values():
            if frames:
                first = self._soft.beat(frames, now, period_s, count, at_once=True)
                self._first += [first] if first else []


def _message(can_id: int, wish: _Wish, *, start: bool) -> bytes:
    if not wish.frames:
        return bcm.delete(can_id)
    return bcm.setup(wish.frames, wish.period_s, wish.count, start=start, at_once=wish.at_once)
