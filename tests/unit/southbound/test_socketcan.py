"""The SocketCAN bus on a pair of sockets in place of an interface: bursts that the kernel does not send."""

from __future__ import annotations

import time

from bridge.southbound.bus.bcm import frame_bytes
from bridge.southbound.bus.frame import Frame
from tests.bench.pair import PairBus, wire

SYNC, HEARTBEAT = Frame(0x080), Frame(0x77F, b"\x05")


async def test_our_own_sync_comes_back_where_the_bridge_itself_sends_it() -> None:
    """From the kernel's bursts it comes by itself; the SYNC window is counted from it."""
    with wire() as (near, far):
        bus = PairBus(near)
        bus.open(lambda: None)
        try:
            bus.accept([0x080, 0x185])
            now = time.monotonic()
            bus.beat((HEARTBEAT,), now, 0.2, 1)
            bus.beat((SYNC,), now, 0.2, 1)
            assert [far.recv(64) for _ in range(2)] == [frame_bytes(HEARTBEAT), frame_bytes(SYNC)]
            far.send(frame_bytes(Frame(0x185, b"\x31\x0b")))
            frames = bus.drain(now)
            assert [frame.can_id for frame in frames] == [0x080, 0x185]
            assert frames[0].time == now
            assert bus.status.frames_received == 1
            assert bus.drain(now) == []
        finally:
            bus.close()


async def test_a_later_one_of_a_burst_does_so_too() -> None:
    with wire() as (near, far):
        bus = PairBus(near)
        bus.open(lambda: None)
        try:
            bus.accept([0x080])
            now = time.monotonic()
            bus.beat((SYNC,), now, 0.2, 3)
            bus.drain(now)
            bus.on_time(now + 0.2)
            assert [frame.can_id for frame in bus.drain(now + 0.2)] == [0x080]
            assert [far.recv(64) for _ in range(2)] == [frame_bytes(SYNC)] * 2
        finally:
            bus.close()
