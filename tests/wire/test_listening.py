"""A process without descriptors: whoever connects is turned away, the log has one line, and it goes on."""

from __future__ import annotations

import asyncio
import errno
import os
import resource
import socket
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any

import pytest

from bridge.cli.logs import log_fault
from bridge.config import ModbusTable
from bridge.northbound.listening import ListeningSocket
from bridge.northbound.modbus.server import ModbusServer
from bridge.northbound.modbus.units import units_of
from tests.support.modbus_site import make_plant
from tests.support.opcua_site import OPEN
from tests.support.opcua_site import serving as opcua_serving
from tests.support.page import Served
from tests.support.quiet import quiet_log
from tests.support.views import view_of

HOST = "127.0.0.1"
CLIENTS = 20


@asynccontextmanager
async def modbus(folder: Path) -> AsyncIterator[int]:
    plant = make_plant()
    table = ModbusTable.model_validate({"listen": f"{HOST}:0"})
    server = ModbusServer(view_of(plant), units_of(plant.catalogue), table, time.monotonic)
    await server.start()
    try:
        yield server.port
    finally:
        await server.close()


@asynccontextmanager
async def opcua(folder: Path) -> AsyncIterator[int]:
    async with opcua_serving(OPEN, folder) as (server, _):
        yield server.port


@asynccontextmanager
async def page(folder: Path) -> AsyncIterator[int]:
    async with Served().serving() as served:
        yield served.port


@contextmanager
def no_descriptors() -> Iterator[None]:
    """From here on this process can open nothing."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    lowest = os.dup(0)
    os.close(lowest)
    resource.setrlimit(resource.RLIMIT_NOFILE, (lowest, before[1]))
    try:
        with pytest.raises(OSError) as told:
            os.open(os.devnull, os.O_RDONLY)
        assert told.value.errno == errno.EMFILE
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def connecting(port: int) -> list[socket.socket]:
    """Clients that the kernel has accepted, and nobody else yet."""
    clients = [socket.create_connection((HOST, port)) for _ in range(CLIENTS)]
    for client in clients:
        client.setblocking(False)
    return clients


async def is_turned_away(client: socket.socket) -> bool:
    try:
        async with asyncio.timeout(3.0):
            return await asyncio.get_running_loop().sock_recv(client, 1) == b""
    except ConnectionResetError:
        return True
    except TimeoutError:
        return False


@pytest.mark.landing(3)
@pytest.mark.parametrize("serving", [modbus, opcua, page])
async def test_without_descriptors_clients_are_turned_away_with_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    serving: Callable[[Path], AbstractAsyncContextManager[int]],
) -> None:
    calls = 0
    accept = ListeningSocket.accept

    def counted(self: ListeningSocket) -> Any:
        nonlocal calls
        calls += 1
        return accept(self)

    monkeypatch.setattr(ListeningSocket, "accept", counted)
    asyncio.get_running_loop().set_exception_handler(log_fault)
    async with serving(tmp_path) as port:
        with quiet_log() as log:
            clients = connecting(port)
            with no_descriptors():
                assert all(await asyncio.gather(*map(is_turned_away, clients)))
                await asyncio.sleep(0.5)
            assert calls <= 2 * CLIENTS, "nobody asks without a pause"
            told = [line for line in log.lines if "no client can connect" in line]
            assert len(told) == 1, log.lines
            assert "Too many open files" in told[0]
            assert not [line for line in log.lines if "Traceback" in line]
        for client in clients:
            client.close()
        reader, writer = await asyncio.open_connection(HOST, port)
        await asyncio.sleep(0.2)
        assert not reader.at_eof(), "and then it is served again"
        writer.close()


async def test_where_not_even_the_spare_one_helps_asyncio_pauses_and_the_log_has_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """ENFILE: the whole machine has none."""
    calls = 0

    def fails(self: socket.socket) -> Any:
        nonlocal calls
        calls += 1
        raise OSError(errno.ENFILE, os.strerror(errno.ENFILE))

    asyncio.get_running_loop().set_exception_handler(log_fault)
    async with modbus(Path()) as port:
        with quiet_log() as log, monkeypatch.context() as patched:
            patched.setattr(socket.socket, "accept", fails)
            with socket.create_connection((HOST, port)):
                await asyncio.sleep(2.5)
            assert 2 <= calls <= 8, "once a second"
        assert len(log.lines) == 2, log.lines
        assert not [line for line in log.lines if "Traceback" in line]


def test_no_descriptor_left_is_one_line_wherever_it_is_met() -> None:
    with quiet_log() as log:
        loop = asyncio.new_event_loop()
        for number in range(100):
            try:
                raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))
            except OSError as error:
                log_fault(loop, {"message": f"step {number}", "exception": error})
        loop.close()
    assert len(log.lines) == 1
