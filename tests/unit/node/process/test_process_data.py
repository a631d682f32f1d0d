"""Process data of a drive with several PDOs, by a mapping file alone: a family of an invented maker."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Action, Code
from bridge.image import Quality
from tests.support.bench import Bench, write_site
from tests.support.invented import SPIN, command, spin_bench, spindle
from tests.support.pdo_node import PdoNode
from tests.support.rig import ENABLE, SHUT_DOWN

DRIVE = "spindle/drive"
READY, RUN = 0x6, 0xF


def running(folder: Path, node: PdoNode, mapping: str = SPIN, drive: str = "") -> Bench:
    bench = spin_bench(folder, node, mapping=mapping, drive=drive)
    bench.run(1.0)
    return bench


def status(bench: Bench) -> str:
    return str(bench.value("spindle/node/boot_status"))


def quality(bench: Bench, leaf: str) -> Quality:
    return bench.plant.image.read(f"{DRIVE}/{leaf}").quality


def reason(bench: Bench, leaf: str) -> str:
    return bench.plant.image.read(f"{DRIVE}/{leaf}").reason


def test_a_family_is_added_by_writing_one_mapping_file_and_no_code(tmp_path: Path) -> None:
    """Identity, start value, scaling, two RPDOs, two TPDOs, state machine, fault: all from the file."""
    node = spindle()
    bench = running(tmp_path, node)
    assert status(bench).startswith("ok")
    assert node.number("6060:00") == 3, "[[slot.start]]"
    assert command(bench, control_word=READY, velocity=1500.0).ok
    bench.run(0.1)
    assert bench.value(f"{DRIVE}/status/state") == 2
    assert command(bench, control_word=RUN, target=12.34, mode=1).forwarded
    bench.run(0.1)
    assert node.number("6042:00") == 500, "1500 of 3000 1/min is half of 1000"
    assert node.number("607A:00", signed=True) == 1734
    assert node.number("2AC8:00") == 1
    assert bench.value(f"{DRIVE}/status/state") == 4
    assert bench.value(f"{DRIVE}/actual/speed") == 1500.0
    node.put("6064:00", 4, -250)
    node.put("6041:00", 2, 0x0627)
    bench.run(0.2)
    assert bench.value(f"{DRIVE}/actual/position") == -7.5
    assert bench.value(f"{DRIVE}/actual/in_position") is True
    bench.run(0.6)
    assert bench.value(f"{DRIVE}/status/fault_text") == "1.0 controller silent"
    bench.run(0.1)
    assert node.number("6040:00") & RUN != RUN
    assert node.number("607A:00") == 0, "setpoints of the second RPDO are zero too"


class TestBeats:
    def test_every_rpdo_has_its_burst_and_the_control_word_goes_last(self, tmp_path: Path) -> None:
        bench = running(tmp_path, spindle())
        del bench.log[:]
        assert command(bench, control_word=READY, velocity=30.0, target=1.0).ok
        bench.run(0)
        assert [frame.can_id for frame in bench.log if frame.can_id in (0x209, 0x309)] == [0x309, 0x209]
        bench.run(0.5)
        assert len(bench.sent(0x309)) == len(bench.sent(0x209)) > 40

    def test_a_hung_bridge_leaves_none_of_them(self, tmp_path: Path) -> None:
        bench = running(tmp_path, spindle())
        bench.hang(0.3)
        del bench.log[:]
        bench.hang(0.3)
        assert not bench.sent(0x209)
        assert not bench.sent(0x309)

    def test_silence_ends_all_of_them(self, tmp_path: Path) -> None:
        bench = running(tmp_path, spindle(), drive='on_expiry = "silence"')
        (drive,) = bench.plant.drives.values()
        drive.channel.on_own_watch("", bench.now)  # as of a drive that watches its process data
        assert command(bench, control_word=READY).ok
        bench.run(0.6)
        del bench.log[:]
        bench.run(0.3)
        assert not bench.sent(0x209)
        assert not bench.sent(0x309)

    def test_before_the_boot_up_a_stopped_word_goes_by_all_that_are_on_at_factory(
        self, tmp_path: Path
    ) -> None:
        bench = spin_bench(tmp_path, spindle())
        bench.run(0.05)
        first = [frame for frame in bench.log if frame.can_id in (0x209, 0x309, 0x409)][:2]
        assert [(frame.can_id, frame.data) for frame in first] == [(0x209, bytes(4)), (0x309, bytes(6))]
        assert not bench.sent(0x409), "off at factory"


class TestValues:
    def test_a_value_of_two_words_and_its_words_must_agree(self, tmp_path: Path) -> None:
        bench = running(tmp_path, spindle())
        assert command(bench, target=12.34, target_low=1734, target_high=0).ok
        refused = command(bench, target=12.34, target_high=1)
        assert refused.code is Code.OUT_OF_RANGE
        assert refused.message == "target and the word it is made from do not agree"

    def test_a_negative_one_fills_both(self, tmp_path: Path) -> None:
        node = spindle()
        bench = running(tmp_path, node)
        assert command(bench, control_word=READY, target=-95.0).ok
        bench.run(0.1)
        assert node.number("607A:00", signed=True) == -9000
        assert bench.value(f"{DRIVE}/command/target_high") == 0xFFFF
        assert bench.value(f"{DRIVE}/command/target") == -95.0

    @pytest.mark.landing(7)
    @pytest.mark.parametrize(
        ("values", "message"),
        [
            ({"target": -100.5}, "target takes -100…1000, not -100.5 mm"),
            ({"target": 1e12}, "target takes -100…1000, not 1e+12 mm"),
            ({"mode": 2}, "mode takes 0 none, 1 profile position, 3 profile velocity, not 2"),
            ({"mode": 1.5}, "mode takes a whole number, not 1.5"),
            ({"mode": -1}, "mode takes 0…65535, not -1"),
            ({"mode": "none"}, "mode takes a number"),
            ({"velocity": 7000.0}, "velocity takes -6000…6000, not 7000 1/min"),
        ],
    )
    def test_ranges_are_kept(self, tmp_path: Path, values: dict[str, object], message: str) -> None:
        bench = running(tmp_path, spindle())
        outcome = command(bench, **values)
        assert (outcome.code, outcome.message) == (Code.OUT_OF_RANGE, message)

    def test_bits_of_one_word_are_set_one_by_one(self, tmp_path: Path) -> None:
        node = spindle()
        node.pdo("rpdo", 3, 0x400, ["2100:00/8"])
        bench = running(tmp_path, node)
        assert command(bench, control_word=READY, valves=0x40).ok
        assert command(bench, valve_b=True).ok
        bench.run(0.05)
        assert node.number("2100:00") == 0x48
        assert command(bench, valve_a=True, valve_b=False).ok
        bench.run(0.05)
        assert node.number("2100:00") == 0x41
        assert bench.value(f"{DRIVE}/command/valve_a") is True
        assert command(bench, valve_a=True, valves=0x40).code is Code.OUT_OF_RANGE
        assert command(bench, valve_a=2).message == "valve_a takes true or false, not 2"

    def test_points_have_types_ranges_states_and_bits(self, tmp_path: Path) -> None:
        points = {
            point.name.removeprefix(f"{DRIVE}/"): point
            for point in running(tmp_path, spindle()).plant.image.points
        }
        target, mode = points["command/target"], points["command/mode"]
        assert (target.data_type, target.low, target.high, target.unit) == ("float", -100.0, 1000.0, "mm")
        assert mode.states == ((0, "none"), (1, "profile position"), (3, "profile velocity"))
        assert mode.data_type == "uint16"
        assert points["actual/in_position"].data_type == "bool"
        assert points["actual/probes"].bits == ("left", "right")


class TestOptional:
    def test_what_is_off_in_the_node_is_not_served_and_the_rest_works(self, tmp_path: Path) -> None:
        bench = running(tmp_path, spindle())
        why = "1402h:01: the PDO is switched off in the node"
        for leaf in ("command/valves", "command/valve_a", "command/valve_b"):
            assert (quality(bench, leaf), reason(bench, leaf)) == (Quality.CONFIG_ERROR, why)
        assert quality(bench, "actual/probes") is Quality.CONFIG_ERROR
        assert quality(bench, "actual/position") is Quality.GOOD
        outcome = command(bench, valve_a=True)
        assert (outcome.code, outcome.message) == (Code.NOT_CONFIGURED, f"valve_a: {why}")
        assert "1402h" not in status(bench), "nothing is wrong with that"

    def test_the_site_file_switches_one_on(self, tmp_path: Path) -> None:
        node = spindle()
        bench = running(tmp_path, node, drive="rpdo = { number = 3 }\ntpdo = [{ number = 3, event_ms = 40 }]")
        assert command(bench, control_word=READY, valves=5).ok
        node.put("60FD:00", 1, 2)
        bench.run(0.1)
        assert node.number("2100:00") == 5
        assert bench.value(f"{DRIVE}/actual/probes") == 2
        assert node.number("1802:05") == 40

    def test_one_that_the_node_refuses_is_told_and_only_its_words_are_lost(self, tmp_path: Path) -> None:
        node = spindle()
        for index, sub in list(node.objects):
            if index in (0x1402, 0x1602):
                del node.objects[index, sub]
        bench = running(tmp_path, node)
        assert reason(bench, "command/valves") == "the node has no RPDO3"
        assert bench.plant.drives[DRIVE].quality is Quality.GOOD

    def test_a_second_pdo_that_is_not_optional_is_told_and_not_the_end(self, tmp_path: Path) -> None:
        node = spindle()
        node.pdo("rpdo", 2, 0x300, ["607A:00/32"], on=False)
        bench = running(tmp_path, node)
        assert "axis: 1401h:01: the PDO is switched off in the node" in status(bench)
        assert quality(bench, "command/target") is Quality.CONFIG_ERROR
        assert command(bench, control_word=READY, velocity=3.0).forwarded


class TestTheNodeWins:
    def test_words_that_it_does_not_carry_are_told_one_by_one(self, tmp_path: Path) -> None:
        node = spindle()
        node.pdo("rpdo", 2, 0x300, ["607A:00/32", "2222:00/16"])
        bench = running(tmp_path, node)
        assert "axis: RPDO2: 2222:00/16 is no word that the mapping file knows" in status(bench)
        assert "axis: modes is not in RPDO2" in status(bench)
        assert reason(bench, "command/mode") == "RPDO2 of the node does not carry it"
        assert command(bench, control_word=READY, target=0.0).ok
        bench.run(0.1)
        assert node.number("607A:00") == 500

    def test_another_length_is_told(self, tmp_path: Path) -> None:
        node = spindle()
        node.pdo("rpdo", 2, 0x300, ["607A:00/16", "2AC8:00/8", "2830:00/8"])
        assert "axis: RPDO2: 607A:00/16 has 32 bits in the mapping file" in status(running(tmp_path, node))

    def test_a_word_may_come_by_another_pdo(self, tmp_path: Path) -> None:
        node = spindle()
        node.pdo("rpdo", 1, 0x200, ["6042:00/16"])
        node.pdo("rpdo", 2, 0x300, ["6040:00/16", "607A:00/32"])
        bench = running(tmp_path, node)
        assert command(bench, control_word=READY, velocity=300.0, target=0.0).forwarded
        bench.run(0.1)
        assert (node.number("6040:00"), node.number("6042:00")) == (READY, 100)

    def test_without_a_control_word_the_drive_is_not_served(self, tmp_path: Path) -> None:
        node = spindle()
        node.pdo("rpdo", 1, 0x200, ["6042:00/16"])
        bench = running(tmp_path, node)
        assert "RPDO1 and RPDO2 do not carry the control word" in status(bench)
        assert bench.plant.drives[DRIVE].quality is Quality.CONFIG_ERROR

    def test_where_the_mapping_file_writes_the_node_is_brought_to_it(self, tmp_path: Path) -> None:
        node = spindle()
        node.pdo("tpdo", 2, 0x280, ["6064:00/16"], event_ms=7)
        bench = running(tmp_path, node)
        assert (0x1A01, 1, bytes.fromhex("20006460")) in node.writes
        assert node.number("1801:05") == 100
        assert "is not in TPDO2" not in status(bench)

    def test_and_the_site_file_wins_over_that(self, tmp_path: Path) -> None:
        node = spindle()
        running(tmp_path, node, drive="tpdo = { number = 2, event_ms = 30 }")
        assert node.number("1801:05") == 30

    def test_what_is_there_already_is_not_written(self, tmp_path: Path) -> None:
        node = spindle()
        node.put("6060:00", 1, 3)
        running(tmp_path, node)
        assert not [write for write in node.writes if write[0] not in (0x1017,)]

    def test_a_start_value_that_is_refused_is_the_drives_problem(self, tmp_path: Path) -> None:
        node = spindle()
        del node.objects[0x6060, 0]
        node.refuses.add(0x6060)
        bench = running(tmp_path, node)
        assert "6060h:00" in status(bench)
        assert bench.plant.drives[DRIVE].quality is Quality.CONFIG_ERROR


class TestFreshness:
    def test_the_values_of_a_further_tpdo_have_an_age_of_their_own(self, tmp_path: Path) -> None:
        node = spindle()
        bench = running(tmp_path, node)
        node.put("1801:05", 2, 0)  # its event timer stops
        bench.run(0.5)
        assert quality(bench, "actual/position") is Quality.STALE
        assert reason(bench, "actual/position") == "no TPDO2 from the drive"
        assert quality(bench, "actual/speed") is Quality.GOOD
        assert bench.plant.drives[DRIVE].quality is Quality.GOOD
        node.put("6064:00", 4, 5)
        bench.run(0.1)
        assert quality(bench, "actual/position") is Quality.GOOD

    def test_the_status_word_is_not_fresh_because_another_tpdo_comes(self, tmp_path: Path) -> None:
        bench = running(tmp_path, spindle())
        bench.deaf_to = frozenset((0x189,))
        bench.run(1.5)
        assert bench.plant.drives[DRIVE].quality is Quality.LOST
        assert quality(bench, "actual/position") is Quality.LOST

    def test_the_worse_of_the_node_and_the_further_tpdo_is_told(self, tmp_path: Path) -> None:
        """What never came still waits when the node is lost; what was late before is lost with it."""
        bench = spin_bench(tmp_path, spindle())
        bench.deaf_to = frozenset((0x289,))
        bench.run(1.0)
        bench.deaf_to = frozenset((0x189, 0x289))
        bench.run(1.5)
        assert quality(bench, "actual/speed") is Quality.LOST
        assert quality(bench, "actual/position") is Quality.WAITING

    def test_what_was_late_is_lost_with_its_node(self, tmp_path: Path) -> None:
        node = spindle()
        bench = running(tmp_path, node)
        node.put("1801:05", 2, 0)
        bench.run(0.5)
        assert quality(bench, "actual/position") is Quality.STALE
        bench.deaf_to = frozenset((0x189,))
        bench.run(1.5)
        assert quality(bench, "actual/speed") is Quality.LOST
        assert quality(bench, "actual/position") is Quality.LOST
        assert reason(bench, "actual/position") == reason(bench, "actual/speed")

    def test_before_its_first_tpdo_a_value_waits(self, tmp_path: Path) -> None:
        bench = spin_bench(tmp_path, spindle())
        bench.deaf_to = frozenset((0x289,))
        bench.run(1.0)
        assert quality(bench, "actual/position") is Quality.WAITING
        assert quality(bench, "actual/speed") is Quality.GOOD


class TestFaults:
    def test_an_event_number_decides_over_the_code(self, tmp_path: Path) -> None:
        node = spindle()
        bench = running(tmp_path, node)
        node.put("6041:00", 2, 0x0208)
        node.emcy(bytes.fromhex("00 10 01 29 02 00 00 00"))
        bench.run(0.2)
        assert bench.value(f"{DRIVE}/status/emcy_code") == 0x1000
        assert bench.value(f"{DRIVE}/status/fault_text") == "41 motor temperature, cause 2"
        node.put("6041:00", 2, 0x0240)
        node.emcy(bytes.fromhex("00 10 00 1E 00 00 00 00"))
        bench.run(0.2)
        assert bench.value(f"{DRIVE}/status/fault_text") == ""

    def test_the_drives_own_fault_number_is_read_and_told(self, tmp_path: Path) -> None:
        node = spindle()
        bench = running(tmp_path, node)
        node.put("205A:00", 2, 72)
        node.put("6041:00", 2, 0x0208)
        bench.run(1.0)
        assert bench.value(f"{DRIVE}/supervision/current_fault") == 7.2
        assert bench.value(f"{DRIVE}/supervision/last_fault") == 7.2
        assert bench.value(f"{DRIVE}/status/fault_text") == "7.2 spindle too hot"
        node.put("205A:00", 2, 0)
        node.put("6041:00", 2, 0x0240)
        bench.run(1.5)
        assert bench.value(f"{DRIVE}/supervision/current_fault") == 0.0
        assert bench.value(f"{DRIVE}/supervision/last_fault") == 7.2

    def test_the_bridges_own_fault_is_told_before_it(self, tmp_path: Path) -> None:
        node = spindle()
        bench = running(tmp_path, node)
        node.put("205A:00", 2, 72)
        assert command(bench, control_word=READY).ok
        bench.run(0.7)
        node.put("6041:00", 2, 0x0208)
        bench.run(1.0)
        assert bench.value(f"{DRIVE}/supervision/current_fault") == 1.0
        assert bench.value(f"{DRIVE}/status/fault_text") == "1.0 controller silent"
        assert bench.ask(Action.RESET_FAULT, DRIVE).ok
        bench.run(0.1)
        assert bench.value(f"{DRIVE}/supervision/current_fault") == 7.2

    def test_a_healthy_drive_is_asked_once(self, tmp_path: Path) -> None:
        bench = running(tmp_path, spindle())
        bench.run(3.0)
        asked = [frame for frame in bench.sent(0x609) if frame.data[1:3] == bytes.fromhex("5A20")]
        assert len(asked) == 1

    def test_and_at_once_when_an_emergency_came(self, tmp_path: Path) -> None:
        node = spindle()
        bench = running(tmp_path, node)
        node.put("205B:00", 2, 33)
        node.emcy(bytes.fromhex("00 10 01 29 02 00 00 00"))
        bench.run(0.05)
        assert bench.value(f"{DRIVE}/supervision/last_fault") == pytest.approx(3.3)


class TestIdentity:
    def test_another_device_at_the_address_is_left_alone(self, tmp_path: Path) -> None:
        node = spindle()
        node.put("1018:01", 4, 0xBAD)
        bench = running(tmp_path, node)
        assert status(bench).startswith("D: 1018h:01 is 00000BADh, expected 00000ACEh by the mapping")
        assert bench.plant.drives[DRIVE].quality is not Quality.GOOD
        assert not node.writes
        assert (0x01, 9) not in [tuple(frame.data) for frame in bench.sent(0)], "it is not started"
        bench.run(1.0)
        repeated = [frame for frame in bench.log if frame.can_id == 0x209]
        assert len(repeated) <= 12, "stopped words at each attempt, no process data"
        assert {bytes(frame.data) for frame in repeated} == {bytes(4)}

    def test_a_node_that_is_not_in_the_site_is_listed_and_left_alone(self, tmp_path: Path) -> None:
        bench = running(tmp_path, spindle())
        del bench.log[:]
        for _ in range(3):
            bench.receive(Frame(0x700 + 33, b"\x7f"))
            bench.run(0.2)
        assert "33" in str(bench.value("bus/can0/unexpected_nodes"))
        assert not [frame for frame in bench.log if frame.can_id & 0x7F == 33]
        assert not [frame for frame in bench.sent(0) if frame.data[1] in (0, 33)]


class TestAWordOfSeveralObjects:
    """What no PDO carries would read as 0, which is a value like any other."""

    MAPPING = (
        SPIN.replace("write = true\nevent_ms = 100\n", "").replace("""[parameter_names]""", """
