"""Outputs of a node that is no drive, as clients of the three protocols command them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from bridge.command import Action, Identity, Outcome, Request, Source
from bridge.northbound.modbus.device_unit import DeviceUnit
from bridge.northbound.modbus.pdu import ExceptionCode, MaskWrite, ModbusException
from bridge.northbound.modbus.registers import ACKNOWLEDGE, KEEP_ALIVE, STOP, RegisterTable, Words32
from bridge.northbound.modbus.units import device_maps
from bridge.northbound.opcua.space.nodes import layout
from bridge.northbound.zenoh.commands import BadCommand, Commands
from tests.support.bench import PLC, Bench
from tests.support.devices import IO_BLOCK, OUTPUTS, device_bench, io_block

ZENOH = Identity(Source.ZENOH, "desk")


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    bench = device_bench(tmp_path, io_block(), IO_BLOCK, OUTPUTS)
    bench.run(2.0)
    return bench


def carried_out(bench: Bench, requests: Sequence[Request]) -> list[Outcome]:
    outcomes: list[Outcome] = []
    for request in requests:
        bench.view.submit(request, outcomes.append)
    bench.run(0.05)
    return outcomes


class TestModbus:
    @pytest.fixture
    def unit(self, bench: Bench) -> DeviceUnit:
        (device,) = device_maps(bench.plant.catalogue)
        return DeviceUnit(device, bench.view, Words32("ABCD"))

    def test_the_map(self, bench: Bench) -> None:
        (device,) = device_maps(bench.plant.catalogue)
        places = {row.name: (row.table, row.address, row.type, row.access) for row in device.rows}
        assert places["output/valves"] == (RegisterTable.HOLDING_REGISTER, 32, "uint16", "rw")
        assert places["output/speed"] == (RegisterTable.HOLDING_REGISTER, 33, "float32", "rw")
        assert places["output/lamp"] == (RegisterTable.HOLDING_REGISTER, 35, "int16", "rw")
        assert places["output/valves/outlet"] == (RegisterTable.COIL, 1, "bool", "rw")
        assert places["acknowledge"] == (RegisterTable.HOLDING_REGISTER, 11, "uint16", "rw")

    def test_one_write_is_one_telegram(self, bench: Bench, unit: DeviceUnit) -> None:
        carried_out(bench, unit.plan_words(32, [0], PLC))
        (done,) = carried_out(bench, unit.plan_words(32, [3, 0x4120, 0, 0xFFFF], PLC))
        assert done.forwarded
        assert unit.read_words(RegisterTable.HOLDING_REGISTER, 32, 4, PLC) == [3, 0x4120, 0, 0xFFFF]
        assert bench.node.number("6411:01") == 100
        assert unit.read_bits(RegisterTable.COIL, 0, 2) == [True, True]
        assert unit.read_words(RegisterTable.HOLDING_REGISTER, KEEP_ALIVE, 1, PLC) == [1]
        known = unit.read_words(RegisterTable.INPUT_REGISTER, 10, 22, PLC)
        assert (known[4], known[10], known[14]) == (2, 2, 2), "watchdog runs, owned by modbus, two telegrams"

    def test_coils_are_bits_of_outputs(self, bench: Bench, unit: DeviceUnit) -> None:
        carried_out(bench, unit.plan_bits(0, [False, False], PLC))
        carried_out(bench, unit.plan_bits(1, [True], PLC))
        assert bench.node.number("6200:01") == 2
        carried_out(bench, unit.plan_mask(MaskWrite(32, 0xFFFE, 0x0001, b""), PLC))
        assert bench.node.number("6200:01") == 3

    def test_stop_acknowledge_and_release(self, bench: Bench, unit: DeviceUnit) -> None:
        carried_out(bench, unit.plan_words(32, [0], PLC))
        carried_out(bench, unit.plan_words(32, [1], PLC))
        carried_out(bench, unit.plan_words(STOP, [1], PLC))
        assert bench.node.number("6200:01") == 0
        carried_out(bench, unit.plan_words(ACKNOWLEDGE, [1], PLC))
        carried_out(bench, unit.plan_words(32, [1], PLC))
        assert bench.node.number("6200:01") == 0, "an acknowledge takes no stop back"
        carried_out(bench, unit.plan_words(32, [0], PLC))
        carried_out(bench, unit.plan_words(32, [1], PLC))
        assert bench.node.number("6200:01") == 1
        carried_out(bench, unit.plan_words(KEEP_ALIVE, [0], PLC))
        assert bench.node.number("6200:01") == 0
        assert bench.value("shaft/supervision/owner") == ""

    @pytest.mark.landing(7)
    @pytest.mark.parametrize(
        ("start", "words", "code"),
        [
            (33, [0], ExceptionCode.ILLEGAL_ADDRESS),
            (34, [0, 0], ExceptionCode.ILLEGAL_ADDRESS),
            (36, [0], ExceptionCode.ILLEGAL_ADDRESS),
            (0, [1], ExceptionCode.ILLEGAL_ADDRESS),
            (STOP, [4], ExceptionCode.ILLEGAL_VALUE),
            (ACKNOWLEDGE, [2], ExceptionCode.ILLEGAL_VALUE),
            (1000, [0, 0], ExceptionCode.ILLEGAL_ADDRESS),
        ],
    )
    def test_what_is_refused(
        self, unit: DeviceUnit, start: int, words: list[int], code: ExceptionCode
    ) -> None:
        with pytest.raises(ModbusException) as told:
            unit.plan_words(start, words, PLC)
        assert told.value.code is code


def test_opcua_has_outputs_and_methods(bench: Bench) -> None:
    drives, _, _ = layout(bench.plant.image.points)
    (shaft,) = drives.objects
    outputs = next(folder for folder in shaft.objects if folder.id == "shaft/output")
    assert [(one.browse_name, one.writable) for one in outputs.variables] == [
        ("Valves", True),
        ("Speed", True),
        ("Lamp", True),
    ]
    methods = {method.browse_name for method in shaft.methods}
    assert methods >= {"Stop", "ResetFault", "TakeControl", "ReleaseControl", "KeepAlive", "StopNode"}


def test_zenoh_commands_them(bench: Bench) -> None:
    commands = Commands(bench.plant.image.points)
    one = commands.request("shaft/output/valves", b"1", ZENOH)
    assert (one.target, one.action) == ("shaft", Action.WRITE)
    many = commands.request("shaft/output", b'{"valves": 1, "valves.1": true}', ZENOH)
    assert many.target == "shaft"
    stop = commands.request("shaft/command/stop", b"", PLC)
    assert carried_out(bench, [stop])[0].ok
    with pytest.raises(BadCommand, match="shaft/command has stop, reset_fault"):
        commands.request("shaft/command/start", b"{}", ZENOH)
    with pytest.raises(BadCommand, match="shaft/output has valves, speed, lamp"):
        commands.request("shaft/output/pump", b"1", ZENOH)
