"""Controllers of all protocols fight for the same drives at full speed: what the drives see is never a mix,
and the audit log has everyone. Real clients, the whole service, frames off the virtual bus."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from asyncua import Client, ua
from pymodbus.client import AsyncModbusTcpClient

from bridge.can.virtual import VirtualWire
from bridge.canopen.frame import Frame
from bridge.command import EventKind, Source
from bridge.project import load_project
from bridge.service.bus_process import BusProcess
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.runner import Simulation
from tests.support import sites
from tests.support.opcua_client import call, word, write_all, write_value
from tests.support.opcua_site import namespace
from tests.support.process import free_port
from tests.support.zenoh_peer import Peer, until, zenoh_peer

NODE_ID = 5
RPDO_OF = {0x200 + NODE_ID: "conveyor/fu1", 0x300 + NODE_ID: "conveyor/fu2"}
SHUT_DOWN, ENABLE = 0x047E, 0x047F
FIGHT_S = 3.0
LEASE_MS = 300

PAIRS = {
    Source.MODBUS: ((SHUT_DOWN, 0x1001), (ENABLE, 0x1002)),
    Source.OPCUA: ((SHUT_DOWN, 0x1801), (ENABLE, 0x1802)),
    Source.ZENOH: ((SHUT_DOWN, 0x2001), (ENABLE, 0x2002)),
}
"""What each controller writes: a frame's setpoint says whose it is and which control word it goes with."""


@dataclass(slots=True)
class Seen:
    """The frames of one drive while they fought: with each the owner at that moment."""

    frames: list[tuple[int, int, Source | None]] = field(default_factory=list)

    def check(self) -> Counter[Source]:
        """Each frame is a pair of the owner's, or a stop without setpoint; how many pairs of whom."""
        pairs: Counter[Source] = Counter()
        for control_word, setpoint, owner in self.frames:
            is_stopped = control_word & 0xF != 0xF and setpoint == 0
            if not is_stopped:
                assert owner is not None, f"{control_word:04X}h {setpoint:04X}h, and nobody owns the drive"
                assert (control_word, setpoint) in PAIRS[owner], f"not what {owner.label} has written"
                pairs[owner] += 1
        return pairs


@dataclass(slots=True)
class Arena:
    service: BusProcess
    modbus: AsyncModbusTcpClient
    opcua: Client
    zenoh: Peer
    folder: Path
    seen: dict[str, Seen]

    def forget(self) -> None:
        for seen in self.seen.values():
            seen.frames.clear()

    async def write_modbus(self, drive: str, pair: tuple[int, int]) -> bool:
        unit = 1 if drive == "conveyor/fu1" else 2
        return not (await self.modbus.write_registers(0, list(pair), device_id=unit)).isError()

    async def write_opcua(self, drive: str, pair: tuple[int, int]) -> bool:
        space = await namespace(self.opcua)
        names = ("control_word", "setpoint_1")
        nodes = [ua.NodeId(f"{drive}/command/{name}", space) for name in names]
        codes = await write_all(
            self.opcua, [write_value(node, word(value)) for node, value in zip(nodes, pair, strict=True)]
        )
        return not any(codes)

    async def write_zenoh(self, drive: str, pair: tuple[int, int]) -> bool:
        telegram = {"control_word": pair[0], "setpoint_1": pair[1]}
        return (await self.zenoh.command(f"drives/hall/{drive}/command", telegram, "robot"))["ok"]

    async def take_opcua(self, drive: str) -> bool:
        ttl_ms = ua.Variant(LEASE_MS, ua.VariantType.UInt32)
        return not await call(self.opcua, drive, f"{drive}/TakeControl", [ttl_ms])

    async def take_zenoh(self, drive: str) -> bool:
        key = f"drives/hall/{drive}/command/take_control"
        return (await self.zenoh.command(key, {"ttl_ms": LEASE_MS}, "robot"))["ok"]

    def audit(self) -> list[dict[str, Any]]:
        """What was done, and what was refused."""
        files = (self.folder / "state").glob("audit*.jsonl")
        return [json.loads(line) for file in files for line in file.read_text("utf-8").splitlines()]


async def fight(
    write: Callable[[str, tuple[int, int]], Awaitable[bool]],
    drive: str,
    source: Source,
    take: Callable[[str], Awaitable[bool]] | None = None,
) -> Counter[bool]:
    """Write one pair after the other as fast as it goes; how many were taken and refused. With ``take`` the
    drive is taken whenever it can be, and after some telegrams left alone until the lease has run out."""
    ended = asyncio.get_running_loop().time() + FIGHT_S
    outcomes: Counter[bool] = Counter()
    while asyncio.get_running_loop().time() < ended:
        has_it = take is None or await take(drive)
        for pair in PAIRS[source] * (20 if has_it else 1):
            outcomes[await write(drive, pair)] += 1
        if take and has_it:
            await asyncio.sleep(2 * LEASE_MS / 1000)
    return outcomes


