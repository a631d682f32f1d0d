"""What it costs that our own RPDOs come back to be told from an intruder's."""

from __future__ import annotations

import asyncio
import contextlib
import time

from bridge.can.burstend import Burst
from bridge.can.socketcan import SocketCanBus
from bridge.canopen.frame import Frame
from tests.bench.figures import show

SECONDS = 5.0
RPDOS = tuple(Frame(0x201 + n, n.to_bytes(8, "little")) for n in range(100))
PERIOD_S = 0.01


async def test_own_rpdos_that_come_back() -> None:
    """A hundred RPDOs every 10 ms, which is more than a bus at 1 Mbit/s takes."""
    without_us, with_us = await cpu_us(watched=False), await cpu_us(watched=True)
    frames = len(RPDOS) / PERIOD_S
    show("an RPDO of our own that comes back", f"{(with_us - without_us) / frames:6.2f} µs of CPU")


async def cpu_us(*, watched: bool) -> float:
    """Of this process in a second, with nothing else to do than to renew the bursts."""
    bus = SocketCanBus("can0", "vcan0")
    bus.open(lambda: None)
    with contextlib.closing(bus):
        bus.accept([0x185])
        bus.watch(frozenset(frame.can_id for frame in RPDOS) if watched else frozenset())
        begin, end, renew_at = time.process_time(), time.monotonic() + SECONDS, 0.0
        while (now := time.monotonic()) < end:
            if now >= renew_at:
                renew_at = now + 0.033
                for frame in RPDOS:
                    bus.burst(Burst((frame,), PERIOD_S, 10), now)
            assert bus.take_foreign(now) == []
            bus.on_time(now)
            await asyncio.sleep(0.01)
        return (time.process_time() - begin) * 1e6 / SECONDS
