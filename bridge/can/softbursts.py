"""Bursts for buses whose driver has no broadcast manager: the same promise, kept by a timer of ours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.can.burstend import BurstEnd
from bridge.canopen.frame import Frame

_SYNC: Final = 0x080


@dataclass(slots=True)
class _Job:
    frames: tuple[Frame, ...]
    period_s: float
    left: int
    due: float
    ending: BurstEnd | None
    place: int = 0

    def take(self, now: float) -> Frame | None:
        """The next frame; None where the burst has ended."""
        if self.ending is not None and now >= self.ending.at:
            return self.ending.frame
        frame = self.frames[self.place]
        self.place = (self.place + 1) % len(self.frames)
        return frame


class SoftBursts:
    """Finite bursts by COB-ID. Times are monotonic seconds; ``due`` gives the frames to be sent."""

    def __init__(self) -> None:
        self._jobs: dict[int, _Job] = {}

    def start(
        self,
        frames: tuple[Frame, ...],
        now: float,
        period_s: float,
        count: int,
        *,
        at_once: bool,
        ending: BurstEnd | None = None,
    ) -> Frame | None:
        """Start or renew; gives the frame that is to be sent right now."""
        job = self._jobs.get(frames[0].can_id)
        if job is None or job.period_s != period_s:
            job = self._jobs[frames[0].can_id] = _Job(frames, period_s, count - 1, now + period_s, ending)
            return job.take(now)
        if len(frames) != len(job.frames):
            job.place = 0
        job.frames = frames
        job.left = count
        job.ending = ending
        return job.take(now) if at_once else None

    def __contains__(self, can_id: int) -> bool:
        return can_id in self._jobs

    def end(self, can_id: int) -> None:
        self._jobs.pop(can_id, None)

    def clear(self) -> None:
        self._jobs.clear()

    def next_deadline(self) -> float | None:
        return min((job.due for job in self._jobs.values()), default=None)

    def due(self, now: float) -> list[Frame]:
        """What is to be sent by ``now``. Periods that were missed are missed: no bunch is sent."""
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
            missed = int((now - job.due) / job.period_s)
            job.left -= missed
            job.due += (missed + 1) * job.period_s
        # SYNC last: an RPDO that is due with it is taken over by it and not by the next one.
        frames.sort(key=lambda frame: frame.can_id == _SYNC)
        return frames
