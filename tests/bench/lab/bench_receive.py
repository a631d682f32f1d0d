"""What a received PDO costs from the socket to its values, ours beside canopen's in the same run."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable
from pathlib import Path

import canopen
from canopen.objectdictionary import UNSIGNED16

from bridge.command.link import NodeState
from bridge.southbound.boot import PdoPlan
from bridge.southbound.bus.socketcan import SocketCanBus
from bridge.southbound.canopen.pdo import Entry, PdoCodec
from bridge.southbound.process_data import DrivePdos
from tests.bench.figures import show
from tests.peers.foreign_slave import variable
from tests.support.bench import Bench, write_site
from tests.support.process import peer

COUNT = 5000
LIMIT_S = 60.0


async def test_a_pdo_from_the_socket_to_the_image(tmp_path: Path) -> None:
    ours_us = await measure_ours(tmp_path)
    theirs_us = await asyncio.to_thread(measure_canopen, tmp_path)
    show("a PDO from the socket to the image", f"{ours_us:6.2f} µs of CPU")
    show("a PDO from the socket to canopen's values", f"{theirs_us:6.2f} µs of CPU")
    show("canopen : ours", f"{theirs_us / ours_us:6.2f}")
    assert theirs_us >= 4 * ours_us


async def measure_ours(folder: Path) -> float:
    bench = Bench(write_site(folder), present=False)
    drive = bench.plant.drives["conveyor/fu1"]
    bench.plant.on_node(bench.plant.nodes["conveyor"], NodeState.OPERATIONAL, time.monotonic())
    entries = tuple(Entry(0x3001 if n == 0 else 0x3003, max(n, 1), 16) for n in range(4))
    plan = PdoPlan(0x185, 255, 250, PdoCodec(entries), (0, 1, 2, 3))
    pdos = DrivePdos(drive, plan, plan, lambda frame, why: None)
    routes = {0x185: pdos.on_tpdo}
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
    network = canopen.Network()
    network.connect(interface="socketcan", channel="vcan0")
    dictionary = canopen.ObjectDictionary()
    dictionary.add_object(variable("status word", 0x3001, 0, UNSIGNED16, 0))
    for n in (1, 2, 3):
        dictionary.add_object(variable(f"value {n}", 0x3010 + n, 0, UNSIGNED16, 0))
    node = network.add_node(5, dictionary)
    mapping = canopen.pdo.base.PdoMap(node.tpdo, None, None)
    mapping.cob_id = 0x185
    for index in (0x3001, 0x3011, 0x3012, 0x3013):
        mapping.add_variable(index)
    received = 0

    def on_pdo(changed: canopen.pdo.base.PdoMap) -> None:
        nonlocal received
        received += 1
        for entry in changed:
            entry.raw  # noqa: B018 - reading is what is measured

    mapping.add_callback(on_pdo)
    network.subscribe(0x185, mapping.on_message)
    try:
        with peer(folder, "pdo_source", "vcan0", str(COUNT)):
            spent_s = asyncio.run(spent(lambda: received))
    finally:
        network.disconnect()
    # Its socket has the default buffer, and it is too slow for it: many frames are lost.
    assert received > COUNT / 10
    return spent_s * 1e6 / received
