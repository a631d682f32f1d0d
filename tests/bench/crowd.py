"""The master as the service runs it, on a bus of many nodes that another process plays."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from bridge.can.socketcan import SocketCanBus
from bridge.canopen.frame import Frame
from bridge.catalogue import Catalogue
from bridge.command import Event, EventKind, Plant
from bridge.command.drive_link import NodeState
from bridge.master.master import Master
from bridge.master.network import Network
from tests.bench.figures import as_the_service, lateness, show
from tests.support.process import Process, peer
from tests.support.quick import MAPPING, NORD, quick_site

NODES = 126
"""With the bridge itself there are 127."""
KEYS = "bitrate = 1000000\nsync_period_ms = 1\nrpdo_period_ms = 50"
SYNC_S = 0.001
MEASURED_S = 10.0
BOOT_LIMIT_S = 60.0
NODE = "supervision_ms = 300\n"
"""The boot-up sets the heartbeat to a third of it: 100 ms."""


_OF_SLAVES = frozenset((0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700))
"""Identifiers without node id: EMCY, TPDO1 ... 4, SDO answers, heartbeat (CiA 301, pre-defined connection
set)."""


class Hearing(Network):
    """Keeps the time stamps of all frames that the nodes sent; it gets some of the bridge's own, too."""

    heard: list[float]

    def on_frames(self, frames: list[Frame], now: float) -> None:
        self.heard += [
            frame.time
            for frame in frames
            if 1 <= frame.can_id & 0x7F <= NODES and frame.can_id & ~0x7F in _OF_SLAVES
        ]
        super().on_frames(frames, now)


@dataclass(slots=True)
class Crowd:
    """A running master and its nodes, all operational."""

    bus: SocketCanBus
    network: Hearing
    plant: Plant
    peer: Process
    report: Path
    events: list[Event]

    async def end(self) -> tuple[list[float], list[float]]:
        """Stop the nodes. Gives when SYNCs came (s since 1970) and when they sent a frame (monotonic s)."""
        await asyncio.to_thread(self.peer.stop)
        await asyncio.sleep(0.05)
        said = json.loads(self.report.read_text(encoding="utf-8"))
        return said["syncs"], said["sent"]


@asynccontextmanager
async def crowd(
    folder: Path, nodes: int, bus: SocketCanBus, channel: str, keys: str, files: Sequence[int] = ()
) -> AsyncIterator[Crowd]:
    """Boot ``nodes`` nodes at the other end of ``bus``, which is ``channel`` (one of ``files``, or an
    interface). ``keys`` are further ones of the site's bus."""
    site = quick_site(folder, nodes, bus=keys, common=NODE)
    plant = Plant(Catalogue.of(site, {MAPPING: NORD}), "0", time.monotonic())
    events: list[Event] = []
    plant.on_event(events.append)
    network = Hearing(site.bus[0], plant.side_of(site.bus[0]))
    network.heard = []
    master = Master([(bus, network)], plant, time.monotonic)
    report = folder / "crowd.json"
    with peer(folder, "crowd", channel, str(nodes), str(report), files=files) as process:
        await asyncio.to_thread(process.wait_output, "is there")
        await master.start()
        try:
            end = time.monotonic() + BOOT_LIMIT_S
            while not all(node.state is NodeState.OPERATIONAL for node in network.nodes):
                assert process.popen.poll() is None, process.output()
                assert time.monotonic() < end, [str(event) for event in events[-5:]]
                await asyncio.sleep(0.1)
            await asyncio.sleep(0.5)
            events.clear()
            yield Crowd(bus, network, plant, process, report, events)
        finally:
            await master.close()


async def measure(running: AbstractAsyncContextManager[Crowd]) -> tuple[int, int]:
    """Let a crowd run for a while and print what it took. Gives how many frames and how often nodes were
    lost."""
    with as_the_service() as priority:
        async with running as nodes:
            begin, wall, spent = time.monotonic(), time.time(), time.process_time()
            await asyncio.sleep(MEASURED_S)
            took_s, spent = time.monotonic() - begin, time.process_time() - spent
            told = [event.message for event in nodes.events if event.kind is EventKind.NODE_LOST]
            syncs, sent = await nodes.end()
    sent, heard = (sum(at > begin for at in times) for times in (sent, nodes.network.heard))
    syncs = [at for at in syncs if wall <= at < wall + took_s]
    show("127 nodes, 100 ms heartbeats and TPDOs, 1 ms SYNC: CPU", f"{100 * spent / took_s:6.1f} %")
    show(f"  of the process, which ran {priority}", "")
    show("  SYNC late by", lateness(syncs, SYNC_S))
    show("  frames of the nodes, of these lost; nodes lost", f"{sent}, {sent - heard}; {len(told)}")
    return sent - heard, len(told)
