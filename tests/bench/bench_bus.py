"""Figures of the bus process: what a PDO costs, what heavy traffic does to SYNC and watchdog."""

from __future__ import annotations

import asyncio
import struct
from pathlib import Path

import canopen
from canopen.objectdictionary import UNSIGNED16

from bridge.canopen.frame import Frame
from bridge.canopen.habits import HabitCounter
from bridge.canopen.pdo import PdoCodec, PdoEntry
from bridge.command.drive_link import NodeState
from bridge.node.boot import PdoPlan
from bridge.node.places.word_map import WordPlace
from bridge.node.process.process_data import DrivePdos
from bridge.node.process.unfit_frames import UnfitFrames
from tests.bench.figures import cpu_us, milliseconds, show
from tests.peers.foreign_slave import variable
from tests.support.bench import Bench, write_site
from tests.support.load import TIMEOUT_S, loaded
from tests.support.node_states import node_goes
from tests.support.process import peer

COUNT = 20_000


def frames(count: int) -> list[Frame]:
    return [Frame(0x185, struct.pack("<HHHH", 0x0B37, n & 0x3FFF, n & 0xFF, 0), 1.0) for n in range(count)]


def test_a_pdo_from_frame_to_image(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path), present=False)
    drive = bench.plant.drives["conveyor/fu1"]
    node_goes(bench.plant, bench.plant.nodes["conveyor"], NodeState.OPERATIONAL, 1.0)
    entries = tuple(PdoEntry(0x3001 if n == 0 else 0x3003, max(n, 1), 16) for n in range(4))
    plan = PdoPlan(0x185, 255, 250, PdoCodec(entries), tuple(WordPlace(n) for n in range(4)))
    unfit = UnfitFrames("conveyor", bench.plant.events, HabitCounter(), None)
    (tpdo,) = DrivePdos(drive, [plan], [plan], unfit).tpdos
    changing, same = frames(COUNT), [Frame(0x185, bytes(8), 1.0)] * COUNT

    def ours(list_of: list[Frame]) -> None:
        for frame in list_of:
            tpdo.on_frame(frame)

    changed_us = cpu_us(lambda: ours(changing), COUNT)
    show("a changed PDO, from frame to image", f"{changed_us:6.2f} µs of CPU")
    show("an unchanged PDO", f"{cpu_us(lambda: ours(same), COUNT):6.2f} µs of CPU")
    theirs_us = canopen_us()
    show("the same PDO in canopen (decoding alone)", f"{theirs_us:6.2f} µs of CPU")
    show("canopen's decoding : ours, image included", f"{theirs_us / changed_us:6.2f}")


def canopen_us() -> float:
    dictionary = canopen.ObjectDictionary()
    dictionary.add_object(variable("status word", 0x3001, 0, UNSIGNED16, 0))
    for n in (1, 2, 3):
        dictionary.add_object(variable(f"value {n}", 0x3010 + n, 0, UNSIGNED16, 0))
    node = canopen.LocalNode(5, dictionary)
    mapping = canopen.pdo.base.PdoMap(node.tpdo, None, None)
    mapping.cob_id = 0x185
    for index in (0x3001, 0x3011, 0x3012, 0x3013):
        mapping.add_variable(index)
    data = [bytearray(frame.data) for frame in frames(COUNT)]

    def work() -> None:
        for number, payload in enumerate(data):
            mapping.on_message(0x185, payload, float(number))
            for entry in mapping:
                entry.raw  # noqa: B018 - reading is what is measured

    return cpu_us(work, COUNT)


async def test_5000_pdos_a_second(tmp_path: Path) -> None:
    async with loaded(tmp_path) as load:
        sent, arrived = await load.fire(5000, 3.0)
        show("5,000 PDO/s for 3 s on a virtual bus: sent, lost", f"{sent}, {sent - arrived}")
        show("  pauses between SYNCs beyond 10 ms", milliseconds(load.sync_lateness_s()))


async def test_ten_thousand_monitored_items(tmp_path: Path) -> None:
    async with loaded(tmp_path) as load:
        with peer(tmp_path, "opcua_flood", load.opcua_url, "10000") as client:
            await asyncio.to_thread(client.wait_output, "creating", 60)
            load.syncs.clear()
            await load.trip(4)
            await asyncio.to_thread(client.wait_output, "created 10000", 60)
        late = [reaction - TIMEOUT_S for reaction in load.reactions]
        show("10,000 monitored items at once: SYNC late by", milliseconds(load.sync_lateness_s()))
        show("  reaction to a silent controller late by", milliseconds(late))
