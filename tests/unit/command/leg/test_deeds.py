"""The deeds of the leg's table: each is done, and by nothing but its cell."""

from __future__ import annotations

from unittest.mock import patch

import pytest

from bridge.command import Action, Start
from bridge.command.leg import deeds
from bridge.command.leg.deeds import About, happen
from bridge.command.leg.effect import LetGo, StartEnded
from bridge.command.leg.forwarded import SENT_BEFORE, Stop
from bridge.command.leg.state import Stage
from bridge.command.leg.table import TABLE, Deed, Stimulus
from bridge.command.messages.request import Code, Outcome
from bridge.drive import DriveState
from tests.support.leg import DISABLE, Leg, running_nord, settings_of, turn_of


def test_every_deed_of_the_table_can_be_done() -> None:
    assert {deed for _, deed in TABLE.values()} == {*deeds._DONE_BY, Deed.NOTHING} == set(Deed)


@pytest.mark.parametrize("stage", [Stage.INTERLOCKED, Stage.TRIPPED])
def test_the_stage_and_the_deed_are_those_of_the_table(stage: Stage) -> None:
    leg = running_nord()
    with patch.dict(TABLE, {(Stage.ENABLED, Stimulus.STOP): (stage, Deed.KEEP_SILENT)}):
        leg.asks(Action.STOP)
    assert leg.state.stage is stage
    assert leg.outcome.said == SENT_BEFORE


def test_a_stop_by_a_command_is_sent_and_lets_go_of_what_is_held() -> None:
    turn = turn_of(running_nord())
    happen(turn, Stimulus.STOP, About(asked=Stop(lambda word: DISABLE)))
    assert turn.sent.words[0] == DISABLE
    assert turn.effects[0] == LetGo()
    assert turn.is_asked


def test_a_start_that_is_led_nowhere_any_more_has_ended() -> None:
    leg = Leg(settings_of("nord/sk-tu4-cao"))
    leg.says(DriveState.READY)
    leg.asks(Start())
    turn = turn_of(leg)
    assert turn.start is not None
    ends = Outcome(Code.CANCELLED, "another owner")
    happen(turn, Stimulus.LEFT, About(ends))
    assert turn.start is None
    assert turn.effects == [StartEnded(ends)]
    happen(turn, Stimulus.LEFT, About(ends))
    assert turn.effects == [StartEnded(ends)], "once"
