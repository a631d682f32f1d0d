"""Runs simulated nodes on a bus: drain, hand over, send, one timer."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Final

from bridge.can.interface import Bus
from bridge.canopen.frame import STANDARD_MASK
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.core.ticks import earliest

_SEND_WITHIN_S: Final = 0.1
_LATE_S: Final = 0.02


class Simulation:
    """Any number of nodes on one end of one bus."""

    def __init__(self, bus: Bus, nodes: Sequence[SimulatedDevice]) -> None:
        self._bus = bus
        self._nodes = tuple(nodes)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._failed: asyncio.Future[None] | None = None
        """Ends ``run``."""
        self._timer: asyncio.TimerHandle | None = None
        self._is_open = False
        self._is_playing = False
        self._due_at: float | None = None
        self._due: dict[SimulatedDevice, float | None] = {}
        """Time at which each node is due; one that is missing here is due now. Asking all of them for every
        frame of a busy bus would cost more than simulating them."""
        self._heard: dict[SimulatedDevice, frozenset[int]] = {}
        """Identifiers heard by each device, from which ``_hearers`` was made."""
        self._hearers: dict[int, list[SimulatedDevice]] = {}
        """Devices by the identifier that they hear."""

    def open(self) -> None:
        """Open the bus. Raises ``Unavailable`` if that fails."""
        self._bus.open(self._play)
        self._is_open = True

    async def run(self) -> None:
        """Power the nodes on and run them until cancelled. Opens the bus if nobody has."""
        loop = asyncio.get_running_loop()
        if not self._is_open:
            self.open()
        for node in self._nodes:
            node.start(loop.time())
        for node in self._nodes:
            self._listen(node)
        self._loop, self._failed = loop, loop.create_future()
        self._play()
        try:
            await self._failed
        finally:
            self._loop = None
            if self._timer is not None:
                self._timer.cancel()

    def catch_up(self, now: float) -> None:
        """Play now what was due while this process was held up: a master in it must not take its own pause
        for the nodes' silence."""
        if self._due_at is not None and self._due_at < now - _LATE_S:
            self._pump(now)

    def poke(self) -> None:
        """A node was changed from outside: serve it now instead of at its next deadline."""
        self._due.clear()
        if self._loop is not None:
            self._loop.call_soon(self._play)

    def close(self) -> None:
        self._bus.close()

    def _play(self) -> None:
        """The loop calls this when there are frames, or when something is due."""
        if self._loop is None or self._failed is None or self._failed.done():
            return
        if self._is_playing:  # a bus that wakes us while we send must not starve the loop
            self._loop.call_soon(self._play)
            return
        self._is_playing = True
        try:
            self._pump(self._loop.time())
            self._arm(self._loop)
        except Exception as error:  # noqa: BLE001 - it ends the task, whose owner is told of it
            self._failed.set_exception(error)
        finally:
            self._is_playing = False

    def _arm(self, loop: asyncio.AbstractEventLoop) -> None:
        """Play at the next deadline."""
        deadline = earliest(self._bus.next_deadline(), *self._due.values())
        self._due_at = deadline
        if self._timer is not None:
            if self._timer.when() == deadline:
                return
            self._timer.cancel()
        self._timer = None if deadline is None else loop.call_at(deadline, self._on_timer)

    def _on_timer(self) -> None:
        self._timer = None
        if self._loop is not None:
            self._loop.call_soon(self._play_alone)

    def _play_alone(self) -> None:
        """Unless frames of the same moment have made us play meanwhile, which has armed the timer again."""
        if self._timer is None:
            self._play()

    def _listen(self, node: SimulatedDevice) -> None:
        """The node may hear other identifiers than before."""
        before, heard = self._heard.get(node, frozenset[int]()), node.heard
        if before is heard:
            return
        self._heard[node] = heard
        for can_id in before - heard:
            self._hearers[can_id] = [one for one in self._hearers[can_id] if one is not node]
        for can_id in heard - before:
            self._hearers[can_id] = [*self._hearers.get(can_id, ()), node]

    def _pump(self, now: float) -> None:
        self._due_at = None
        # Frames first, by their own time of reception: a late loop must not look like a silent master.
        addressed: set[SimulatedDevice] = set()
        for frame in self._bus.drain(now):
            for node in self._hearers.get(frame.can_id & STANDARD_MASK, ()):
                node.on_frame(frame, frame.time)
                addressed.add(node)
                self._listen(node)
        self._bus.on_time(now)
        for node in self._nodes:
            is_known, due = node in self._due, self._due.get(node)
            if is_known and node in addressed:
                due = self._due[node] = node.next_deadline()
            if not is_known or (due is not None and due <= now):
                node.on_time(now)
                self._due[node] = node.next_deadline()
                self._listen(node)
            elif node not in addressed:
                continue
            for frame in node.take_frames():
                self._bus.send(frame, now, now + _SEND_WITHIN_S)
