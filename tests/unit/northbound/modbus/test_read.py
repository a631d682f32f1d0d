"""Reading a drive over Modbus: the register map, qualities, word orders."""

from __future__ import annotations

import struct

import pytest

from bridge.command import Identification
from bridge.command.drive_link import NodeState
from bridge.config import WordOrder
from bridge.drive import OwnJudgement
from bridge.northbound.modbus.registers import DriveMap, RegisterTable, Words32
from bridge.northbound.modbus.units import drive_maps, units_of
from tests.support.modbus_site import (
    ENABLED,
    OTHER_PLC,
    PLC,
    READY,
    Rig,
    float_words,
    make_plant,
)
from tests.support.rig import emergency

NO_ADDRESS, NOT_CONFIGURED, NOT_RESPONDING = -2, -0x0A, -0x0B


def test_input_registers_of_a_running_drive():
    rig = Rig()
    rig.runs(ENABLED, 0x2000, 0x1234, 0xC000)
    rig.fu1.on_sdo_refused(0x06020000, rig.now)
    rig.fu1.channel.on_emcy(emergency(0x8100), rig.now)
    rig.write(0, 0x047E)
    rig.now += 0.050
    words = rig.read(4, 0, 32)
    assert words[0] == ENABLED
    assert words[1:9] == [0x2000, 0x1234, 0xC000, 0, 0, 0, 0, 0]
    assert words[9] == ENABLED
    assert words[10:14] == [4, 1, 0x8100, 0]  # operation enabled, good, last emergency, no fault
    assert words[14:16] == [2, 150]  # watchdog running, ms left
    assert words[16:18] == [0, 50]  # ms since the last PDO
    assert words[18:20] == [0x0602, 0x0000]
    assert words[20] == 2  # modbus
    assert words[21] == 0
    assert words[24] == 1  # the first telegram
    assert words[25:] == [0] * 7


def test_scaled_values_follow_as_floats():
    rig = Rig()
    rig.runs(ENABLED, 0x2000, 0x2000, drive="fu2")
    assert rig.read(4, 32, 2, unit=2) == list(float_words(25.0))
    assert rig.read(4, 32, 4, unit=2) == [*float_words(25.0), *float_words(5.0)]


def test_a_value_without_scale_is_not_configured_and_only_it():
    rig = Rig()
    rig.runs(ENABLED, 0x2000, 0x2000)
    assert rig.read(4, 32, 2) == list(float_words(25.0))
    assert rig.read(4, 34, 2) == [NOT_CONFIGURED]
    assert rig.read(4, 32, 4) == [*float_words(25.0), 0, 0]
    assert rig.read(3, 32, 2, unit=9) == [NOT_CONFIGURED]


def test_further_points_come_after_the_scaled_values_as_they_are_listed():
    rig = Rig()
    rig.runs(ENABLED)
    names = [row.name for row in DriveMap(rig.fu1.spec).inputs]
    assert names[:2] == ["actual/frequency", "actual/current"]
    assert names[2:6] == [
        "supervision/telegram_downtime_s",
        "supervision/current_fault",
        "supervision/trips",
        "supervision/worst_case_stop_ms",
    ]
    assert names[-1] == "actual/position", "it is not in the telegram"
    ours = [name for name in names[:-1] if not name.startswith("parameter/")]
    assert ours[-4:] == [f"identity/{leaf}" for leaf in ("vendor", "product", "revision", "serial")]
    assert names[: len(ours)] == ours
    rows = {row.name: row for row in DriveMap(rig.fu1.spec).inputs}
    downtime, stop = rows["supervision/telegram_downtime_s"], rows["supervision/worst_case_stop_ms"]
    assert rig.read(4, downtime.address, 2) == list(float_words(0.5))
    assert (stop.type, rig.read(4, stop.address, 2)) == ("uint32", [0, 25 + 200 + 20 + 10 + 10])
    assert rig.read(4, rows["identity/serial"].address, 2) == [NOT_RESPONDING]  # not read from the node yet


