"""Reading a drive over Modbus: the register map, qualities, word orders, the bridge's own unit."""

from __future__ import annotations

import struct

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bridge.command import Code, Identification
from bridge.command.link import NodeState
from bridge.config import WordOrder
from bridge.drive import OwnJudgement
from bridge.northbound.modbus.dispatch import EXCEPTIONS
from bridge.northbound.modbus.pdu import PDU_MOST, Identify, identification_answer
from bridge.northbound.modbus.registers import DriveMap, Table, Words32
from bridge.northbound.modbus.unit import BridgeUnit
from bridge.northbound.modbus.units import drive_maps, units_of
from tests.support import sites
from tests.support.modbus_site import (
    ENABLED,
    OTHER_PLC,
    PLC,
    READY,
    SWITCH_ON_INHIBITED,
    Rig,
    float_words,
    make_plant,
)
from tests.support.rig import emergency
from tests.support.views import view_of

NO_FUNCTION, NO_ADDRESS, BAD_VALUE, NOT_CONFIGURED, NOT_RESPONDING = -1, -2, -3, -0x0A, -0x0B


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
    names = [row.name for row in DriveMap(rig.fu1).inputs]
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
    rows = {row.name: row for row in DriveMap(rig.fu1).inputs}
    downtime, stop = rows["supervision/telegram_downtime_s"], rows["supervision/worst_case_stop_ms"]
    assert rig.read(4, downtime.address, 2) == list(float_words(0.5))
    assert (stop.type, rig.read(4, stop.address, 2)) == ("uint32", [0, 25 + 200 + 20 + 10 + 10])
    assert rig.read(4, rows["identity/serial"].address, 2) == [NOT_RESPONDING]  # not read from the node yet


def test_nothing_is_readable_beyond_the_map():
    rig = Rig()
    rig.runs(ENABLED)
    rows = DriveMap(rig.fu1).inputs
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


# quality


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


# holding registers and coils


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


# the bridge's own unit


@pytest.mark.parametrize("unit", [0, 255])
def test_the_bridge_itself(unit: int):
    rig = Rig()
    assert rig.read(4, 0, 8, unit=unit) == [0x01, 0, 4, 3, 0, 0xFF00, 0xFF00, 0xFF00]
    rig.plant.set("bus/can0/state", 0, rig.now)
    rig.plant.set("bus/can0/load", 12.34, rig.now)
    rig.runs(ENABLED)
    assert rig.read(4, 0, 8, unit=unit) == [0x02, 123, 0, 3, 1, 0x0401, 0xFF00, 0xFF00]
    assert rig.read(4, 0, 9, unit=unit) == [NO_ADDRESS]
    assert rig.read(3, 0, 1, unit=unit) == [NO_FUNCTION]
    assert rig.read_bits(2, 0, 1, unit=unit) == [NO_FUNCTION]
    assert rig.ask("06 0000 0001", unit) == b"\x86\x01"
    assert rig.ask("05 0000 FF00", unit) == b"\x85\x01"
    assert rig.ask("16 0000 0000 0000", unit) == b"\x96\x01"


@pytest.mark.parametrize(("bus_state", "bits"), [(1, 0x12), (2, 0x12), (3, 0x22), (4, 0x02)])
def test_module_state_of_the_bus(bus_state: int, bits: int):
    rig = Rig()
    rig.runs(ENABLED)
    rig.plant.set("bus/can0/state", bus_state, rig.now)
    assert rig.read(4, 0, 3, unit=255) == [bits, 0, bus_state]


def test_module_state_of_nodes_and_watchdogs():
    rig = Rig()
    rig.plant.set("bus/can0/state", 0, rig.now)
    rig.runs(READY)
    rig.write(0, 0x047E)
    rig.pass_time(0.3)
    assert rig.read(4, 0, 1, unit=255) == [0x0A]
    rig.node(NodeState.LOST)
    assert rig.read(4, 0, 1, unit=255) == [0x0C]


def test_a_node_that_is_out_of_service_says_nothing_of_the_module():
    plant = sites.plant_of(
        sites.site(
            sites.bus(
                sites.node(sites.drive("fu1", "modbus", 200, ""), name="conveyor"),
                sites.node(
                    sites.drive("fu1", "modbus", 200, ""), name="spare", node_id=6, more="enabled = false"
                ),
            ),
            sites.modbus(0),
        )
    )
    plant.set("bus/can0/state", 0, 100.0)
    plant.on_node(plant.nodes["conveyor"], NodeState.OPERATIONAL, 100.0)
    plant.on_node(plant.nodes["spare"], NodeState.DISABLED, 100.0)
    unit = BridgeUnit(units_of(plant), view_of(plant, lambda: 100.0))
    (state,) = unit.read_words(Table.INPUT_REGISTER, 0, 1, PLC)
    assert state == 0x02, "operational, and nothing else"


