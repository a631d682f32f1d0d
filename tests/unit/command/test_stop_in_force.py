"""The way out to a drive of each family: which stop is in force, and how long."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from bridge.command import Action, Start
from bridge.command.leg.event import StartAnew
from bridge.command.leg.outlook import next_deadline
from bridge.config import Reaction
from bridge.drive import DriveState
from tests.support.leg import OPEN, SHUT, Leg, settings_of

ENABLED, QUICK, READY = DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.READY
STANDING = (READY, DriveState.SWITCHED_ON, DriveState.SWITCH_ON_INHIBITED, DriveState.FAULT)

FAMILIES = {
    # family: run, stop of that, what is left of it for a drive that stands
    "lenze/8400-motec": (0x0009, 0x000D, 0x0005),  # bit 2 is the quick stop, bit 3 enables operation
    "stoeber/5000": (0x0001, 0x0005, 0x0004),
    "cia402/velocity": (0x007F, 0x0077, 0x0076),
    "nord/sk-tu4-cao": (0x047F, 0x047E, 0x047E),
}


class Drive(Leg):
    def __init__(self, family: str, reaction: Reaction = "stop") -> None:
        super().__init__(settings_of(family, on_expiry=reaction, fieldbus_timeout_ms=30_000))
        self.family = family
        self.words = self.settings.words
        self.run, self.stop, self.withheld = FAMILIES[family]

    def says(self, state: DriveState, after_s: float = 1.0, *, is_acknowledged: bool = False) -> int:
        return super().says(state, after_s, is_acknowledged=is_acknowledged)

    def gets_ready(self) -> None:
        self.writes(self.words.ready)
        self.says(READY)

    def runs(self) -> None:
        self.gets_ready()
        assert self.writes(self.run) == self.run
        self.says(ENABLED)

    def released(self) -> int:
        """A stop by the bridge, which nobody has asked for as such."""
        return self.asks(Action.RELEASE_CONTROL)


@pytest.fixture(params=FAMILIES)
def drive(request: pytest.FixtureRequest) -> Iterator[Drive]:
    made = Drive(request.param)
    yield made
    assert made.words.is_valid(made.sent), "what is sent is valid at any time"


def test_a_drive_that_runs_is_stopped_by_its_ramp_and_one_that_stands_gets_no_current(drive: Drive) -> None:
    drive.runs()
    drive.restarts()
    assert drive.writes(drive.run) == drive.stop
    assert drive.says(QUICK) == drive.stop
    for state in STANDING:
        assert drive.says(state) == drive.withheld
        assert drive.writes(drive.run) == drive.withheld


def test_what_is_said_late_brings_no_stop_back(drive: Drive) -> None:
    """Word follows state and state follows word: two of them under way must not chase each other."""
    drive.runs()
    drive.restarts()
    drive.writes(drive.run)
    drive.says(READY)
    assert drive.says(ENABLED, 0.003) == drive.withheld
    assert drive.released() == drive.withheld
    assert drive.says(READY, 0.003) == drive.withheld


def test_nor_after_a_fault_that_came_before_it_had_moved(drive: Drive) -> None:
    drive.gets_ready()
    drive.writes(drive.run)
    drive.says(DriveState.FAULT)
    assert drive.released() == drive.withheld
    assert drive.says(ENABLED, 0.003) == drive.withheld
    assert drive.happens(StartAnew()) == drive.withheld


def test_one_that_turned_after_all_is_on_its_ramp_until_it_says_that_it_stands(drive: Drive) -> None:
    drive.gets_ready()
    drive.writes(drive.run)
    assert drive.restarts() == drive.stop
    assert drive.says(ENABLED, 0.05) == drive.stop
    assert drive.says(READY) == drive.withheld


def test_what_was_said_before_it_was_enabled_takes_no_ramp_away(drive: Drive) -> None:
    drive.gets_ready()
    drive.writes(drive.run)
    assert drive.restarts() == drive.stop
    assert drive.says(DriveState.SWITCHED_ON, 0.05) == drive.stop
    assert drive.says(ENABLED, 0.05) == drive.stop


@pytest.mark.parametrize("action", [Action.QUICK_STOP, Action.DISABLE_VOLTAGE])
def test_the_next_run_of_the_owner_weakens_no_stop(drive: Drive, action: Action) -> None:
    drive.runs()
    change = {
        Action.QUICK_STOP: drive.words.quick_stop,
        Action.DISABLE_VOLTAGE: drive.words.disable_voltage,
    }[action]
    stopped = change(drive.sent)
    assert drive.asks(action) == stopped
    assert drive.writes(drive.run) == stopped
    assert drive.writes(drive.words.ready) == drive.words.ready, "what does not enable is the owner's own"


def test_a_stop_that_was_asked_for_stays_as_it_is(drive: Drive) -> None:
    drive.runs()
    assert drive.asks(Action.STOP) == drive.stop
    assert drive.says(READY) == drive.stop
    assert drive.writes(drive.run) == drive.stop


def test_the_owners_own_stop_gives_way_where_the_bridge_keeps_it_in_force(drive: Drive) -> None:
    drive.says(READY)
    assert drive.writes(drive.stop) == drive.stop
    drive.restarts()
    drive.says(READY)
    assert drive.writes(drive.run) == drive.withheld


def test_the_owners_acknowledge_goes_on_to_a_drive_that_is_interlocked(drive: Drive) -> None:
    acknowledge = drive.words.acknowledge_mask
    drive.runs()
    assert drive.restarts() == drive.stop
    assert drive.says(DriveState.FAULT) == drive.withheld
    assert drive.writes(drive.run | acknowledge) == drive.withheld | acknowledge


def test_an_acknowledge_brings_no_current_after_a_stop_that_was_asked_for(drive: Drive) -> None:
    acknowledge = drive.words.acknowledge_mask
    drive.runs()
    drive.says(DriveState.FAULT)
    assert drive.asks(Action.STOP) == drive.stop
    assert drive.writes(drive.run | acknowledge) == drive.withheld | acknowledge
    assert drive.writes(drive.run) == drive.withheld


def test_a_drive_that_had_stopped_by_itself_before_it_is_stopped_gets_no_current(drive: Drive) -> None:
    drive.runs()
    drive.says(DriveState.SWITCH_ON_INHIBITED)
    assert drive.restarts() == drive.withheld
    assert drive.says(READY) == drive.withheld


def test_one_that_turned_again_after_that_is_stopped_by_its_ramp(drive: Drive) -> None:
    drive.runs()
    drive.says(READY)
    drive.says(ENABLED)
    assert drive.restarts() == drive.stop


def test_what_a_drive_says_after_its_node_has_restarted_is_believed_at_once(drive: Drive) -> None:
    drive.gets_ready()
    drive.writes(drive.run)
    assert drive.happens(StartAnew()) == drive.stop
    assert drive.says(READY, 0.01) == drive.withheld


def test_one_that_ran_when_the_bus_was_gone_is_still_on_its_ramp(drive: Drive) -> None:
    drive.runs()
    assert drive.happens(StartAnew()) == drive.stop
    drive.waits(0.1)
    assert drive.sent == drive.stop
    assert drive.says(ENABLED) == drive.stop
    assert drive.says(READY) == drive.withheld


def test_after_a_bus_that_was_gone_a_start_waits_for_nothing_from_before(drive: Drive) -> None:
    drive.gets_ready()
    drive.writes(drive.run)
    drive.says(DriveState.FAULT)
    drive.happens(StartAnew())
    drive.says(READY, 0.01)
    assert drive.asks(Start()) == drive.words.run


def test_and_of_one_that_was_released_only_what_it_says_of_its_run(drive: Drive) -> None:
    drive.gets_ready()
    drive.writes(drive.run)
    assert drive.released() == drive.stop
    assert drive.says(READY, 0.01) == drive.stop


def test_a_stop_by_the_watchdog_brings_no_current_either(drive: Drive) -> None:
    drive.runs()
    assert drive.trips() == drive.stop
    assert drive.says(READY) == drive.withheld
    assert drive.says(ENABLED, 0.003) == drive.withheld


def test_a_fault_that_is_reset_moves_nothing(drive: Drive) -> None:
    drive.runs()
    drive.says(DriveState.FAULT)
    assert drive.sent == drive.run
    assert drive.asks(Action.RESET_FAULT) == drive.withheld | drive.words.acknowledge_mask
    drive.waits(0.2)
    assert drive.says(READY) == drive.withheld
    assert drive.writes(drive.run) == drive.withheld


def test_a_quick_stop_by_the_watchdog_ends_with_disable_voltage(drive: Drive) -> None:
    ramps = Drive(drive.family, "quick_stop")
    ramps.runs()
    assert ramps.trips() == ramps.words.quick_stop(ramps.run)
    assert next_deadline(ramps.state) == ramps.now + 10.0
    ramps.waits(10.0)
    assert ramps.sent == ramps.words.disable_voltage(ramps.words.quick_stop(ramps.run))
    assert next_deadline(ramps.state) is None


# what opens the way


def test_a_stop_for_a_drive_that_may_not_be_enabled_does_not_open_the_interlock(drive: Drive) -> None:
    drive.happens(SHUT)
    drive.writes(drive.words.ready)
    assert drive.outcome.forwarded
    assert drive.is_interlocked
    drive.happens(OPEN)
    drive.writes(drive.run)
    assert not drive.outcome.forwarded, "that needs a stop while it may be enabled"
    assert not drive.enables


def test_an_enable_for_a_drive_that_may_not_be_enabled_does_not_go_out(drive: Drive) -> None:
    drive.writes(drive.words.ready)
    assert not drive.is_interlocked
    drive.happens(SHUT)
    drive.writes(drive.run)
    assert not drive.outcome.forwarded
    assert not drive.enables


def test_a_start_leads_an_interlocked_drive_through_a_word_that_does_not_enable(drive: Drive) -> None:
    """A drive that still says that it is enabled keeps its stop until it has said something else."""
    drive.runs()
    drive.restarts()
    assert drive.asks(Start()) == drive.stop
    assert drive.says(DriveState.SWITCH_ON_INHIBITED) == drive.words.ready
    assert drive.says(READY) == drive.words.run


def test_a_drive_in_fault_rests_also_where_it_never_said_that_it_had_moved(drive: Drive) -> None:
    """A stop that would hold the motor brings it under no current when the fault is gone."""
    drive.gets_ready()
    drive.writes(drive.run)
    drive.says(DriveState.FAULT)
    assert drive.released() == drive.withheld


@pytest.mark.parametrize("state", [DriveState.FAULT_REACTION_ACTIVE, DriveState.UNKNOWN])
def test_one_whose_fault_reaction_goes_on_does_not(drive: Drive, state: DriveState) -> None:
    drive.gets_ready()
    drive.writes(drive.run)
    drive.says(state)
    assert drive.released() == drive.stop
