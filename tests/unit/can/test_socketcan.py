"""The SocketCAN bus on a pair of sockets in place of an interface: bursts that the kernel does not send."""

from __future__ import annotations

import socket
import time
from collections.abc import Collection

from bridge.can.bcm import frame_bytes
from bridge.can.burstend import Burst
from bridge.can.foreignwatch import LOOK_S
from bridge.can.socketcan import SocketCanBus
from bridge.canopen.frame import Frame
from tests.bench.pair import PairBus, PairSockets, wire

SYNC, HEARTBEAT = Frame(0x080), Frame(0x77F, b"\x05")


async def test_our_own_sync_comes_back_where_the_bridge_itself_sends_it() -> None:
    """From the kernel's bursts it comes by itself; the SYNC window is counted from it."""
    with wire() as (near, far):
        bus = PairBus(near)
        bus.open(lambda: None)
        try:
            bus.accept([0x080, 0x185])
            now = time.monotonic()
            bus.burst(Burst((HEARTBEAT,), 0.2, 1), now)
            bus.burst(Burst((SYNC,), 0.2, 1), now)
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
            bus.burst(Burst((SYNC,), 0.2, 3), now)
            bus.drain(now)
            bus.on_time(now + 0.2)
            assert [frame.can_id for frame in bus.drain(now + 0.2)] == [0x080]
            assert [far.recv(64) for _ in range(2)] == [frame_bytes(SYNC)] * 2
        finally:
            bus.close()


class WatchedSockets(PairSockets):
    """``back`` is where what comes back, or from others, is put in; without a mark of who sent it."""

    def __init__(self, end: socket.socket) -> None:
        super().__init__(end)
        self.watching_end, self.back = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)

    def watching(self, can_ids: Collection[int]) -> socket.socket:
        self.watching_end.setblocking(False)
        return self.watching_end


async def test_what_comes_back_without_any_mark_is_told_from_anothers_by_what_it_says() -> None:
    """A driver that loses the mark must not make the bridge take itself for another."""
    with wire() as (near, _):
        sockets = WatchedSockets(near)
        bus = SocketCanBus("can0", "pair", sockets=sockets)
        now = time.monotonic()
        bus.open(lambda: None)
        with sockets.back:
            bus.watch(frozenset((0x205, 0x77F)))
            own, boot_up = Frame(0x205, bytes(8)), Frame(0x77F, b"\0")
            bus.send(boot_up, now, now + 0.1)
            bus.burst(Burst((own,), 0.01, 10), now, at_once=True)
            stranger, elsewhere = Frame(0x205, b"\x7f\x04" + bytes(6)), Frame(0x185, bytes(8))
            for frame in (boot_up, own, stranger, own, elsewhere):
                sockets.back.send(frame_bytes(frame))
            assert bus.take_foreign(now) == [], "it is looked at now and then"
            found = bus.take_foreign(time.monotonic() + 2 * LOOK_S)
            assert [(frame.can_id, frame.data) for frame in found] == [(0x205, stranger.data)]
            sockets.back.send(frame_bytes(stranger))
            assert bus.take_foreign(now) == []
            assert [frame.data for frame in bus.take_foreign(now, at_once=True)] == [stranger.data]
            assert bus.next_deadline() is not None
            bus.close()
