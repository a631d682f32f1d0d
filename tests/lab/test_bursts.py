"""Bursts of the kernel's broadcast manager: whoever renews them late loses a few frames, never all."""

from __future__ import annotations

import asyncio
import socket
import time
from pathlib import Path

import pytest

from bridge.can.burstend import Burst, BurstEnd
from bridge.can.socketcan import SocketCanBus
from bridge.canopen.frame import Frame
from bridge.canopen.sync import burst_length
from bridge.zenohlink.sockets import TcpConnections
from tests.support.sniffer import sniffing

DEADMAN_MS = 100
NOISE_S = 0.02
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
            bus.burst(Burst((RPDO,), period_s, count), time.monotonic())
            await asyncio.sleep(0.2)
            decided_at = time.monotonic()
            await asyncio.sleep(0.35)
            late = time.time()
            bus.burst(Burst((RPDO,), period_s, count), decided_at)
            await asyncio.sleep(0.1)
        finally:
            bus.close()
        after = sniffer.of(RPDO.can_id, late)
    assert len(after) >= 3


STOP = Frame(0x205, b"\1" + bytes(7))


@pytest.mark.parametrize("period_ms", [2, 10, 20])
@pytest.mark.parametrize("stop", [STOP, None])
async def test_a_burst_that_nobody_renews_any_more_stops_at_its_deadline(
    period_ms: int, stop: Frame | None
) -> None:
    period_s = period_ms / 1000
    count = burst_length(period_s, DEADMAN_MS)
    bus = SocketCanBus("can0", "vcan0")
    with sniffing() as sniffer:
        bus.open(lambda: None)
        bus.accept([])
        try:
            begin = time.time()
            at = time.monotonic() + 0.2
            deadline = time.time() + 0.2
            while time.monotonic() < at - 0.05:
                ending = BurstEnd(at, stop)
                bus.burst(Burst((RPDO,), period_s, count, ending), time.monotonic())
                await asyncio.sleep(DEADMAN_MS / 3000)
            renewed = time.time()
            await asyncio.sleep(0.4)
        finally:
            bus.close()
        seen = sniffer.of(RPDO.can_id, begin)
    going = [frame.time for frame in seen if frame.data == RPDO.data]
    stops = [frame.time for frame in seen if frame.data == STOP.data]
    assert len(going) >= 0.5 * 0.2 / period_s
    assert max(going) < deadline + period_s + NOISE_S
    assert bool(stops) is bool(stop)
    if stops:
        assert deadline <= stops[0] <= deadline + 2 * period_s + NOISE_S
        assert max(stops) <= renewed + DEADMAN_MS / 1000 + NOISE_S
        assert max(going) < stops[0]


async def test_a_deadline_that_moves_moves_the_stop() -> None:
    bus = SocketCanBus("can0", "vcan0")
    with sniffing() as sniffer:
        bus.open(lambda: None)
        bus.accept([])
        try:
            end = time.monotonic() + 1.0
            begin = time.time()
            while (now := time.monotonic()) < end:
                bus.burst(Burst((RPDO,), 0.01, 10, BurstEnd(now + 0.08, STOP)), now)
                await asyncio.sleep(0.01)
        finally:
            bus.close()
        seen = sniffer.of(RPDO.can_id, begin)
    assert len(seen) >= 50
    assert {frame.data for frame in seen} == {RPDO.data}, "each telegram is in time"


async def renew(bus: SocketCanBus, period_s: float, count: int, seconds: float) -> None:
    """What the master does: renew three times in the dead-man time, and look at the timers."""
    end = time.monotonic() + seconds
    renew_at = 0.0
    while (now := time.monotonic()) < end:
        if now >= renew_at:
            bus.burst(Burst((RPDO,), period_s, count), now)
            renew_at = now + DEADMAN_MS / 3000
        bus.on_time(now)
        await asyncio.sleep(0.003)


def test_zenohs_look_at_the_sockets_leaves_no_copy_of_the_manager() -> None:
    """It would keep the bursts on the bus when the bridge has closed its own."""
    manager = socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, socket.CAN_BCM)
    with manager, socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW):
        manager.connect(("vcan0",))
        before = len(list(Path("/proc/self/fd").iterdir()))
        TcpConnections().settle()
        assert len(list(Path("/proc/self/fd").iterdir())) == before
