"""Transfers that wait for an SDO channel: bounded, by priority and then in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from bridge.canopen.sdo_block import BlockUse
from bridge.canopen.sdo_transfer import Result, Transfer

MOST_WAITING: Final = 64


class Priority(IntEnum):
    """Order of transfers that wait for one channel."""

    COMMAND = 0
    BOOT = 1
    MEANING = 2
    """Objects that decide how process data are to be read."""
    POLL = 3


@dataclass(slots=True, eq=False)
class SdoJob:
    """A transfer that has been asked for; ``SdoChannel.cancel`` takes it."""

    index: int
    sub: int
    start: Callable[[BlockUse], Transfer]
    done: Callable[[Result], None]
    priority: Priority
    retries_left: int
    timeout_s: float
    may_begin: Callable[[], bool] | None = None


class SdoQueue:
    """Queue of at most ``MOST_WAITING`` jobs."""

    def __init__(self) -> None:
        self._lanes: dict[Priority, deque[SdoJob]] = {priority: deque() for priority in Priority}

    def __len__(self) -> int:
        return sum(map(len, self._lanes.values()))

    def __iter__(self) -> Iterator[SdoJob]:
        """Jobs in the order in which they are served."""
        for lane in self._lanes.values():
            yield from lane

    def add(self, job: SdoJob) -> SdoJob | None:
        """Add ``job``. If there is no room, return the job that is dropped: the last of the least important,
        or ``job`` itself if none is less important."""
        victim = None
        if len(self) >= MOST_WAITING:
            lane = next((lane for lane in reversed(self._lanes.values()) if lane), None)
            if lane is None or lane[-1].priority <= job.priority:
                return job
            victim = lane.pop()
        self._lanes[job.priority].append(job)
        return victim

    def remove(self, job: SdoJob) -> bool:
        """False if it does not wait here."""
        lane = self._lanes[job.priority]
        if job not in lane:
            return False
        lane.remove(job)
        return True

    def clear(self) -> None:
        for lane in self._lanes.values():
            lane.clear()
