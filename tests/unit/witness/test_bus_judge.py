"""The judgement of the witness: every way to break the promise is told, and an honest plant is left alone."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.witness.bus_judge import BLIND_S, UNKNOWN_MS, BusJudge
from bridge.witness.findings import Alarm, AlarmKind, Cause, Sight, Stop
from bridge.witness.plan import FRESH_S, EnableWord, Speed, WatchedBus, WatchedDrive

RPDO, TPDO, SYNC = 0x205, 0x185, 0x080
CONTROL, STATUS = EnableWord(0, 2, 0x000F, 0x000F), EnableWord(0, 2, 0x007F, 0x0037)
RUN, STOP = bytes.fromhex("7F 04 00 20"), bytes.fromhex("7E 04 00 00")
ENABLED, READY = bytes.fromhex("37 0B 00 20"), bytes.fromhex("31 0B 00 00")
FU1 = WatchedDrive("conveyor/fu1", 1, RPDO, TPDO, CONTROL, STATUS, 200, 40, 600, 1500)
BOUND_MS = 240
BUS = WatchedBus("can0", "vcan0", (FU1,), {SYNC: ("SYNC", 10)})


class Plant:
    """A bridge, a drive and an owner that say what the test wants, 10 ms at a time."""

    def __init__(self) -> None:
        self.watch = BusJudge(BUS)
        self.now = 100.0
        self.number = 0
        self.rpdo: bytes | None = STOP
        self.tpdo: bytes | None = READY
        self.writes = False
        self.answers = True
        self.timeout_ms: int | None = 200
        self.beats = 1
        self.stops: list[Stop] = []
        self.alarms: list[Alarm] = []
        self.sights: list[Sight] = []

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            self.now = round(self.now + 0.01, 6)
            tenth = round(self.now * 100)
            if self.writes and tenth % 5 == 0:
                self.number = (self.number + 1) & 0xFFFF
            if self.answers and tenth % 5 == 1:
                at = self.now - 0.001
                self.watch.on_number(FU1.name, self.number, at - 0.001, at, self.timeout_ms)
            for _ in range(self.beats):
                self.watch.on_frame(SYNC, b"", self.now)
            if self.rpdo is not None:
                self.watch.on_frame(RPDO, self.rpdo, self.now)
            if self.tpdo is not None:
                self.watch.on_frame(TPDO, self.tpdo, self.now)
            self.watch.on_time(self.now)
            for finding in self.watch.take_findings():
                if isinstance(finding, Stop):
                    self.stops.append(finding)
                elif isinstance(finding, Sight):
                    self.sights.append(finding)
                else:
                    self.alarms.append(finding)

    def move(self) -> None:
        self.writes = True
        self.run(1.0)
        self.rpdo = RUN
        self.run(0.05)
        self.tpdo = ENABLED
        self.run(2.0)
        assert not self.stops
        assert not self.alarms

    @property
    def kinds(self) -> list[AlarmKind]:
        return [alarm.kind for alarm in self.alarms]


@pytest.fixture
def plant() -> Plant:
    plant = Plant()
    plant.move()
    return plant


def test_a_silent_controller_and_a_stop_in_time(plant: Plant) -> None:
    plant.writes = False
    plant.run(0.2)
    plant.rpdo = STOP
    plant.run(0.03)
    plant.tpdo = READY
    plant.run(1.0)
    (stop,) = plant.stops
    assert stop.cause is Cause.CONTROLLER
    assert stop.bus_ms is not None and 200 <= stop.bus_ms <= 240
    assert stop.is_in_time
    assert not plant.alarms


def test_an_enabling_rpdo_after_the_bound_is_told_at_once_and_once(plant: Plant) -> None:
    plant.writes = False
    plant.run(0.4)
    assert plant.kinds == [AlarmKind.LATE]
    assert "its owner's last telegram; promised: 240" in plant.alarms[0].message
    plant.run(3.0)
    assert plant.kinds == [AlarmKind.LATE]
    plant.rpdo, plant.tpdo = STOP, READY
    plant.run(0.1)
    assert not plant.stops[0].is_in_time


def test_the_owner_is_not_judged_while_nobody_tells_its_telegrams(plant: Plant) -> None:
    plant.answers = plant.writes = False
    plant.watch.on_numbers_lost()
    plant.run(BLIND_S - 0.1)
    assert not plant.alarms


@pytest.mark.parametrize("ever", [False, True])
def test_blindness_is_told_once_per_outage_and_so_is_its_end(ever: bool) -> None:
    plant = Plant()
    plant.answers = ever
    plant.run(1.0)
    for outage in (1, 2):
        plant.answers = False
        plant.watch.on_numbers_lost("connection refused")
        plant.run(3 * BLIND_S)
        assert plant.kinds == [AlarmKind.BLIND] * outage
        assert plant.alarms[-1].source == "can0"
        assert "connection refused; not judged: conveyor/fu1" in plant.alarms[-1].message
        plant.answers = True
        plant.run(1.0)
        assert len(plant.sights) == outage
        assert "conveyor/fu1" in plant.sights[-1].message


def test_a_witness_that_does_not_ask_is_not_blind() -> None:
    plant = Plant()
    plant.watch = BusJudge(BUS, asks=False)
    plant.answers = False
    plant.run(3 * BLIND_S)
    assert not plant.alarms


def test_a_time_out_that_its_owner_has_set_is_what_it_is_held_to(plant: Plant) -> None:
    plant.timeout_ms = 500
    plant.run(1.0)
    plant.writes = False
    plant.run(0.53)
    assert not plant.alarms
    plant.run(0.2)
    assert plant.kinds == [AlarmKind.LATE]
    assert "promised: 540" in plant.alarms[0].message


def test_a_shorter_time_out_is_held_to_from_when_it_is_known(plant: Plant) -> None:
    plant.timeout_ms = 2000
    plant.run(1.0)
    plant.writes = False
    plant.run(0.5)
    plant.timeout_ms = 200
    plant.run(0.05)
    assert not plant.alarms
    plant.run(0.3)
    assert plant.kinds == [AlarmKind.LATE]


def test_a_time_out_that_was_made_longer_just_in_time_is_no_lateness(plant: Plant) -> None:
    """The frames after the old deadline are seen before the new time-out is read."""
    plant.writes = False
    while round(plant.now * 100) % 5 != 1:
        plant.run(0.01)
    plant.answers = False
    plant.run(0.3)
    plant.answers, plant.timeout_ms = True, 2000
    plant.run(1.0)
    assert not plant.alarms


def test_where_the_time_out_is_not_told_that_of_the_site_counts(plant: Plant) -> None:
    plant.timeout_ms = None
    plant.writes = False
    plant.run(0.4)
    assert plant.kinds == [AlarmKind.LATE]


def test_a_stop_that_was_ordered(plant: Plant) -> None:
    plant.rpdo = STOP
    plant.run(0.3)
    plant.tpdo = READY
    plant.run(0.1)
    (stop,) = plant.stops
    assert (stop.cause, stop.bus_ms, stop.drive_bound_ms) == (Cause.COMMAND, None, 1500)
    assert stop.drive_ms is not None and 290 <= stop.drive_ms <= 320


def test_a_drive_that_does_not_follow_a_stop_is_told(plant: Plant) -> None:
    plant.rpdo = STOP
    plant.run(1.4)
    assert not plant.alarms
    plant.run(0.3)
    assert plant.kinds == [AlarmKind.IGNORED]


def test_a_dead_bridge_and_a_drive_that_stops_by_itself(plant: Plant) -> None:
    plant.rpdo, plant.answers, plant.beats = None, False, 0
    plant.run(0.5)
    plant.tpdo = READY
    plant.run(0.5)
    (stop,) = plant.stops
    assert (stop.cause, stop.drive_bound_ms) == (Cause.BRIDGE, 600)
    assert stop.is_in_time
    assert not plant.alarms


def test_a_drive_that_runs_on_without_a_bridge_is_told(plant: Plant) -> None:
    plant.rpdo, plant.answers, plant.beats = None, False, 0
    plant.run(0.7)
    assert plant.kinds == [AlarmKind.RUNS_ON]


def test_a_drive_that_falls_into_fault_is_nobodys(plant: Plant) -> None:
    plant.tpdo = READY
    plant.run(0.1)
    assert plant.stops[0].cause is Cause.DRIVE


def test_a_drive_that_nobody_enabled_is_told() -> None:
    plant = Plant()
    plant.rpdo, plant.tpdo = None, ENABLED
    plant.run(2.0)
    assert plant.kinds == [AlarmKind.UNTOLD]


def test_two_senders_of_one_rpdo_are_told(plant: Plant) -> None:
    for _ in range(20):
        plant.watch.on_frame(RPDO, STOP, plant.now + 0.005)
        plant.run(0.01)
    assert AlarmKind.INTRUDER in plant.kinds
    assert plant.alarms[0].source == "conveyor/fu1"


def test_two_producers_of_sync_are_told(plant: Plant) -> None:
    plant.beats = 2
    plant.run(2.0)
    assert AlarmKind.INTRUDER in plant.kinds
    assert plant.alarms[0].source == "can0"


@pytest.mark.parametrize("data", [b"", b"\x7f"])
def test_a_frame_that_is_too_short_is_no_word(plant: Plant, data: bytes) -> None:
    plant.watch.on_frame(RPDO, data, plant.now)
    plant.watch.on_frame(TPDO, data, plant.now)
    plant.run(0.5)
    assert not plant.alarms
    assert not plant.stops


@given(st.integers(0, 600))
def test_late_is_told_exactly_if_it_is(after_ms: int) -> None:
    """``after_ms`` from the owner's last telegram to the last enabling RPDO. By the time between two
    readings it may seem shorter, never longer."""
    plant = Plant()
    plant.move()
    while round(plant.now * 100) % 5:
        plant.run(0.01)
    plant.writes = False
    plant.run(after_ms // 10 / 100)
    plant.rpdo, plant.tpdo = STOP, READY
    plant.run(0.3)
    is_told = AlarmKind.LATE in plant.kinds
    if after_ms <= BOUND_MS:
        assert not is_told
    if after_ms > BOUND_MS + 70:
        assert is_told


@given(st.lists(st.sampled_from(("write", "pause", "stop", "die", "fault")), max_size=12))
def test_an_honest_plant_is_left_alone(events: list[str]) -> None:
    plant = Plant()
    for event in events:
        plant.writes = plant.answers = True
        plant.beats = 1
        plant.rpdo, plant.tpdo = RUN, ENABLED
        plant.run(1.0)
        if event == "pause":
            plant.writes = False
            plant.run(0.2)
            plant.rpdo = STOP
            plant.run(0.05)
        elif event == "stop":
            plant.rpdo = STOP
            plant.run(1.0)
        elif event == "die":
            plant.rpdo, plant.answers, plant.beats = None, False, 0
            plant.watch.on_numbers_lost()
            plant.run(0.5)
        if event != "write":
            plant.tpdo = READY
            plant.run(0.5)
    assert not plant.alarms


# what nobody promises, and what is heard of the node alone

HEARD = replace(FU1, node_id=5, rpdo_ms=10, speed=Speed(2, 2), lost_ms=1200)
HEARTBEAT, NMT, OPERATIONAL = 0x705, 0x000, b"\x05"


def heard(drive: WatchedDrive = HEARD) -> Plant:
    plant = Plant()
    bus = replace(BUS, drives=(drive,), nodes={5: 0.5})
    plant.watch = BusJudge(bus)
    plant.move()
    plant.watch.on_frame(HEARTBEAT, OPERATIONAL, plant.now)
    return plant


def test_it_has_to_see_heartbeats_nmt_and_sdo() -> None:
    bus = replace(BUS, drives=(HEARD,), nodes={5: 0.5})
    assert BusJudge(bus).identifiers == [NMT, SYNC, TPDO, RPDO, 0x585, 0x605, HEARTBEAT]


def test_a_drive_without_a_known_time_out_may_not_run_on_for_ever() -> None:
    plant = heard(replace(HEARD, silent_ms=0))
    plant.rpdo, plant.answers, plant.beats = None, False, 0
    plant.run(UNKNOWN_MS / 1000 - 0.1)
    assert not plant.alarms
    plant.run(0.3)
    assert plant.kinds == [AlarmKind.RUNS_ON]
    assert "its own time-out is not known" in plant.alarms[0].message
    plant.tpdo = READY
    plant.run(0.1)
    assert (plant.stops[0].cause, plant.stops[0].drive_bound_ms) == (Cause.BRIDGE, None)


def test_a_drive_whose_node_is_stopped_while_it_is_enabled_may_run_on() -> None:
    plant = heard()
    plant.rpdo = STOP
    plant.run(0.02)
    plant.watch.on_frame(NMT, b"\x02\x05", plant.now)
    plant.tpdo = None
    for _ in range(14):
        plant.run(0.1)
        plant.watch.on_frame(HEARTBEAT, b"\x04", plant.now)
    assert not plant.alarms
    plant.run(0.2)
    assert plant.kinds == [AlarmKind.UNHEARD]
    assert "before its node was taken out of operation by NMT" in plant.alarms[0].message
    plant.run(5.0)
    assert plant.kinds == [AlarmKind.UNHEARD]


def test_a_node_that_has_restarted_may_be_asked_anew() -> None:
    plant = heard()
    question = 0x605, bytes.fromhex("40 00 10 00 00 00 00 00")
    for frame in (question, (HEARTBEAT, b"\0"), question):
        plant.watch.on_frame(*frame, plant.now)
    plant.run(0.1)
    assert not plant.alarms


def test_who_is_back_in_operation_is_heard_though_it_is_enabled() -> None:
    plant = heard()
    plant.watch.on_frame(NMT, b"\x80\x05", plant.now)
    plant.watch.take_findings()
    # One TPDO waited for the bus, and says nothing of the node's state.
    plant.run(0.01)
    plant.tpdo = None
    plant.run(0.5)
    plant.tpdo = ENABLED
    plant.run(6.0)
    assert not plant.alarms


@pytest.mark.parametrize(
    ("drive", "state"), [(HEARD, b"\x00"), (replace(HEARD, nmt_stops=True), b"\x04"), (HEARD, None)]
)
def test_who_has_restarted_is_stopped_by_nmt_or_says_so_is_not_told(
    drive: WatchedDrive, state: bytes | None
) -> None:
    plant = heard(drive)
    plant.rpdo = STOP
    plant.run(0.02)
    plant.watch.on_frame(NMT, b"\x02\x05", plant.now)
    plant.tpdo = READY if state is None else None
    plant.run(0.02)
    plant.tpdo = None
    if state is not None:
        plant.watch.on_frame(HEARTBEAT, state, plant.now)
    plant.run(5.0)
    assert not plant.alarms


def test_a_cut_of_a_drive_that_was_enabled_is_told() -> None:
    plant = heard()
    plant.tpdo = None
    plant.run(1.0)
    assert not plant.alarms
    plant.run(0.4)
    assert plant.kinds == [AlarmKind.UNHEARD]
    assert "enabled when it was heard last" in plant.alarms[0].message


@pytest.mark.parametrize("lost_ms", [0, 1200])
def test_a_node_that_is_heard_or_of_which_nobody_knows_is_not_cut_off(lost_ms: int) -> None:
    """A TPDO that is sent on change alone may not come for long."""
    plant = heard(replace(HEARD, lost_ms=lost_ms))
    plant.tpdo = None
    for _ in range(50):
        plant.run(0.1)
        if lost_ms:
            plant.watch.on_frame(HEARTBEAT, OPERATIONAL, plant.now)
    assert not plant.alarms


def test_who_repeats_the_frame_that_runs_the_drive_is_told() -> None:
    plant = heard()
    for _ in range(200):
        plant.watch.on_frame(RPDO, RUN, plant.now + 0.005)
        plant.run(0.01)
    assert AlarmKind.INTRUDER in plant.kinds
    assert "RPDO 205h comes too often" in plant.alarms[0].message


def test_new_words_may_come_as_often_as_their_owner_likes() -> None:
    plant = heard()
    for n in range(400):
        plant.watch.on_frame(RPDO, RUN[:2] + n.to_bytes(2, "little"), plant.now + 0.005)
        plant.run(0.01)
    assert not plant.alarms


@pytest.mark.parametrize(("can_id", "data"), [(NMT, b"\x02\x05"), (0x605, bytes.fromhex("2317100000000000"))])
def test_foreign_services_are_told(can_id: int, data: bytes) -> None:
    plant = heard()
    plant.watch.on_frame(can_id, data, plant.now)
    plant.run(0.01)
    assert plant.kinds == [AlarmKind.INTRUDER]
    assert "somebody else sends it" in plant.alarms[0].message


def test_a_bridge_that_begins_again_is_nobody_else() -> None:
    """It wakes a node that is stopped before it can send it a word."""
    plant = heard()
    plant.rpdo, plant.tpdo = None, READY
    plant.run(FRESH_S + 0.1)
    plant.watch.on_frame(NMT, b"\x80\x05", plant.now)
    plant.run(0.01)
    assert not plant.alarms


def test_a_deaf_drive_whose_owner_jogs_is_told_once_in_a_while() -> None:
    plant = heard()
    for _ in range(20):
        plant.rpdo = STOP
        plant.run(0.3)
        plant.rpdo = RUN
        plant.run(1.0)
    assert set(plant.kinds) == {AlarmKind.IGNORED}
    assert len(plant.alarms) <= 5
    assert plant.alarms[0].message.startswith("enabled and no slower in 1.")


def test_two_stops_are_judged_by_themselves(plant: Plant) -> None:
    for _ in range(4):
        plant.rpdo = STOP
        plant.run(0.5)
        plant.rpdo = RUN
        plant.run(0.6)
    assert not plant.alarms


def test_two_producers_of_sync_are_told_now_and_then(plant: Plant) -> None:
    plant.beats = 2
    plant.run(4.0)
    assert 1 <= len(plant.alarms) <= 5


def test_a_telegram_that_was_not_read_in_time_is_no_lateness(plant: Plant) -> None:
    plant.answers = False
    plant.run(0.4)
    plant.answers = True
    plant.run(1.0)
    assert not plant.alarms


def test_lost_numbers_are_forgotten(plant: Plant) -> None:
    """The first one that is told again may be of a telegram that has just come."""
    plant.writes = False
    plant.run(0.05)
    plant.answers = False
    plant.watch.on_numbers_lost()
    plant.run(0.5)
    plant.answers = True
    plant.run(0.15)
    assert not plant.alarms


def test_a_shorter_time_out_gives_the_bridge_its_time() -> None:
    plant = heard(replace(HEARD, beside_ms=140))
    plant.timeout_ms = 2000
    plant.run(1.0)
    plant.writes = False
    plant.run(0.5)
    plant.timeout_ms = 200
    plant.run(0.12)
    assert not plant.alarms
    plant.run(0.2)
    assert plant.kinds == [AlarmKind.LATE]


def test_each_lateness_is_told(plant: Plant) -> None:
    for count in (1, 2):
        plant.writes = False
        plant.run(0.5)
        assert plant.kinds == [AlarmKind.LATE] * count
        plant.writes = True
        plant.run(0.5)


def test_late_is_told_from_the_first(plant: Plant) -> None:
    """RPDOs go on while the number is asked for."""
    plant.writes = False
    plant.run(0.15)
    plant.answers = False
    plant.run(0.5)
    plant.answers = True
    plant.run(0.1)
    after_ms = int(plant.alarms[0].message.removeprefix("told to run ").split()[0])
    assert BOUND_MS < after_ms <= BOUND_MS + 20


def test_without_a_time_out_no_stop_is_one_of_a_silent_owner(plant: Plant) -> None:
    plant.timeout_ms = 0
    plant.writes = False
    plant.run(5.0)
    plant.rpdo = STOP
    plant.run(0.1)
    plant.tpdo = READY
    plant.run(0.1)
    assert plant.stops[0].cause is Cause.COMMAND
    assert not plant.alarms


def test_where_nothing_is_promised_nothing_is_late() -> None:
    plant = heard(replace(HEARD, beside_ms=None))
    plant.writes = False
    plant.run(5.0)
    assert not plant.alarms
