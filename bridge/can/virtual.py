"""A CAN bus in memory, for the demo and for tests: it can lose, delay and be cut."""

from __future__ import annotations

import asyncio
import random
from collections import deque
from collections.abc import Callable

from bridge.can.softbus import SoftBus
from bridge.canopen.frame import Frame

_MOST_WAITING = 1 << 16


class VirtualWire:
    """Medium to which the ends are attached. Faults are set on it: ``loss`` (0 … 1), ``delay_s``, ``cut``."""

    def __init__(self, seed: int = 0) -> None:
        self.loss = 0.0
        self.delay_s = 0.0
        self.cut = False
        self.listeners: list[Callable[[Frame], None]] = []
        """Called with every frame put on the wire, whoever sends it."""
        self.players: list[Callable[[float], None]] = []
        """Called before an end is drained: simulated nodes of this process, which share its pauses, say what
        real ones would have said meanwhile."""
        self._random = random.Random(seed)
        self._ends: list[VirtualBus] = []

    def end(self, name: str) -> VirtualBus:
        """A new end of this wire."""
        bus = VirtualBus(name, self)
        self._ends.append(bus)
        return bus

    def put(self, frame: Frame, sender: VirtualBus, now: float) -> None:
        frame = frame._replace(time=now + self.delay_s)
        for listener in self.listeners:
            listener(frame)
        if self.cut or (self.loss and self._random.random() < self.loss):
            return
        for end in self._ends:
            if end is not sender:
                end.pass_by(frame, now)
                end.deliver(frame, now)


class VirtualBus(SoftBus):
    """One end. Everything runs in the event loop of the one who opened it."""

    def __init__(self, name: str, wire: VirtualWire) -> None:
        super().__init__(name, bursts_in_step=True)
        self._wire = wire
        self._waiting: deque[Frame] = deque()
        self._foreign: list[Frame] = []

    def open(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._loop = asyncio.get_running_loop()

    def take_foreign(self, now: float, *, at_once: bool = False) -> list[Frame]:
        foreign, self._foreign = self._foreign, []
        return foreign

    def pass_by(self, frame: Frame, now: float) -> None:
        """Take in somebody else's frame on the wire."""
        self._passes(frame)
        if frame.can_id in self._ours and self._wake and len(self._foreign) < _MOST_WAITING:
            self._foreign.append(frame)
            self._rouse(frame.time - now)

    def deliver(self, frame: Frame, now: float) -> None:
        """The wire brings a frame."""
        if self._accepted is None or frame.can_id in self._accepted:
            self._give(frame, now)

    def _give(self, frame: Frame, now: float) -> None:
        if self._wake is None:
            return
        if len(self._waiting) >= _MOST_WAITING:
            self._status.frames_lost += 1
            return
        self._waiting.append(frame)
        self._rouse(frame.time - now)

    def _rouse(self, delay_s: float) -> None:
        if self._woken or self._loop is None:
            return
        self._woken = True
        if delay_s > 0:
            self._loop.call_later(delay_s, self._wake_up)
        else:
            self._loop.call_soon(self._wake_up)

    def _wake_up(self) -> None:
        self._woken = False
        # Whoever has drained us meanwhile, for another reason, need not be woken for it again.
        if self._wake and (self._waiting or self._foreign):
            self._wake()

    def drain(self, now: float) -> list[Frame]:
        for play in self._wire.players:
            play(now)
        waiting = self._waiting
        frames: list[Frame] = []
        while waiting and waiting[0].time <= now:
            frames.append(waiting.popleft())
        if waiting:
            self._rouse(waiting[0].time - now)
        self._status.frames_received += len(frames)
        return frames

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        if self._wake is None:
            self._status.frames_expired += 1
            return
        self._passes(frame._replace(time=now))
        self._wire.put(frame, self, now)

    def close(self) -> None:
        self._wake = None
        self._bursts.clear()
        self._waiting.clear()
