"""SDO channels on a bus, pumped as the master does it: drain, tell, send."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from functools import partial

from bridge.can.interface import Bus
from bridge.canopen.sdo import Priority, Result, SdoChannel

ANSWER = b"\x2a\0\0\0"


class Reader:
    """Reads one object of each of ``node_ids`` again and again, ``reads`` times in all. ``most_at_once``
    is how many transfers have been under way at the same time."""

    def __init__(self, bus: Bus, node_ids: Sequence[int], reads: int) -> None:
        self._bus = bus
        self._reads = reads
        self._channels = {
            0x580 + node_id: SdoChannel(0x600 + node_id, 0x580 + node_id, 1.0) for node_id in node_ids
        }
        self._done = asyncio.Event()
        self._left = reads
        self._now = 0.0
        self.most_at_once = 0

    async def run(self) -> float:
        """Reads per second."""
        self._bus.open(self._pump)
        self._bus.accept(list(self._channels))
        begin = self._now = time.monotonic()
        for channel in self._channels.values():
            self._ask(channel)
        self._send()
        await self._done.wait()
        seconds = time.monotonic() - begin
        self._bus.close()
        return self._reads / seconds

    def _ask(self, channel: SdoChannel) -> None:
        channel.read(0x2000, 1, self._now, partial(self._answered, channel), priority=Priority.POLL)

    def _answered(self, channel: SdoChannel, result: Result) -> None:
        assert result == ANSWER
        self._left -= 1
        if self._left >= len(self._channels):
            self._ask(channel)
        elif not self._left:
            self._done.set()

    def _pump(self) -> None:
        self._now = time.monotonic()
        for frame in self._bus.drain(self._now):
            self._channels[frame.can_id].on_frame(frame)
        for channel in self._channels.values():
            channel.on_time(self._now)
        self._send()

    def _send(self) -> None:
        self.most_at_once = max(self.most_at_once, sum(bool(c.waiting) for c in self._channels.values()))
        for channel in self._channels.values():
            for frame in channel.take_frames():
                self._bus.send(frame, self._now, self._now + 0.1)