@asynccontextmanager
async def arena(folder: Path) -> AsyncIterator[Arena]:
    """fu1 is fixed to Modbus; fu2 belongs to whoever takes it."""
    ports = {"modbus": free_port(), "opcua": free_port(), "zenoh": free_port()}
    drives = (sites.drive("fu1", "modbus", 1000), sites.drive("fu2", "lease", 1000))
    bus = sites.bus(sites.node(*drives, more="supervision_ms = 1000"), more="deadman_ms = 500")
    tables = (sites.modbus(ports["modbus"]), sites.opcua(ports["opcua"]), sites.zenoh(ports["zenoh"]))
    wire = VirtualWire()
    service = BusProcess(load_project(sites.write(folder, bus, *tables)), lambda table: wire.end(table.name))
    seen = {drive: Seen() for drive in RPDO_OF.values()}

    def on_frame(frame: Frame) -> None:
        drive = RPDO_OF.get(frame.can_id)
        if drive:
            owner = service.plant.drives[drive].channel.owner
            words = [int.from_bytes(frame.data[i : i + 2], "little") for i in (0, 2)]
            seen[drive].frames.append((words[0], words[1], owner.source if owner else None))

    wire.listeners.append(on_frame)
    simulation = Simulation(wire.end("simulation"), [NordTu4(NODE_ID)])
    ready, booted = asyncio.Event(), asyncio.Event()
    service.plant.on_event(lambda event: booted.set() if event.kind is EventKind.NODE_BACK else None)
    tasks = [asyncio.create_task(simulation.run()), asyncio.create_task(service.run(ready.set))]
    try:
        await asyncio.wait_for(asyncio.gather(ready.wait(), booted.wait()), 30)
        modbus = AsyncModbusTcpClient("127.0.0.1", port=ports["modbus"])
        assert await modbus.connect()
        opcua = await _connected(f"opc.tcp://127.0.0.1:{ports['opcua']}")
        async with zenoh_peer(f"tcp/127.0.0.1:{ports['zenoh']}") as zenoh:
            yield Arena(service, modbus, opcua, zenoh, folder, seen)
        await opcua.disconnect()
        modbus.close()
    finally:
        for task in reversed(tasks):
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _connected(url: str) -> Client:
    """The front needs some seconds before it serves."""
    for _ in range(60):
        with suppress(OSError, TimeoutError, ConnectionError):
            client = Client(url, timeout=10)
            await client.connect()
            return client
        await asyncio.sleep(0.5)
    raise AssertionError("the OPC UA front does not serve")


@pytest.mark.landing
async def test_a_drive_never_sees_a_mix(tmp_path: Path) -> None:
    async with arena(tmp_path) as a:
        assert (await a.modbus.write_register(999, 1, device_id=1)).isError()
        assert not (await a.zenoh.command("drives/hall/conveyor/fu1/command", "no JSON", "robot"))["ok"]
        shown = ua.NodeId("conveyor/fu1/status/status_word", await namespace(a.opcua))
        assert all(await write_all(a.opcua, [write_value(shown, word(1))] * 3))
        assert await call(a.opcua, "conveyor/fu1", "conveyor/fu1/Start", [])
        assert await a.write_modbus("conveyor/fu1", PAIRS[Source.MODBUS][0])
        a.forget()
        fixed = await asyncio.gather(
            fight(a.write_modbus, "conveyor/fu1", Source.MODBUS),
            fight(a.write_zenoh, "conveyor/fu1", Source.ZENOH),
            fight(a.write_opcua, "conveyor/fu1", Source.OPCUA),
        )
        pairs = a.seen["conveyor/fu1"].check()
        print(f"fixed: {fixed}, frames {len(a.seen['conveyor/fu1'].frames)}, pairs {pairs}")
        assert [set(outcomes) for outcomes in fixed] == [{True}, {False}, {False}]
        assert pairs.keys() == {Source.MODBUS}
        assert pairs[Source.MODBUS] > 100

        leased = await asyncio.gather(
            fight(a.write_zenoh, "conveyor/fu2", Source.ZENOH, a.take_zenoh),
            fight(a.write_opcua, "conveyor/fu2", Source.OPCUA, a.take_opcua),
            fight(a.write_modbus, "conveyor/fu2", Source.MODBUS),
        )
        pairs = a.seen["conveyor/fu2"].check()
        print(f"leased: {leased}, frames {len(a.seen['conveyor/fu2'].frames)}, pairs {pairs}")
        assert set(leased[2]) == {False}
        assert pairs.keys() == {Source.ZENOH, Source.OPCUA}, "each of them had the drive for a while"

        await until(lambda: any(line["target"] == "conveyor/fu2" for line in a.audit()), "the audit log")
    # How stops have ended is the bridge's own word, and nobody's request.
    told = {(line["source"], line["code"]) for line in a.audit() if line["action"] != "stop_ended"}
    assert told == {
        *((source.label, code) for source in PAIRS for code in ("ok", "not_allowed")),
        ("modbus", "unknown_point"),
        ("zenoh", "malformed"),
        ("opcua", "read_only"),
        ("opcua", "not_valid"),
    }
    (read_only,) = [line for line in a.audit() if line["code"] == "read_only"]
    assert read_only["target"] == "conveyor/fu1"
    assert (read_only["count"], read_only["new"]) == (3, {"status_word": 1})
    refused = [line for line in a.audit() if line["code"] == "not_allowed"]
    expected = fixed[1][False] + fixed[2][False] + sum(outcomes[False] for outcomes in leased)
    assert sum(line.get("count", 1) for line in refused if line["action"] == "write") == expected
    assert len(a.audit()) < 2000, "what goes on for seconds at full speed does not fill a disk"
