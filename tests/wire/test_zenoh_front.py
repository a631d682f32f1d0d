"""zenoh as a process of its own: what strangers do to it, it may die of, and nothing else does."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from pymodbus.client import AsyncModbusTcpClient

from tests.support import sites
from tests.support.process import REPOSITORY, Process, drivebridge, free_port
from tests.support.zenoh_peer import Peer, zenoh_peer
from tests.support.zenoh_peer import until as until_in_loop
from tests.wire.test_fronts import children

KEEP_ALIVE, UNIT = 10, 1
BACK_S = 10.0
TOP = "drives/hall"
FU3 = f"{TOP}/conveyor/fu3"
OPERATION_ENABLED = 0x27


class Plant:
    """A bridge with one drive of a PLC, which is kept running, and one of zenoh."""

    def __init__(self, bridge: Process, plc: AsyncModbusTcpClient, endpoint: str) -> None:
        self.bridge = bridge
        self.endpoint = endpoint
        self._plc = plc

    async def start_drive(self) -> None:
        for words in ([0x047E, 0], [0x047F, 0x2000]):
            assert not (await self._plc.write_registers(0, words, device_id=UNIT)).isError()
        await until_in_loop(self._is_running, "the PLC's drive runs")

    async def keep_running(self) -> None:
        """The PLC, until cancelled."""
        while True:
            assert not (await self._plc.write_register(KEEP_ALIVE, 1, device_id=UNIT)).isError()
            await asyncio.sleep(0.1)

    async def is_running(self) -> bool:
        inputs = (await self._plc.read_input_registers(0, count=1, device_id=UNIT)).registers
        return inputs[0] & 0x6F == OPERATION_ENABLED

    def _is_running(self) -> bool:
        return "conveyor/fu1: controlled by modbus" in self.bridge.output()

    @property
    def front(self) -> int:
        [front] = children(self.bridge.pid)
        return front

    def ends_of_the_front(self) -> list[str]:
        return re.findall(r"the zenoh front (?:ended|held|gave) .*", self.bridge.output())

    async def answers(self) -> None:
        """zenoh does, to a session that comes now."""
        async with zenoh_peer(self.endpoint) as peer:
            await _until_answered(peer)


async def _until_answered(peer: Peer) -> None:
    deadline = time.monotonic() + BACK_S
    while not (await peer.do("get", f"{FU3}/identity/device_name"))["values"]:
        assert time.monotonic() < deadline, "zenoh is back"
        await asyncio.sleep(0.1)


@asynccontextmanager
async def plant(folder: Path, more: str = "") -> AsyncIterator[Plant]:
    modbus, zenoh = free_port(), free_port()
    fu1 = sites.drive("fu1", "modbus", 2000, f"unit_id = 1\n{sites.SCALED}")
    bus = sites.bus(sites.node(fu1, sites.drive("fu3", "zenoh", 1000)), more="deadman_ms = 500")
    path = sites.write(folder, bus, sites.modbus(modbus), sites.zenoh(zenoh))
    path.write_text(
        path.read_text(encoding="utf-8").replace("[site]\n", f"[site]\n{more}\n", 1), encoding="utf-8"
    )
    with drivebridge(folder, "run", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        bridge.wait_output("node operational")
        plc = AsyncModbusTcpClient("127.0.0.1", port=modbus)
        assert await plc.connect()
        it = Plant(bridge, plc, f"tcp/127.0.0.1:{zenoh}")
        await it.start_drive()
        keeping = asyncio.create_task(it.keep_running())
        try:
            yield it
            assert not keeping.done(), "the PLC went on all the time"
            assert await it.is_running(), "and its drive with it"
            assert "hung" not in bridge.output()
        finally:
            keeping.cancel()
            plc.close()


async def attack(plant: Plant, *what: str) -> None:
    script = str(REPOSITORY / "tests" / "peers" / "zenoh_keys.py")
    attacking = await asyncio.create_subprocess_exec(
        sys.executable, script, plant.endpoint, *what, stdout=asyncio.subprocess.PIPE
    )
    try:
        async with asyncio.timeout(30):
            # It may be cut off before it has done everything.
            await attacking.communicate()
    finally:
        if attacking.returncode is None:
            attacking.kill()
            await attacking.wait()


@pytest.mark.landing
async def test_a_key_of_8000_words_stops_no_drive_whatever_is_done_with_it(tmp_path: Path) -> None:
    doings = ("token", "queryable", "subscriber", "alias", "publisher", "get", "put")
    async with plant(tmp_path) as it:
        for mode in ("client", "peer", "router"):
            await asyncio.gather(*(attack(it, mode, doing, "8000", "1") for doing in doings))
        await it.answers()
        assert it.ends_of_the_front() == [], "not even the front ends"


@pytest.mark.landing
async def test_names_without_end_end_the_front_and_no_drive(tmp_path: Path) -> None:
    """zenoh keeps each key for ever, and takes two megabytes for one of 2,000 words."""
    async with plant(tmp_path, "front_memory_mb = 200") as it:
        await attack(it, "client", "queryable", "2000", "300")
        await until_in_loop(it.ends_of_the_front, "the front has been ended")
        assert it.ends_of_the_front()[0].startswith(("the zenoh front held ", "the zenoh front ended (SIG"))
        await it.answers()


@pytest.mark.landing
async def test_a_killed_front_is_a_silent_controller_and_comes_back(tmp_path: Path) -> None:
    async with plant(tmp_path) as it:
        async with zenoh_peer(it.endpoint) as peer:
            await _until_answered(peer)
            for word in (0x047E, 0x047F):
                telegram = {"control_word": word, "setpoint_1": 0x1000}
                assert (await peer.command(f"{FU3}/command", telegram, "plc"))["ok"]
            os.kill(it.front, signal.SIGKILL)
            silent = "conveyor/fu3: zenoh:plc was silent for 1000 ms"
            await until_in_loop(lambda: silent in it.bridge.output(), "its drive is stopped")
            assert it.ends_of_the_front() == ["the zenoh front ended (SIGKILL); it is started again in 0.2 s"]
        await it.answers()
