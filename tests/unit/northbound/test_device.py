"""A node that is no drive, as the three protocols show it."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Action, Identity, Outcome, Role, Source, WriteParameter
from bridge.northbound.modbus.device_unit import DeviceUnit
from bridge.northbound.modbus.pdu import ExceptionCode, Refused
from bridge.northbound.modbus.registers import Table, Words32
from bridge.northbound.modbus.units import device_maps
from bridge.northbound.opcua.nodes import layout
from bridge.northbound.zenoh.commands import Commands
from bridge.northbound.zenoh.keys import KeySpace
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
        (device,) = device_maps(bench.plant)
        return DeviceUnit(device, bench.view, Words32("ABCD"))

    def test_the_map(self, bench: Bench) -> None:
        (device,) = device_maps(bench.plant)
        assert device.unit_id == 1
        places = {row.name: (row.table, row.address, row.type) for row in device.rows}
        assert places["input/position"] == (Table.INPUT_REGISTER, 32, "float32")
        assert places["input/speed"] == (Table.INPUT_REGISTER, 34, "int16")
        assert places["input/alarms"] == (Table.INPUT_REGISTER, 35, "uint16")
        assert places["input/turns"] == (Table.INPUT_REGISTER, 36, "int32")
        assert places["input/alarms/commissioning"] == (Table.DISCRETE_INPUT, 1, "bool")
        assert places["input/switch"] == (Table.DISCRETE_INPUT, 2, "bool")

    def test_values(self, unit: DeviceUnit) -> None:
        assert unit.read_words(Table.INPUT_REGISTER, 32, 2, CALLER) == [0xBFC0, 0], "-1.5"
        assert unit.read_words(Table.INPUT_REGISTER, 35, 3, CALLER) == [0, 0xFFFF, 0xFFFE]
        assert unit.read_bits(Table.DISCRETE_INPUT, 0, 3) == [False, False, True]

    def test_what_the_bridge_knows(self, unit: DeviceUnit) -> None:
        words = unit.read_words(Table.INPUT_REGISTER, 10, 22, CALLER)
        assert words[1] == 7, "config_error: no TPDO carries the speed"
        assert words[13] == 0b10, "of the values the second"

    @pytest.mark.parametrize(("start", "count"), [(33, 1), (32, 1), (36, 1), (0, 1), (9, 2), (38, 1)])
    def test_what_is_not_there_or_split(self, unit: DeviceUnit, start: int, count: int) -> None:
        with pytest.raises(Refused) as told:
            unit.read_words(Table.INPUT_REGISTER, start, count, CALLER)
        assert told.value.code is ExceptionCode.ILLEGAL_ADDRESS

    def test_what_is_not_good(self, bench: Bench, unit: DeviceUnit) -> None:
        with pytest.raises(Refused) as told:
            unit.read_words(Table.INPUT_REGISTER, 34, 1, CALLER)
        assert told.value.code is ExceptionCode.PATH_UNAVAILABLE
        bench.cut = True
        bench.run(4.0)
        with pytest.raises(Refused) as told:
            unit.read_words(Table.INPUT_REGISTER, 32, 2, CALLER)
        assert told.value.code is ExceptionCode.NOT_RESPONDING

    def test_it_takes_nothing(self, unit: DeviceUnit) -> None:
        for write in (
            lambda: unit.plan_words(32, [1], CALLER),
            lambda: unit.plan_bits(0, [True], CALLER),
            lambda: unit.read_bits(Table.COIL, 0, 1),
        ):
            with pytest.raises(Refused) as told:
                write()
            assert told.value.code is ExceptionCode.ILLEGAL_FUNCTION

    def test_its_parameters_stand_from_1000_on(self, bench: Bench, unit: DeviceUnit) -> None:
        assert unit.read_words(Table.HOLDING_REGISTER, 1000, 2, CALLER) == [0, 4]
        (request,) = unit.plan_words(1000, [0, 5], CALLER)
        assert request.command == WriteParameter("6000", 5)
        for start, count in ((1001, 1), (1000, 1), (1000, 4)):
            with pytest.raises(Refused):
                unit.plan_words(start, [0] * count, CALLER)

    def test_who_it_is(self, bench: Bench) -> None:
        (device,) = device_maps(bench.plant)
        assert device.texts == {0: "Acme", 1: "Encoder", 6: "shaft"}


def test_opcua_has_its_folders(bench: Bench) -> None:
    drives, _, _ = layout(bench.plant.image.points)
    (shaft,) = drives.objects
    assert [folder.id for folder in shaft.objects] == [
        f"shaft/{group}" for group in ("node", "supervision", "input", "parameter")
    ]
    names = [variable.browse_name for variable in shaft.objects[2].variables]
    assert names == ["Position", "Speed", "Alarms", "Switch", "Turns"]
    methods = {method.browse_name: method.target for method in shaft.methods}
    assert methods.keys() >= {"Reset", "ReadParameter", "WriteParameter", "SaveParameters"}
    assert set(methods.values()) == {"shaft"}


def test_zenoh_has_its_keys(bench: Bench) -> None:
    keys = KeySpace("drives", "hall", bench.plant.image.points)
    assert "drives/hall/shaft/input/position" in keys.keys


def test_zenoh_reads_and_writes_its_parameters_by_any_name(bench: Bench) -> None:
    commands = Commands(bench.plant.image.points)
    engineer = Identity(Source.ZENOH, "desk", Role.ENGINEER)
    outcomes: list[Outcome] = []
    bench.view.submit(commands.request("shaft/parameter/6000", b"5", engineer), outcomes.append)
    bench.run(0.5)
    bench.view.submit(commands.reading("shaft", "6000:00", engineer, cached=False), outcomes.append)
    bench.run(0.5)
    assert [(one.ok, one.value) for one in outcomes] == [(True, 5), (True, 5)]
    assert commands.meant("shaft/parameter/6000") == ("shaft", Action.WRITE_PARAMETER)
