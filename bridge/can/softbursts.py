"""Bursts for buses whose driver has no broadcast manager: the same promise, kept by a timer of ours."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, inf
from typing import Final

from bridge.can.burstend import Burst
from bridge.canopen.frame import Frame

_SYNC: Final = 0x080
_ROUNDING: Final = 1e-6
"""Fraction of a period: a time that is a multiple of it but for its last bits counts as one."""


@dataclass(slots=True)
class _SoftBurst:
    burst: Burst
    left: int
    due: float
    place: int = 0

    def take(self, now: float) -> Frame | None:
        """The next frame; None where the burst has ended."""
        frames, ending = self.burst.frames, self.burst.ending
        if ending is not None and now >= ending.at:
            return ending.frame
        frame = frames[self.place]
        self.place = (self.place + 1) % len(frames)
        return frame


class SoftBursts:
    """Finite bursts by COB-ID. Times are monotonic seconds; ``due`` gives the frames to be sent.

    Those ``in_step`` are due at the multiples of their period, so that those of one period are due together
    and wake their process once. Only the first interval of such a burst is shorter than its period.
    """

    def __init__(self, *, in_step: bool = False) -> None:
        self._in_step = in_step
        self._jobs: dict[int, _SoftBurst] = {}
        self._next = inf
        """Time at which the first of them is due."""

    def start(self, burst: Burst, now: float, *, at_once: bool) -> Frame | None:
        """Start or renew; gives the frame that is to be sent right now."""
        job = self._jobs.get(burst.can_id)
        if job is None or job.burst.period_s != burst.period_s:
            due = self._step_after(now, burst.period_s) if self._in_step else now + burst.period_s
            job = self._jobs[burst.can_id] = _SoftBurst(burst, burst.total - 1, due)
            self._look()
            return job.take(now)
        if len(burst.frames) != len(job.burst.frames):
            job.place = 0
        job.burst, job.left = burst, burst.total
        return job.take(now) if at_once else None

    def __contains__(self, can_id: int) -> bool:
        return can_id in self._jobs

    def end(self, can_id: int) -> None:
        if self._jobs.pop(can_id, None):
            self._look()

    def clear(self) -> None:
        self._jobs.clear()
        self._look()

    def _look(self) -> None:
        self._next = min((job.due for job in self._jobs.values()), default=inf)

    @staticmethod
    def _step_after(time: float, period_s: float) -> float:
        return (floor(time / period_s + _ROUNDING) + 1) * period_s

    def next_deadline(self) -> float | None:
        return self._next if self._jobs else None

    def due(self, now: float) -> list[Frame]:
        """Frames to be sent by ``now``. Periods that were missed are left out: no bunch is sent."""
        if now < self._next:
            return []
        frames: list[Frame] = []
        for can_id, job in list(self._jobs.items()):
            if job.due > now:
                continue
            if job.left <= 0:
                del self._jobs[can_id]
                continue
            frame = job.take(now)
            if frame is None:
                del self._jobs[can_id]
                continue
            frames.append(frame)
            job.left -= 1
            period_s = job.burst.period_s
            missed = int((now - job.due) / period_s)
            job.left -= missed
            job.due += (missed + 1) * period_s
            if self._in_step:  # the same number for all of one period, which a sum of floats is not
                job.due = round(job.due / period_s) * period_s
        self._look()
        # SYNC last: an RPDO that is due with it is taken over by it and not by the next one.
        frames.sort(key=lambda frame: frame.can_id == _SYNC)
        return frames