[[value]]
name = "mode_now"
group = "actual"
word = "modes_now"
[[value]]
name = "aux_ready"
group = "actual"
word = "modes_now"
bit = 0
[[value]]
name = "homed"
group = "actual"
word = "modes_now"
bit = 8
[[value]]
name = "brake"
group = "command"
word = "modes"
bit = 8

[parameter_names]""")
    )  # fmt: skip

    def test_a_value_of_a_part_that_is_not_mapped_is_not_good(self, tmp_path: Path) -> None:
        node = spindle()
        node.pdo("tpdo", 2, 0x280, ["6064:00/32", "2AC9:00/8"], event_ms=100)
        node.put("2AC9:00", 1, 1)
        bench = running(tmp_path, node, self.MAPPING)
        why = "no TPDO of the node carries 2831:00"
        assert f"{why}, a part of modes_now" in status(bench)
        assert quality(bench, "actual/aux_ready") is Quality.GOOD
        for leaf in ("actual/homed", "actual/mode_now"):
            assert (quality(bench, leaf), reason(bench, leaf)) == (Quality.CONFIG_ERROR, why)

    def test_nor_is_it_commanded(self, tmp_path: Path) -> None:
        node = spindle()
        node.pdo("rpdo", 2, 0x300, ["607A:00/32", "2AC8:00/8"])
        bench = running(tmp_path, node, self.MAPPING)
        for values in ({"brake": 1}, {"mode": 1}):
            refused = command(bench, control_word=RUN, **values)
            assert (refused.code, refused.message.partition(": ")[2]) == (
                Code.NOT_CONFIGURED,
                "no RPDO of the node carries 2830:00",
            )
        assert quality(bench, "command/brake") is Quality.CONFIG_ERROR

    @pytest.mark.parametrize(
        ("word", "of_two", "kind", "mapped", "missing"),
        [
            ("6041:00", "6041:00+2041:00", "tpdo", "2041:00/8", "6041:00, a part of the status word"),
            ("6040:00", "2040:00+6040:00", "rpdo", "2040:00/8", "6040:00, a part of the control word"),
        ],
    )
    def test_without_a_part_of_its_state_a_drive_is_not_served(
        self, tmp_path: Path, word: str, of_two: str, kind: str, mapped: str, missing: str
    ) -> None:
        node = spindle()
        node.pdo(kind, 1, 0x180 if kind == "tpdo" else 0x200, [mapped], event_ms=50)
        mapping = SPIN.replace(f'["{word}"]', f'["{of_two}"]')
        if kind == "rpdo":  # acknowledged and valid by a bit of the high byte
            mapping = mapping.replace("acknowledge_bit = 7", "acknowledge_bit = 8")
        bench = running(tmp_path, node, mapping)
        assert f"no {kind.upper()} of the node carries {missing}" in status(bench)
        assert quality(bench, "status/state") is Quality.CONFIG_ERROR


class TestNordsDigitalOutputs:
    """BU 2500 §6.4: RPDO5, 240h + node id, off at factory; 3004h."""

    ON = "rpdo = { number = 5 }"

    def test_they_are_not_served_where_it_is_off(self, tmp_path: Path) -> None:
        bench = Bench(write_site(tmp_path))
        bench.run(1.0)
        assert bench.write(control_word=SHUT_DOWN, digital_outputs=1).code is Code.NOT_CONFIGURED
        assert not bench.sent(0x245)
        assert str(bench.value("conveyor/node/boot_status")).split(";")[0] == "ok"

    def test_fu1s_owner_commands_them_where_it_is_on(self, tmp_path: Path) -> None:
        bench = Bench(write_site(tmp_path, drive=self.ON))
        bench.run(1.0)
        assert bench.write(control_word=SHUT_DOWN, digital_outputs=0b10).ok
        bench.run(0.1)
        assert bench.node.image.outputs == 0b10
        assert bench.value("conveyor/fu1/command/digital_outputs") == 0b10
        assert "digital_outputs" not in " ".join(
            point.name for point in bench.plant.image.points if point.name.startswith("conveyor/fu2/")
        )

    def test_they_fall_when_the_controller_does(self, tmp_path: Path) -> None:
        bench = Bench(write_site(tmp_path, drive=self.ON))
        bench.run(1.0)
        assert bench.write(control_word=SHUT_DOWN, digital_outputs=3).ok
        bench.run(0.1)
        assert bench.node.image.outputs == 3
        bench.run(0.3)
        assert bench.node.image.outputs == 0

    def test_the_worst_case_is_that_of_the_control_word(self, tmp_path: Path) -> None:
        plain = Bench(write_site(tmp_path))
        plain.run(1.0)
        bench = Bench(write_site(tmp_path, drive="rpdo = { number = 5, transmission_type = 1 }"))
        bench.run(1.0)
        name = "conveyor/fu1/supervision/worst_case_stop_ms"
        assert bench.number(name) == plain.number(name)

    def test_a_running_drive_keeps_its_four_words(self, tmp_path: Path) -> None:
        bench = Bench(write_site(tmp_path, drive=self.ON))
        bench.run(1.0)
        bench.keep_writing(0.2, control_word=SHUT_DOWN)
        bench.keep_writing(0.2, control_word=ENABLE, frequency=25.0, digital_outputs=1)
        assert bench.sent(0x205)[-1].data == bytes.fromhex("7F04 0020 0000 0000")
        assert bench.sent(0x245)[-1].data == bytes.fromhex("0100")
