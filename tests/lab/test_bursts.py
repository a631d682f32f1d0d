"""Bursts of the kernel's broadcast manager: whoever renews them late loses a few frames, never all."""

from __future__ import annotations

import asyncio
import time

import pytest

from bridge.southbound.bus.frame import Frame
from bridge.southbound.bus.socketcan import SocketCanBus
from bridge.southbound.canopen.sync import burst_length
from tests.support.sniffer import sniffing

DEADMAN_MS = 100
RPDO = Frame(0x205, bytes(8))


@pytest.mark.parametrize("period_ms", [10, 50, 100])
@pytest.mark.parametrize("late_ms", [0, 88, 98, 101])
async def test_a_late_renewal_ends_no_burst_for_good(period_ms: int, late_ms: int) -> None:
    period_s = period_ms / 1000
    count = burst_length(period_s, DEADMAN_MS)
    bus = SocketCanBus("can0", "vcan0")
    with sniffing() as sniffer:
        bus.open(lambda: None)
        bus.accept([])
        try:
            await renew(bus, period_s, count, 0.2)
            await asyncio.sleep(late_ms / 1000)
            late = time.time()
            await renew(bus, period_s, count, 0.6)
        finally:
            bus.close()
        await asyncio.sleep(0.05)
        after = sniffer.of(RPDO.can_id, late)
    assert len(after) >= 0.5 * 0.6 / period_s


async def test_a_renewal_that_was_held_up_on_its_way_ends_no_burst_for_good() -> None:
    period_s, count = 0.02, 25
    bus = SocketCanBus("can0", "vcan0")
    with sniffing() as sniffer:
        bus.open(lambda: None)
        bus.accept([])
        try:
            bus.beat((RPDO,), time.monotonic(), period_s, count)
            await asyncio.sleep(0.2)
            decided_at = time.monotonic()
            await asyncio.sleep(0.35)
            late = time.time()
            bus.beat((RPDO,), decided_at, period_s, count)
            await asyncio.sleep(0.1)
        finally:
            bus.close()
        after = sniffer.of(RPDO.can_id, late)
    assert len(after) >= 3


async def renew(bus: SocketCanBus, period_s: float, count: int, seconds: float) -> None:
    """What the master does: renew three times in the dead-man time, and look at the timers."""
    end = time.monotonic() + seconds
    renew_at = 0.0
    while (now := time.monotonic()) < end:
        if now >= renew_at:
            bus.beat((RPDO,), now, period_s, count)
            renew_at = now + DEADMAN_MS / 3000
        bus.on_time(now)
        await asyncio.sleep(0.003)
