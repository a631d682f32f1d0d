"""The way out to a drive of each family: which stop is in force, and how long."""

from __future__ import annotations

import pytest

from bridge.command.output import Gate
from bridge.config import Reaction
from bridge.drive import ControlWords, DriveState
from bridge.mapping import load_family

ENABLED, QUICK, READY = DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.READY
STANDING = (READY, DriveState.SWITCHED_ON, DriveState.SWITCH_ON_INHIBITED, DriveState.FAULT)

FAMILIES = {
    # family: run, stop of that, what is left of it for a drive that stands
    "lenze/8400-motec": (0x0009, 0x000D, 0x0005),  # bit 2 is the quick stop, bit 3 enables operation
    "stoeber/5000": (0x0001, 0x0005, 0x0004),
    "cia402/velocity": (0x007F, 0x0077, 0x0076),
    "nord/sk-tu4-cao": (0x047F, 0x047E, 0x047E),
}


class Way:
    """A gate with its clock, of a drive that may be enabled."""

    def __init__(self, family: str, reaction: Reaction = "stop") -> None:
        self.words = ControlWords(load_family(family).control_word)
        self.run, self.stop, self.withheld = FAMILIES[family]
        self.gate = Gate(self.words, 1, reaction, 0)
        self.now = 100.0

    @property
    def sent(self) -> int:
        return self.gate.compute(self.now, may_enable=True).words[0]

    def writes(self, word: int) -> int:
        self.gate.take(word, (0,), may_enable=True)
        return self.sent

    def says(self, state: DriveState, after_s: float = 1.0) -> int:
        self.now += after_s
        self.gate.on_state(state)
        return self.sent

    def runs(self) -> None:
        self.writes(self.words.ready)
        self.says(READY)
        assert self.writes(self.run) == self.run
        self.says(ENABLED)


@pytest.fixture(params=FAMILIES)
def way(request: pytest.FixtureRequest) -> Way:
    return Way(request.param)


def test_a_drive_that_runs_is_stopped_by_its_ramp_and_one_that_stands_gets_no_current(way: Way) -> None:
    way.runs()
    way.gate.interlocked = True
    assert way.writes(way.run) == way.stop
    assert way.says(QUICK) == way.stop
    for state in STANDING:
        assert way.says(state) == way.withheld
        assert way.writes(way.run) == way.withheld


def test_what_is_said_late_brings_no_stop_back(way: Way) -> None:
    """Word follows state and state follows word: two of them under way must not chase each other."""
    way.runs()
    way.gate.interlocked = True
    way.writes(way.run)
    way.says(READY)
    assert way.says(ENABLED, 0.003) == way.withheld
    assert way.says(READY, 0.003) == way.withheld


def test_what_was_said_before_it_was_enabled_takes_no_ramp_away(way: Way) -> None:
    way.writes(way.words.ready)
    way.says(READY)
    way.writes(way.run)
    way.gate.interlocked = True
    assert way.sent == way.stop
    assert way.says(DriveState.SWITCHED_ON, 0.05) == way.stop
    assert way.says(ENABLED, 0.05) == way.stop


@pytest.mark.parametrize("kind", ["quick_stop", "disable_voltage"])
def test_the_next_run_of_the_owner_weakens_no_stop(way: Way, kind: str) -> None:
    way.runs()
    change = {"quick_stop": way.words.quick_stop, "disable_voltage": way.words.disable_voltage}[kind]
    stopped = change(way.sent)
    way.gate.stop(stopped)
    assert way.sent == stopped
    assert way.writes(way.run) == stopped
    assert way.writes(way.words.ready) == way.words.ready, "what does not enable is the owner's own"


def test_a_stop_that_was_asked_for_stays_as_it_is(way: Way) -> None:
    way.runs()
    way.gate.stop(way.stop, is_asked=True)
    assert way.sent == way.stop
    assert way.says(READY) == way.stop
    assert way.writes(way.run) == way.stop


def test_the_owners_acknowledge_goes_on_to_a_drive_that_is_interlocked(way: Way) -> None:
    acknowledge = way.words.acknowledge_mask
    way.runs()
    way.gate.interlocked = True
    assert way.sent == way.stop
    assert way.says(DriveState.FAULT) == way.withheld
    assert way.writes(way.run | acknowledge) == way.withheld | acknowledge


