"""A drive that asks for a life sign, by Modbus and OPC UA, with clients that we did not write."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path

from asyncua import Client, ua
from pymodbus.client import AsyncModbusTcpClient

from bridge.command import Plant
from tests.support import sites
from tests.support.modbus_site import READY
from tests.support.node_states import run_timers
from tests.support.opcua_client import node, word, write
from tests.support.opcua_site import OPEN, serving
from tests.wire.test_modbus import drive_says, on_the_bus, pymodbus
from tests.wire.test_modbus import serving as serving_modbus

UNIT = 1
SHUT_DOWN, RUN = 0x047E, 0x047F
"""NORD's (BU 2500 §6.8)."""
TOKEN, BROUGHT = 26, 14
TIMEOUT_S = 2.0
ILLEGAL_VALUE = 3


def plant_of(control: str, more: str = "") -> Plant:
    more = f"unit_id = 1\nlife_sign = true\nparameters = {{ P105 = 50.0 }}\n{more}"
    bus = sites.bus(sites.node(sites.drive("fu1", control, round(TIMEOUT_S * 1000), more)))
    plant = sites.plant_of(sites.site(bus, sites.modbus(0), "[opcua]\n"))
    drive_says(plant, READY)
    return plant


def runs(plant: Plant) -> bool:
    run_timers(plant, time.monotonic())
    return on_the_bus(plant)[0] & 0xF == 0xF


async def token_of(plc: AsyncModbusTcpClient) -> int:
    return (await plc.read_input_registers(TOKEN, count=1, device_id=UNIT)).registers[0]


async def test_a_plc_that_brings_the_token_back_moves_the_drive_and_a_relay_does_not() -> None:
    plant = plant_of("modbus")
    async with serving_modbus(plant) as server, pymodbus(server) as plc:
        refused = await plc.write_register(0, SHUT_DOWN, device_id=UNIT)
        assert refused.exception_code == ILLEGAL_VALUE
        for control_word in (SHUT_DOWN, RUN):
            assert not (await plc.write_register(BROUGHT, await token_of(plc), device_id=UNIT)).isError()
            assert not (await plc.write_register(0, control_word, device_id=UNIT)).isError()
        tokens: set[int] = set()
        end = time.monotonic() + 1.5 * TIMEOUT_S
        while time.monotonic() < end:
            token = await token_of(plc)
            tokens.add(token)
            await plc.write_register(BROUGHT, token, device_id=UNIT)
            assert (await plc.read_holding_registers(BROUGHT, count=1, device_id=UNIT)).registers == [token]
            assert not (await plc.write_register(0, RUN, device_id=UNIT)).isError()
            assert runs(plant)
            await asyncio.sleep(0.1)
        assert len(tokens) >= 3, "another one each second"

        stopped_by = time.monotonic() + TIMEOUT_S + 0.2
        while runs(plant):
            assert time.monotonic() < stopped_by, (
                "a repeated token moves the drive no longer than its time-out"
            )
            await plc.write_register(BROUGHT, token, device_id=UNIT)
            await plc.write_register(0, RUN, device_id=UNIT)
            await asyncio.sleep(0.02)
        assert plant.drives["conveyor/fu1"].channel.is_tripped
        assert (await plc.write_register(11, 1, device_id=UNIT)).exception_code == ILLEGAL_VALUE
        for register, value in ((BROUGHT, await token_of(plc)), (11, 1), (0, SHUT_DOWN), (0, RUN)):
            assert not (await plc.write_register(register, value, device_id=UNIT)).isError()
        assert runs(plant)


async def test_words_and_token_in_one_request_are_one_telegram() -> None:
    """Registers 0 to 14; 12 has to be what it is, where the site's owner may write it."""
    plant = plant_of("modbus", "fieldbus_timeout_writable = true")
    async with serving_modbus(plant) as server, pymodbus(server) as plc:
        for control_word in (SHUT_DOWN, RUN):
            block = [
                control_word,
                0,
                0,
                0,
                0,
                0,
                0,
                0,
                0,
                0,
                1,
                0,
                round(TIMEOUT_S * 1000),
                0,
                await token_of(plc),
            ]
            assert not (await plc.write_registers(0, block, device_id=UNIT)).isError()
        assert runs(plant)


async def test_a_client_of_opcua_writes_the_token_beside_the_word(tmp_path: Path) -> None:
    plant = plant_of("opcua")
    top = "conveyor/fu1"
    async with serving(OPEN, tmp_path, plant) as (server, _), Client(server.endpoint_url) as client:
        offered = await node(client, f"{top}/supervision/life_sign")

        async def writes(control_word: int, **token: int) -> set[int]:
            """The status codes."""
            values = {"control_word": control_word, **token}
            return set(await write(client, **{leaf: word(value) for leaf, value in values.items()}))

        plant.refresh(time.monotonic())
        assert await writes(SHUT_DOWN) == {ua.StatusCodes.BadOutOfRange}
        token = await offered.read_value()
        assert await writes(SHUT_DOWN, life_sign=token) == {ua.StatusCodes.Good}
        assert await writes(RUN, life_sign=token) == {ua.StatusCodes.Good}
        assert runs(plant)
        stopped_by = time.monotonic() + TIMEOUT_S + 0.2
        while runs(plant):
            assert time.monotonic() < stopped_by, "what is repeated grows old"
            await writes(RUN, life_sign=token)
            await asyncio.sleep(0.02)
        assert plant.drives[top].channel.is_tripped
