"""Simulated nodes on a wire."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.canopen.frame import STANDARD_MASK, Frame
from bridge.sim.core.simulated_device import SimulatedDevice
from tests.plant.sdo_answers import SdoAnswers
from tests.plant.wire import Wire
from tests.plant.world import Timer, World

_ERROR_CONTROL: Final = 0x700


class FieldNode:
    """One simulated device. ``speaks`` is false while nothing that it sends reaches its wire."""

    def __init__(self, world: World, wire: Wire, device: SimulatedDevice) -> None:
        self._world = world
        self.device = device
        self._port = wire.port(f"node {device.node_id}", self._take)
        self._timer: Timer | None = None
        self.speaks = True
        self.is_mute = False
        """Nothing of it but its heartbeat reaches its wire."""
        self.deaf_to: tuple[int, ...] = ()
        """Identifiers that it does not hear."""
        self.answers = SdoAnswers(world, device.node_id, self._port.send)
        self.composed: dict[int, list[Callable[[Frame], None]]] = {}
        """Called with each frame of this identifier that it has composed."""

    def power_on(self) -> None:
        self.device.start(self._world.now)
        self.serve()

    def _take(self, frame: Frame) -> None:
        if frame.can_id & STANDARD_MASK in self.device.heard and frame.can_id not in self.deaf_to:
            self.device.on_frame(frame, frame.time)
            self.serve()

    def feed(self, frame: Frame) -> None:
        """A frame that nobody else hears."""
        self._take(frame._replace(time=self._world.now))

    def change(self, act: Callable[[], None]) -> None:
        """Have something done at the device itself."""
        self.device.on_time(self._world.now)
        act()
        self.device.slave.touch()
        self.device.on_time(self._world.now)
        self.serve()

    def _on_time(self) -> None:
        self._timer = None
        self.device.on_time(self._world.now)
        self.serve()

    def serve(self) -> None:
        """Send what it has to send, and look when it is due next."""
        answers = self.answers
        for frame in self.device.take_frames():
            for tell in self.composed.get(frame.can_id, ()):
                tell(frame)
            is_heard = not self.is_mute or frame.can_id == _ERROR_CONTROL + self.device.node_id
            if not (self.speaks and is_heard):
                continue
            if answers.how and frame.can_id in answers.can_ids:
                answers.on_answer(frame)
            else:
                self._port.send(frame)
        due = self.device.next_deadline()
        timer = self._timer
        if timer is not None:
            if timer.at == due:
                return
            timer.cancel()
        self._timer = None if due is None else self._world.at(due, self._on_time)
