"""Outputs under every sequence of events: the answers are true, and a stop by somebody stays one."""

from __future__ import annotations

from typing import Any

import pytest

from bridge.command.leg.draft import Draft
from bridge.command.output_words import OutputWords
from bridge.command.outputs import OutputChannel
from tests.support.leg_outputs import OutputSpace

BLOCKS = [(0, 0), (0, "hold"), ("hold", "hold"), (5, "hold")]
"""What two outputs of a block get when nobody commands them."""


@pytest.mark.landing(2)
@pytest.mark.parametrize("on_expiry", BLOCKS)
def test_whatever_happens_to_outputs(on_expiry: Any) -> None:
    space = OutputSpace(on_expiry)
    assert space.explore() > 100
    assert space.steps > 3000


def _forgets(turn: Draft, word: int, *, is_asked: bool = False) -> None:
    turn.word, turn.is_ours, turn.is_asked = word, True, is_asked
    turn.drop_setpoints()


FAULTS: dict[str, tuple[object, str, object]] = {
    "what holds outlasts a stop": (OutputChannel, "_on_let_go", lambda channel: None),
    "an acknowledge takes a stop back": (Draft, "stop", _forgets),
    "outputs keep what they got": (OutputWords, "safe", lambda words, held: tuple(held)),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    where, name, wrong = FAULTS[fault]
    space = OutputSpace((5, "hold"))
    monkeypatch.setattr(where, name, wrong)
    with pytest.raises(AssertionError, match="\nafter "):
        space.explore()
