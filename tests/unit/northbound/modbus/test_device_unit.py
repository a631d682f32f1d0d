"""A node that is no drive over Modbus: its map, its values, and what it does not take."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Identity, Source, WriteParameter
from bridge.northbound.modbus.device_unit import DeviceUnit
from bridge.northbound.modbus.pdu import ExceptionCode, ModbusException
from bridge.northbound.modbus.registers import RegisterTable, Words32
from bridge.northbound.modbus.units import device_maps
from tests.support.bench import Bench
from tests.support.devices import ENCODER, device_bench, encoder

CALLER = Identity(Source.MODBUS, "127.0.0.1")
SWITCH = """
[[input]]
name = "switch"
object = "6100:01"
data_type = "bool"
[[input]]
name = "turns"
object = "6200:01"
data_type = "int32"
"""


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    node = encoder()
    node.pdo("tpdo", 3, 0x380, ["6100:01/8", "6200:01/32"], event_ms=100)
    node.put("6100:01", 1, 1)
    node.put("6200:01", 4, -2)
    bench = device_bench(tmp_path, node, ENCODER.replace("[[parameter]]", SWITCH + "[[parameter]]"))
    bench.run(1.0)
    return bench


class TestModbus:
    @pytest.fixture
    def unit(self, bench: Bench) -> DeviceUnit:
        (device,) = device_maps(bench.plant.catalogue)
        return DeviceUnit(device, bench.view, Words32("ABCD"))

    def test_the_map(self, bench: Bench) -> None:
        (device,) = device_maps(bench.plant.catalogue)
        assert device.unit_id == 1
        places = {row.name: (row.table, row.address, row.type) for row in device.rows}
        assert places["input/position"] == (RegisterTable.INPUT_REGISTER, 32, "float32")
        assert places["input/speed"] == (RegisterTable.INPUT_REGISTER, 34, "int16")
        assert places["input/alarms"] == (RegisterTable.INPUT_REGISTER, 35, "uint16")
        assert places["input/turns"] == (RegisterTable.INPUT_REGISTER, 36, "int32")
        assert places["input/alarms/commissioning"] == (RegisterTable.DISCRETE_INPUT, 1, "bool")
        assert places["input/switch"] == (RegisterTable.DISCRETE_INPUT, 2, "bool")

    def test_values(self, unit: DeviceUnit) -> None:
        assert unit.read_words(RegisterTable.INPUT_REGISTER, 32, 2, CALLER) == [0xBFC0, 0], "-1.5"
        assert unit.read_words(RegisterTable.INPUT_REGISTER, 35, 3, CALLER) == [0, 0xFFFF, 0xFFFE]
        assert unit.read_bits(RegisterTable.DISCRETE_INPUT, 0, 3) == [False, False, True]

    def test_what_the_bridge_knows(self, unit: DeviceUnit) -> None:
        words = unit.read_words(RegisterTable.INPUT_REGISTER, 10, 22, CALLER)
        assert words[1] == 7, "config_error: no TPDO carries the speed"
        assert words[13] == 0b10, "of the values the second"

    @pytest.mark.landing(6)
    @pytest.mark.parametrize(("start", "count"), [(33, 1), (32, 1), (36, 1), (0, 1), (9, 2), (38, 1)])
    def test_what_is_not_there_or_split(self, unit: DeviceUnit, start: int, count: int) -> None:
        with pytest.raises(ModbusException) as told:
            unit.read_words(RegisterTable.INPUT_REGISTER, start, count, CALLER)
        assert told.value.code is ExceptionCode.ILLEGAL_ADDRESS

    def test_what_is_not_good(self, bench: Bench, unit: DeviceUnit) -> None:
        with pytest.raises(ModbusException) as told:
            unit.read_words(RegisterTable.INPUT_REGISTER, 34, 1, CALLER)
        assert told.value.code is ExceptionCode.PATH_UNAVAILABLE
        bench.cut = True
        bench.run(4.0)
        with pytest.raises(ModbusException) as told:
            unit.read_words(RegisterTable.INPUT_REGISTER, 32, 2, CALLER)
        assert told.value.code is ExceptionCode.NOT_RESPONDING

    def test_it_takes_nothing(self, unit: DeviceUnit) -> None:
        for write in (
            lambda: unit.plan_words(32, [1], CALLER),
            lambda: unit.plan_bits(0, [True], CALLER),
            lambda: unit.read_bits(RegisterTable.COIL, 0, 1),
        ):
            with pytest.raises(ModbusException) as told:
                write()
            assert told.value.code is ExceptionCode.ILLEGAL_FUNCTION

    def test_its_parameters_stand_from_1000_on(self, bench: Bench, unit: DeviceUnit) -> None:
        assert unit.read_words(RegisterTable.HOLDING_REGISTER, 1000, 2, CALLER) == [0, 4]
        (request,) = unit.plan_words(1000, [0, 5], CALLER)
        assert request.command == WriteParameter("6000", 5)
        for start, count in ((1001, 1), (1000, 1), (1000, 4)):
            with pytest.raises(ModbusException):
                unit.plan_words(start, [0] * count, CALLER)

    def test_who_it_is(self, bench: Bench) -> None:
        (device,) = device_maps(bench.plant.catalogue)
        assert device.texts == {0: "Acme", 1: "Encoder", 6: "shaft"}
