"""The register map of a node that is no drive: its rows by their addresses, without overlap."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.northbound.modbus.device_registers import DeviceMap
from bridge.northbound.modbus.registers import RegisterTable, Row
from tests.support.devices import ENCODER, IO_BLOCK, OUTPUTS
from tests.support.nodes import device_plant


def map_of(folder: Path, mapping: str = ENCODER, more: str = "") -> DeviceMap:
    plant = device_plant(folder, mapping, more)
    return DeviceMap(plant.catalogue.devices["shaft"])


def rows(one: DeviceMap, table: RegisterTable) -> dict[int, Row]:
    return {row.address: row for row in one.rows if row.table is table}


def test_inputs_begin_at_32_in_the_order_of_the_mapping(tmp_path: Path) -> None:
    """docs/reference: an integer that is not scaled has the registers of its type, all else is a float32."""
    found = rows(map_of(tmp_path), RegisterTable.INPUT_REGISTER)
    named = {address: (row.name, row.type) for address, row in found.items() if address >= 32}
    assert named == {
        32: ("input/position", "float32"),
        34: ("input/speed", "int16"),
        35: ("input/alarms", "uint16"),
    }
    assert found[32].unit == "rev"


def test_named_bits_are_discrete_inputs(tmp_path: Path) -> None:
    found = rows(map_of(tmp_path), RegisterTable.DISCRETE_INPUT)
    assert [found[place].name for place in (0, 1)] == [
        "input/alarms/position_error",
        "input/alarms/commissioning",
    ]


def test_what_has_no_outputs_has_nothing_to_write(tmp_path: Path) -> None:
    one = map_of(tmp_path)
    assert rows(one, RegisterTable.COIL) == {}
    assert all(address >= 1000 for address in rows(one, RegisterTable.HOLDING_REGISTER))
    assert 14 not in rows(one, RegisterTable.INPUT_REGISTER), "no watchdog"


def test_outputs_are_commanded_where_drives_are(tmp_path: Path) -> None:
    found = rows(map_of(tmp_path, IO_BLOCK, OUTPUTS), RegisterTable.HOLDING_REGISTER)
    assert [found[address].name for address in (10, 11, 13)] == ["keep_alive", "acknowledge", "stop"]
    assert [found[address].name for address in (32, 33, 35)] == [
        "output/valves",
        "output/speed",
        "output/lamp",
    ]


@pytest.mark.parametrize(("mapping", "more"), [(ENCODER, ""), (IO_BLOCK, OUTPUTS)])
def test_no_two_rows_overlap(tmp_path: Path, mapping: str, more: str) -> None:
    one = map_of(tmp_path, mapping, more)
    taken = [
        (row.table, address) for row in one.rows for address in range(row.address, row.address + row.size)
    ]
    assert len(taken) == len(set(taken))
    for table in (RegisterTable.INPUT_REGISTER, RegisterTable.HOLDING_REGISTER):
        ends = [row.address + row.size for row in one.rows if row.table is table and 32 <= row.address < 1000]
        assert one.end(table) == max(ends, default=32)