def test_a_node_whose_first_drive_has_no_process_data_is_not_in_operation():
    rig = Rig()
    rig.plant.set("bus/can0/state", 0, 100.0)
    node = rig.plant.nodes["conveyor"]
    rig.plant.on_node(node, NodeState.OPERATIONAL, 100.0)
    assert rig.read(4, 0, 1, 255)[0] & 0x03 == 0x02
    node.drives[1].channel.on_node(NodeState.CONFIG_ERROR, 100.0)
    assert rig.read(4, 0, 1, 255)[0] & 0x03 == 0x02, "the first one has them"
    node.drives[0].channel.on_node(NodeState.CONFIG_ERROR, 100.0)
    assert rig.read(4, 0, 1, 255)[0] & 0x03 == 0x01, "starting"
    assert rig.plant.image.read("conveyor/node/state").value == 6


# exceptions


def test_unknown_units_are_not_configured():
    rig = Rig()
    for unit in (3, 8, 247, 254):
        assert rig.ask("03 0000 0001", unit) == b"\x83\x0a"
        assert rig.ask("99", unit) == b"\x99\x0a"


@pytest.mark.parametrize(
    ("pdu", "answer"),
    [
        ("00", "80 01"),
        ("07", "87 01"),  # read exception status, §6.7
        ("63 00", "E3 01"),
        ("83 00", "83 01"),
        ("2B 0D 00", "AB 01"),  # CANopen general reference, a later issue
        ("2B 0E 05 00", "AB 03"),
        ("2B 0E 00 00", "AB 03"),
        ("2B 0E 01", "AB 03"),
        ("2B", "AB 03"),
        ("08 0001 0000", "88 01"),
        ("08 00", "88 03"),
        ("03 0000 0000", "83 03"),
        ("03 0000 007E", "83 03"),
        ("04 0000 0000", "84 03"),
        ("04 0000", "84 03"),
        ("04 0000 0001 00", "84 03"),
        ("01 0000 07D1", "81 03"),
        ("02 0000 0000", "82 03"),
        ("05 0000 0001", "85 03"),
        ("06 0000", "86 03"),
        ("0F 0000 0008 02 0000", "8F 03"),
        ("0F 0000 0009 01 00", "8F 03"),
        ("0F 0000 0000 00", "8F 03"),
        ("10 0000 0001 02 00", "90 03"),
        ("10 0000 0001 04 0000 0000", "90 03"),
        ("10 0000 0000 00", "90 03"),
        ("16 0000 0000", "96 03"),
        ("17 0000 0000 0000 0001 02 047E", "97 03"),
        ("17 0000 0001 0000 0001 02 04", "97 03"),
    ],
)
def test_wrong_functions_and_counts_name_the_right_function(pdu: str, answer: str):
    rig = Rig()
    rig.runs(SWITCH_ON_INHIBITED)
    assert rig.ask(pdu).hex(" ").upper() == answer
    assert rig.fu1.channel.owner is None


def test_every_outcome_has_its_exception():
    assert set(EXCEPTIONS) == set(Code) - {Code.OK}


def test_loopback():
    assert Rig().ask("08 0000 A537") == bytes.fromhex("08 0000 A537")


# device identification


def objects_of(answer: bytes) -> dict[int, bytes]:
    found: dict[int, bytes] = {}
    rest = answer[7:]
    while rest:
        found[rest[0]] = rest[2 : 2 + rest[1]]
        rest = rest[2 + rest[1] :]
    assert len(found) == answer[6]
    return found


def test_identification_is_that_of_the_drive():
    rig = Rig()
    rig.fu1.on_identification(Identification(0x38, 0x1234, 0x0001_0002, 7, "SK 200E"), rig.now)
    basic = rig.ask("2B 0E 01 00")
    assert basic[:6] == bytes.fromhex("2B 0E 01 83 00 00")
    assert objects_of(basic) == {0: b"Getriebebau NORD", 1: b"SK TU4-CAO", 2: b"1.2"}
    regular = objects_of(rig.ask("2B 0E 02 00"))
    assert (regular[4], regular[5], regular[6]) == (b"SK 200E", b"fu1", b"conveyor/fu1")
    extended = objects_of(rig.ask("2B 0E 03 00"))
    assert (extended[0x80], extended[0x83]) == (b"00000038", b"00000007")
    assert objects_of(rig.ask("2B 0E 03 82")) == {0x82: b"00010002", 0x83: b"00000007"}
    assert objects_of(rig.ask("2B 0E 01 04")) == objects_of(basic)  # not in the category: from the beginning


