"""What has waited in a connection does not keep a drive moving when its controller hangs."""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from bridge.command import Plant
from bridge.command.link import NodeState
from bridge.config import ModbusTable
from bridge.northbound.modbus.server import ModbusServer
from tests.support import sites
from tests.support.modbus_site import ENABLED, READY, SWITCH_ON_INHIBITED

PEER = Path(__file__).parents[1] / "peers" / "modbus_backlog.py"
TIMEOUT_MS = 600
TIMEOUT_S = TIMEOUT_MS / 1000
MARGIN_S = 0.4
"""For a machine that is busy with other tests; a backlog was worth 8 to 33 s."""


def drive_says(plant: Plant, *words: int) -> None:
    now = time.monotonic()
    plant.drives["conveyor/fu1"].on_process_data([*words, 0, 0, 0][:4], now)


def enables(plant: Plant) -> bool:
    return plant.drives["conveyor/fu1"].channel.output.words[0] & 0xF == 0xF


@asynccontextmanager
async def running(plant: Plant) -> AsyncIterator[list[float]]:
    """Looks at the timers as the master does; gives the last time at which the drive was enabled."""
    last = [0.0]

    async def look() -> None:
        while True:
            now = time.monotonic()
            if enables(plant):
                last[0] = now
            plant.on_time(now)
            await asyncio.sleep(0.002)

    task = asyncio.create_task(look())
    try:
        yield last
    finally:
        task.cancel()


@pytest.mark.parametrize(("connections", "seconds"), [(1, 0.0005), (1, 1.0), (8, 1.0)])
async def test_a_backlog_of_modbus_does_not_keep_a_drive_moving(connections: int, seconds: float) -> None:
    drive = sites.drive("fu1", "modbus", TIMEOUT_MS, "unit_id = 1")
    plant = sites.plant_of(sites.site(sites.bus(sites.node(drive)), sites.modbus(0)))
    plant.on_node(plant.nodes["conveyor"], NodeState.OPERATIONAL, time.monotonic())
    drive_says(plant, SWITCH_ON_INHIBITED)
    server = ModbusServer(plant, ModbusTable.model_validate({"listen": "127.0.0.1:0"}), time.monotonic)
    await server.start()
    peer = await asyncio.create_subprocess_exec(
        sys.executable,
        *(str(PEER), str(server.port), "1", str(connections), str(seconds)),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
    )
    assert peer.stdin is not None
    assert peer.stdout is not None
    async with running(plant) as last:
        for status in (READY, ENABLED):
            peer.stdin.write(b"\n")
            await peer.stdout.readline()
            drive_says(plant, status)
        assert enables(plant)
        peer.stdin.write(b"\n")
        written_at = float(await peer.stdout.readline())
        while time.monotonic() - max(last[0], written_at) < 1.0:  # noqa: ASYNC110
            await asyncio.sleep(0.05)
        assert last[0] - written_at < TIMEOUT_S + MARGIN_S
    peer.kill()
    await server.close()
