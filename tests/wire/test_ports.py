"""Ports that cannot be opened at the start: the plant is served on the others, and people are told."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path

import pytest

from bridge.base.errors import Unavailable
from bridge.can.virtual import VirtualWire
from bridge.command import Event, EventKind
from bridge.project import load_project
from bridge.service.bus_process import BusProcess
from bridge.service.fronts import FRONTS
from bridge.service.parts import Ports
from tests.support import sites
from tests.support.process import free_port


@contextmanager
def taken() -> Iterator[socket.socket]:
    """A port of somebody else."""
    with socket.create_server(("127.0.0.1", 0)) as other:
        yield other


@asynccontextmanager
async def serving(
    folder: Path, *tables: str, more: str = "", fronts: bool = False
) -> AsyncIterator[tuple[BusProcess, list[Event]]]:
    """The bus process on a bus of its own."""
    path = sites.write(folder, sites.bus(sites.node(sites.drive("fu1", "modbus", 1000)), more=more), *tables)
    wire = VirtualWire()
    service = BusProcess(
        load_project(path), lambda table: wire.end(table.name), fronts=FRONTS if fronts else ()
    )
    events: list[Event] = []
    service.plant.on_event(events.append)
    is_open = asyncio.Event()
    running = asyncio.create_task(service.run(is_open.set))
    try:
        waiting = asyncio.create_task(is_open.wait())
        await asyncio.wait({running, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        if running.done():
            running.result()
        yield service, events
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)


async def until(service: BusProcess, failing: str) -> None:
    """Until the point names ``failing``, or nothing where that is empty."""
    async with asyncio.timeout(20):
        while True:
            shown = str(service.plant.image.read("bridge/fronts_failing").value)
            if (failing in shown) if failing else not shown:
                return
            await asyncio.sleep(0.02)


def answers(port: int) -> bool:
    with socket.create_connection(("127.0.0.1", port), 2):
        return True


async def test_one_port_that_is_taken_keeps_nothing_else_from_being_served(tmp_path: Path) -> None:
    gateway, zenoh = free_port(), free_port()
    with taken() as other:
        tables, more = (
            (sites.modbus(other.getsockname()[1]), sites.zenoh(zenoh)),
            f'gateway = "127.0.0.1:{gateway}"',
        )
        async with serving(tmp_path, *tables, more=more, fronts=True) as (service, events):
            await until(service, "modbus: has failed: modbus.listen")
            assert answers(gateway)
            await asyncio.wait_for(service.supervisor.all_known(), 20)
            assert answers(zenoh)
            [told] = [event for event in events if event.kind is EventKind.FRONT]
            assert "is taken by another program" in told.message and "it is started again" in told.message
            assert "not served: modbus" in service.supervisor.status


@pytest.mark.landing(3)
@pytest.mark.parametrize("what", ["modbus", "gateway", "zenoh"])
async def test_a_port_that_becomes_free_is_served(tmp_path: Path, what: str) -> None:
    with taken() as other:
        port = other.getsockname()[1]
        ports = {name: free_port() for name in ("modbus", "gateway", "zenoh")} | {what: port}
        tables = sites.modbus(ports["modbus"]), sites.zenoh(ports["zenoh"])
        more = f'gateway = "127.0.0.1:{ports["gateway"]}"'
        async with serving(tmp_path, *tables, more=more, fronts=True) as (service, _):
            await until(service, what)
            other.close()
            await until(service, "")
            assert answers(port)


async def test_a_front_whose_port_is_taken_keeps_nothing_else_from_being_served(tmp_path: Path) -> None:
    modbus = free_port()
    with taken() as other:
        tables = sites.modbus(modbus), sites.opcua(other.getsockname()[1])
        async with serving(tmp_path, *tables, fronts=True) as (service, events):
            await until(service, "opcua: cannot be started: opcua.listen")
            assert answers(modbus)
            [told] = [event for event in events if event.kind is EventKind.FRONT]
            assert told.message.startswith("the opcua front cannot be started")


async def test_no_port_at_all_is_an_end(tmp_path: Path) -> None:
    with taken() as other, pytest.raises(Unavailable, match="is taken by another program"):
        async with serving(tmp_path, sites.modbus(other.getsockname()[1])):
            pass


async def test_a_site_may_need_all_of_them() -> None:
    ports = Ports()

    async def opens() -> None:
        pass

    async def fails() -> None:
        raise Unavailable("opcua.listen: port 4840 is taken")

    await ports.open("modbus", opens)
    await ports.open("opcua", fails)
    ports.check(needs_all=False)
    assert ports.has("modbus") and not ports.has("opcua")
    with pytest.raises(Unavailable, match="port 4840 is taken"):
        ports.check(needs_all=True)
