"""Tools read neighbouring rows of the export in one request: a value that is not there costs no other."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path
from typing import Final

import pytest

from bridge.command import Drive, Plant
from bridge.command.drive_link import NodeState
from bridge.image import DataType, Point, Quality
from bridge.mapping import family_names
from bridge.northbound.modbus.dispatch import Dispatcher
from bridge.northbound.modbus.registers import (
    INPUT_FLAGS,
    MIRROR,
    MOST_PARAMETERS,
    PARAMETERS,
    VALUE_FLAGS,
    DriveMap,
    RegisterTable,
    Row,
)
from bridge.northbound.modbus.units import device_maps, drive_maps, units_of
from tests.support import sites
from tests.support.devices import ENCODER, IO_BLOCK, OUTPUTS, device_bench, encoder, io_block
from tests.support.modbus_runs import Run, runs_of
from tests.support.modbus_site import PLC, Rig
from tests.support.node_states import node_goes
from tests.support.views import dispatcher_of

NOW: Final = 100.0


def ask(dispatcher: Dispatcher, unit: int, function: int, start: int, count: int) -> bytes:
    answers: list[bytes] = []
    dispatcher.handle(unit, struct.pack(">BHH", function, start, count), PLC, answers.append)
    (answer,) = answers
    return answer


def bits(dispatcher: Dispatcher, unit: int, start: int, count: int) -> list[bool]:
    answer = ask(dispatcher, unit, 2, start, count)
    assert answer[0] == 2, answer.hex()
    packed = int.from_bytes(answer[2:], "little")
    return [bool(packed >> place & 1) for place in range(count)]


def words(answer: bytes) -> list[int]:
    return list(struct.unpack(f">{(len(answer) - 2) // 2}H", answer[2:]))


def family_plant(mapping: str) -> Plant:
    """All drives of one node of this family, running, not identified yet; of its parameters every other one
    has been read."""
    family = sites.family(mapping)
    scaled = sorted({name for value in family.value for name in value.scaled_by})
    scales = "parameters = {{ {} }}".format(", ".join(f'"{name}" = 50.0' for name in scaled))
    drives = [sites.drive(slot.name, "modbus", 0, scales) for slot in family.slot]
    plant = sites.plant_of(sites.site(sites.bus(sites.node(*drives, mapping=mapping))), mapping)
    for node in plant.nodes.values():
        node_goes(plant, node, NodeState.OPERATIONAL, NOW)
    for drive in plant.drives.values():
        drive.on_pdos({}, [], NOW, deadline_s=1.0, rpdo_type=255)
        drive.on_process_data(telling(drive), NOW)
    parameters = [point.name for point in plant.image.points if "/parameter/" in point.name]
    for name in parameters[::2]:
        plant.set(name, 1, NOW)
    return plant


def telling(drive: Drive) -> list[int]:
    """Words by which they mean what their mapping takes them to mean."""
    process = drive.family.process.tpdo
    codes = {
        process.index(word): meaning.default
        for meaning in drive.family.meaning
        if meaning.group == "actual" and (word := drive.family.told_by(drive.slot, meaning))
    }
    return [codes.get(place, word) for place, word in enumerate(drive.words)]


@pytest.mark.parametrize("mapping", [name for name in family_names() if sites.family(name).slot])
def test_a_point_that_was_added_later_moves_no_register(mapping: str) -> None:
    """Wherever it stands among the others, and whatever its drive has."""
    [spec, *_] = family_plant(mapping).catalogue.drives.values()
    newest = max(point.added for point in spec.points)
    later = [
        Point(name=f"{spec.name}/supervision/{leaf}", data_type=DataType.UINT32, added=newest + added)
        for leaf, added in (("third", 2), ("first", 1), ("second", 1))
    ]
    before, after = DriveMap(spec), DriveMap(replace(spec, points=(*later, *spec.points)))
    inputs = [row.name for row in after.inputs]
    assert after.inputs[: len(before.inputs)] == before.inputs
    assert inputs[len(before.inputs) :] == [f"supervision/{leaf}" for leaf in ("first", "second", "third")]
    assert set(before.rows) <= set(after.rows)


@pytest.mark.landing(22)
@pytest.mark.parametrize("mapping", family_names())
def test_every_run_of_every_familys_export_is_read(mapping: str) -> None:
    plant = family_plant(mapping)
    dispatcher = dispatcher_of(plant, lambda: NOW)
    absent = 0
    for drive_map in drive_maps(plant.catalogue):
        for run in runs_of(drive_map.rows):
            answer = ask(dispatcher, drive_map.unit_id, run.function, run.start, run.count)
            missing = absent_of(plant, drive_map.drive_name, run)
            if len(missing) == len(run.rows):
                assert answer[0] == run.function | 0x80, "nothing else is in it"
                continue
            assert answer[0] == run.function, f"{run.table} {run.start}+{run.count}: {answer.hex()}"
            for row in missing:
                at = row.address - run.start
                assert words(answer)[at : at + row.size] == [0] * row.size, row
            absent += len(missing)
    assert absent, "a family without a value that is not there proves nothing"
    for run in runs_of(units_of(plant.catalogue).bridge_rows):
        assert ask(dispatcher, 255, run.function, run.start, run.count)[0] == run.function


def absent_of(plant: Plant, drive: str, run: Run) -> list[Row]:
    """The values of a run that are not there."""
    index = plant.image.index
    named = [(row, f"{drive}/{row.name}") for row in run.rows if row.size == 2]
    return [row for row, name in named if name in index and not plant.image.read(name).quality.has_value]


@pytest.mark.landing(22)
@pytest.mark.parametrize("mapping", family_names())
def test_every_value_that_is_not_good_says_so(mapping: str) -> None:
    """Registers 22 and 23 for the first 32, the discrete inputs from 4096 on for all."""
    plant = family_plant(mapping)
    dispatcher = dispatcher_of(plant, lambda: NOW)
    for drive_map in drive_maps(plant.catalogue):
        unit, rows = drive_map.unit_id, drive_map.inputs
        flags = bits(dispatcher, unit, VALUE_FLAGS, len(rows))
        high, low = words(ask(dispatcher, unit, 4, 22, 2))
        for place, row in enumerate(rows):
            is_bad = plant.image.read(f"{drive_map.drive_name}/{row.name}").quality is not Quality.GOOD
            assert flags[place] == is_bad, row.name
            if place < 32:
                assert bool((high << 16 | low) >> place & 1) == is_bad, row.name
        assert ask(dispatcher, unit, 2, VALUE_FLAGS, len(rows) + 1) == b"\x82\x02"


def test_what_is_not_there_reads_0_beside_others_and_is_refused_alone() -> None:
    rig = Rig()
    rig.runs(0x0237, 0x2000, 0x2000)
    assert rig.read(4, 34, 2) == [-0x0A], "the scale of the current is not known"
    assert rig.read(4, 32, 4)[2:] == [0, 0]
    assert len(rig.read(4, 10, 26)) == 26
    serial = next(
        row.address for row in drive_maps(rig.plant.catalogue)[0].inputs if row.name == "identity/serial"
    )
    assert rig.read(4, serial - 2, 4) == [-0x0B], "nothing else in it is there"


def test_while_there_is_no_data_a_block_with_the_drives_values_is_refused() -> None:
    """No 0 Hz of a drive that nobody hears."""
    rig = Rig()
    rig.runs(0x0237, 0x2000, 0x2000)
    rows = {row.name: row.address for row in drive_maps(rig.plant.catalogue)[0].inputs}
    assert len(rig.read(4, 32, 66)) == 66
    rig.node(NodeState.LOST)
    rig.now += 3.0
    assert rig.read(4, 32, 66) == [-0x0B]
    assert rig.read(4, 10, 24) == [-0x0B]
    assert rig.read(4, rows["supervision/follows"], 2) == [-0x0B]
    assert len(rig.read(4, rows["supervision/telegram_downtime_s"], 2)) == 2
    assert all(bits(rig.dispatcher, 1, VALUE_FLAGS, 2))


def test_of_a_device_one_absent_input_costs_no_other(tmp_path: Path) -> None:
    """No TPDO of the encoder carries its speed."""
    bench = device_bench(tmp_path, encoder(), ENCODER)
    bench.run(1.0)
    (device,) = device_maps(bench.plant.catalogue)
    dispatcher = dispatcher_of(bench.plant, lambda: bench.now, view=bench.view)
    for run in runs_of(device.rows):
        answer = ask(dispatcher, device.unit_id, run.function, run.start, run.count)
        assert answer[0] == run.function, f"{run.table} {run.start}+{run.count}: {answer.hex()}"
    position, speed, alarms = bits(dispatcher, device.unit_id, VALUE_FLAGS, 3)
    assert (position, speed, alarms) == (False, True, False)
    assert words(ask(dispatcher, device.unit_id, 4, 32, 4))[2:] == [0, 0]
    assert ask(dispatcher, device.unit_id, 4, 34, 1) == b"\x84\x0a", "alone"
    assert bits(dispatcher, device.unit_id, INPUT_FLAGS, 2) == [False, False]
    bench.cut = True
    bench.run(4.0)
    assert ask(dispatcher, device.unit_id, 4, 10, 26) == b"\x84\x0b", "of a dead node no value is served"
    assert all(bits(dispatcher, device.unit_id, INPUT_FLAGS, 2))
    assert bits(dispatcher, device.unit_id, VALUE_FLAGS, 4)[3], "parameters follow the inputs"


def test_of_an_output_block_every_run_is_read(tmp_path: Path) -> None:
    bench = device_bench(tmp_path, io_block(), IO_BLOCK, OUTPUTS)
    bench.run(2.0)
    (device,) = device_maps(bench.plant.catalogue)
    dispatcher = dispatcher_of(bench.plant, lambda: bench.now, view=bench.view)
    for run in runs_of(device.rows):
        answer = ask(dispatcher, device.unit_id, run.function, run.start, run.count)
        assert answer[0] == run.function, f"{run.table} {run.start}+{run.count}: {answer.hex()}"


class TestMirror:
    """Tools that know function 3 alone, and function 23."""

    def test_holding_registers_from_4096_on_are_the_input_registers(self) -> None:
        rig = Rig()
        rig.runs(0x0237, 0x2000, 0x1234)
        for start, count in ((0, 10), (10, 22), (32, 2), (0, 40)):
            assert rig.read(3, MIRROR + start, count) == rig.read(4, start, count)
        assert rig.read(3, MIRROR + 33, 1) == [-0x02]
        assert rig.read(3, MIRROR, 5, unit=255) == rig.read(4, 0, 5, unit=255)

    def test_it_cannot_be_written(self) -> None:
        rig = Rig()
        rig.runs(0x0237)
        assert rig.write(MIRROR, 1) == 0x02
        assert rig.write(MIRROR + 32, 1, 1) == 0x02
        assert rig.ask(struct.pack(">BHHH", 22, MIRROR, 0, 1)) == b"\x96\x02"

    def test_one_request_commands_a_drive_and_reads_its_state(self) -> None:
        """FC23, MODBUS Application Protocol V1.1b3 §6.17: the write comes first."""
        rig = Rig()
        rig.runs(0x0231, 0x2000)
        request = struct.pack(">BHHHHB2H", 23, MIRROR, 25, 0, 2, 4, 0x047E, 0x1000)
        answer = words(rig.ask(request))
        assert answer[:2] == [0x0231, 0x2000]
        assert answer[20] == 2, "Modbus has it"
        assert rig.sent[:2] == (0x047E, 0x1000)

    def test_nothing_is_written_where_the_state_cannot_be_read(self) -> None:
        rig = Rig()
        request = struct.pack(">BHHHHB2H", 23, MIRROR, 2, 0, 2, 4, 0x047F, 0x1000)
        assert rig.ask(request) == b"\x97\x0b"
        assert rig.read(3, 0, 1) != [0x047F]

    @pytest.mark.landing(22)
    @pytest.mark.parametrize("mapping", family_names())
    def test_it_is_behind_all_other_registers(self, mapping: str) -> None:
        assert PARAMETERS + 2 * MOST_PARAMETERS <= MIRROR
        for drive_map in drive_maps(family_plant(mapping).catalogue):
            holding = [row for row in drive_map.rows if row.table is RegisterTable.HOLDING_REGISTER]
            assert max(row.address + row.size for row in holding) <= MIRROR
