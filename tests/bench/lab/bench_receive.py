"""What a received PDO costs from the socket to its values, ours beside canopen's in the same run."""

from __future__ import annotations

import asyncio
import contextlib
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import canopen

from bridge.can.socketcan import SocketCanBus
from bridge.canopen.habits import HabitCounter
from bridge.canopen.pdo import PdoCodec, PdoEntry
from bridge.command.drive_link import NodeState
from bridge.node.boot import PdoPlan
from bridge.node.places.word_map import WordPlace
from bridge.node.process.process_data import DrivePdos
from bridge.node.process.unfit_frames import UnfitFrames
from tests.bench.canopen_node import with_four_words
from tests.bench.figures import show
from tests.support.bench import Bench, write_site
from tests.support.node_states import node_goes
from tests.support.process import peer

COUNT = 5000
ROUNDS = 3
LIMIT_S = 60.0


async def test_a_pdo_from_the_socket_to_the_image(tmp_path: Path) -> None:
    rounds = [
        (await measure_ours(tmp_path), await asyncio.to_thread(measure_canopen, tmp_path))
        for _ in range(ROUNDS)
    ]
    ours_us, theirs_us = (statistics.median(column) for column in zip(*rounds, strict=True))
    ratio = statistics.median(theirs / ours for ours, theirs in rounds)
    show("a PDO from the socket to the image", f"{ours_us:6.2f} µs of CPU")
    show("a PDO from the socket to canopen's values", f"{theirs_us:6.2f} µs of CPU")
    show("canopen : ours", f"{ratio:6.2f}")
    assert ratio >= 4


async def measure_ours(folder: Path) -> float:
    bench = Bench(write_site(folder), present=False)
    drive = bench.plant.drives["conveyor/fu1"]
    node_goes(bench.plant, bench.plant.nodes["conveyor"], NodeState.OPERATIONAL, time.monotonic())
    entries = tuple(PdoEntry(0x3001 if n == 0 else 0x3003, max(n, 1), 16) for n in range(4))
    plan = PdoPlan(0x185, 255, 250, PdoCodec(entries), tuple(WordPlace(n) for n in range(4)))
    unfit = UnfitFrames("conveyor", bench.plant.events, HabitCounter(), None)
    pdos = DrivePdos(drive, (plan,), (plan,), unfit)
    routes = pdos.handlers
    bus = SocketCanBus("can0", "vcan0")
    received = 0

    def wake() -> None:
        nonlocal received
        frames = bus.drain(time.monotonic())
        received += len(frames)
        for frame in frames:
            routes[frame.can_id](frame)

    bus.open(wake)
    bus.accept([0x185])
    with contextlib.closing(bus), peer(folder, "pdo_source", "vcan0", str(COUNT)):
        spent_s = await spent(lambda: received)
    assert received == COUNT, f"{received} of {COUNT}; lost {bus.status.frames_lost}"
    return spent_s * 1e6 / received


async def spent(received: Callable[[], int]) -> float:
    """CPU seconds of this process until nothing more arrives."""
    begin, end, before = time.process_time(), time.monotonic() + LIMIT_S, -1
    while (not before or received() != before) and received() < COUNT and time.monotonic() < end:
        before = received()
        await asyncio.sleep(0.5)
    return time.process_time() - begin


def measure_canopen(folder: Path) -> float:
    received = 0

    def count() -> None:
        nonlocal received
        received += 1

    network = canopen.Network()
    network.connect(interface="socketcan", channel="vcan0")
    with_four_words(network, count)
    try:
        with peer(folder, "pdo_source", "vcan0", str(COUNT)):
            spent_s = asyncio.run(spent(lambda: received))
    finally:
        network.disconnect()
    # Its socket has the default buffer, and it is too slow for it: many frames are lost.
    assert received > COUNT / 10
    return spent_s * 1e6 / received
