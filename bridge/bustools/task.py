"""Bus tasks, the work of a single command on a bus: frames and time in, frames out. Sans-IO."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Final

from bridge.canopen.frame import Frame
from bridge.canopen.sdo import SdoChannel

NOTHING_KNOWN: Final[Mapping[int, str]] = MappingProxyType({})


class BusTask(ABC):
    """Base of all tasks. Times are monotonic seconds. Frames to be sent go into ``_frames``. The caller
    counts them: ``sent`` is the number of all, ``unsent`` of those that the bus did not take in time."""

    sent: int = 0
    unsent: int = 0

    def __init__(self) -> None:
        self._frames: list[Frame] = []

    @abstractmethod
    def is_finished(self, now: float) -> bool: ...

    @abstractmethod
    def on_frame(self, frame: Frame) -> None: ...

    def on_time(self, now: float) -> None:
        """Do nothing: a task takes silence for an answer."""
        del now

    @abstractmethod
    def next_deadline(self) -> float | None: ...

    def take_frames(self) -> list[Frame]:
        frames, self._frames = self._frames, []
        return frames


class SdoTasks(BusTask):
    """Task that uses SDO channels side by side. ``_now`` is the latest time that is known."""

    def __init__(self, channels: Iterable[SdoChannel], now: float) -> None:
        super().__init__()
        self._now = now
        self._channels = {channel.reply_id: channel for channel in channels}

    def take_learned(self) -> dict[int, str]:
        """Reasons why servers are not asked for block transfer any more, by the COB-ID of their requests:
        each given once, when it was found out."""
        learned = {channel.request_id: channel.take_learned() for channel in self._channels.values()}
        return {request_id: str(one) for request_id, one in learned.items() if one}

    def on_frame(self, frame: Frame) -> None:
        self._now = max(self._now, frame.time)
        if frame.can_id in self._channels:
            self._channels[frame.can_id].on_frame(frame)

    def on_time(self, now: float) -> None:
        self._now = max(self._now, now)
        for channel in self._channels.values():
            channel.on_time(now)

    def next_deadline(self) -> float | None:
        times = (channel.next_deadline() for channel in self._channels.values())
        return min((time for time in times if time is not None), default=None)

    def take_frames(self) -> list[Frame]:
        return [frame for channel in self._channels.values() for frame in channel.take_frames()]
