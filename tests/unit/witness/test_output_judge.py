"""The judgement of the witness over outputs: what is told of drives is told of them, and an honest node is
left alone."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.witness.bus_judge import BLIND_S, BusJudge
from bridge.witness.findings import Alarm, AlarmKind, Cause, Sight, Stop
from bridge.witness.output_plan import Values
from bridge.witness.plan import UNKNOWN_MS, WatchedBus, WatchedOutputs

DIGITAL, ANALOGUE, TPDO, HEARTBEAT, NMT, SDO = 0x215, 0x315, 0x195, 0x715, 0x000, 0x615
OPERATIONAL, PRE_OPERATIONAL, STOPPED, BOOT_UP = b"\x05", b"\x7f", b"\x04", b"\x00"
START, STOP, OUT, RESET, RESET_COMMUNICATION = (bytes((one, 21)) for one in (1, 2, 0x80, 0x81, 0x82))
SAFE, ACTIVE = b"\x00\x00", b"\x08\x00"
HELD = bytes.fromhex("0000 1027")
"""The second analogue output is on hold."""
IO = WatchedOutputs(
    name="io",
    unit_id=4,
    node_id=21,
    rpdos={DIGITAL: Values(2, 0xFFFF, 0), ANALOGUE: Values(4, 0xFFFF, 0)},
    timeout_ms=200,
    beside_ms=40,
    rpdo_ms=10,
    silent_ms=800,
    follow_ms=500,
    lost_ms=1200,
    written=frozenset({0x6200, 0x6206, 0x1029}),
)
KEEPS = replace(IO, why_active="digital keeps its value: 6206:01 is 0h")
SHOWN = replace(IO, tpdos={TPDO: Values(2, 0xFFFF, 0)})
BOUND_MS = 240


class Plant:
    """A bridge, a node and an owner that say what the test wants, 10 ms at a time."""

    def __init__(self, outputs: WatchedOutputs = IO, *, asks: bool = True) -> None:
        self.watch = BusJudge(WatchedBus("can0", "vcan0", (), {}, {21: 0.5}, (outputs,)), asks=asks)
        self.now = 100.0
        self.number = 0
        self.digital: bytes | None = SAFE
        self.analogue: bytes | None = HELD
        self.tpdo: bytes | None = None
        self.state: bytes | None = OPERATIONAL
        self.writes = False
        self.answers = asks
        self.is_dead = False
        self.stops: list[Stop] = []
        self.alarms: list[Alarm] = []
        self.sights: list[Sight] = []

    def send(self, can_id: int, data: bytes) -> None:
        self.watch.on_frame(can_id, data, self.now)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            self.now = round(self.now + 0.01, 6)
            tenth = round(self.now * 100)
            if self.writes and tenth % 5 == 0:
                self.number = (self.number + 1) & 0xFFFF
            if self.answers and tenth % 5 == 1:
                at = self.now - 0.001
                self.watch.on_number("io", self.number, at - 0.001, at)
            for can_id, data in ((DIGITAL, self.digital), (ANALOGUE, self.analogue), (TPDO, self.tpdo)):
                if data is not None:
                    self.send(can_id, data)
            if self.state is not None and tenth % 10 == 0:
                self.send(HEARTBEAT, self.state)
            self.watch.on_time(self.now)
            for finding in self.watch.take_findings():
                if isinstance(finding, Stop):
                    self.stops.append(finding)
                elif isinstance(finding, Sight):
                    self.sights.append(finding)
                elif finding.kind is not AlarmKind.BLIND or not self.is_dead:
                    self.alarms.append(finding)

    def die(self) -> None:
        """The bridge: it answers nothing any more, which is told beside all else."""
        self.is_dead = True
        self.digital = self.analogue = None
        self.answers = self.writes = False
        self.watch.on_numbers_lost()

    @property
    def kinds(self) -> list[AlarmKind]:
        return [alarm.kind for alarm in self.alarms]

    @property
    def said(self) -> str:
        (alarm,) = self.alarms
        assert alarm.source == "io"
        return alarm.message


def moving(outputs: WatchedOutputs = IO) -> Plant:
    plant = Plant(outputs)
    if outputs.tpdos:
        plant.tpdo = SAFE
    plant.writes = True
    plant.run(1.0)
    plant.digital = ACTIVE
    plant.run(0.05)
    plant.tpdo = ACTIVE if outputs.tpdos else None
    plant.run(2.0)
    assert not plant.stops
    assert not plant.alarms
    return plant


def test_it_has_to_see_its_rpdos_tpdos_heartbeat_nmt_and_sdo() -> None:
    watch = BusJudge(WatchedBus("can0", "vcan0", (), {}, {21: 0.5}, (SHOWN,)))
    assert watch.identifiers == [NMT, TPDO, DIGITAL, ANALOGUE, 0x595, SDO, HEARTBEAT]


def test_outputs_of_which_nothing_is_known_are_not_looked_at() -> None:
    watch = BusJudge(WatchedBus("can0", "vcan0", (), {}, {}, (replace(IO, why_unknown="no file"),)))
    assert not watch.identifiers


# the owner


def test_a_silent_controller_and_safe_values_in_time() -> None:
    plant = moving()
    plant.writes = False
    plant.run(0.2)
    plant.digital = SAFE
    plant.run(1.0)
    (stop,) = plant.stops
    assert (stop.drive, stop.cause, stop.drive_ms, stop.bus_bound_ms) == (
        "io",
        Cause.CONTROLLER,
        None,
        BOUND_MS,
    )
    assert stop.bus_ms is not None and 200 <= stop.bus_ms <= BOUND_MS
    assert stop.is_in_time
    assert not plant.alarms


@pytest.mark.parametrize("rpdo", [DIGITAL, ANALOGUE])
def test_active_values_after_the_bound_are_told_at_once_and_once(rpdo: int) -> None:
    plant = moving()
    if rpdo == ANALOGUE:
        plant.digital, plant.analogue = SAFE, bytes.fromhex("E803 0000")
        plant.run(0.1)
    plant.writes = False
    plant.run(0.4)
    assert plant.kinds == [AlarmKind.LATE]
    assert plant.said.startswith("told to be active 2")
    assert plant.said.endswith("ms after its owner's last telegram; promised: 240")
    plant.run(3.0)
    assert plant.kinds == [AlarmKind.LATE]


def test_what_is_on_hold_may_stay_as_it_is() -> None:
    plant = moving()
    plant.writes = False
    plant.run(0.2)
    plant.digital = SAFE
    plant.run(20.0)
    assert not plant.alarms


def test_an_owner_that_makes_them_safe_itself_is_no_stop() -> None:
    plant = moving()
    plant.digital = SAFE
    plant.run(1.0)
    assert not plant.stops


@pytest.mark.parametrize("beside_ms", [None, 40])
def test_a_witness_that_is_told_nothing_of_the_owner_says_so(beside_ms: int | None) -> None:
    plant = Plant(replace(IO, beside_ms=beside_ms))
    plant.answers = False
    plant.run(2 * BLIND_S)
    assert plant.kinds == [AlarmKind.BLIND] * (beside_ms is not None)
    plant.answers = True
    plant.run(0.2)
    assert len(plant.sights) == len(plant.alarms)


@given(st.integers(0, 600))
def test_late_is_told_exactly_if_it_is(after_ms: int) -> None:
    plant = moving()
    while round(plant.now * 100) % 5:
        plant.run(0.01)
    plant.writes = False
    plant.run(after_ms // 10 / 100)
    plant.digital = SAFE
    plant.run(0.3)
    if after_ms <= BOUND_MS:
        assert not plant.alarms
    if after_ms > BOUND_MS + 70:
        assert plant.kinds == [AlarmKind.LATE]


# intruders


def test_who_repeats_the_active_frame_is_told() -> None:
    plant = moving()
    for _ in range(200):
        plant.watch.on_frame(DIGITAL, ACTIVE, plant.now + 0.005)
        plant.run(0.01)
    assert set(plant.kinds) == {AlarmKind.INTRUDER}
    assert "RPDO 215h comes too often: somebody else sends it, too" in plant.alarms[0].message


def test_who_sends_other_values_between_ours_is_told() -> None:
    plant = moving()
    for _ in range(50):
        plant.watch.on_frame(DIGITAL, b"\xff\x00", plant.now + 0.005)
        plant.run(0.01)
    assert set(plant.kinds) == {AlarmKind.INTRUDER}
    assert "RPDO 215h changes more often than its owner sends telegrams" in plant.alarms[0].message


@pytest.mark.parametrize("asks", [True, False])
def test_an_owner_may_switch_as_often_as_it_likes(asks: bool) -> None:
    """A lamp that blinks; each telegram brings another value."""
    plant = Plant(asks=asks)
    for n in range(800):
        plant.digital = ACTIVE if n % 2 else SAFE
        plant.number += 1
        plant.run(0.01)
    assert not plant.alarms


def test_a_bridge_that_begins_to_count_anew_is_no_intruder() -> None:
    plant = moving()
    for n in range(30):
        plant.digital = ACTIVE if n % 2 else SAFE
        plant.number = plant.number + 1 if n != 20 else 0
        plant.run(0.01)
    assert not plant.alarms


@pytest.mark.parametrize("data", [b"", b"\x01", b"\x01\x00\x00"])
def test_a_frame_of_another_length_is_told_and_not_judged(data: bytes) -> None:
    plant = Plant()
    plant.digital = data
    plant.run(2.0)
    assert plant.kinds == [AlarmKind.BLIND]
    assert plant.said == f"RPDO 215h has {len(data)} bytes, and 2 by the files: its outputs are not judged"


@pytest.mark.parametrize(
    ("can_id", "data", "what"),
    [
        (NMT, STOP, "NMT stop of node 21 while its outputs are told to be active"),
        (NMT, b"\x81\x00", "NMT reset of node 21 while its outputs are told to be active"),
        (SDO, bytes.fromhex("2F00620108000000"), "SDO write of 6200h to node 21 while its outputs are told"),
        (SDO, bytes.fromhex("2F06620100000000"), "SDO write of 6206h to node 21 while its outputs are told"),
        (SDO, bytes.fromhex("2317100000000000"), "SDO write of 1017h to node 21 while its outputs are told"),
    ],
)
@pytest.mark.parametrize("is_active", [True, False])
def test_foreign_services_are_told_while_they_are_active(
    can_id: int, data: bytes, what: str, is_active: bool
) -> None:
    plant = moving()
    plant.digital = ACTIVE if is_active else SAFE
    plant.run(0.1)
    plant.send(can_id, data)
    plant.run(0.01)
    assert [alarm.message.startswith(what) for alarm in plant.alarms] == [True] * is_active


def test_a_bridge_that_is_started_anew_is_no_stranger() -> None:
    plant = moving()
    plant.die()
    plant.run(0.55)
    plant.send(NMT, b"\x82\x00")
    plant.state = PRE_OPERATIONAL
    plant.run(0.1)
    assert not plant.alarms


# a dead bridge


def test_a_dead_bridge_and_a_node_that_makes_them_safe() -> None:
    plant = moving()
    plant.die()
    plant.run(0.6)
    plant.state = PRE_OPERATIONAL
    plant.run(5.0)
    (stop,) = plant.stops
    assert (stop.cause, stop.bus_ms, stop.drive_bound_ms) == (Cause.BRIDGE, None, 800)
    assert stop.drive_ms is not None and 600 <= stop.drive_ms <= 710
    assert not plant.alarms


@pytest.mark.parametrize("silent_ms", [800, 0])
def test_a_node_that_stays_operational_without_a_bridge_is_told(silent_ms: int) -> None:
    plant = moving(replace(IO, silent_ms=silent_ms))
    plant.die()
    plant.run((silent_ms or UNKNOWN_MS) / 1000)
    assert not plant.alarms
    plant.run(0.2)
    assert plant.kinds == [AlarmKind.RUNS_ON]
    promised = "promised: 800" if silent_ms else "its own time-out is not known"
    assert plant.said.startswith("operational ") and plant.said.endswith(promised)
    plant.run(5.0)
    assert plant.kinds == [AlarmKind.RUNS_ON]


def test_a_node_that_keeps_them_is_told_whatever_it_says() -> None:
    plant = moving(KEEPS)
    plant.die()
    plant.run(0.6)
    plant.state = PRE_OPERATIONAL
    plant.run(0.2)
    assert not plant.alarms
    plant.run(0.1)
    assert plant.kinds == [AlarmKind.UNHEARD]
    assert plant.said.startswith("may stay active: its last RPDO, 8")
    assert plant.said.endswith("ms ago, was; digital keeps its value: 6206:01 is 0h")
    plant.run(5.0)
    assert plant.kinds == [AlarmKind.UNHEARD]


def test_each_silence_of_the_bridge_is_told() -> None:
    plant = moving(KEEPS)
    for count in (1, 2):
        plant.digital = None
        plant.analogue = None
        plant.run(1.0)
        assert plant.kinds.count(AlarmKind.UNHEARD) == count
        plant.digital, plant.analogue = ACTIVE, HELD
        plant.run(0.5)


@pytest.mark.parametrize("outputs", [IO, KEEPS])
def test_a_bridge_that_dies_with_safe_outputs_leaves_nothing_behind(outputs: WatchedOutputs) -> None:
    plant = moving(outputs)
    plant.digital = SAFE
    plant.run(1.0)
    plant.die()
    plant.run(10.0)
    assert not plant.alarms


@pytest.mark.parametrize("outputs", [IO, KEEPS])
def test_a_node_that_starts_anew_has_them_off(outputs: WatchedOutputs) -> None:
    plant = moving(outputs)
    plant.die()
    plant.run(0.5)
    plant.send(HEARTBEAT, BOOT_UP)
    plant.state = PRE_OPERATIONAL
    plant.run(10.0)
    assert not plant.alarms


# NMT and a cut


@pytest.mark.parametrize(
    ("outputs", "command", "limit_s", "why"),
    [
        (KEEPS, STOP, 0.5, "digital keeps its value: 6206:01 is 0h"),
        (KEEPS, OUT, 0.5, "it need not make them safe by that"),
        (IO, OUT, 0.5, "it need not make them safe by that"),
        (IO, RESET, 5.0, "it need not make them safe by that"),
        (IO, RESET_COMMUNICATION, 5.0, "it need not make them safe by that"),
    ],
)
def test_a_node_that_is_taken_out_while_they_are_active(
    outputs: WatchedOutputs, command: bytes, limit_s: float, why: str
) -> None:
    plant = moving(outputs)
    plant.digital = plant.analogue = None
    plant.run(0.55)
    plant.send(NMT, command)
    plant.state = PRE_OPERATIONAL
    plant.digital, plant.analogue = SAFE, HELD
    plant.run(limit_s)
    assert not plant.alarms
    plant.run(0.2)
    assert plant.kinds == [AlarmKind.UNHEARD]
    assert plant.said == f"may stay active: told so before its node was taken out of operation by NMT; {why}"
    plant.run(5.0)
    assert plant.kinds == [AlarmKind.UNHEARD]


def test_a_node_that_makes_them_safe_when_it_is_stopped_is_left_alone() -> None:
    plant = moving()
    plant.run(0.02)
    plant.die()
    plant.run(0.55)
    plant.send(NMT, STOP)
    plant.state = STOPPED
    plant.run(10.0)
    assert not plant.alarms


def test_a_node_that_does_not_follow_nmt_is_told() -> None:
    plant = moving()
    plant.digital = plant.analogue = None
    plant.run(0.55)
    plant.send(NMT, STOP)
    plant.digital, plant.analogue = SAFE, HELD
    plant.run(0.5)
    assert not plant.alarms
    plant.run(5.0)
    assert plant.kinds == [AlarmKind.IGNORED]
    assert plant.said.startswith("operational ") and plant.said.endswith("by NMT; expected: 500")


@pytest.mark.parametrize("command", [STOP, OUT, RESET_COMMUNICATION])
def test_a_bridge_that_makes_them_safe_first_is_left_alone(command: bytes) -> None:
    plant = moving(KEEPS)
    plant.digital = SAFE
    plant.run(0.01)
    plant.send(NMT, command)
    plant.state = STOPPED
    plant.digital = plant.analogue = None
    plant.run(10.0)
    assert not plant.alarms


def test_a_node_that_is_started_again_in_time_is_left_alone() -> None:
    plant = moving(KEEPS)
    plant.digital = plant.analogue = None
    plant.run(0.55)
    plant.send(NMT, OUT)
    plant.run(0.1)
    plant.send(NMT, START)
    plant.digital, plant.analogue = SAFE, HELD
    plant.run(10.0)
    assert not plant.alarms


@pytest.mark.parametrize("answers_with", [SAFE, ACTIVE])
def test_a_node_that_is_cut_off_while_they_are_active(answers_with: bytes) -> None:
    """The bridge sends safe values when it misses the node: nobody hears them."""
    plant = moving(KEEPS)
    plant.state = None
    plant.run(0.4)
    plant.digital = answers_with
    plant.run(0.7)
    assert not plant.alarms
    plant.run(0.3)
    assert plant.kinds == [AlarmKind.UNHEARD]
    assert plant.said.startswith("may stay active: told so when it was heard last, 12")
    assert plant.said.endswith("; digital keeps its value: 6206:01 is 0h")
    plant.run(5.0)
    assert plant.kinds == [AlarmKind.UNHEARD]
    plant.state, plant.digital = OPERATIONAL, ACTIVE
    plant.run(1.0)
    plant.state = None
    plant.run(2.0)
    assert plant.kinds == [AlarmKind.UNHEARD, AlarmKind.UNHEARD]


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        (IO, ""),
        (replace(IO, silent_ms=0), "; its own time-out is not known"),
        (replace(KEEPS, lost_ms=0), ""),
    ],
)
def test_a_cut_off_node_that_sees_it_itself_makes_them_safe(outputs: WatchedOutputs, said: str) -> None:
    plant = moving(outputs)
    plant.state = None
    plant.run(2.0)
    assert [alarm.message.endswith(said) for alarm in plant.alarms] == [True] * bool(said)


def test_a_node_that_was_told_in_time_may_be_cut_off() -> None:
    plant = moving(KEEPS)
    plant.digital = SAFE
    plant.run(0.2)
    plant.state = None
    plant.run(5.0)
    assert not plant.alarms


def test_a_node_that_was_never_heard_is_not_missed() -> None:
    plant = Plant(KEEPS, asks=False)
    plant.state = None
    plant.digital = ACTIVE
    plant.run(5.0)
    assert not plant.alarms


def test_a_frame_without_a_state_says_nothing() -> None:
    plant = moving(KEEPS)
    plant.state = b""
    plant.run(2.0)
    assert plant.kinds == [AlarmKind.UNHEARD]


# what a TPDO shows


def test_outputs_that_do_not_follow_are_told() -> None:
    plant = moving(SHOWN)
    plant.digital = SAFE
    plant.run(0.5)
    assert not plant.alarms
    plant.run(0.1)
    assert plant.kinds == [AlarmKind.IGNORED]
    assert plant.said.startswith("active 51") and plant.said.endswith("it was told to be safe; expected: 500")
    plant.run(2.0)
    plant.tpdo = SAFE
    plant.run(1.0)
    assert plant.kinds == [AlarmKind.IGNORED]


def test_each_stop_that_is_not_followed_is_told() -> None:
    plant = moving(SHOWN)
    for count in (1, 2):
        plant.digital = SAFE
        plant.run(1.0)
        assert plant.kinds == [AlarmKind.IGNORED] * count
        plant.digital = ACTIVE
        plant.run(1.0)


def test_outputs_that_follow_are_left_alone() -> None:
    plant = moving(SHOWN)
    plant.digital = SAFE
    plant.run(0.3)
    plant.tpdo = SAFE
    plant.run(2.0)
    assert not plant.alarms


def test_outputs_that_nobody_commands_are_told() -> None:
    plant = Plant(SHOWN)
    plant.digital = plant.analogue = None
    plant.tpdo = ACTIVE
    plant.run(1.0)
    assert not plant.alarms
    plant.run(1.0)
    assert plant.kinds == [AlarmKind.UNTOLD]
    assert plant.said == "active, and nobody sends its RPDOs"


def test_outputs_that_are_shown_active_without_a_bridge_are_told() -> None:
    plant = moving(SHOWN)
    plant.die()
    plant.state = PRE_OPERATIONAL
    plant.run(0.8)
    assert not plant.alarms
    plant.run(0.1)
    assert plant.kinds == [AlarmKind.RUNS_ON]
    assert plant.said.startswith("active 81") and plant.said.endswith("its last RPDO; promised: 800")


def test_a_node_that_shows_them_safe_may_stay_operational() -> None:
    plant = moving(SHOWN)
    plant.die()
    plant.tpdo = SAFE
    plant.run(10.0)
    assert not plant.alarms


def test_two_tpdos_are_seen_together() -> None:
    plant = Plant(replace(SHOWN, tpdos={TPDO: Values(2, 0xFFFF, 0), 0x295: Values(2, 0xFFFF, 0)}))
    plant.tpdo = SAFE
    for _ in range(100):
        plant.send(0x295, ACTIVE)
        plant.run(0.01)
    assert plant.kinds == [AlarmKind.IGNORED]


def test_a_short_tpdo_shows_nothing() -> None:
    plant = Plant(SHOWN)
    plant.tpdo = b"\x08"
    plant.run(2.0)
    assert not plant.alarms


@pytest.mark.landing
@given(st.lists(st.sampled_from(("write", "pause", "safe", "die", "boot", "stop")), max_size=12))
def test_an_honest_node_is_left_alone(events: list[str]) -> None:
    plant = Plant()
    for event in events:
        plant.writes = plant.answers = True
        plant.state = OPERATIONAL
        if plant.digital is None:
            plant.send(NMT, START)
        plant.digital, plant.analogue = SAFE, HELD
        plant.run(0.8)
        plant.digital = ACTIVE
        plant.run(1.0)
        if event == "pause":
            plant.writes = False
            plant.run(0.2)
        if event in ("pause", "safe", "stop"):
            plant.digital = SAFE
            plant.run(0.05)
        if event == "die":
            plant.die()
            plant.run(0.5)
        if event == "stop":
            plant.send(NMT, STOP)
            plant.digital = plant.analogue = None
        if event in ("die", "stop"):
            plant.state = STOPPED
            plant.run(0.5)
        if event == "boot":
            plant.send(HEARTBEAT, BOOT_UP)
            plant.state, plant.digital = PRE_OPERATIONAL, None
            plant.run(0.5)
    assert not plant.alarms


# what goes on, and what comes again


def test_nmt_of_another_node_is_not_theirs() -> None:
    plant = moving(KEEPS)
    plant.send(NMT, b"\x02\x05")
    plant.run(3.0)
    assert [alarm.source for alarm in plant.alarms] == ["can0"]


def test_telegrams_of_long_ago_are_no_reason() -> None:
    plant = moving()
    plant.run(20.0)
    for _ in range(50):
        plant.watch.on_frame(DIGITAL, b"\xff\x00", plant.now + 0.005)
        plant.run(0.01)
    assert set(plant.kinds) == {AlarmKind.INTRUDER}


def test_new_values_may_come_as_often_as_their_owner_likes() -> None:
    plant = moving()
    for n in range(400):
        plant.watch.on_frame(DIGITAL, n.to_bytes(2, "little"), plant.now + 0.005)
        plant.number += 2
        plant.run(0.01)
    assert not plant.alarms


def test_an_owner_may_switch_over_the_end_of_the_count() -> None:
    plant = Plant()
    plant.number = 0xFFF0
    for n in range(400):
        plant.digital = ACTIVE if n % 2 else SAFE
        plant.number = (plant.number + 1) & 0xFFFF
        plant.run(0.01)
    assert not plant.alarms


def test_after_an_outage_telegrams_are_counted_anew() -> None:
    """Another bridge may count from another number: no telegrams came between the two."""
    plant = moving()
    plant.watch.on_numbers_lost()
    plant.number += 1000
    for _ in range(60):
        plant.watch.on_frame(DIGITAL, b"\xff\x00", plant.now + 0.005)
        plant.run(0.01)
    assert AlarmKind.INTRUDER in plant.kinds


def test_who_sends_other_values_between_ours_is_told_now_and_then() -> None:
    plant = moving()
    for _ in range(100):
        plant.watch.on_frame(DIGITAL, b"\xff\x00", plant.now + 0.005)
        plant.run(0.01)
    assert 1 <= len(plant.alarms) <= 15


def test_one_of_two_rpdos_is_not_all() -> None:
    plant = moving()
    plant.analogue = bytes.fromhex("E803 0000")
    plant.run(0.1)
    plant.writes = False
    plant.run(0.2)
    plant.digital = SAFE
    plant.run(0.02)
    assert not plant.stops
    plant.analogue = HELD
    plant.run(0.02)
    assert len(plant.stops) == 1


def test_a_silent_owner_of_safe_outputs_is_no_stop() -> None:
    plant = moving()
    plant.digital = SAFE
    plant.run(0.1)
    plant.writes = False
    plant.run(3.0)
    assert not plant.stops


def test_the_first_rpdo_that_is_seen_stops_nothing() -> None:
    plant = Plant()
    plant.digital = plant.analogue = None
    plant.run(3.0)
    plant.digital = SAFE
    plant.run(1.0)
    assert not plant.stops


def test_outputs_that_follow_late_are_told_each_time() -> None:
    plant = moving(SHOWN)
    for count in (1, 2):
        plant.digital = plant.analogue = None
        plant.run(1.0)
        assert plant.kinds == [AlarmKind.RUNS_ON] * count
        plant.tpdo = SAFE
        plant.digital, plant.analogue = ACTIVE, HELD
        plant.run(0.1)
        plant.tpdo = ACTIVE


def test_a_reset_of_its_communication_leaves_them_active() -> None:
    plant = moving(KEEPS)
    plant.digital = plant.analogue = None
    plant.run(0.55)
    plant.send(NMT, RESET_COMMUNICATION)
    plant.send(HEARTBEAT, BOOT_UP)
    plant.state = PRE_OPERATIONAL
    plant.run(0.4)
    assert plant.kinds == [AlarmKind.UNHEARD]


def test_a_stopped_node_has_them_off() -> None:
    plant = moving(replace(IO, silent_ms=0))
    plant.digital = plant.analogue = None
    plant.run(0.55)
    plant.send(NMT, STOP)
    plant.state = STOPPED
    plant.run(0.5)
    plant.state = None
    plant.run(5.0)
    assert not plant.alarms


def test_a_stopped_node_of_which_nothing_is_heard_is_left_alone() -> None:
    plant = moving(replace(IO, lost_ms=0))
    plant.digital = plant.analogue = None
    plant.run(0.55)
    plant.send(NMT, STOP)
    plant.state = None
    plant.run(5.0)
    assert not plant.alarms


def test_a_node_that_leaves_by_itself_is_no_dead_bridge() -> None:
    plant = moving()
    plant.state = PRE_OPERATIONAL
    plant.run(0.1)
    assert not plant.stops


def test_a_bridge_that_dies_with_safe_outputs_is_no_stop() -> None:
    plant = moving()
    plant.digital = SAFE
    plant.run(0.2)
    plant.die()
    plant.run(0.6)
    plant.state = PRE_OPERATIONAL
    plant.run(0.2)
    assert not plant.stops


def test_each_time_that_it_is_taken_out_is_told() -> None:
    plant = moving(KEEPS)
    for count in (1, 2):
        plant.digital = plant.analogue = None
        plant.run(0.55)
        plant.send(NMT, OUT)
        plant.digital, plant.analogue = SAFE, HELD
        plant.state = PRE_OPERATIONAL
        plant.run(0.7)
        assert plant.kinds == [AlarmKind.UNHEARD] * count
        plant.send(NMT, START)
        plant.state = OPERATIONAL
        plant.digital = ACTIVE
        plant.run(0.5)


def test_a_repeated_command_does_not_put_it_off() -> None:
    plant = moving(KEEPS)
    plant.digital = plant.analogue = None
    plant.run(0.55)
    plant.digital, plant.analogue, plant.state = ACTIVE, HELD, PRE_OPERATIONAL
    for _ in range(3):
        plant.watch.on_frame(NMT, OUT, plant.now)
        plant.run(0.25)
    plant.alarms = [alarm for alarm in plant.alarms if alarm.kind is not AlarmKind.INTRUDER]
    assert plant.kinds == [AlarmKind.UNHEARD]


def test_outputs_that_come_on_by_themselves_have_their_time() -> None:
    plant = moving(SHOWN)
    plant.digital = plant.tpdo = SAFE
    plant.run(2.0)
    plant.tpdo = ACTIVE
    plant.run(0.4)
    assert not plant.alarms
    plant.run(0.2)
    assert plant.kinds == [AlarmKind.IGNORED]