def test_identification_object_by_object():
    rig = Rig()
    assert objects_of(rig.ask("2B 0E 04 06", unit=2)) == {6: b"conveyor/fu2"}
    assert rig.ask("2B 0E 04 03") == b"\xab\x02"
    assert rig.ask("2B 0E 04 FF") == b"\xab\x02"
    assert objects_of(rig.ask("2B 0E 01 00", unit=255)) == {0: b"drivebridge", 1: b"drivebridge", 2: b"1.2.3"}


@given(st.dictionaries(st.integers(0, 255), st.binary(max_size=240), min_size=1))
@example({0: bytes(122), 1: bytes(120)})  # together 253 bytes
@example({0: bytes(122), 1: bytes(121)})
def test_identification_of_any_length_comes_whole_in_answers_that_fit(objects: dict[int, bytes]):
    """§6.21: asked again where an answer says that more follows, a client gets every object once."""
    wanted = dict(sorted(objects.items()))
    found: dict[int, bytes] = {}
    at = 0
    for _ in wanted:
        answer = identification_answer(Identify(3, at), wanted)
        assert len(answer) <= PDU_MOST
        came = objects_of(answer)
        assert came and not came.keys() & found.keys()
        found |= came
        more, at = answer[4], answer[5]
        rest = [number for number in wanted if number not in found]
        assert (more, at) == ((0xFF, rest[0]) if rest else (0, 0))
        if rest:
            # No answer is cut sooner than it has to be.
            assert len(answer) + 2 + len(wanted[rest[0]]) > PDU_MOST
        else:
            break
    assert found == wanted


def test_a_name_of_any_length_fits_into_an_answer():
    rig = Rig()
    rig.fu1.on_identification(Identification(1, 2, 3, 4, "drive " * 100), rig.now)
    rig.runs(ENABLED)
    for number in range(256):
        assert len(rig.ask(struct.pack(">BBBB", 0x2B, 0x0E, 4, number))) <= PDU_MOST
    answer = rig.ask("2B 0E 03 00")
    for _ in range(20):
        assert objects_of(answer), "a stream comes to its end"
        if not answer[4]:
            break
        answer = rig.ask(struct.pack(">BBBB", 0x2B, 0x0E, 3, answer[5]))
    assert not answer[4]


def test_long_identification_goes_on_where_it_says():
    texts = {0: b"a" * 200, 1: b"b" * 100, 2: b"c"}
    first = identification_answer(Identify(1, 0), texts)
    assert len(first) <= 253
    assert first[4:6] == b"\xff\x01"
    assert objects_of(first) == {0: texts[0]}
    second = identification_answer(Identify(1, 1), texts)
    assert second[4:6] == b"\x00\x00"
    assert objects_of(second) == {1: texts[1], 2: texts[2]}


# the list that `export modbus` prints


def test_the_list_is_complete_and_without_overlap():
    plant = make_plant()
    assert [m.unit_id for m in drive_maps(plant)] == [1, 2, 9]
    for drive_map in drive_maps(plant):
        for table in Table:
            used = [
                a for r in drive_map.rows if r.table is table for a in range(r.address, r.address + r.size)
            ]
            assert used == sorted(set(used))
    references = {row.name: row.reference for row in DriveMap(plant.by_unit[1]).rows if row.size == 2}
    assert references["actual/frequency"] == "30033"
    assert references["command/frequency"] == "40033"
    access = {(m.unit_id, r.name): r.access for m in drive_maps(plant) for r in m.rows}
    assert access[1, "supervision/fieldbus_timeout_ms"] == "r"
    assert access[9, "supervision/fieldbus_timeout_ms"] == "rw"
    bridge = units_of(plant).bridge_rows
    assert [row.name for row in bridge][-3:] == ["conveyor/fu1", "conveyor/fu2", "conveyor/fu3"]


def test_every_listed_register_can_be_read():
    rig = Rig()
    rig.runs(ENABLED, drive="fu2")
    rig.drive("fu2").on_identification(Identification(1, 2, 3, 4, "x"), rig.now)
    rig.drive("fu2").on_own_supervision(OwnJudgement(accepted="a test of registers"), rig.now)
    functions = {
        Table.COIL: 1,
        Table.DISCRETE_INPUT: 2,
        Table.HOLDING_REGISTER: 3,
        Table.INPUT_REGISTER: 4,
    }
    for row in DriveMap(rig.drive("fu2")).rows:
        if row.name in ("actual/position", "command/position"):
            continue  # not in the telegram
        if row.name.startswith("parameter/"):
            rig.plant.set(f"conveyor/fu2/{row.name}", 1, rig.now)
        request = struct.pack(">BHH", functions[row.table], row.address, row.size)
        assert rig.ask(request, unit=2, caller=PLC)[0] < 0x80, row
