"""The state machine of a NORD inverter as a table (BU 2500 §6.5.3)."""

from __future__ import annotations

import itertools

import pytest

from bridge.sim.nord.nord_states import STATE_BITS, TRANSITIONS, NordState, commanded


def test_the_commands_of_one_state_exclude_each_other() -> None:
    for word, state in itertools.product(range(0x80), NordState):
        targets = {one.target for one in TRANSITIONS if one.source is state and one.command.matches(word)}
        assert len(targets) <= 1, (word, state)


@pytest.mark.parametrize(
    ("state", "word", "target"),
    [
        (NordState.SWITCH_ON_INHIBITED, 0x047E, NordState.READY),
        (NordState.SWITCH_ON_INHIBITED, 0x047F, None),
        (NordState.READY, 0x0477, NordState.SWITCHED_ON),
        (NordState.SWITCHED_ON, 0x047F, NordState.ENABLED),
        (NordState.ENABLED, 0x047D, NordState.SWITCH_ON_INHIBITED),
        (NordState.ENABLED, 0x047B, NordState.QUICK_STOP),
        (NordState.QUICK_STOP, 0x047F, None),
        (NordState.FAULT, 0x047E, None),
    ],
)
def test_a_word_leads_to_its_state(state: NordState, word: int, target: NordState | None) -> None:
    found = commanded(state, word)
    assert (found.target if found else None) is target


def test_every_state_has_bits_and_only_shut_down_waits_for_standstill() -> None:
    assert set(STATE_BITS) == set(NordState)
    assert [one.number for one in TRANSITIONS if one.at_standstill] == [8]
