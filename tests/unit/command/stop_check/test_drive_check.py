"""When a drive is named for a stop that it did not follow, by its family, its PDOs and the site file."""

from __future__ import annotations

from typing import Any

import pytest

from bridge.command import Action, Request, command_of
from bridge.command.drive_link import NodeState
from bridge.command.stop_check.state import LastStop
from bridge.drive import OwnJudgement, OwnVerdict
from bridge.drive.own_judgement import DriveWatch
from tests.support.judged_plant import JudgedPlant
from tests.support.leg_words import LENZE, NORD_TU4, LegWords
from tests.support.node_states import hand_over
from tests.support.rig import FAULT, FAULT_REACTION, PLC, QUICK_STOPPING

ABOUT_S = 0.00001
OFF, RAMP = Action.DISABLE_VOLTAGE, Action.STOP


def named_after(line: JudgedPlant, bound_s: float) -> None:
    """Not by a telegram just before the bound, but by one just after it."""
    line.goes_on(bound_s - ABOUT_S)
    assert line.last_stop is LastStop.FORWARDED
    line.goes_on(bound_s + ABOUT_S)
    assert line.last_stop is LastStop.IGNORED
    assert not line.drive.stop_check.follows


@pytest.mark.parametrize(
    ("action", "settings", "bound_s"),
    [
        # Three deadlines of its TPDO, one RPDO period of 10 ms, 250 ms of its family.
        (OFF, {"deadline_s": 0.035}, 3 * 0.035 + 0.010 + 0.250),
        (OFF, {"deadline_s": 0.170}, 3 * 0.170 + 0.010 + 0.250),
        (OFF, {"deadline_s": 0.035, "bus": "sync_period_ms = 0\nrpdo_period_ms = 50"}, 0.105 + 0.050 + 0.250),
        # A synchronous RPDO waits for SYNC, too, also for the fifth one.
        (OFF, {"deadline_s": 0.035, "rpdo_type": 1}, 0.105 + 0.020 + 0.250),
        (OFF, {"deadline_s": 0.035, "rpdo_type": 5}, 0.105 + 0.060 + 0.250),
        # A ramp has a minute more, and the site file's figure is for both.
        (RAMP, {"deadline_s": 0.035}, 0.105 + 0.010 + 0.250 + 60.0),
        (OFF, {"deadline_s": 0.035, "more": "ignored_stop_ms = 700"}, 0.700),
        (RAMP, {"deadline_s": 0.035, "more": "ignored_stop_ms = 700"}, 0.700),
    ],
)
def test_the_bound_is_that_of_the_page(action: Action, settings: dict[str, Any], bound_s: float) -> None:
    line = JudgedPlant(**settings).enables()
    line.asks(action)
    named_after(line, bound_s)


def test_a_drive_that_sends_changes_alone_has_500_ms_for_each_deadline_and_is_judged_by_the_time() -> None:
    line = JudgedPlant(deadline_s=None).enables()
    line.asks(OFF)
    bound_s = 3 * 0.5 + 0.010 + 0.250
    line.is_silent(bound_s - ABOUT_S)
    assert line.last_stop is LastStop.FORWARDED
    line.is_silent(bound_s + ABOUT_S)
    assert line.last_stop is LastStop.IGNORED


def test_silence_has_the_drives_own_time_out_beside_the_ramp() -> None:
    line = JudgedPlant(deadline_s=0.035, more='on_expiry = "silence"', timeout_ms=250)
    p151 = DriveWatch("P151", "process_data", "P151", 500.0, "", OwnVerdict.STOPS)
    line.drive.on_own_supervision(OwnJudgement((p151,)), line.now)
    line.enables()
    line.goes_on(0.25)
    assert line.drive.channel.output.silent
    named_after(line, 0.25 + 0.500 + 0.365 + 60.0)


@pytest.mark.parametrize(("every_s", "is_named"), [(1 / 32, True), (1 / 32 + 1 / 1024, False)])
def test_a_pause_longer_than_the_deadline_begins_the_bound_anew(every_s: float, is_named: bool) -> None:
    """Who does not hear the drive may not have been heard either. Exactly the deadline is no such pause."""
    line = JudgedPlant(deadline_s=1 / 32).enables()
    line.asks(OFF)
    line.goes_on(1.0, every_s)
    assert line.last_stop is (LastStop.IGNORED if is_named else LastStop.FORWARDED)


# what its status word says


