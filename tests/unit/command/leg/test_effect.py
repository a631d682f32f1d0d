"""Effects of a step of the leg: values that do not change, and what they say where nothing is given."""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from typing import get_args

import pytest

from bridge.command import Code, EventKind, Outcome
from bridge.command.leg.effect import (
    Answer,
    Effect,
    Heard,
    Ignored,
    LetGo,
    StartBegun,
    StartEnded,
    Tell,
    Tripped,
)

EFFECTS: tuple[Effect, ...] = (
    Answer(Outcome(Code.OK)),
    StartBegun(),
    StartEnded(Outcome(Code.CANCELLED)),
    Heard(),
    Tripped(100.2, None, 200),
    LetGo(),
    Ignored(),
    Tell(EventKind.OWNER, 300, "text"),
)


def test_every_kind_of_effect_is_here() -> None:
    assert {type(effect) for effect in EFFECTS} == set(get_args(Effect))


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: type(effect).__name__)
def test_an_effect_is_a_value(effect: Effect) -> None:
    assert len({effect, effect}) == 1
    name = next(iter(type(effect).__slots__), "anything")
    with pytest.raises((FrozenInstanceError, TypeError)):
        setattr(effect, name, None)


def test_an_answer_is_no_refusal_and_a_telegram_has_no_commands_unless_it_says_so() -> None:
    assert not Answer(Outcome(Code.OK)).is_refused
    assert Heard().names == ()
    assert LetGo() != Ignored()
