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
_LATE_S: Final = 0.02


class Simulation:
    """Any number of nodes on one end of one bus."""

    def __init__(self, bus: Bus, nodes: Sequence[SimulatedDevice]) -> None:
        self._bus = bus
        self._nodes = tuple(nodes)
        self._woken: asyncio.Future[None] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._is_open = False
        self._due_at: float | None = None
        self._due: dict[SimulatedDevice, float | None] = {}
        """When each node is due; one that is missing here is due now. Asking all of them for every frame of a
        busy bus would cost more than simulating them."""

    def open(self) -> None:
        """Open the bus. Raises ``Unavailable`` if that fails."""
        self._bus.open(self._wake)
        self._is_open = True

    async def run(self) -> None:
        """Power the nodes on and run them until cancelled. Opens the bus if nobody has."""
        loop = asyncio.get_running_loop()
        if not self._is_open:
            self.open()
        for node in self._nodes:
            node.start(loop.time())
        try:
            while True:
                self._woken = loop.create_future()
                self._pump(loop.time())
                self._arm(loop)
                if self._woken.done():
                    await asyncio.sleep(0)  # a bus that wakes us while we send must not starve the loop
                await self._woken
        finally:
            if self._timer is not None:
                self._timer.cancel()

    def catch_up(self, now: float) -> None:
        """Where this process was held up, what was due meanwhile is played now: a master in it must not take
        its own pause for the nodes' silence."""
        if self._due_at is not None and self._due_at < now - _LATE_S:
            self._pump(now)

    def poke(self) -> None:
        """A node was changed from outside: serve it now instead of at its next deadline."""
        self._due.clear()
        self._wake()

    def close(self) -> None:
        self._bus.close()

    def _wake(self) -> None:
        if self._woken is not None and not self._woken.done():
            self._woken.set_result(None)

    def _arm(self, loop: asyncio.AbstractEventLoop) -> None:
        """Wake at the next deadline."""
        deadline = earliest(self._bus.next_deadline(), *self._due.values())
        self._due_at = deadline
        if self._timer is not None:
            if self._timer.when() == deadline:
                return
            self._timer.cancel()
        self._timer = None if deadline is None else loop.call_at(deadline, self._on_timer)

    def _on_timer(self) -> None:
        self._timer = None
        self._wake()

    def _pump(self, now: float) -> None:
        self._due_at = None
        # Frames first, by their own time of reception: a late loop must not look like a silent master.
        addressed: set[SimulatedDevice] = set()
        for frame in self._bus.drain(now):
            for node in self._nodes:
                if frame.can_id & STANDARD_MASK in node.heard:
                    node.on_frame(frame, frame.time)
                    addressed.add(node)
        self._bus.on_time(now)
        for node in self._nodes:
            is_known, due = node in self._due, self._due.get(node)
            if is_known and node in addressed:
                due = self._due[node] = node.next_deadline()
            if not is_known or (due is not None and due <= now):
                node.on_time(now)
                self._due[node] = node.next_deadline()
            elif node not in addressed:
                continue
            for frame in node.take_frames():
                self._bus.send(frame, now, now + _SEND_WITHIN_S)
