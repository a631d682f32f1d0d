"""One owner is one connection, with Modbus clients that we did not write."""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import AsyncIterator
from dataclasses import dataclass

import pytest

from bridge.command import Event, EventKind, Plant
from bridge.northbound.modbus.server import ModbusServer
from tests.support import sites
from tests.support.modbus_site import ENABLED, READY
from tests.wire.test_modbus import HOST, drive_says, mbpoll, on_the_bus, pymodbus, serving

UNIT = 1
SHUT_DOWN, RUN = 0x047E, 0x047F
"""NORD's (BU 2500 §6.8)."""
NOT_ALLOWED = 1
TIMEOUT_S = 2.0
SITE = sites.site(
    sites.bus(sites.node(sites.drive("fu1", "modbus", round(TIMEOUT_S * 1000), "unit_id = 1"))),
    sites.modbus(0),
)


@dataclass
class Hall:
    plant: Plant
    server: ModbusServer
    events: list[Event]

    def told(self, kind: EventKind) -> list[str]:
        return [event.message for event in self.events if event.kind is kind]

    @property
    def runs(self) -> bool:
        return on_the_bus(self.plant)[0] & 0xF == 0xF


@pytest.fixture
async def hall() -> AsyncIterator[Hall]:
    plant = sites.plant_of(SITE)
    drive_says(plant, READY)
    events: list[Event] = []
    plant.on_event(events.append)
    async with serving(plant) as server:
        yield Hall(plant, server, events)


async def test_two_programs_behind_one_address_do_not_move_a_drive_in_turns(hall: Hall):
    async with pymodbus(hall.server) as one, pymodbus(hall.server) as other:
        for word in (SHUT_DOWN, RUN):
            assert not (await one.write_register(0, word, device_id=UNIT)).isError()
        drive_says(hall.plant, ENABLED)
        for _ in range(50):
            refused = await other.write_register(0, SHUT_DOWN, device_id=UNIT)
            assert refused.exception_code == NOT_ALLOWED
            assert hall.runs
            assert not (await one.write_register(0, RUN, device_id=UNIT)).isError()
        ports = [client.ctx.transport.get_extra_info("sockname")[1] for client in (one, other)]
        names = [f"modbus:{HOST} port {port}" for port in ports]
        why = f"write by {names[1]} refused: the drive is controlled by {names[0]}"
        assert set(hall.told(EventKind.REFUSED)) == {why}


async def test_the_second_one_may_read_and_stop(hall: Hall):
    async with pymodbus(hall.server) as one, pymodbus(hall.server) as other:
        for word in (SHUT_DOWN, RUN):
            await one.write_register(0, word, device_id=UNIT)
            assert (await other.read_holding_registers(0, count=2, device_id=UNIT)).registers[0] == word
        assert hall.runs
        assert not (await other.write_register(13, 1, device_id=UNIT)).isError()
        assert not hall.runs


async def test_it_goes_on_at_once_where_the_first_one_is_closed(hall: Hall):
    async with pymodbus(hall.server) as other:
        async with pymodbus(hall.server) as one:
            for word in (SHUT_DOWN, RUN):
                await one.write_register(0, word, device_id=UNIT)
            assert (await other.write_register(0, RUN, device_id=UNIT)).isError()
        assert not (await other.write_register(0, RUN, device_id=UNIT)).isError()
        assert hall.runs


async def test_it_takes_over_a_half_open_one_when_its_time_is_up(hall: Hall):
    """The first client has vanished without closing: the drive has stopped before the second one commands."""
    drive = hall.plant.drives["conveyor/fu1"]
    async with pymodbus(hall.server) as one, pymodbus(hall.server) as other:
        for word in (SHUT_DOWN, RUN):
            await one.write_register(0, word, device_id=UNIT)
        began = asyncio.get_running_loop().time()
        while (await other.write_register(0, RUN, device_id=UNIT)).isError():
            assert asyncio.get_running_loop().time() < began + 5
            await asyncio.sleep(0.02)
        assert asyncio.get_running_loop().time() - began >= 0.9 * TIMEOUT_S
        assert drive.channel.trips == 1
        assert not hall.runs
        for register, value in ((11, 1), (0, SHUT_DOWN), (0, RUN)):
            assert not (await other.write_register(register, value, device_id=UNIT)).isError()
        assert hall.runs


async def test_a_client_that_connects_anew_for_each_write_moves_the_drive(hall: Hall):
    for word in (SHUT_DOWN, RUN, RUN, SHUT_DOWN):
        status, output = await mbpoll(hall.server, "-a", "1", "-r", "0", "-t", "4", "--", str(word))
        assert status == 0, output
        assert hall.runs is (word == RUN)
    assert not hall.told(EventKind.REFUSED)


def _write(word: int) -> bytes:
    return struct.pack(">HHHBBHH", 1, 0, 6, UNIT, 6, 0, word)


async def _over_a_new_connection(port: int, word: int) -> bytes:
    loop = asyncio.get_running_loop()
    with socket.socket() as sock:
        sock.setblocking(False)
        await loop.sock_connect(sock, (HOST, port))
        await loop.sock_sendall(sock, _write(word))
        return await loop.sock_recv(sock, 64)


async def test_hundreds_of_connections_one_after_the_other_are_one_controller(hall: Hall):
    assert await _over_a_new_connection(hall.server.port, SHUT_DOWN) == _write(SHUT_DOWN)
    for _ in range(300):
        assert await _over_a_new_connection(hall.server.port, RUN) == _write(RUN)
        assert hall.runs
    assert not hall.told(EventKind.REFUSED)


async def test_the_order_in_which_an_end_and_a_beginning_are_read_does_not_matter(hall: Hall):
    """The end of the first connection waits unread in the kernel while the second one writes."""
    loop = asyncio.get_running_loop()
    with socket.socket() as first:
        first.setblocking(False)
        await loop.sock_connect(first, (HOST, hall.server.port))
        for word in (SHUT_DOWN, RUN):
            await loop.sock_sendall(first, _write(word))
            assert await loop.sock_recv(first, 64) == _write(word)
        (session,) = hall.server._sessions
        assert session._transport
        session._transport.pause_reading()
    await asyncio.sleep(0.05)
    assert session in hall.server._sessions, "its end has not been read"
    assert await _over_a_new_connection(hall.server.port, RUN) == _write(RUN)
    assert hall.runs
    await asyncio.sleep(0.05)
    assert session._transport is None, "nothing that it may still hold is read"
