"""Connections to zenoh's port that say nothing lock nobody out."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from bridge.zenohlink.strangers import PATIENCE_S
from tests.support.zenoh_peer import until, zenoh_peer
from tests.support.zenoh_rig import TOP, Rig, rig

MANY = 300
"""More than zenoh itself lets wait."""
SOON_S = 3.0
"""The peer is a new Python, too."""


def is_open(one: socket.socket) -> bool:
    try:
        return one.recv(1) != b""
    except BlockingIOError:
        return True
    except OSError:
        return False


def broken(r: Rig) -> int:
    return int(r.plant.image.read("bridge/zenoh_broken_connections").value)


@asynccontextmanager
async def idle_connections(endpoint: str, count: int) -> AsyncIterator[list[socket.socket]]:
    """So many, which are replaced when they end."""
    host, port = endpoint.removeprefix("tcp/").rsplit(":", 1)
    there: list[socket.socket] = []

    async def keep() -> None:
        while True:
            for one in [one for one in there if not is_open(one)]:
                there.remove(one)
                one.close()
            while len(there) < count:
                there.append(socket.create_connection((host, int(port)), timeout=2))
                there[-1].setblocking(False)
            await asyncio.sleep(0.02)

    keeping = asyncio.create_task(keep())
    try:
        await asyncio.sleep(0.5)
        yield there
    finally:
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)
        for one in there:
            one.close()


async def test_idle_connections_lock_no_client_out() -> None:
    async with rig(mode="client") as r, idle_connections(r.endpoint, MANY):
        begin = time.monotonic()
        async with zenoh_peer(r.endpoint, mode="client") as newcomer:
            assert (await newcomer.do("get", f"{TOP}/bridge/version"))["values"]
        assert time.monotonic() - begin < SOON_S


async def test_who_says_nothing_is_shown_the_door() -> None:
    async with rig(mode="client") as r, idle_connections(r.endpoint, 1) as there:
        first = there[0]
        await asyncio.sleep(1.5)
        assert first not in there


async def test_who_says_nothing_is_counted_and_named(caplog: pytest.LogCaptureFixture) -> None:
    async with rig(mode="client") as r, idle_connections(r.endpoint, 20):
        await until(lambda: broken(r) >= 20, "they are counted")
    sources = {vars(line)["line_source"] for line in caplog.records if "no zenoh session" in line.message}
    assert sources == {"127.0.0.1"}


async def test_who_comes_to_a_session_is_no_stranger(caplog: pytest.LogCaptureFixture) -> None:
    async with rig(mode="client") as r, zenoh_peer(r.endpoint):
        await asyncio.sleep(PATIENCE_S + 2.0)
        assert broken(r) == 0
    assert not [line for line in caplog.records if "no zenoh session" in line.message]
