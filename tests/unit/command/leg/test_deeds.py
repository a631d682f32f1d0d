"""The deeds of the leg's table: each is done, and by nothing but its cell."""

from __future__ import annotations

from unittest.mock import patch

import pytest

from bridge.command import Action, Start
from bridge.command.leg import deeds
from bridge.command.leg.deeds import About, happen
from bridge.command.leg.effect import LetGo, StartEnded
from bridge.command.leg.forwarded import SENT_BEFORE, StopRule
from bridge.command.leg.state import Stage
from bridge.command.leg.table import TABLE, Deed, Stimulus
from bridge.command.messages.request import Code, Outcome
from bridge.drive import DriveState
from tests.support.leg import DISABLE, Leg, draft_of, running_nord, settings_of


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
    draft = draft_of(running_nord())
    happen(draft, Stimulus.STOP, About(asked=StopRule(lambda word: DISABLE)))
    assert draft.sent.words[0] == DISABLE
    assert draft.effects[0] == LetGo()
    assert draft.is_asked


def test_a_start_that_is_led_nowhere_any_more_has_ended() -> None:
    leg = Leg(settings_of("nord/sk-tu4-cao"))
    leg.says(DriveState.READY)
    leg.asks(Start())
    draft = draft_of(leg)
    assert draft.start is not None
    ends = Outcome(Code.CANCELLED, "another owner")
    happen(draft, Stimulus.LEFT, About(ends))
    assert draft.start is None
    assert draft.effects == [StartEnded(ends)]
    happen(draft, Stimulus.LEFT, About(ends))
    assert draft.effects == [StartEnded(ends)], "once"
