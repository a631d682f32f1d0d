"""Base of the buses without the kernel's broadcast manager, with bursts by our own timer."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Final

from bridge.can.burstend import Burst
from bridge.can.interface import BusStatus
from bridge.can.softbursts import SoftBursts
from bridge.can.wirebits import WireBits
from bridge.canopen.frame import Frame

_WITHIN_S: Final = 0.05
"""A frame of a burst that cannot be sent within this time is dropped."""
_MOST_OVERHEARD: Final = 1 << 14


class SoftBus(ABC):
    """One end of a bus, as ``interface.Bus`` has it."""

    def __init__(self, name: str, *, bursts_in_step: bool = False) -> None:
        self._name = name
        self._status = BusStatus()
        self._bursts = SoftBursts(in_step=bursts_in_step)
        self._bits = WireBits()
        self._overheard: deque[Frame] | None = None
        self._accepted: frozenset[int] | None = None
        self._ours: frozenset[int] = frozenset()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._wake: Callable[[], None] | None = None
        self._woken = False

    @property
    def name(self) -> str:
        return self._name

    @property
    def status(self) -> BusStatus:
        self._status.bits = int(self._bits.total)
        return self._status

    def accept(self, can_ids: list[int]) -> None:
        self._accepted = frozenset(can_ids)

    def watch(self, can_ids: frozenset[int]) -> None:
        self._ours = can_ids

    def overhear(self, *, is_on: bool) -> None:
        """Whether all that passes on the bus is kept for ``take_overheard``, at most 16,384 frames of it."""
        if is_on and self._overheard is None:
            self._overheard = deque(maxlen=_MOST_OVERHEARD)
        elif not is_on:
            self._overheard = None

    def take_overheard(self) -> list[Frame]:
        """Frames since the last call, ours and everybody's, with their times."""
        frames: list[Frame] = []
        while self._overheard:
            frames.append(self._overheard.popleft())
        return frames

    def _passes(self, frame: Frame) -> None:
        """A frame is on the wire, whoever sends it. May be called in any thread."""
        self._bits.add(frame)
        overheard = self._overheard
        if overheard is not None:
            overheard.append(frame)

    @abstractmethod
    def send(self, frame: Frame, now: float, deadline: float) -> None: ...

    @abstractmethod
    def _give(self, frame: Frame, now: float) -> None:
        """A frame for ``drain``."""

    def burst(self, burst: Burst, now: float, *, at_once: bool = False) -> None:
        frame = self._bursts.start(burst, now, at_once=at_once)
        if frame is not None:
            self._send_of_burst(frame, now, burst.period_s)

    def end_burst(self, can_id: int) -> None:
        self._bursts.end(can_id)

    def next_deadline(self) -> float | None:
        return self._bursts.next_deadline()

    def on_time(self, now: float) -> None:
        for frame in self._bursts.due(now):
            self._send_of_burst(frame, now, _WITHIN_S)

    def _send_of_burst(self, frame: Frame, now: float, within_s: float) -> None:
        self.send(frame, now, now + within_s)
        if self._accepted is not None and frame.can_id in self._accepted:
            self._give(frame._replace(time=now), now)

    def _wake_up(self) -> None:
        self._woken = False
        if self._wake:
            self._wake()
