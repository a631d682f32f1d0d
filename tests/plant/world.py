"""The one clock of a plant: what is to happen when, and a digest of what has happened.

Nothing here looks at another clock, and nothing depends on addresses or on the order of sets: the same plan
gives the same run on any machine.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from heapq import heappop, heappush
from struct import Struct
from typing import Final

from bridge.canopen.frame import Frame

BEGIN_S: Final = 1000.0
_NOON_NS: Final = 1_795_262_400_000_000_000
"""2026-11-21 12:00 UTC: the wall clock at the beginning."""
_STAMP: Final = Struct("<dII")

Act = Callable[[], None]


class Timer:
    """One thing to be done; ``cancel`` may be called at any time."""

    __slots__ = ("act", "at")

    def __init__(self, at: float, act: Act) -> None:
        self.at = at
        self.act: Act | None = act

    def cancel(self) -> None:
        self.act = None


class World:
    """Time passes by ``run_until`` alone. That may be called while something is being done: a process that
    stands still lets everything else go on in the middle of its turn."""

    def __init__(self) -> None:
        self.now = BEGIN_S
        self.wall_step_s = 0.0
        """By how much somebody has set the wall clock."""
        self.turns = 0
        """Number of processes in a turn, each but the first within a look at the clock of the one before."""
        self.log: list[str] | None = None
        """Lines of what has happened, for somebody who looks at a run."""
        self._queue: list[tuple[float, int, Timer]] = []
        self._order = 0
        self._digest = hashlib.sha256()

    def at(self, time: float, act: Act) -> Timer:
        """Have ``act`` done at this time, or now where that is over; of one moment in the order of calls."""
        timer = Timer(time if time > self.now else self.now, act)
        self._order += 1
        heappush(self._queue, (timer.at, self._order, timer))
        return timer

    def after(self, seconds: float, act: Act) -> Timer:
        return self.at(self.now + seconds, act)

    def run_until(self, end: float) -> None:
        queue = self._queue
        while queue and queue[0][0] <= end:
            at, _, timer = heappop(queue)
            act = timer.act
            if act is None:
                continue
            timer.act = None
            if at > self.now:
                self.now = at
            act()
        if end > self.now:
            self.now = end

    def epoch_ns(self, at: float) -> int:
        return _NOON_NS + round((at - BEGIN_S + self.wall_step_s) * 1e9)

    def tell(self, what: str) -> None:
        """Take ``what`` into the digest of the run, with its time."""
        line = f"{self.now - BEGIN_S:.6f} {what}"
        self._digest.update(line.encode())
        if self.log is not None:
            self.log.append(line)

    def tell_frame(self, sender: str, frame: Frame) -> None:
        """Take a frame that has been on the wire into the digest. There are many: only for somebody who
        looks they are written out."""
        self._digest.update(_STAMP.pack(self.now, frame.can_id, len(frame.data)) + frame.data)
        self._digest.update(sender.encode())
        if self.log is not None:
            self.log.append(f"{self.now - BEGIN_S:.6f} {sender} {frame!r}")

    @property
    def hash(self) -> str:
        """Digest of everything told so far."""
        return self._digest.hexdigest()