def test_an_acknowledge_brings_no_current_after_a_stop_that_was_asked_for(way: Way) -> None:
    acknowledge = way.words.acknowledge_mask
    way.runs()
    way.says(DriveState.FAULT)
    way.gate.stop(way.stop, is_asked=True)
    assert way.sent == way.stop
    assert way.writes(way.run | acknowledge) == way.withheld | acknowledge
    assert way.writes(way.run) == way.withheld


def test_a_drive_that_had_stopped_by_itself_before_it_is_stopped_gets_no_current(way: Way) -> None:
    way.runs()
    way.says(DriveState.SWITCH_ON_INHIBITED)
    way.gate.interlocked = True
    assert way.sent == way.withheld
    assert way.says(READY) == way.withheld


def test_one_that_turned_again_after_that_is_stopped_by_its_ramp(way: Way) -> None:
    way.runs()
    way.says(READY)
    way.says(ENABLED)
    way.gate.interlocked = True
    assert way.sent == way.stop


def test_what_a_drive_says_after_its_node_has_restarted_is_believed_at_once(way: Way) -> None:
    way.writes(way.words.ready)
    way.says(READY)
    way.writes(way.run)
    way.gate.stop(way.stop)
    assert way.sent == way.stop
    way.gate.forget()
    assert way.says(READY, 0.01) == way.withheld


def test_a_stop_by_the_watchdog_brings_no_current_either(way: Way) -> None:
    way.runs()
    way.gate.trip(way.now)
    assert way.sent == way.stop
    assert way.says(READY) == way.withheld
    assert way.says(ENABLED, 0.003) == way.withheld


def test_a_fault_that_is_reset_moves_nothing(way: Way) -> None:
    way.runs()
    way.says(DriveState.FAULT)
    assert way.sent == way.run
    way.gate.clear(way.now, DriveState.FAULT, pulse=True)
    assert way.sent == way.withheld | way.words.acknowledge_mask
    way.now += 0.2
    assert way.says(READY) == way.withheld
    assert way.writes(way.run) == way.withheld


def test_a_quick_stop_by_the_watchdog_ends_with_disable_voltage(way: Way) -> None:
    way.gate = Gate(way.words, 1, "quick_stop", 0)
    way.runs()
    way.gate.trip(way.now)
    assert way.sent == way.words.quick_stop(way.run)
    deadline = way.gate.next_deadline()
    assert deadline == way.now + 10.0
    way.now = deadline
    assert way.sent == way.words.disable_voltage(way.words.quick_stop(way.run))
    assert way.gate.next_deadline() is None


# what opens the way


def test_a_stop_for_a_drive_that_may_not_be_enabled_does_not_open_the_interlock(way: Way) -> None:
    assert way.gate.take(way.words.ready, (0,), may_enable=False)
    assert way.gate.interlocked
    assert not way.gate.take(way.run, (0,), may_enable=True), "that needs a stop while it may be enabled"
    assert not way.words.enables(way.sent)


def test_an_enable_for_a_drive_that_may_not_be_enabled_does_not_go_out(way: Way) -> None:
    way.writes(way.words.ready)
    assert not way.gate.interlocked
    assert not way.gate.take(way.run, (0,), may_enable=False)
    assert not way.words.enables(way.gate.compute(way.now, may_enable=False).words[0])


def test_the_enabling_word_of_a_start_opens_no_interlock(way: Way) -> None:
    way.gate.lead(way.run)
    assert way.gate.interlocked
    assert not way.words.enables(way.sent)
    way.gate.lead(way.words.ready)
    way.gate.lead(way.run)
    assert way.sent == way.run


def test_a_drive_in_fault_rests_also_where_it_never_said_that_it_had_moved(way: Way) -> None:
    """A stop that would hold the motor brings it under no current when the fault is gone."""
    way.writes(way.words.ready)
    way.says(READY)
    way.writes(way.run)
    assert way.gate.may_follow_late
    way.says(DriveState.FAULT)
    way.gate.stop(way.words.stop(way.run))
    assert way.sent == way.withheld


@pytest.mark.parametrize("state", [DriveState.FAULT_REACTION_ACTIVE, DriveState.UNKNOWN])
def test_one_whose_fault_reaction_goes_on_does_not(way: Way, state: DriveState) -> None:
    way.writes(way.words.ready)
    way.says(READY)
    way.writes(way.run)
    way.says(state)
    way.gate.stop(way.words.stop(way.run))
    assert way.sent == way.stop
