"""Parameters of drives over the bus: read, written, polled, and what it does to the EEPROM.

A whole CANopen side with the simulated NORD interface on a virtual clock.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Action, Code, EventKind, Identity, Outcome, Request, Role, Source, command_of
from bridge.drive import DriveState, OwnJudgement
from bridge.image import Quality
from bridge.parameter.ledger import MOST_WRITES, WriteRecord
from bridge.sim.nord.nord_tu4 import NordTu4
from tests.support.bench import Bench, write_site

ENGINEER = Identity(Source.OPCUA, "eve", Role.ENGINEER)
OPERATOR = Identity(Source.OPCUA, "ann", Role.OPERATOR)
OBSERVER = Identity(Source.OPCUA, "guest", Role.OBSERVER)
READ, WRITE, SAVE = Action.READ_PARAMETER, Action.WRITE_PARAMETER, Action.SAVE_PARAMETERS
SETTLED_S = 3.0


class Parameters:
    """A bench whose node is in operation and whose points have been read."""

    def __init__(self, folder: Path, node: str = "sdo_channels = [2]", bus: str = "") -> None:
        self.bench = Bench(write_site(folder, node=node, bus=bus))
        self.bench.run(SETTLED_S)
        self.node = self.bench.node
        assert isinstance(self.node, NordTu4)

    def begin(self, action: Action, identity: Identity = ENGINEER, **more: Any) -> list[Outcome]:
        outcomes: list[Outcome] = []
        target = more.pop("target", "conveyor/fu1")
        self.bench.view.submit(Request(identity, target, command_of(action, **more)), outcomes.append)
        return outcomes

    def ask(self, action: Action, identity: Identity = ENGINEER, **more: Any) -> Outcome:
        outcomes = self.begin(action, identity, **more)
        self.bench.run(0.6)
        (outcome,) = outcomes
        return outcome

    def write(self, name: str, value: float | str, **more: Any) -> Outcome:
        return self.ask(WRITE, parameter=name, value=value, **more)

    def point(self, leaf: str, drive: str = "conveyor/fu1") -> tuple[object, Quality]:
        reading = self.bench.plant.image.read(f"{drive}/parameter/{leaf}")
        return reading.value, reading.quality

    def downloads(self, index: int) -> list[Frame]:
        low, high = index & 0xFF, index >> 8
        requests = self.bench.sent(0x605)
        return [f for f in requests if f.data[0] & 0xE0 == 0x20 and tuple(f.data[1:3]) == (low, high)]


@pytest.fixture
def parameters(tmp_path: Path) -> Parameters:
    return Parameters(tmp_path)


# reading


def test_a_parameter_is_read_by_its_name(parameters: Parameters) -> None:
    outcome = parameters.ask(READ, OBSERVER, parameter="P105.2")
    assert (outcome.code, outcome.value) == (Code.OK, 50.0)
    assert outcome.time < parameters.bench.now


@pytest.mark.landing
def test_an_object_that_no_file_lists_is_read_by_its_index(parameters: Parameters) -> None:
    # 1018h:0, number of entries: one byte
    assert parameters.ask(READ, OBSERVER, parameter="1018:00").value == 4


def test_each_drive_is_reached_over_its_own_channel(parameters: Parameters) -> None:
    assert parameters.ask(READ, target="conveyor/fu2", parameter="P426").value == 0.1
    asked = [frame.data[:4].hex(" ") for frame in parameters.bench.sent(0x345)]
    assert "40 aa 21 01" in asked


def test_a_name_that_does_not_exist_is_told_with_the_nearest(parameters: Parameters) -> None:
    outcome = parameters.ask(READ, parameter="P1002")
    assert outcome.code is Code.UNKNOWN_PARAMETER
    assert "did you mean P102" in outcome.message


def test_a_parameter_that_the_drive_does_not_have_brings_its_abort_code(parameters: Parameters) -> None:
    outcome = parameters.ask(READ, parameter="P999")
    assert (outcome.code, outcome.abort_code) == (Code.REFUSED_BY_DRIVE, 0x0602_0000)
    assert "object does not exist" in outcome.message
    assert parameters.bench.value("conveyor/fu1/supervision/sdo_abort_code") == 0x0602_0000


def test_several_who_read_at_once_share_one_answer(parameters: Parameters) -> None:
    before = len(parameters.bench.sent(0x605))
    outcomes = [parameters.begin(READ, parameter="P426") for _ in range(5)]
    parameters.bench.run(0.01)
    assert [one[0].value for one in outcomes] == [0.1] * 5
    assert len(parameters.bench.sent(0x605)) == before + 1


def test_a_value_read_a_moment_ago_is_given_without_asking(parameters: Parameters) -> None:
    parameters.ask(READ, parameter="P426")
    before = len([f for f in parameters.bench.sent(0x605) if f.data[1:3] == b"\xaa\x21"])
    assert parameters.ask(READ, parameter="P426", max_age_ms=60_000).value == 0.1
    assert len([f for f in parameters.bench.sent(0x605) if f.data[1:3] == b"\xaa\x21"]) == before


@pytest.mark.landing
def test_who_accepts_no_old_value_has_the_drive_asked_each_time(parameters: Parameters) -> None:
    for count in (1, 2, 3):
        outcomes = parameters.begin(READ, parameter="P426")
        parameters.bench.run(0.0005)
        assert [outcome.value for outcome in outcomes] == [0.1]
        asked = [frame for frame in parameters.bench.sent(0x605) if frame.data[1:3] == b"\xaa\x21"]
        assert len(asked) == count


def test_a_drive_without_a_channel_is_told_how_to_get_one(tmp_path: Path) -> None:
    parameters = Parameters(tmp_path, node="")
    outcome = parameters.ask(READ, target="conveyor/fu2", parameter="P105")
    assert outcome.code is Code.NOT_CONFIGURED
    assert "sdo_channels" in outcome.message
    assert parameters.point("p105", "conveyor/fu2")[1] is Quality.CONFIG_ERROR


def test_a_node_that_is_not_there_is_not_asked(parameters: Parameters) -> None:
    parameters.bench.cut = True
    parameters.bench.run(1.0)
    outcome = parameters.ask(READ, parameter="P105")
    assert outcome.code is Code.NOT_READY


# writing


def test_a_parameter_is_written_and_read_back(parameters: Parameters) -> None:
    outcome = parameters.write("P102", 1.03)
    assert (outcome.code, outcome.value) == (Code.OK, 1.03)
    # BU 2500 §6.6.1, the example of the manual
    (frame,) = parameters.downloads(0x2066)
    assert frame.data == bytes.fromhex("2B 66 20 01 67 00 00 00")
    assert parameters.point("p102") == (1.03, Quality.GOOD)
    told = [event.message for event in parameters.bench.events if event.kind is EventKind.CONFIGURATION]
    assert "P102 = 1.03 s (was 2 s), by opcua:eve" in told


def test_what_the_drive_holds_already_is_not_written_again(parameters: Parameters) -> None:
    outcome = parameters.write("P102", 2.0)
    assert (outcome.code, outcome.value) == (Code.OK, 2.0)
    assert not parameters.downloads(0x2066)
    assert parameters.node.drives[0].parameters.eeprom_writes == 0


@pytest.mark.landing(3)
@pytest.mark.parametrize("identity", [OPERATOR, OBSERVER, Identity(Source.MODBUS, "10.0.0.1")])
def test_who_is_no_engineer_writes_nothing(parameters: Parameters, identity: Identity) -> None:
    for action, more in ((WRITE, {"parameter": "P102", "value": 1.0}), (SAVE, {})):
        assert parameters.ask(action, identity, **more).code is Code.NOT_ALLOWED
    assert not parameters.downloads(0x2066)
    assert parameters.bench.events[-1].kind is EventKind.REFUSED


def test_a_client_of_a_protocol_without_roles_may_be_let(parameters: Parameters) -> None:
    plc = Identity(Source.MODBUS, "10.0.0.1", sets_parameters=True)
    assert parameters.ask(WRITE, plc, parameter="P102", value=1.0).ok


def test_without_roles_only_who_controls_the_drive_sets_its_parameters(parameters: Parameters) -> None:
    fleet = Identity(Source.ZENOH, "fleet", sets_parameters=True)
    for action, more in ((WRITE, {"parameter": "P102", "value": 1.0}), (SAVE, {})):
        outcome = parameters.ask(action, fleet, **more)
        assert (outcome.code, outcome.message) == (Code.NOT_ALLOWED, "the drive is controlled by modbus")
    assert not parameters.downloads(0x2066)
    assert parameters.ask(WRITE, ENGINEER, parameter="P102", value=1.0).ok, "an engineer may all the same"


@pytest.mark.landing(8)
@pytest.mark.parametrize(
    ("name", "value", "code"),
    [
        ("P102", 320.01, Code.OUT_OF_RANGE),
        ("P102", float("nan"), Code.OUT_OF_RANGE),
        ("P102", "fast", Code.OUT_OF_RANGE),
        ("P700[1]", 1.0, Code.READ_ONLY),
        # what the bridge itself lives by, and what the drive's controller commands
        ("1017:00", 0, Code.NOT_ALLOWED),
        ("1010:01", "save", Code.NOT_ALLOWED),
        ("3000:01", 0x047F, Code.NOT_ALLOWED),
        ("3002:01", 0x4000, Code.NOT_ALLOWED),
    ],
)
def test_what_must_not_be_written_never_reaches_the_drive(
    parameters: Parameters, name: str, value: float | str, code: Code
) -> None:
    before = len([f for f in parameters.bench.sent(0x605) if f.data[0] & 0xE0 == 0x20])
    assert parameters.write(name, value).code is code
    assert len([f for f in parameters.bench.sent(0x605) if f.data[0] & 0xE0 == 0x20]) == before


def test_a_refusal_of_the_drive_is_the_outcome(parameters: Parameters) -> None:
    # The file's range is the widest of all drives; this one takes 0 … 2.
    outcome = parameters.write("21FD:00", 100)
    assert outcome.code is Code.OUT_OF_RANGE
    outcome = parameters.write("2078:01", 9)
    assert outcome.code is Code.OUT_OF_RANGE
    outcome = parameters.write("21FE:01", 99)
    assert outcome.code in (Code.OUT_OF_RANGE, Code.REFUSED_BY_DRIVE)


def test_one_parameter_is_written_by_one_client_at_a_time(parameters: Parameters) -> None:
    first = parameters.begin(WRITE, parameter="P102", value=1.0)
    (busy,) = parameters.begin(WRITE, parameter="P102.1", value=3.0)
    other = parameters.begin(WRITE, parameter="P103", value=3.0)
    assert busy.code is Code.BUSY
    parameters.bench.run(0.1)
    assert first[0].value == 1.0
    assert other[0].value == 3.0
    assert parameters.write("P102", 3.0).ok


def test_a_scale_that_is_written_counts_at_once(parameters: Parameters) -> None:
    assert parameters.write("P105", 100.0).ok
    drive = parameters.bench.plant.drives["conveyor/fu1"]
    drive.on_process_data([0x0B31, 0x2000, 0, 0], parameters.bench.now)
    assert parameters.bench.value("conveyor/fu1/actual/frequency") == 50.0


def test_a_node_that_dies_during_a_write_ends_it(parameters: Parameters) -> None:
    outcomes = parameters.begin(WRITE, parameter="P102", value=1.0)
    parameters.bench.cut = True
    parameters.bench.run(5.0)
    (outcome,) = outcomes
    assert outcome.code is Code.TIMED_OUT


def test_an_answer_that_is_lost_after_the_write_is_no_failure(parameters: Parameters) -> None:
    parameters.ask(READ, parameter="P560")
    parameters.ask(READ, parameter="P102")
    outcomes = parameters.begin(WRITE, parameter="P102", value=1.0)
    parameters.bench.deaf_to = frozenset((0x585,))
    parameters.bench.run(0.3)
    parameters.bench.deaf_to = frozenset()
    parameters.bench.run(3.0)
    (outcome,) = outcomes
    assert (outcome.code, outcome.value) == (Code.OK, 1.0)
    assert len(parameters.downloads(0x2066)) == 1, "an EEPROM is not written twice"


# the EEPROM


def test_every_write_to_the_eeprom_is_counted(parameters: Parameters) -> None:
    for value in (1.0, 1.5, 1.5, 2.0):
        assert parameters.write("P102", value).ok
    assert parameters.bench.plant.eeprom_writes.writes(("conveyor/fu1", "2066:01")) == 3
    assert parameters.node.drives[0].parameters.eeprom_writes == 3


def test_writing_in_a_cycle_is_refused(parameters: Parameters) -> None:
    outcomes = [parameters.write("P102", float(number)) for number in range(3, MOST_WRITES + 6)]
    codes = [outcome.code for outcome in outcomes]
    assert codes == [Code.OK] * MOST_WRITES + [Code.TOO_OFTEN] * 3
    assert parameters.node.drives[0].parameters.eeprom_writes == MOST_WRITES


def test_writes_to_the_ram_alone_are_neither_counted_nor_held_up(parameters: Parameters) -> None:
    assert parameters.write("P560", "RAM only").ok
    for number in range(3, MOST_WRITES + 6):
        assert parameters.write("P102", float(number)).ok
    ledger = parameters.bench.plant.eeprom_writes
    assert ledger.writes(("conveyor/fu1", "2066:01")) == 0
    assert ledger.writes(("conveyor/fu1", "2230:00")) == 1
    assert parameters.node.drives[0].parameters.eeprom_writes == 1


def test_parameters_of_the_interface_go_to_the_eeprom_when_they_are_saved(parameters: Parameters) -> None:
    assert parameters.write("P151", 200).ok
    ledger = parameters.bench.plant.eeprom_writes
    assert ledger.writes(("conveyor/fu1", "2097:01")) == 0
    assert parameters.ask(SAVE).ok
    assert ledger.writes(("conveyor", "1010:01")) == 1
    (frame,) = parameters.downloads(0x1010)
    assert frame.data == bytes.fromhex("23 10 10 01 73 61 76 65")


def test_a_warning_comes_with_each_tenth(parameters: Parameters) -> None:
    ledger = parameters.bench.plant.eeprom_writes
    ledger.restore({("conveyor/fu1", "2066:01"): WriteRecord(9_999)}, 0.0, 0.0)
    assert parameters.write("P102", 1.0).ok
    told = [event.message for event in parameters.bench.events if event.severity == 600]
    assert told == ["P102 of conveyor/fu1 was written 10000 times: its EEPROM endures 100000 writes"]


# points


@pytest.mark.landing
def test_points_are_read_when_the_node_is_there(parameters: Parameters) -> None:
    assert parameters.point("p102") == (2.0, Quality.GOOD)
    assert parameters.point("p560") == (1, Quality.GOOD)
    assert parameters.point("p102", "conveyor/fu2") == (2.0, Quality.GOOD)


@pytest.mark.landing
def test_a_polled_point_is_as_old_as_its_period(parameters: Parameters) -> None:
    parameters.bench.run(20.0)
    reading = parameters.bench.plant.image.read("conveyor/fu1/parameter/p700_1")
    assert parameters.bench.now - reading.time < 2.5
    reading = parameters.bench.plant.image.read("conveyor/fu1/parameter/p102")
    assert parameters.bench.now - reading.time > 20.0


def test_polls_stay_within_their_budget(parameters: Parameters) -> None:
    def reads() -> int:
        frames = [*parameters.bench.sent(0x605), *parameters.bench.sent(0x345)]
        return len([frame for frame in frames if frame.data[0] == 0x40])

    before = reads()
    parameters.bench.run(10.0)
    assert reads() - before < 10 * 20 + 40


def test_what_was_read_is_not_a_present_value_once_the_node_is_gone(parameters: Parameters) -> None:
    parameters.bench.cut = True
    parameters.bench.run(1.0)
    assert parameters.point("p102") == (2.0, Quality.LOST)
    parameters.bench.run(3.0)
    assert parameters.point("p102")[1] is Quality.DEAD
    parameters.bench.cut = False
    parameters.bench.run(15.0)
    assert parameters.point("p102") == (2.0, Quality.GOOD)


# what commands or supervises a drive


@pytest.mark.landing(5)
@pytest.mark.parametrize("name", ["3000:00", "3005:01", "6040:00", "6042:00", "6060:00"])
def test_what_commands_a_drive_is_no_parameter(parameters: Parameters, name: str) -> None:
    outcome = parameters.write(name, 1)
    assert outcome.code is Code.NOT_ALLOWED
    assert not parameters.downloads(int(name[:4], 16))


@pytest.mark.landing(6)
@pytest.mark.parametrize("name", ["P509", "P510", "P513", "P151", "2201:00", "P120[1]"])
def test_only_an_engineer_sets_what_supervises_a_drive(parameters: Parameters, name: str) -> None:
    plc = Identity(Source.MODBUS, "10.0.0.1", sets_parameters=True)
    outcome = parameters.ask(WRITE, plc, parameter=name, value=1)
    assert outcome.code is Code.NOT_ALLOWED
    assert "an engineer may set it" in outcome.message


def test_what_supervises_a_drive_is_not_set_while_it_is_enabled(parameters: Parameters) -> None:
    channel = parameters.bench.plant.drives["conveyor/fu1"].channel
    channel.leg = channel.leg._replace(drive=DriveState.OPERATION_ENABLED)
    drive_word = parameters.begin(WRITE, parameter="P513", value=2.5)
    assert drive_word[0].code is Code.NOT_ALLOWED
    assert "while the drive is enabled" in drive_word[0].message


@pytest.mark.landing(2)
@pytest.mark.parametrize(("name", "index"), [("P513", 0x2201), ("P509", 0x21FD)])
def test_whether_it_is_enabled_is_judged_again_when_its_turn_has_come(
    parameters: Parameters, name: str, index: int
) -> None:
    """The drive is enabled while the write waits for the read before it."""
    channel = parameters.bench.plant.drives["conveyor/fu1"].channel
    outcomes = parameters.begin(WRITE, parameter=name, value=2)
    for _ in range(100):
        channel.leg = channel.leg._replace(drive=DriveState.OPERATION_ENABLED)
        if outcomes:
            break
        parameters.bench.run(0.001)
    (outcome,) = outcomes
    assert outcome.code is Code.NOT_ALLOWED
    assert "while the drive is enabled" in outcome.message
    assert not parameters.downloads(index)
    parameters.bench.run(1.0)
    assert parameters.write("P102.1", 3.0).ok, "the channel goes on"


def test_own_supervision_is_not_known_any_more_when_it_was_written(parameters: Parameters) -> None:
    assert parameters.write("P151", 500).ok
    reading = parameters.bench.plant.image.read("conveyor/fu1/supervision/worst_case_bridge_ms")
    assert reading.quality is Quality.CONFIG_ERROR
    assert parameters.bench.plant.drives["conveyor/fu1"].own == OwnJudgement()


def test_the_nodes_own_parameters_go_over_its_first_channel(parameters: Parameters) -> None:
    before = len(parameters.bench.sent(0x605))
    assert parameters.ask(READ, target="conveyor/fu2", parameter="P151").ok
    assert b"\x40\x97\x20\x01" in [frame.data[:4] for frame in parameters.bench.sent(0x605)[before:]]


def test_a_parameter_without_its_set_is_told_how_it_is_written(parameters: Parameters) -> None:
    assert "P999.1" in parameters.ask(READ, parameter="P999").message
