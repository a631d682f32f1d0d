"""What has waited in a connection does not keep a drive moving when its controller hangs.

Each controller is a process of its own, which leaves as much behind as it can and then stops itself.
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from bridge.command import Action, Code, Do, Identity, Plant, Reply, Request, Source
from bridge.command.drive_link import NodeState
from bridge.config import ModbusTable, ZenohTable
from bridge.mirror import MirrorClient, MirrorPublisher, socket_endpoint
from bridge.northbound.modbus.server import ModbusServer
from bridge.northbound.modbus.units import units_of
from bridge.northbound.opcua.server import OpcUaServer
from bridge.northbound.zenoh import ZenohServer
from tests.support import sites
from tests.support.modbus_site import ENABLED, READY, SWITCH_ON_INHIBITED
from tests.support.node_states import node_goes, run_timers
from tests.support.opcua_site import OPEN, LocalView
from tests.support.views import view_of
from tests.support.zenoh_peer import free_port
from tests.support.zenoh_site import epoch

PEERS = Path(__file__).parents[1] / "peers"
TIMEOUT_MS = 2000
TIMEOUT_S = TIMEOUT_MS / 1000
MARGIN_S = 1.0
"""For a machine that is busy with other tests; a backlog was worth many seconds."""


def drive_says(plant: Plant, *words: int) -> None:
    now = time.monotonic()
    plant.drives["conveyor/fu1"].on_process_data([*words, 0, 0, 0][:4], now)


def enables(plant: Plant) -> bool:
    return plant.drives["conveyor/fu1"].channel.output.words[0] & 0xF == 0xF


def plant_for(control: str) -> Plant:
    drive = sites.drive("fu1", control, TIMEOUT_MS, "unit_id = 1")
    tables = (sites.modbus(0), "[opcua]\n", sites.zenoh())
    plant = sites.plant_of(sites.site(sites.bus(sites.node(drive)), *tables))
    node_goes(plant, plant.nodes["conveyor"], NodeState.OPERATIONAL, time.monotonic())
    drive_says(plant, SWITCH_ON_INHIBITED)
    return plant


@asynccontextmanager
async def running(plant: Plant) -> AsyncIterator[list[float]]:
    """Looks at the timers as the master does; gives the last time at which the drive was enabled."""
    last = [0.0]

    async def look() -> None:
        while True:
            now = time.monotonic()
            if enables(plant):
                last[0] = now
            run_timers(plant, now)
            await asyncio.sleep(0.002)

    task = asyncio.create_task(look())
    try:
        yield last
    finally:
        task.cancel()


async def enabled_after_it_hung(plant: Plant, peer: str, *arguments: object) -> float:
    """Seconds for which the drive was still enabled after its controller had spoken for the last time."""
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *(str(PEERS / peer), *map(str, arguments)),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        async with running(plant) as last:
            for word, status in (b"047E\n", READY), (b"047F\n", ENABLED):
                process.stdin.write(b"\n")
                assert await process.stdout.readline() == word
                drive_says(plant, status)
            assert enables(plant)
            process.stdin.write(b"\n")
            written_at = float(await process.stdout.readline())
            while time.monotonic() - max(last[0], written_at) < 1.0:  # noqa: ASYNC110
                await asyncio.sleep(0.05)
            return last[0] - written_at
    finally:
        process.kill()
        await process.wait()


@pytest.mark.landing(3)
@pytest.mark.parametrize(("connections", "seconds"), [(1, 0.0005), (1, 1.0), (8, 1.0)])
async def test_a_backlog_of_modbus_does_not_keep_a_drive_moving(connections: int, seconds: float) -> None:
    plant = plant_for("modbus")
    server = ModbusServer(
        view_of(plant),
        units_of(plant.catalogue),
        ModbusTable.model_validate({"listen": "127.0.0.1:0"}),
        time.monotonic,
    )
    await server.start()
    try:
        after = await enabled_after_it_hung(plant, "modbus_backlog.py", server.port, 1, connections, seconds)
    finally:
        await server.close()
    assert after < TIMEOUT_S + MARGIN_S


class BusyView(LocalView):
    """The way to the bus takes one request after the other, and 20 ms for each."""

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        self._lock = asyncio.Lock()
        self._waiting: list[asyncio.Task[None]] = []

    def submit(self, request: Request, reply: Reply) -> None:
        self._waiting.append(asyncio.create_task(self._carry(request, reply)))

    async def _carry(self, request: Request, reply: Reply) -> None:
        async with self._lock:
            await asyncio.sleep(0.02)
            super().submit(request, reply)


@pytest.mark.landing
async def test_a_backlog_of_opcua_does_not_keep_a_drive_moving(tmp_path: Path) -> None:
    view = BusyView(plant_for("opcua"))
    server = OpcUaServer(view, OPEN, tmp_path, "hall")
    await server.start()
    try:
        arguments = (server.endpoint_url, "conveyor/fu1", 400)
        after = await enabled_after_it_hung(view.plant, "opcua_backlog.py", *arguments)
    finally:
        await server.close()
    assert after < TIMEOUT_S + MARGIN_S


@pytest.mark.landing(2)
async def test_a_backlog_of_zenoh_does_not_keep_a_drive_moving(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a bus process that is busy with other things."""
    plant = plant_for("zenoh")
    view = view_of(plant, epoch_ns=epoch)
    submit = view.submit

    def submit_slowly(request: Request, reply: Reply) -> None:
        time.sleep(0.005)
        submit(request, reply)

    monkeypatch.setattr(view, "submit", submit_slowly)
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    settings = ZenohTable.model_validate({"listen": [endpoint]})
    server = ZenohServer(view, settings, "hall", time.monotonic)
    await server.start()
    try:
        key = "drives/hall/conveyor/fu1/command"
        after = await enabled_after_it_hung(plant, "zenoh_backlog.py", endpoint, key, 1.0)
    finally:
        await server.close()
    assert after < TIMEOUT_S + MARGIN_S


async def test_what_has_waited_on_the_link_between_our_processes_does_not_count(tmp_path: Path) -> None:
    plant = plant_for("opcua")
    endpoint = socket_endpoint(tmp_path / "run", "hall")
    publisher = MirrorPublisher(view_of(plant, epoch_ns=epoch), endpoint, time.monotonic)
    await publisher.start()
    front = MirrorClient(endpoint)
    try:
        await front.open()
        who = Identity(Source.OPCUA, "plc")
        fresh = Request(who, "conveyor/fu1", Do(Action.KEEP_ALIVE))
        assert (await front.request(fresh)).code is Code.OK
        for received_at, code in (
            (time.monotonic() - 1.0, Code.STALE),
            (time.monotonic() + 60.0, Code.STALE),
            (time.monotonic() - 0.2, Code.OK),
        ):
            request = Request(who, "conveyor/fu1", Do(Action.KEEP_ALIVE), received_at=received_at)
            assert (await front.request(request)).code is code
        stop = Request(who, "conveyor/fu1", Do(Action.STOP), received_at=time.monotonic() - 60.0)
        assert (await front.request(stop)).code is Code.OK
    finally:
        await front.close()
        await publisher.close()
