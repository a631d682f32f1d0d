"""The sockets of the ASCII gateway: who may connect, and what a fault costs."""

from __future__ import annotations

import asyncio
import socket
import stat
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import cast

import pytest

from bridge.base.errors import OperationFailed, Unavailable
from bridge.command import Code, Outcome, Reply, Request, Role
from bridge.northbound.gateway.server import MOST_CLIENTS, GatewayServer
from bridge.northbound.view import View
from tests.unit.northbound.gateway.test_gateway_session import NET


class Bridge:
    """Answers every request in a moment, and fails for the object DEADh."""

    def __init__(self) -> None:
        self.requests: list[Request] = []

    def submit(self, request: Request, reply: Reply) -> None:
        self.requests.append(request)
        if "DEAD" in str(request.command):
            raise RuntimeError("a fault of our own")
        asyncio.get_running_loop().call_later(0.01, reply, Outcome(Code.OK, value="67 00"))


@pytest.fixture
def bridge() -> Bridge:
    return Bridge()


@pytest.fixture
async def server(tmp_path: Path, bridge: Bridge) -> AsyncIterator[GatewayServer]:
    path = tmp_path / "run" / "hall-can0.gateway"
    server = GatewayServer(cast("View", bridge), NET, path, "127.0.0.1:0", time.monotonic)
    await server.start()
    yield server
    await server.close()
    assert not path.exists()


async def ask(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, line: str) -> str:
    writer.write(f"{line}\n".encode())
    return (await reader.readline()).decode().strip()


async def test_the_socket_is_for_engineers_and_tcp_for_operators(
    server: GatewayServer, bridge: Bridge, tmp_path: Path
) -> None:
    path = tmp_path / "run" / "hall-can0.gateway"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    ends = [await asyncio.open_unix_connection(path), await asyncio.open_connection("127.0.0.1", server.port)]
    for end in ends:
        assert await ask(*end, "[1] 5 r 0x2066 1 i16") == "[1] 103"
        end[1].close()
    assert [request.identity.role for request in bridge.requests] == [Role.ENGINEER, Role.OPERATOR]
    assert not any(request.identity.sets_parameters for request in bridge.requests)


async def test_a_late_answer_is_an_error_in_time(server: GatewayServer) -> None:
    end = await asyncio.open_connection("127.0.0.1", server.port)
    assert await ask(*end, "[1] set command_timeout 1") == "[1] OK"
    assert await ask(*end, "[2] 5 r 0x2066 1 i16") == "[2] ERROR:103"
    end[1].close()


async def test_a_fault_of_ours_costs_one_connection(server: GatewayServer) -> None:
    broken = await asyncio.open_connection("127.0.0.1", server.port)
    other = await asyncio.open_connection("127.0.0.1", server.port)
    assert await ask(*broken, "[1] 5 r 0xDEAD 0") == ""
    assert await ask(*other, "[1] 5 r 0x2066 1 i16") == "[1] 103"
    other[1].close()


async def test_there_are_so_many_clients(server: GatewayServer) -> None:
    ends = [await asyncio.open_connection("127.0.0.1", server.port) for _ in range(MOST_CLIENTS)]
    for end in ends:
        assert await ask(*end, "[1] set node 5") == "[1] OK"
    refused = await asyncio.open_connection("127.0.0.1", server.port)
    assert await refused[0].read() == b""
    ends.pop()[1].close()
    await asyncio.sleep(0.05)
    again = await asyncio.open_connection("127.0.0.1", server.port)
    assert await ask(*again, "[1] set node 5") == "[1] OK"
    for end in (*ends, again):
        end[1].close()


async def test_who_says_nothing_makes_room_for_who_does(server: GatewayServer) -> None:
    silent = [await asyncio.open_connection("127.0.0.1", server.port) for _ in range(MOST_CLIENTS)]
    busy: list[tuple[asyncio.StreamReader, asyncio.StreamWriter]] = []
    for _ in range(MOST_CLIENTS):
        busy.append(await asyncio.open_connection("127.0.0.1", server.port))
        assert await ask(*busy[-1], "[1] set node 5") == "[1] OK"
    for reader, _ in silent:
        assert await reader.read() == b""
    for _, writer in (*silent, *busy):
        writer.close()


async def test_a_socket_left_behind_is_no_obstacle_and_a_folder_is(tmp_path: Path, bridge: Bridge) -> None:
    path = tmp_path / "left.gateway"
    for _ in range(2):
        left = GatewayServer(cast("View", bridge), NET, path, None, time.monotonic)
        await left.start()
        left._stop_listening()
    await left.close()
    path.mkdir()
    with pytest.raises(Unavailable, match=r"bus\.gateway"):
        await GatewayServer(cast("View", bridge), NET, path, None, time.monotonic).start()


async def test_that_nobody_can_connect_any_more_is_seen(server: GatewayServer) -> None:
    server._sockets[1].shutdown(socket.SHUT_RDWR)
    with pytest.raises(OperationFailed, match=r"bus\.gateway"):
        await server.failed()
