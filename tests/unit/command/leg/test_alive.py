"""Tokens of a life sign: how long telegrams count with one, whose they are, and which are refused."""

from __future__ import annotations

from typing import cast

import pytest

from bridge.command import Action, Code, Identity, Source
from bridge.command.leg import alive
from bridge.command.leg.draft import Draft
from bridge.command.messages.request import Do, Request
from bridge.command.messages.telegram import Refusal
from bridge.image import Value
from tests.support.leg import PLC, TOKENS, Leg, settings_of
from tests.support.rig import OTHER_PLC

TIMEOUT_MS = 3000


def draft(*, alive_until: float | None = None, life_sign: bool = True) -> Draft:
    """At 100 s, of a drive whose owner is a PLC."""
    leg = Leg(settings_of("nord/sk-tu4-cao", fieldbus_timeout_ms=TIMEOUT_MS, life_sign=life_sign))
    owner = leg.state.owner._replace(identity=PLC, alive_until=alive_until)
    return Draft(leg.settings, leg.state._replace(owner=owner), 100.5)


def test_a_token_counts_for_the_time_out_from_when_it_was_offered_first() -> None:
    assert alive.read(draft(), PLC, TOKENS.token(100.2)) == 100.0 + TIMEOUT_MS / 1000
    assert alive.read(draft(), PLC, TOKENS.token(98.9)) == 98.0 + TIMEOUT_MS / 1000


def test_without_a_token_the_last_one_of_the_same_owner_counts() -> None:
    assert alive.read(draft(alive_until=101.0), PLC, None) == 101.0
    assert alive.read(draft(alive_until=101.0), OTHER_PLC, None) is None
    assert alive.read(draft(), PLC, None) is None


def test_an_older_token_takes_nothing_from_a_newer_one() -> None:
    assert alive.read(draft(alive_until=103.0), PLC, TOKENS.token(98.0)) == 103.0


def test_a_number_that_is_no_token_counts_for_nothing() -> None:
    assert alive.read(draft(), PLC, 0) is None
    assert alive.read(draft(alive_until=101.0), PLC, 0) == 101.0


@pytest.mark.parametrize("token", [-1, 65_536, 1.5, True, "7"])
def test_what_is_no_word_is_refused(token: Value) -> None:
    with pytest.raises(Refusal) as caught:
        alive.read(draft(), PLC, token)
    assert (caught.value.code, str(caught.value)) == (Code.OUT_OF_RANGE, "life_sign takes 0…65535")


def test_a_drive_that_asks_for_none_takes_none() -> None:
    plain = draft(life_sign=False)
    assert alive.read(plain, PLC, None) is None
    with pytest.raises(Refusal) as caught:
        alive.read(plain, PLC, 5)
    assert caught.value.code is Code.UNKNOWN_POINT
    assert not alive.is_missing(plain, None)


@pytest.mark.parametrize(("until", "missing"), [(None, True), (100.5, True), (100.6, False)])
def test_a_telegram_does_not_count_from_the_moment_on_at_which_its_time_is_up(
    until: float | None, missing: bool
) -> None:
    assert alive.is_missing(draft(), until) is missing


@pytest.mark.parametrize(
    ("action", "refused"),
    [(Action.KEEP_ALIVE, True), (Action.RESET_FAULT, True), (Action.START, True), (Action.QUICK_STOP, False)],
)
def test_what_would_prove_a_program_is_refused_where_none_has_shown_itself(
    action: Action, refused: bool
) -> None:
    request = Request(PLC, "n/d", Do(action))
    if refused:
        with pytest.raises(Refusal, match="the life sign is missing or too old"):
            alive.check(draft(), request)
    else:
        alive.check(draft(), request)
    alive.check(draft(alive_until=101.0), request)


def test_who_is_another_has_proved_nothing() -> None:
    stranger = Identity(Source.MODBUS, "192.168.1.77")
    assert not alive.is_there(draft(alive_until=101.0), stranger)
    assert alive.is_there(draft(alive_until=101.0), PLC)


def test_what_is_noted_is_kept_and_none_takes_it_away() -> None:
    one = draft(alive_until=101.0)
    alive.note(one, None)
    assert cast("float", one.owner.alive_until) == 101.0
    alive.note(one, 103.0)
    assert one.owner.alive_until == 103.0
