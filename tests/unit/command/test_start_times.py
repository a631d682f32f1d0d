"""How long a start waits for the drive, to the instant, and what it believes when nothing comes."""

from __future__ import annotations

import pytest

from bridge.command import Action, Code, Outcome, Start
from bridge.command.leg.effect import StartEnded
from bridge.command.leg.event import NodeBack
from bridge.drive import DriveState
from tests.support.leg import OPEN, Leg, settings_of
from tests.support.outcomes import in_english
from tests.support.rig import OPERATOR, OTHER_PLC

SHUT_DOWN, RUN = 0x047E, 0x047F
"""NORD's (BU 2500 §6.8)."""
VOLTAGE = 0x0002
"""Without it the voltage is disabled (BU 2500 §6.5.1)."""
ENABLED, READY, INHIBITED = DriveState.OPERATION_ENABLED, DriveState.READY, DriveState.SWITCH_ON_INHIBITED
QUICK = DriveState.QUICK_STOP_ACTIVE
UNHEARD = OPEN._replace(is_heard=False)
A_MOMENT_S = 1e-6


class Drive(Leg):
    """A NORD drive with a controller that has half a minute; its clock begins at 100 s."""

    def __init__(self, **given: object) -> None:
        super().__init__(settings_of("nord/sk-tu4-cao", **{"fieldbus_timeout_ms": 30_000, **given}))

    def runs(self) -> None:
        self.says(READY)
        self.writes(SHUT_DOWN)
        self.writes(RUN)
        self.says(ENABLED)
        assert self.enables

    def starts(self) -> None:
        self.asks(Start())

    @property
    def end(self) -> Outcome | None:
        """Of a start, where the last event has ended one."""
        ends = [effect.outcome for effect in self.effects if isinstance(effect, StartEnded)]
        return ends[-1] if ends else None


@pytest.fixture
def drive() -> Drive:
    return Drive()


@pytest.fixture
def stopped(drive: Drive) -> Drive:
    """A moment ago: it still says that it is enabled."""
    drive.runs()
    drive.asks(Action.STOP)
    return drive


@pytest.fixture
def unheard(drive: Drive) -> Drive:
    """Its node is operational again, and it has said nothing since."""
    drive.says(INHIBITED)
    drive.happens(NodeBack())
    drive.happens(UNHEARD)
    return drive


@pytest.mark.parametrize(("at", "enables"), [(100.2 - A_MOMENT_S, False), (100.2, True)])
def test_what_is_said_within_200_ms_of_a_stop_may_be_older_than_it(stopped: Drive, at: float, enables: bool):
    stopped.starts()
    stopped.now = at
    stopped.says(ENABLED)
    assert stopped.enables is enables


@pytest.mark.parametrize(("at", "enables"), [(101.0 - A_MOMENT_S, False), (101.0, True)])
def test_after_a_second_without_a_word_the_last_one_is_believed(stopped: Drive, at: float, enables: bool):
    stopped.starts()
    stopped.at(100.5)
    stopped.starts()  # the first one counts
    stopped.at(at)
    assert stopped.enables is enables


def test_it_is_given_up_after_3_s(drive: Drive):
    drive.says(INHIBITED)
    drive.starts()
    drive.at(103.0 - A_MOMENT_S)
    assert drive.end is None
    drive.at(103.0)
    why = "the drive did not start, it is switch on inhibited"
    assert in_english(drive.end) == Outcome(Code.TIMED_OUT, why)


def test_a_drive_that_nobody_hears_is_made_ready_after_1_s_and_enabled_after_2(unheard: Drive):
    unheard.starts()
    rest = unheard.sent
    unheard.at(101.0 - A_MOMENT_S)
    assert unheard.sent == rest
    unheard.at(101.0)
    assert unheard.sent == SHUT_DOWN
    unheard.at(102.0 - A_MOMENT_S)
    assert unheard.sent == SHUT_DOWN
    unheard.at(102.0)
    assert unheard.enables
    unheard.at(103.0)
    assert unheard.end is not None
    assert unheard.end.code is Code.TIMED_OUT
    assert not unheard.enables


def test_asked_again_it_goes_on_with_that_and_does_not_begin_anew(unheard: Drive):
    unheard.starts()
    unheard.at(100.9)
    unheard.starts()
    unheard.at(101.0)
    assert unheard.sent == SHUT_DOWN
    unheard.at(101.9)
    unheard.starts()
    assert unheard.sent == SHUT_DOWN
    unheard.at(102.0)
    assert unheard.enables
    unheard.at(102.5)
    unheard.starts()
    assert not unheard.enables, "that nothing has come of it is no reason to send it for ever"
    unheard.at(103.5)
    assert unheard.enables


def test_a_drive_that_is_not_heard_any_more_gets_a_whole_second_for_it(stopped: Drive):
    stopped.asks(Action.DISABLE_VOLTAGE)
    stopped.starts()
    stopped.at(100.5)
    stopped.happens(UNHEARD)
    stopped.starts()
    rest = stopped.sent
    assert rest != SHUT_DOWN
    stopped.at(101.5 - A_MOMENT_S)
    assert stopped.sent == rest
    stopped.at(101.5)
    assert stopped.sent == SHUT_DOWN