def test_nothing_is_readable_beyond_the_map():
    rig = Rig()
    rig.runs(ENABLED)
    rows = DriveMap(rig.fu1.spec).inputs
    end = rows[-1].address + 2
    assert rig.read(4, end, 1) == [NO_ADDRESS]
    assert rig.read(4, 40, end - 40 + 1) == [NO_ADDRESS]
    assert rig.read(3, 35, 1) == [NO_ADDRESS]
    assert rig.read(3, 36, 1) == [NO_ADDRESS]
    assert rig.read(3, 5, 1) == [NO_ADDRESS]
    assert rig.read(4, 4, 5) == [NO_ADDRESS]
    assert rig.read(4, 65535, 1) == [NO_ADDRESS]
    assert rig.read(4, 65535, 125) == [NO_ADDRESS]
    assert rig.read_bits(2, 24, 1) == [NO_ADDRESS]
    assert rig.read_bits(2, 20, 5) == [NO_ADDRESS]
    assert rig.read_bits(1, 15, 2) == [NO_ADDRESS]


@pytest.mark.parametrize(("start", "count"), [(17, 1), (16, 1), (0, 17), (17, 2), (19, 1), (0, 19), (33, 1)])
def test_a_32_bit_value_is_not_read_by_halves(start: int, count: int):
    rig = Rig()
    rig.runs(ENABLED)
    assert rig.read(4, start, count) == [NO_ADDRESS]


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        ("ABCD", [0x41C8, 0x0000]),
        ("CDAB", [0x0000, 0x41C8]),
        ("BADC", [0xC841, 0x0000]),
        ("DCBA", [0x0000, 0xC841]),
    ],
)
def test_word_order_of_the_site(order: WordOrder, expected: list[int]):
    rig = Rig(order)
    rig.runs(ENABLED, 0x2000)
    rig.fu1.on_sdo_refused(0x41C80000, rig.now)
    assert rig.read(4, 32, 2) == expected
    assert rig.read(4, 18, 2) == expected
    assert rig.write(0, 0x047E) == 0
    assert rig.write(32, *expected) == 0
    assert rig.fu1.channel.setpoints[0] == 0x2000
    assert rig.read(3, 32, 2) == expected


@pytest.mark.parametrize("order", ["ABCD", "CDAB", "BADC", "DCBA"])
def test_floats_survive_the_way_there_and_back(order: WordOrder):
    words32 = Words32(order)
    for value in (0.0, -1.5, 25.0, 3.4e38, float("inf")):
        packed = struct.unpack(">f", struct.pack(">f", value))[0]
        assert words32.to_float(*words32.from_float(value)) == packed
    assert words32.to_float(*words32.from_float(1e300)) == float("inf")
    assert words32.from_float(-1e300) == words32.from_float(float("-inf"))


def test_before_the_first_data_only_the_diagnostics_are_readable():
    rig = Rig()
    assert rig.read(4, 0, 32) == [NOT_RESPONDING]
    assert rig.read(4, 0, 1) == [NOT_RESPONDING]
    assert rig.read(4, 9, 2) == [NOT_RESPONDING]
    assert rig.read(4, 32, 2) == [NOT_RESPONDING]
    assert rig.read_bits(2, 0, 24) == [NOT_RESPONDING]
    assert rig.read(4, 10, 8) == [255, 0, 0, 0, 1, 0, 0xFFFF, 0xFFFF]
    assert len(rig.read(4, 10, 22)) == 22
    assert rig.read_bits(2, 16, 8) == [1, 0, 0, 0, 0, 0, 0, 0]


def test_a_lost_drive_keeps_its_values_until_it_is_dead():
    rig = Rig()
    rig.runs(ENABLED, 0x2000)
    rig.node(NodeState.LOST)
    assert rig.read(4, 0, 2) == [ENABLED, 0x2000]
    assert rig.read(4, 10, 2) == [4, 3]
    assert rig.read_bits(2, 16, 8) == [0, 0, 0, 1, 0, 0, 0, 0]
    assert rig.read(4, 32, 2) == list(float_words(25.0))
    rig.now += 2.0  # the timer has not run yet: reading judges for itself
    assert rig.read(4, 0, 2) == [NOT_RESPONDING]
    assert rig.read(4, 32, 2) == [NOT_RESPONDING]
    assert rig.read(4, 10, 2) == [255, 4]
    assert rig.read(4, 13, 1) == [109]  # 10.9, node missing


