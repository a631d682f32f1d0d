"""What the witness asks of the bridge, over real sockets: numbers, time-outs, and why there are none."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

import pytest

from bridge.command import Action, Do, Identity, Plant, Request, SetTimeout, Source
from bridge.command.drive_link import NodeState
from bridge.config import ModbusTable
from bridge.northbound.modbus.server import ModbusServer
from bridge.northbound.modbus.units import units_of
from bridge.witness.numbers import Numbers, UnitReading
from tests.support.modbus_site import READY, make_plant
from tests.support.node_states import node_goes
from tests.support.views import view_of

HOST = "127.0.0.1"
PLC = Identity(Source.MODBUS, "10.0.0.5", address="10.0.0.5:40001")
FU3 = "conveyor/fu3"


async def served(plant: Plant, **settings: object) -> ModbusServer:
    table = ModbusTable.model_validate({"listen": f"{HOST}:0", **settings})
    server = ModbusServer(view_of(plant), units_of(plant.catalogue), table, time.monotonic)
    await server.start()
    return server


async def readings(numbers: Numbers, enough: Callable[[list[UnitReading]], bool]) -> list[UnitReading]:
    """What is read until that is enough, or ``numbers`` are lost."""
    found: list[UnitReading] = []
    until = time.monotonic() + 10.0
    while time.monotonic() < until:
        now = time.monotonic()
        found += numbers.receive(now)
        numbers.on_time(now)
        if enough(found) or numbers.take_lost():
            return found
        await asyncio.sleep(0.005)
    pytest.fail("neither readings nor an end of them")


async def test_a_reading_has_the_number_and_the_time_out_in_force() -> None:
    plant = make_plant()
    now = time.monotonic()
    node_goes(plant, plant.nodes["conveyor"], NodeState.OPERATIONAL, now)
    plant.drives[FU3].on_process_data([READY, 0, 0, 0], now)
    plant.submit(Request(PLC, FU3, Do(Action.KEEP_ALIVE)), now, lambda outcome: None)
    plant.submit(Request(PLC, FU3, SetTimeout(timeout_ms=1500)), now, lambda outcome: None)
    server = await served(plant)
    numbers = Numbers(HOST, server.port, [1, 2, 9])
    try:
        found = await readings(numbers, lambda found: len(found) >= 3)
    finally:
        numbers.close()
        await server.close()
    assert {one.unit: one.timeout_ms for one in found} == {1: 200, 2: 200, 9: 1500}
    assert next(one.number for one in found if one.unit == 9) == 1
    assert all(one.asked_at <= one.answered_at for one in found)


async def test_of_outputs_the_number_alone_is_asked_for() -> None:
    """They have no register for a time-out that is in force."""
    server = await served(make_plant())
    numbers = Numbers(HOST, server.port, [1], [9])
    try:
        found = await readings(numbers, lambda found: len(found) >= 4)
    finally:
        numbers.close()
        await server.close()
    assert {one.unit: one.timeout_ms for one in found} == {1: 200, 9: None}


async def test_a_bridge_that_is_not_there_is_lost_each_time() -> None:
    server = await served(make_plant())
    port = server.port
    await server.close()
    numbers = Numbers(HOST, port, [1])
    assert await readings(numbers, bool) == []
    assert numbers.why == "Connection refused"


async def test_a_bridge_that_does_not_allow_this_address_is_lost() -> None:
    server = await served(make_plant(), allow=["10.0.0.0/8"])
    numbers = Numbers(HOST, server.port, [1])
    try:
        assert await readings(numbers, bool) == []
    finally:
        numbers.close()
        await server.close()
    assert "[modbus] allow" in numbers.why


async def test_a_unit_that_is_not_there_gives_no_reading_and_says_why() -> None:
    server = await served(make_plant())
    numbers = Numbers(HOST, server.port, [77, 1])
    try:
        found = await readings(numbers, lambda found: len(found) >= 2)
    finally:
        numbers.close()
        await server.close()
    assert {one.unit for one in found} == {1}
    assert numbers.why == "unit 77 answers exception 0Ah"
