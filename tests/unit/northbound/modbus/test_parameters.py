"""Parameters in the register map: holding registers from 1000 on, answered when the drive has answered."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import pytest

from bridge.command import Identity, Role, Source
from bridge.northbound.modbus.pdu import ExceptionCode
from bridge.northbound.modbus.registers import PARAMETERS, RegisterTable
from bridge.northbound.modbus.units import drive_maps
from bridge.sim.nord.nord_supervision import Presence
from tests.support.bench import Bench, write_site
from tests.support.views import dispatcher_of

PLC = Identity(Source.MODBUS, "10.0.0.1", Role.OPERATOR, sets_parameters=True)
UNIT = 1
SETTLED_S = 3.0


class Station:
    def __init__(self, folder: Path) -> None:
        self.bench = Bench(write_site(folder))
        self.bench.run(SETTLED_S)
        self.dispatcher = dispatcher_of(self.bench.plant, lambda: self.bench.now, view=self.bench.view)
        self.map = drive_maps(self.bench.plant.catalogue)[UNIT - 1]

    def place(self, name: str) -> int:
        (row,) = [row for row in self.map.parameters if row.name == f"parameter/{name}"]
        return row.address

    def begin(self, pdu: bytes, caller: Identity = PLC) -> list[bytes]:
        answers: list[bytes] = []
        self.dispatcher.handle(UNIT, pdu, caller, answers.append)
        return answers

    def write(self, name: str, value: float, caller: Identity = PLC) -> list[bytes]:
        data = struct.pack(">f", value)
        return self.begin(struct.pack(">BHHB", 16, self.place(name), 2, 4) + data, caller)

    def refused(self, answers: list[bytes]) -> int:
        (answer,) = answers
        assert answer[0] & 0x80, answer.hex(" ")
        return answer[1]


@pytest.fixture
def station(tmp_path: Path) -> Station:
    return Station(tmp_path)


def test_writable_parameters_stand_from_register_1000_on(station: Station) -> None:
    rows = station.map.parameters
    assert [row.address for row in rows] == list(range(PARAMETERS, PARAMETERS + 2 * len(rows), 2))
    assert {row.name for row in rows} >= {"parameter/p102", "parameter/p560"}
    assert not {row.name for row in rows} & {"parameter/p700_1", "parameter/p701_1"}
    shown = [row.name for row in station.map.inputs]
    assert shown.index("parameter/p102") > shown.index("actual/frequency")
    assert {row.type for row in rows} == {"float32", "int32"}
    assert all(row.table is RegisterTable.HOLDING_REGISTER for row in rows)


def test_a_write_is_answered_when_the_drive_has_answered(station: Station) -> None:
    answers = station.write("p102", 1.03)
    assert answers == []
    station.bench.run(0.1)
    assert answers == [struct.pack(">BHH", 16, station.place("p102"), 2)]
    assert station.bench.value("conveyor/fu1/parameter/p102") == 1.03


def test_while_it_is_being_written_it_is_busy(station: Station) -> None:
    station.write("p102", 1.0)
    assert station.refused(station.write("p102", 2.0)) == ExceptionCode.BUSY


def test_a_drive_that_refuses_is_exception_04_and_its_abort_code(station: Station) -> None:
    # BU 2500 §8.3.2: 0606 0000h where the drive behind the interface does not answer
    station.bench.node.presence[0] = Presence.LOST
    answers = station.write("p102", 1.0)
    station.bench.run(0.2)
    assert station.refused(answers) == ExceptionCode.DEVICE_FAILURE
    (answer,) = station.begin(struct.pack(">BHH", 4, 18, 2))
    assert answer == bytes.fromhex("04 04 06 06 00 00")


def test_who_may_not_set_parameters_is_exception_01(station: Station) -> None:
    reader = replace(PLC, sets_parameters=False)
    assert station.refused(station.write("p102", 1.0, reader)) == ExceptionCode.ILLEGAL_FUNCTION


@pytest.mark.landing
def test_a_value_that_was_never_read_is_not_served(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path), present=False)
    bench.run(1.0)
    dispatcher = dispatcher_of(bench.plant, lambda: bench.now, view=bench.view)
    answers: list[bytes] = []
    dispatcher.handle(UNIT, struct.pack(">BHH", 3, PARAMETERS, 2), PLC, answers.append)
    assert answers == [bytes((0x83, ExceptionCode.NOT_RESPONDING))]
