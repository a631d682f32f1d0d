"""Simulated nodes on a wire."""

from __future__ import annotations

from bridge.canopen.frame import STANDARD_MASK, Frame
from bridge.sim.core.simulated_device import SimulatedDevice
from tests.plant.wire import Wire
from tests.plant.world import Timer, World


class FieldNode:
    """One simulated device. ``speaks`` is false while nothing that it sends reaches its wire."""

    def __init__(self, world: World, wire: Wire, device: SimulatedDevice) -> None:
        self._world = world
        self.device = device
        self._port = wire.port(f"node {device.node_id}", self._take)
        self._timer: Timer | None = None
        self.speaks = True

    def power_on(self) -> None:
        self.device.start(self._world.now)
        self.serve()

    def _take(self, frame: Frame) -> None:
        if frame.can_id & STANDARD_MASK in self.device.heard:
            self.device.on_frame(frame, frame.time)
            self.serve()

    def _on_time(self) -> None:
        self._timer = None
        self.device.on_time(self._world.now)
        self.serve()

    def serve(self) -> None:
        """Send what it has to send, and look when it is due next."""
        for frame in self.device.take_frames():
            if self.speaks:
                self._port.send(frame)
        due = self.device.next_deadline()
        timer = self._timer
        if timer is not None:
            if timer.at == due:
                return
            timer.cancel()
        self._timer = None if due is None else self._world.at(due, self._on_time)
