"""The SocketCAN bus on a real kernel: error frames, outages, bursts, load, losses.

A vcan has no controller, but a frame with the error flag that somebody sends reaches every listener as
an error frame would.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import subprocess
import time
from collections.abc import AsyncIterator, Callable

import pytest

from bridge.base.errors import Unavailable
from bridge.can import netlink
from bridge.can.burstend import Burst
from bridge.can.interface import ControllerState
from bridge.can.socketcan import SocketCanBus
from bridge.canopen.frame import ERROR, Frame
from tests.support.sniffer import Sniffer, sniffing

LIMIT_S = 15.0
BUS_OFF = ERROR | 0x40, bytes(8)
RESTARTED = ERROR | 0x100, bytes(8)


def ip(*arguments: str) -> None:
    subprocess.run(["ip", "link", *arguments], check=True)


class Loop:
    """Does with the bus what the master does, and keeps what it receives."""

    def __init__(self, channel: str = "vcan0") -> None:
        self.bus = SocketCanBus("can0", channel, 1_000_000)
        self.frames: list[Frame] = []
        self._work = asyncio.Event()

    def open(self) -> None:
        self.bus.open(self._work.set)

    async def run(self, seconds: float) -> None:
        await self.until(lambda: False, seconds)

    async def until(self, condition: Callable[[], bool], limit_s: float = LIMIT_S) -> bool:
        end = time.monotonic() + limit_s
        while True:
            now = time.monotonic()
            self.frames += self.bus.drain(now)
            self.bus.on_time(now)
            if condition() or now >= end:
                return condition()
            deadline = self.bus.next_deadline() or end
            self._work.clear()
            try:
                await asyncio.wait_for(self._work.wait(), max(0.0, min(end, deadline) - now))
            except TimeoutError:
                continue

    async def until_state(self, state: ControllerState) -> None:
        assert await self.until(lambda: self.bus.status.state is state), f"{state}: {self.bus.status}"

    def send(self, frame: Frame) -> None:
        now = time.monotonic()
        self.bus.send(frame, now, now + 0.1)

    def beat(self, *frames: Frame, period_s: float = 0.01, count: int = 10, at_once: bool = False) -> None:
        self.bus.burst(Burst(frames, period_s, count), time.monotonic(), at_once=at_once)


@pytest.fixture
async def loop() -> AsyncIterator[Loop]:
    loop = Loop()
    loop.open()
    yield loop
    loop.bus.close()
    ip("set", "vcan0", "up")


@pytest.fixture
def wire() -> object:
    with sniffing() as wire:
        yield wire


async def test_error_frames_set_state_counters_and_text(loop: Loop, wire: Sniffer) -> None:
    status = loop.bus.status
    for can_id, data, state in (
        (ERROR | 0x204, "0008000000006000", ControllerState.WARNING),
        (ERROR | 0x204, "0020000000008001", ControllerState.PASSIVE),
        (ERROR | 0x204, "0040000000001000", ControllerState.OK),
    ):
        wire.send(can_id, bytes.fromhex(data))
        await loop.until_state(state)
    assert (status.tx_errors, status.rx_errors) == (0x10, 0)
    wire.send(ERROR | 0x88, bytes.fromhex("0000841900000000"))
    assert await loop.until(lambda: "stuff error" in str(status.last_error))
    assert status.error_frames == 4
    assert not loop.frames, "an error frame is no frame"


async def test_bus_off_ends_every_burst_and_sends_nothing_until_the_restart(
    loop: Loop, wire: Sniffer
) -> None:
    loop.beat(Frame(0x205, b"\1"), count=1000)
    await loop.run(0.2)
    assert wire.of(0x205)
    wire.send(*BUS_OFF)
    await loop.until_state(ControllerState.BUS_OFF)
    off = time.time()
    loop.send(Frame(0x605, b"stale"))
    await loop.run(0.3)
    assert len(wire.of(0x205, off)) <= 1
    wire.send(*RESTARTED)
    await loop.until_state(ControllerState.OK)
    loop.send(Frame(0x605, b"fresh"))
    await loop.run(0.2)
    assert [frame.data for frame in wire.of(0x605)] == [b"fresh"]
    assert loop.bus.status.frames_expired == 1


async def test_the_interface_goes_down_and_comes_back(loop: Loop, wire: Sniffer) -> None:
    loop.beat(Frame(0x205, b"\1"), count=1000)
    await loop.run(0.1)
    ip("set", "vcan0", "down")
    await loop.until_state(ControllerState.DOWN)
    assert "interface vcan0 is down" in str(loop.bus.status.last_error)
    loop.send(Frame(0x605, b"stale"))
    ip("set", "vcan0", "up")
    up = time.time()
    await loop.until_state(ControllerState.OK)
    loop.send(Frame(0x605, b"fresh"))
    await loop.run(0.3)
    assert not wire.of(0x205, up), "no burst outlives the outage"
    assert [frame.data for frame in wire.of(0x605)] == [b"fresh"]


async def test_an_interface_that_is_deleted_and_made_anew_is_found_again() -> None:
    ip("add", "vcan9", "type", "vcan")
    ip("set", "vcan9", "up")
    first = socket.if_nametoindex("vcan9")
    loop = Loop("vcan9")
    loop.open()
    loop.bus.accept([0x185])
    try:
        ip("del", "vcan9")
        await loop.until_state(ControllerState.DOWN)
        assert "there is no interface vcan9" in str(loop.bus.status.last_error) or await loop.until(
            lambda: "there is no interface vcan9" in str(loop.bus.status.last_error)
        )
        ip("add", "vcan9", "type", "vcan")
        ip("set", "vcan9", "up")
        assert socket.if_nametoindex("vcan9") != first
        await loop.until_state(ControllerState.OK)
        with sniffing("vcan9") as wire:
            wire.send(0x185, b"back")
            assert await loop.until(lambda: bool(loop.frames))
            loop.send(Frame(0x605, b"heard"))
            await loop.run(0.1)
            assert wire.of(0x605)
        assert loop.frames[0].data == b"back"
    finally:
        loop.bus.close()
        with contextlib.suppress(subprocess.CalledProcessError):
            ip("del", "vcan9")


async def test_looking_for_a_lost_interface_gets_rarer(loop: Loop) -> None:
    ip("set", "vcan0", "down")
    await loop.until_state(ControllerState.DOWN)
    pauses: list[float] = []
    for _ in range(4):
        due = loop.bus.next_deadline()
        assert due is not None
        pauses.append(round(due - time.monotonic(), 1))
        await loop.until(lambda due=due: loop.bus.next_deadline() != due)
    assert pauses == [0.2, 0.4, 0.8, 1.6]


async def test_a_bus_that_is_not_there_or_down_says_what_helps() -> None:
    with pytest.raises(Unavailable, match="there is no interface nocan"):
        Loop("nocan").open()
    ip("set", "vcan1", "down")
    try:
        with pytest.raises(Unavailable, match="interface vcan1 is down: ip link set vcan1 up"):
            Loop("vcan1").open()
    finally:
        ip("set", "vcan1", "up")


async def test_a_sync_counter_is_one_burst_that_keeps_its_count_when_renewed(
    loop: Loop, wire: Sniffer
) -> None:
    frames = tuple(Frame(0x80, bytes((number,))) for number in range(1, 8))
    loop.beat(*frames, count=10, at_once=True)
    for _ in range(12):
        await loop.run(0.04)
        loop.beat(*frames, count=10)
    await loop.run(0.2)
    numbers = [frame.data[0] for frame in wire.of(0x80)]
    assert len(numbers) > 40
    assert numbers == [place % 7 + 1 for place in range(len(numbers))]


async def test_a_burst_comes_back_where_it_is_accepted(loop: Loop, wire: Sniffer) -> None:
    loop.bus.accept([0x185])
    loop.beat(Frame(0x80), count=5)
    await loop.run(0.1)
    assert not loop.frames
    loop.bus.accept([0x185, 0x80])
    loop.beat(Frame(0x80), count=5, at_once=True)
    assert await loop.until(lambda: len(loop.frames) >= 3)
    assert {frame.can_id for frame in loop.frames} == {0x80}


async def test_more_nodes_than_the_kernel_has_filters(loop: Loop, wire: Sniffer) -> None:
    wanted = [base + node for node in range(1, 128) for base in (0x180, 0x280, 0x580, 0x700, 0x80)]
    loop.bus.accept(wanted)
    for can_id in (0x605, 0x1FF, 0x77F):
        wire.send(can_id, b"x")
    assert await loop.until(lambda: len(loop.frames) == 2)
    assert {frame.can_id for frame in loop.frames} == {0x1FF, 0x77F}


async def test_the_load_counts_every_frame_once_accepted_or_not(loop: Loop, wire: Sniffer) -> None:
    loop.bus.accept([0x185])
    await loop.until(lambda: False, 1.1)
    before, link = loop.bus.status.bits, netlink.query("vcan0")
    for number in range(200):
        wire.send(0x305, bytes((number,)) * 8)
        loop.send(Frame(0x605, bytes(8)))
    await loop.run(1.2)
    passed = netlink.query("vcan0").frames - link.frames
    assert passed == 400
    bits = (loop.bus.status.bits - before) / passed
    assert 111 <= bits <= 135


async def test_frames_that_found_no_room_are_counted(loop: Loop, wire: Sniffer) -> None:
    sent = 8000
    for _ in range(sent):
        wire.send(0x185, bytes(8))
    loop.frames += loop.bus.drain(time.monotonic())
    # The kernel tells of losses with the frames that come after them.
    wire.send(0x185, b"last")
    assert await loop.until(lambda: loop.frames[-1].data == b"last")
    assert loop.bus.status.frames_lost == sent + 1 - len(loop.frames) > 0


async def test_time_stamps_are_monotonic_and_near_now(loop: Loop, wire: Sniffer) -> None:
    begin = time.monotonic()
    for number in range(50):
        wire.send(0x185, bytes((number,)))
    assert await loop.until(lambda: len(loop.frames) == 50)
    times = [frame.time for frame in loop.frames]
    assert times == sorted(times)
    assert begin - 0.05 <= times[0] <= times[-1] <= time.monotonic()
    assert [frame.data[0] for frame in loop.frames] == list(range(50))