@pytest.mark.parametrize(
    ("state", "code", "quality"),
    [(NodeState.DISABLED, NOT_RESPONDING, 6), (NodeState.CONFIG_ERROR, NOT_CONFIGURED, 7)],
)
def test_disabled_and_wrongly_configured_nodes(state: NodeState, code: int, quality: int):
    rig = Rig()
    rig.runs(ENABLED)
    rig.node(state)
    assert rig.read(4, 0, 2) == [code]
    assert rig.read(4, 32, 2) == [code]
    assert rig.read_bits(2, 0, 1) == [code]
    assert rig.read(4, 11, 1) == [quality]


def test_a_tripped_drive_shows_fault_until_the_acknowledge():
    rig = Rig()
    rig.runs(READY)
    rig.write(0, 0x047E)
    rig.pass_time(0.201)
    words = rig.read(4, 0, 32)
    assert words[0] & 0x4F == 0x08
    assert words[9] == READY
    assert (words[10], words[13], words[14], words[15]) == (7, 103, 3, 0)
    assert rig.read_bits(2, 3, 1) == [1]


def test_holding_registers_give_what_the_owner_wrote():
    rig = Rig()
    rig.runs(READY)
    rig.write(0, 0x047E, 0x2000, 1, 2)
    assert rig.read(3, 0, 13) == [0x047E, 0x2000, 1, 2, 0, 0, 0, 0, 0, 0, 1, 0, 200]
    assert rig.read(3, 10, 1, caller=OTHER_PLC) == [0]
    assert rig.read(3, 0, 34) == [0x047E, 0x2000, 1, 2, *[0] * 6, 1, 0, 200, *[0] * 19, *float_words(25.0)]
    assert rig.read_bits(1, 0, 16) == [0, 1, 1, 1, 1, 1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0]


def test_reading_is_no_telegram():
    rig = Rig()
    rig.runs(READY)
    rig.write(0, 0x047E)
    for _ in range(3):
        rig.pass_time(0.070)
        rig.read(3, 0, 13)
    assert rig.fu1.channel.is_tripped


def test_unknown_units_are_not_configured():
    rig = Rig()
    for unit in (3, 8, 247, 254):
        assert rig.ask("03 0000 0001", unit) == b"\x83\x0a"
        assert rig.ask("99", unit) == b"\x99\x0a"


def test_the_list_is_complete_and_without_overlap():
    plant = make_plant()
    assert [m.unit_id for m in drive_maps(plant.catalogue)] == [1, 2, 9]
    for drive_map in drive_maps(plant.catalogue):
        for table in RegisterTable:
            used = [
                a for r in drive_map.rows if r.table is table for a in range(r.address, r.address + r.size)
            ]
            assert used == sorted(set(used))
    references = {row.name: row.reference for row in drive_maps(plant.catalogue)[0].rows if row.size == 2}
    assert references["actual/frequency"] == "30033"
    assert references["command/frequency"] == "40033"
    access = {(m.unit_id, r.name): r.access for m in drive_maps(plant.catalogue) for r in m.rows}
    assert access[1, "supervision/fieldbus_timeout_ms"] == "r"
    assert access[9, "supervision/fieldbus_timeout_ms"] == "rw"
    bridge = units_of(plant.catalogue).bridge_rows
    assert [row.name for row in bridge][-3:] == ["conveyor/fu1", "conveyor/fu2", "conveyor/fu3"]


def test_every_listed_register_can_be_read():
    rig = Rig()
    rig.runs(ENABLED, drive="fu2")
    rig.drive("fu2").on_identification(Identification(1, 2, 3, 4, "x"), rig.now)
    rig.drive("fu2").on_own_supervision(OwnJudgement(accepted="a test of registers"), rig.now)
    functions = {
        RegisterTable.COIL: 1,
        RegisterTable.DISCRETE_INPUT: 2,
        RegisterTable.HOLDING_REGISTER: 3,
        RegisterTable.INPUT_REGISTER: 4,
    }
    for row in DriveMap(rig.drive("fu2").spec).rows:
        if row.name in ("actual/position", "command/position"):
            continue  # not in the telegram
        if row.name.startswith("parameter/"):
            rig.plant.set(f"conveyor/fu2/{row.name}", 1, rig.now)
        request = struct.pack(">BHH", functions[row.table], row.address, row.size)
        assert rig.ask(request, unit=2, caller=PLC)[0] < 0x80, row
