"""Simulated nodes on a wire."""

from __future__ import annotations

from typing import Final

from bridge.canopen.frame import STANDARD_MASK, Frame
from bridge.sim.core.simulated_device import SimulatedDevice
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

    def _on_time(self) -> None:
        self._timer = None
        self.device.on_time(self._world.now)
        self.serve()

    def serve(self) -> None:
        """Send what it has to send, and look when it is due next."""
        for frame in self.device.take_frames():
            is_heard = not self.is_mute or frame.can_id == _ERROR_CONTROL + self.device.node_id
            if self.speaks and is_heard:
                self._port.send(frame)
        due = self.device.next_deadline()
        timer = self._timer
        if timer is not None:
            if timer.at == due:
                return
            timer.cancel()
        self._timer = None if due is None else self._world.at(due, self._on_time)