@pytest.mark.parametrize(("at", "disables"), [(101.0 - A_MOMENT_S, False), (101.0, True)])
def test_a_quick_stop_has_a_second_to_end_by_itself(drive: Drive, at: float, disables: bool):
    drive.writes(SHUT_DOWN)
    drive.says(QUICK)
    drive.starts()
    drive.at(100.5)
    drive.starts()  # the first one counts
    drive.at(at)
    assert (not drive.sent & VOLTAGE) is disables


def test_a_quick_stop_has_its_second_from_when_the_start_was_asked_for(stopped: Drive):
    stopped.asks(Action.QUICK_STOP)
    stopped.starts()
    stopped.at(100.9)
    stopped.says(QUICK)
    assert stopped.sent & VOLTAGE
    stopped.at(101.0)
    assert not stopped.sent & VOLTAGE


def test_a_quick_stop_that_shows_after_that_has_had_its_time(unheard: Drive):
    """The word to become ready would lead nowhere."""
    unheard.starts()
    unheard.at(101.0)
    assert unheard.sent == SHUT_DOWN
    unheard.says(QUICK)
    assert not unheard.sent & VOLTAGE
    unheard.says(INHIBITED)
    assert unheard.sent == SHUT_DOWN
    unheard.says(READY)
    assert unheard.sent == RUN


def test_whoever_takes_a_running_drive_over_by_a_start_has_it_stopped_first():
    """Its owner fell silent, and the site file has that ignored."""
    drive = Drive(fieldbus_timeout_ms=1000, telegram_downtime_s=-0.1)
    drive.runs()
    drive.at(101.0)
    assert drive.enables
    drive.asks(Start(), OTHER_PLC)
    assert drive.state.owner.identity == OTHER_PLC
    assert not drive.enables
    drive.says(READY)
    assert drive.sent == RUN
    drive.says(ENABLED)
    assert drive.end == Outcome(Code.OK)


def test_a_start_that_replaces_another_is_the_one_that_goes_on(drive: Drive):
    drive.says(INHIBITED)
    drive.starts()
    drive.asks(Start(direction=1))
    assert in_english(drive.end) == Outcome(Code.CANCELLED, "started anew")
    drive.says(READY)
    assert drive.sent == 0x0C7F
    drive.says(ENABLED)
    assert drive.end == Outcome(Code.OK)


@pytest.mark.parametrize(("late", "enables"), [(READY, False), (INHIBITED, True)])
def test_right_after_a_stop_of_a_drive_that_had_not_followed_yet(
    drive: Drive, late: DriveState, enables: bool
):
    """*Ready* may still come from before the enable: it may follow that after all."""
    drive.says(DriveState.SWITCHED_ON)
    drive.writes(SHUT_DOWN)
    drive.writes(RUN)
    drive.asks(Action.DISABLE_VOLTAGE, OPERATOR)
    drive.starts()
    drive.says(late, 0.1)
    drive.says(READY, 0.05)
    assert drive.enables is enables


@pytest.mark.parametrize("state", [DriveState.NOT_READY, DriveState.UNKNOWN])
def test_of_a_drive_that_is_not_ready_yet_asks_it_to_become_ready(drive: Drive, state: DriveState):
    drive.says(state)
    drive.starts()
    assert drive.sent == SHUT_DOWN
    drive.says(READY)
    assert drive.sent == RUN


def test_after_a_stop_it_asks_one_that_is_not_ready_to_become_so(stopped: Drive):
    stopped.asks(Action.DISABLE_VOLTAGE)
    stopped.starts()
    assert not stopped.sent & VOLTAGE
    stopped.says(DriveState.NOT_READY)
    assert stopped.sent == SHUT_DOWN


@pytest.mark.parametrize("failure", ["time", "fault"])
def test_one_that_has_failed_leaves_no_setpoints_behind(drive: Drive, failure: str):
    drive.says(INHIBITED)
    drive.writes(SHUT_DOWN, setpoint_1=0x2000)
    drive.starts()
    drive.says(READY)
    assert drive.setpoints[0] == 0x2000
    if failure == "time":
        drive.at(103.0)
    else:
        drive.says(DriveState.FAULT)
        drive.says(READY)
    assert drive.setpoints[0] == 0
    drive.writes(SHUT_DOWN)
    drive.writes(RUN)
    assert drive.enables
    assert drive.setpoints[0] == 0, "nobody has written it since"


def test_a_direction_has_a_bit_where_the_drive_has_one():
    for direction, word in ((0, 0x047F), (1, 0x0C7F), (-1, 0x147F)):
        drive = Drive()
        drive.says(READY)
        drive.asks(Start(direction))
        assert drive.sent == word


def test_forward_needs_no_bit_where_the_setpoint_has_the_direction():
    axis = Leg(settings_of("cia402/velocity"))
    axis.says(READY)
    axis.asks(Start(-1))
    assert axis.outcome.code is Code.OUT_OF_RANGE
    assert "sign" in axis.outcome.message
    for direction in (0, 1):
        axis.asks(Start(direction))
        assert axis.sent == 0x007F


def test_what_begins_a_movement_comes_when_the_drive_is_enabled_and_not_before():
    """CiA 402-2, homing mode: bit 4 starts it."""
    axis = Leg(settings_of("cia402/homing"))
    axis.says(READY)
    axis.asks(Start())
    assert axis.sent == 0x000F
    axis.says(ENABLED)
    assert axis.sent == 0x001F
