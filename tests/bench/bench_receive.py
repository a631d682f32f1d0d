"""What a received PDO costs from the socket to its values, ours beside canopen's in the same run.

*The path* is what is done with a burst of frames that is there: reading it from the socket, finding out
whose it is, decoding, into the image; canopen: ``recv``, ``notify``, decoding, reading the four values.
*The process* has everything: being woken, the master's rounds and timers, canopen's thread. The frames come
from a pair of Unix sockets; the sender is another process or is not counted.
"""

from __future__ import annotations

import asyncio
import socket
import statistics
import struct
import time
from collections.abc import Callable
from pathlib import Path

import canopen
import pytest

from bridge.can.socketcan import SocketCanBus
from bridge.master.network import Network
from tests.bench.canopen_node import with_four_words
from tests.bench.crowd import crowd
from tests.bench.figures import record, show
from tests.bench.pair import PairBus, PairCan, named, wire
from tests.support.process import peer

NODES = 5
FRAMES = 6400
ROUNDS = 5
PAUSES_US = {1: 500, 8: 2000, 64: 12000}
"""Between bursts of so many frames."""
IDLE_S = 1.0
LIMIT_S = 30.0
_FRAME = struct.Struct("=IB3x4H")


def tpdos(changing: bool) -> list[bytes]:
    numbers = range(FRAMES) if changing else [1] * FRAMES
    return [_FRAME.pack(0x185, 8, 0x0B37, n & 0x3FFF, n & 0xFF, 0) for n in numbers]


def path_us(far: socket.socket, burst: int, frames: list[bytes], read: Callable[[int], None]) -> float:
    """CPU of this thread for each frame, in µs."""
    spent_ns = 0
    for begin in range(0, len(frames), burst):
        for frame in frames[begin : begin + burst]:
            far.send(frame)
        before = time.thread_time_ns()
        read(burst)
        spent_ns += time.thread_time_ns() - before
    return spent_ns / len(frames) / 1e3


def our_path(bus: SocketCanBus, network: Network) -> Callable[[int], None]:
    def read(burst: int) -> None:
        now = time.monotonic()
        frames = bus.drain(now)
        assert len(frames) >= burst
        Network.on_frames(network, frames, now)  # without what the bench hears

    return read


def their_path(bus: PairCan) -> Callable[[int], None]:
    network = canopen.Network(bus)
    with_four_words(network, lambda: None)
    (listener,) = network.listeners

    def read(burst: int) -> None:
        for _ in range(burst):
            message = bus.recv(0)
            assert message is not None
            listener(message)

    return read


@pytest.mark.parametrize("burst", PAUSES_US)
@pytest.mark.parametrize("changing", [True, False], ids=["changing", "same"])
async def test_the_path(tmp_path: Path, burst: int, changing: bool) -> None:
    ours: list[float] = []
    theirs: list[float] = []
    with wire() as (near, far), wire() as (their_near, their_far):
        bus = PairBus(near)
        async with crowd(tmp_path, NODES, bus, named(far), "", [far.fileno()]) as nodes:
            frames = tpdos(changing)
            their_bus = PairCan(their_near)
            our_read, their_read = our_path(bus, nodes.network), their_path(their_bus)
            for _ in range(ROUNDS):
                ours.append(path_us(far, burst, frames, our_read))
                theirs.append(path_us(their_far, burst, frames, their_read))
            their_bus.shutdown()
            assert not changing or nodes.plant.image.read("n5/fu1/status/status_word").value == 0x0B37
    tell("path", burst, changing, ours, theirs)


@pytest.mark.parametrize("burst", PAUSES_US)
async def test_the_process(tmp_path: Path, burst: int) -> None:
    ours: list[float] = []
    theirs: list[float] = []
    with wire() as (near, far), wire() as (their_near, their_far):
        bus = PairBus(near)
        async with crowd(tmp_path, NODES, bus, named(far), "", [far.fileno()]):
            ours += [
                await process_us(tmp_path, far, burst, lambda: bus.status.frames_received) for _ in range(3)
            ]
        for _ in range(3):
            count = [0]
            network = canopen.Network(PairCan(their_near))
            with_four_words(network, lambda count=count: count.__setitem__(0, count[0] + 1))
            network.connect()
            try:
                theirs.append(await process_us(tmp_path, their_far, burst, lambda count=count: count[0]))
            finally:
                network.disconnect()
    tell("process", burst, True, ours, theirs)


@pytest.mark.parametrize("drives", [4, 16, 40])
async def test_a_single_frame_costs_the_same_however_many_drives_there_are(
    tmp_path: Path, drives: int
) -> None:
    found: list[float] = []
    with wire() as (near, far):
        bus = PairBus(near)
        async with crowd(tmp_path, drives, bus, named(far), "", [far.fileno()]):
            found += [
                await process_us(tmp_path, far, 1, lambda: bus.status.frames_received) for _ in range(3)
            ]
    figure = statistics.median(found)
    record(f"single frame, {drives} drives, µs", figure)
    show(f"a changed PDO that comes alone, {drives} drives: process", f"{figure:6.2f} µs of CPU")


async def process_us(folder: Path, far: socket.socket, burst: int, received: Callable[[], int]) -> float:
    """CPU of this process for each frame, in µs, beyond what it needs without them."""
    idle = await spent_in(IDLE_S) / IDLE_S
    before, spent, begin = received(), time.process_time(), time.monotonic()
    arguments = (named(far), str(FRAMES), str(burst), str(PAUSES_US[burst]))
    with peer(folder, "pdo_source", *arguments, files=[far.fileno()]):
        while received() - before < FRAMES:
            assert time.monotonic() < begin + LIMIT_S, f"{received() - before} of {FRAMES} frames"
            await asyncio.sleep(0.1)
    spent = time.process_time() - spent - idle * (time.monotonic() - begin)
    return spent * 1e6 / FRAMES


async def spent_in(seconds: float) -> float:
    """CPU seconds of this process in the next ``seconds``."""
    begin = time.process_time()
    await asyncio.sleep(seconds)
    return time.process_time() - begin


def tell(what: str, burst: int, changing: bool, ours: list[float], theirs: list[float]) -> None:
    our, their = statistics.median(ours), statistics.median(theirs)
    ratio = statistics.median(b / a for a, b in zip(ours, theirs, strict=True))
    kind = "changed" if changing else "unchanged"
    show(
        f"a {kind} PDO, {what}, bursts of {burst}",
        f"{our:6.2f} µs of CPU   canopen {their:6.1f}   canopen : ours {ratio:5.1f}",
    )