@pytest.mark.parametrize(
    ("words", "status_word", "after_disable_voltage", "after_stop"),
    [
        (NORD_TU4, NORD_TU4.enabled, LastStop.IGNORED, LastStop.FORWARDED),
        (NORD_TU4, NORD_TU4.enabled | 0x0080, LastStop.IGNORED, LastStop.FORWARDED),
        (NORD_TU4, NORD_TU4.ready, LastStop.FOLLOWED, LastStop.FOLLOWED),
        (NORD_TU4, QUICK_STOPPING, LastStop.FOLLOWED, LastStop.FOLLOWED),
        (NORD_TU4, FAULT, LastStop.FOLLOWED, LastStop.FOLLOWED),
        (NORD_TU4, FAULT_REACTION, LastStop.FOLLOWED, LastStop.FOLLOWED),
        # By its quick stop a Lenze holds its motor: it follows a stop that leaves the voltage.
        (LENZE, LENZE.enabled, LastStop.IGNORED, LastStop.FORWARDED),
        (LENZE, LENZE.enabled | 0x0040, LastStop.IGNORED, LastStop.FOLLOWED),
        (LENZE, LENZE.ready, LastStop.FOLLOWED, LastStop.FOLLOWED),
        (LENZE, 0x0600, LastStop.FORWARDED, LastStop.FORWARDED),  # no state of its family: nothing is known
    ],
)
def test_what_a_status_word_says_of_a_stop(
    words: LegWords, status_word: int, after_disable_voltage: LastStop, after_stop: LastStop
) -> None:
    for action, expected in ((OFF, after_disable_voltage), (RAMP, after_stop)):
        line = JudgedPlant(words).enables()
        line.asks(action)
        line.says(status_word)
        line.goes_on(1.0)
        assert line.last_stop is expected


def test_a_ramp_after_the_voltage_was_taken_ends_after_a_minute_also_with_other_status_words() -> None:
    line = JudgedPlant(deadline_s=None).enables()
    line.asks(OFF)
    for n in range(60):
        line.now += 1.0
        line.says(FAULT_REACTION | (0x0080 if n % 2 else 0))
    assert line.last_stop is LastStop.FOLLOWED
    line.is_silent(64.0)
    assert line.last_stop is LastStop.IGNORED


# its node


def test_the_point_has_the_numbers_of_the_reference() -> None:
    line = JudgedPlant().enables()
    values = [line.value("supervision/last_stop")]
    line.asks(OFF)
    values.append(line.value("supervision/last_stop"))
    line.says(NORD_TU4.ready)
    values.append(line.value("supervision/last_stop"))
    line.goes_on(1.0)
    line.says(NORD_TU4.enabled)
    values.append(line.value("supervision/last_stop"))
    assert values == [0, 1, 2, 3]


def test_what_a_drive_said_before_its_node_restarted_is_not_what_it_says() -> None:
    """It is judged by its first telegram, although that says what the last one before it said."""
    line = JudgedPlant().enables()
    line.asks(OFF)
    line.node(NodeState.BOOTING)
    line.goes_on(1.0)
    assert line.last_stop is LastStop.FORWARDED
    line.node(NodeState.OPERATIONAL)
    line.is_silent(10.0)
    assert line.last_stop is LastStop.FORWARDED
    line.goes_on(20.0)
    assert line.last_stop is LastStop.IGNORED


def test_a_drive_that_was_cut_off_while_enabled_is_named_by_the_time_alone() -> None:
    line = JudgedPlant(deadline_s=0.035).enables()
    line.asks(OFF)
    line.is_cut_off()
    line.is_silent(0.365 - ABOUT_S)
    assert line.last_stop is LastStop.FORWARDED
    line.is_silent(0.365 + ABOUT_S)
    assert line.last_stop is LastStop.IGNORED


def test_a_node_that_says_that_it_is_stopped_or_starts_speaks_for_a_drive_that_was_cut_off() -> None:
    line = JudgedPlant().enables()
    line.asks(OFF)
    line.is_cut_off()
    line.drive.stop_check.on_node_stopped(line.now)
    line.is_silent(10.0)
    assert line.last_stop is LastStop.FOLLOWED
    line = JudgedPlant().enables()
    line.asks(OFF)
    line.is_cut_off()
    line.drive.stop_check.on_restart()
    line.is_silent(10.0)
    assert line.last_stop is LastStop.FORWARDED
    assert not line.told


# when the plant is asked next


class TestThePlantWakesUp:
    """By the clock alone: the drive sends changes, and nothing of what it is asked here."""

    @pytest.fixture
    def line(self) -> JudgedPlant:
        return JudgedPlant(deadline_s=None).enables()

    def wakes_after(self, line: JudgedPlant) -> float | None:
        at = line.plant.next_deadline(line.now)
        return None if at is None else at - line.now

    def test_when_the_bound_of_a_stop_is_over_from_when_it_was_handed_over(self, line: JudgedPlant) -> None:
        request = Request(PLC, line.drive.name, command_of(OFF))
        line.plant.submit(request, line.now, lambda outcome: None)
        assert self.wakes_after(line) is None
        hand_over(line.plant, line.drive, line.now)
        assert self.wakes_after(line) == pytest.approx(3 * 0.5 + 0.010 + 0.250)

    def test_at_once_where_the_node_says_that_it_is_stopped(self, line: JudgedPlant) -> None:
        line.asks(OFF)
        line.is_cut_off()
        assert self.wakes_after(line)
        line.drive.stop_check.on_node_stopped(line.now)
        assert self.wakes_after(line) == 0
