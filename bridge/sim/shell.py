"""Runs simulated nodes on a bus: drain, hand over, send, one timer."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Final

from bridge.can.interface import Bus
from bridge.canopen.frame import STANDARD_MASK
from bridge.sim.device import SimulatedDevice
from bridge.sim.ticks import earliest

_SEND_WITHIN_S: Final = 0.1


class Simulation:
    """Any number of nodes on one end of one bus."""

    def __init__(self, bus: Bus, nodes: Sequence[SimulatedDevice]) -> None:
        self._bus = bus
        self._nodes = tuple(nodes)
        self._work = asyncio.Event()
        self._is_open = False
        self._due: dict[SimulatedDevice, float | None] = {}
        """When each node is due; one that is missing here is due now. Asking all of them for every frame of a
        busy bus would cost more than simulating them."""

    def open(self) -> None:
        """Open the bus. Raises ``Unavailable`` if that fails."""
        self._bus.open(self._work.set)
        self._is_open = True

    async def run(self) -> None:
        """Power the nodes on and run them until cancelled. Opens the bus if nobody has."""
        loop = asyncio.get_running_loop()
        if not self._is_open:
            self.open()
        for node in self._nodes:
            node.start(loop.time())
        while True:
            await asyncio.sleep(0)  # a bus that wakes us while we send must not starve the loop
            self._work.clear()
            self._pump(loop.time())
            deadline = self._next_deadline()
            timer = None if deadline is None else loop.call_at(deadline, self._work.set)
            try:
                await self._work.wait()
            finally:
                if timer is not None:
                    timer.cancel()

    def poke(self) -> None:
        """A node was changed from outside: serve it now instead of at its next deadline."""
        self._due.clear()
        self._work.set()

    def close(self) -> None:
        self._bus.close()

    def _pump(self, now: float) -> None:
        # Frames first, by their own time of reception: a late loop must not look like a silent master.
        for frame in self._bus.drain(now):
            for node in self._nodes:
                if frame.can_id & STANDARD_MASK in node.heard:
                    node.on_frame(frame, frame.time)
                    self._due.pop(node, None)
        self._bus.on_time(now)
        for node in self._nodes:
            due = self._due.get(node, now)
            if due is None or due > now:
                continue
            node.on_time(now)
            for frame in node.take_frames():
                self._bus.send(frame, now, now + _SEND_WITHIN_S)
            self._due[node] = node.next_deadline()

    def _next_deadline(self) -> float | None:
        return earliest(self._bus.next_deadline(), *self._due.values())
