"""Bursts for buses whose driver has no broadcast manager: the same promise, kept by a timer of ours."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.southbound.bus.frame import Frame


@dataclass(slots=True)
class _Job:
    frame: Frame
    period_s: float
    left: int
    due: float


class SoftBeat:
    """Finite bursts by COB-ID. Times are monotonic seconds; ``due`` gives the frames to be sent."""

    def __init__(self) -> None:
        self._jobs: dict[int, _Job] = {}

    def beat(self, frame: Frame, now: float, period_s: float, count: int, *, at_once: bool) -> bool:
        """Start or renew; True where the frame is to be sent right now."""
        job = self._jobs.get(frame.can_id)
        if job is None or job.period_s != period_s:
            self._jobs[frame.can_id] = _Job(frame, period_s, count - 1, now + period_s)
            return True
        job.frame = frame
        job.left = count
        return at_once

    def silence(self, can_id: int) -> None:
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
            frames.append(job.frame)
            job.left -= 1
            missed = int((now - job.due) / job.period_s)
            job.left -= missed
            job.due += (missed + 1) * job.period_s
        return frames
