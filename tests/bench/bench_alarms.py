"""Memory of the OPC UA server after many events and many clients that come and go."""

from __future__ import annotations

import asyncio
import contextlib
import subprocess
import sys
import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from asyncua import Client, ua

from tests.bench.figures import record, show
from tests.bench.processes import usage
from tests.support.opcua_alarms import following

REPOSITORY = Path(__file__).parents[2]
ALARMS = 1000
SETTLED_S = 3.0
"""Time in which what is told last has been told, and saved."""


class Server:
    """The server of ``tests.bench.alarming``."""

    def __init__(self, process: asyncio.subprocess.Process, url: str) -> None:
        self._process = process
        self.url = url

    async def raise_all(self, turns: int) -> None:
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(f"{turns}\n".encode())
        assert await self._process.stdout.readline() == b"raised\n"

    async def memory_mb(self) -> float:
        await asyncio.sleep(SETTLED_S)
        return usage(self._process.pid).memory_mb


@contextlib.asynccontextmanager
async def alarming() -> AsyncIterator[Server]:
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "tests.bench.alarming"),
        cwd=REPOSITORY,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        assert process.stdout
        said = (await process.stdout.readline()).decode().split()
        yield Server(process, said[1])
    finally:
        process.kill()
        await process.wait()


@pytest.mark.timeout(600)
async def test_100000_events() -> None:
    async with (
        alarming() as server,
        Client(server.url, timeout=30, watchdog_intervall=10) as client,
        following(client, queue=2 * ALARMS) as follower,
    ):
        before, began = 0.0, time.monotonic()
        for turn in range(120):
            follower.events.clear()
            await server.raise_all(1)
            async with asyncio.timeout(30):
                while len(follower.events) < ALARMS:
                    await follower.another()
            if turn == 19:
                before, began = await server.memory_mb(), time.monotonic()
        per_s = 100 * ALARMS / (time.monotonic() - began)
        more = await server.memory_mb() - before
    record("opcua: MB more after 100,000 alarm events", more)
    show("100,000 alarm events to a client of asyncua's", f"{per_s:.0f} in a second")
    show("  memory of the server before, and more after them", f"{before:.1f} MB, {more:+.2f} MB")


async def come_and_go(url: str, times: int) -> None:
    """Clients one after the other, each with items for values and for events."""
    for _ in range(times):
        async with Client(url, timeout=30, watchdog_intervall=10) as client, following(client) as follower:
            watched = [client.nodes.server_state, client.nodes.namespace_array]
            await follower.subscription.subscribe_data_change(watched)


@pytest.mark.timeout(1800)
async def test_10000_clients_that_come_and_go() -> None:
    async with alarming() as server:
        await come_and_go(server.url, 1000)
        before, began = await server.memory_mb(), time.monotonic()
        await come_and_go(server.url, 10_000)
        per_s = 10_000 / (time.monotonic() - began)
        more = await server.memory_mb() - before
        async with Client(server.url, timeout=30, watchdog_intervall=10) as client:
            assert await client.nodes.server_state.read_value() == ua.ServerState.Running
    record("opcua: MB more after 10,000 clients", more)
    show("10,000 clients with a subscription that come and go", f"{per_s:.0f} in a second")
    show("  memory of the server before, and more after them", f"{before:.1f} MB, {more:+.2f} MB")
