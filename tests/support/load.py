"""A bus process under load, and what it made of it. Used by a wire test and by ``make bench``."""

from __future__ import annotations

import asyncio
import struct
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path

from bridge.can.virtual import VirtualBus, VirtualWire
from bridge.canopen.frame import Frame
from bridge.command import EventKind, Identity, Request, Source, Write
from bridge.project import load_project
from bridge.service.bus_process import BusProcess
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.runner import Simulation
from tests.support import sites
from tests.support.process import free_port

SYNC, RPDO1, TPDO2 = 0x080, 0x205, 0x285
TIMEOUT_S = 0.2
SYNC_PERIOD_S = 0.01
_PLC = Identity(Source.MODBUS, "127.0.0.1")


@dataclass(slots=True)
class Load:
    """A running bus process with its OPC UA front, on a virtual wire."""

    service: BusProcess
    end: VirtualBus
    opcua_url: str
    syncs: list[float] = field(default_factory=list[float])
    reactions: list[float] = field(default_factory=list[float])
    """Times in seconds from a silent controller's last telegram to the reaction on the bus."""

    def sync_lateness_s(self) -> list[float]:
        """Time by which each pause between two SYNCs was longer than its period."""
        pairs = zip(self.syncs, self.syncs[1:], strict=False)
        return [later - earlier - SYNC_PERIOD_S for earlier, later in pairs]

    async def fire(self, frames_per_s: int, seconds: float) -> tuple[int, int]:
        """Send TPDOs of fu2, each with its number; returns how many were sent and how many arrived."""
        drive = self.service.plant.drives["conveyor/fu2"]
        seen: set[int] = set()
        deliver = drive.on_process_data

        def count(words: object, now: float) -> None:
            number = struct.unpack("<I", struct.pack("<HH", *words[1:3]))[0]  # type: ignore[index]
            seen.add(number)
            deliver(words, now)  # type: ignore[arg-type]

        drive.on_process_data = count
        sent, begin = 0, time.monotonic()
        while (elapsed := time.monotonic() - begin) < seconds:
            for number in range(sent, round(elapsed * frames_per_s)):
                words = struct.pack("<HIH", 0x0B31, number + 1, 0)
                self.end.send(Frame(TPDO2, words), time.monotonic(), time.monotonic())
                sent += 1
            await asyncio.sleep(0.002)
        await asyncio.sleep(0.2)
        drive.on_process_data = deliver
        return sent, len(seen - {0})

    async def trip(self, times: int) -> None:
        """Let fu1's controller fall silent, again and again."""
        for _ in range(times):
            for word in (0x047E, 0x04FE, 0x047E, 0x047F):
                request = Request(_PLC, "conveyor/fu1", Write({"control_word": word}))
                last = time.monotonic()
                self.service.view.submit(request, lambda outcome: None)
            self._last_telegram = last
            await asyncio.sleep(TIMEOUT_S + 0.2)

    _last_telegram: float = 0.0
    serving: asyncio.Task[None] | None = None

    def on_frame(self, frame: Frame) -> None:
        if frame.can_id == SYNC:
            self.syncs.append(frame.time)
        elif frame.can_id == RPDO1 and self._last_telegram and not frame.data[0] & 0x02:
            self.reactions.append(frame.time - self._last_telegram)
            self._last_telegram = 0.0


@asynccontextmanager
async def loaded(folder: Path) -> AsyncIterator[Load]:
    """Start the bus process in this one, with a front of its own, and wait until the node is booted."""
    opcua = free_port()
    drives = [sites.drive(f"fu{n}", "modbus", 200) for n in (1, 2, 3, 4)]
    bus = sites.bus(sites.node(*drives, more="supervision_ms = 1000"), more="deadman_ms = 500")
    path = sites.write(folder, bus, sites.modbus(free_port()), sites.opcua(opcua))
    wire = VirtualWire()
    service = BusProcess(load_project(path), lambda table: wire.end(table.name))
    load = Load(service, wire.end("firehose"), f"opc.tcp://127.0.0.1:{opcua}")
    load.end.open(lambda: load.end.drain(time.monotonic()))
    wire.listeners.append(load.on_frame)
    simulation = Simulation(wire.end("simulation"), [NordTu4(5)])
    ready, booted = asyncio.Event(), asyncio.Event()
    service.plant.on_event(lambda event: booted.set() if event.kind is EventKind.NODE_BACK else None)
    load.serving = asyncio.create_task(service.run(ready.set))
    tasks = [asyncio.create_task(simulation.run()), load.serving]
    try:
        await asyncio.wait_for(ready.wait(), 60)
        await asyncio.wait_for(booted.wait(), 30)
        yield load
    finally:
        for task in reversed(tasks):
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
