"""Outcomes in words; no server."""

from __future__ import annotations

from bridge.command.messages.request import Code, Outcome
from bridge.northbound.opcua.requests.outcome_texts import explanation, outcome_text
from bridge.text import Text
from bridge.uaserver.languages import speaking


def test_a_refusal_of_a_drive_has_its_abort_code_and_the_bridges_sentence() -> None:
    said = Text.of("parameter.held_already")
    told = explanation(Outcome(Code.REFUSED_BY_DRIVE, said, abort_code=0x0609_0030))
    assert told.more == "SDO abort 06090030h: invalid value for parameter"
    assert told.symbol == "parameter.held_already"
    with speaking(["en"]):
        assert told.text.Text == str(said)


def test_a_refusal_without_a_sentence_has_its_code() -> None:
    told = explanation(Outcome(Code.BUSY))
    assert (told.symbol, told.text.Text, told.more) == (Code.BUSY.value, Code.BUSY.value, "")


def test_what_is_done_says_so() -> None:
    assert outcome_text(Outcome(Code.OK)).Text == "done"
    said = Text.of("parameter.held_already")
    assert outcome_text(Outcome(Code.OK, said)).Text == str(said)
