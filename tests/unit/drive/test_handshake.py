"""The new set-point handshake: bit 4 rises with a position, falls with bit 12, and rises again after it."""

from __future__ import annotations

import pytest

from bridge.drive import Handshake
from bridge.mapping.model import Handshake as Model

NEW, TAKEN = 0x0010, 0x1000


@pytest.fixture
def handshake() -> Handshake:
    return Handshake(Model(value="position", bit=4, acknowledge_bit=12), (0, 1))


def order(handshake: Handshake, *words: int, status: int = 0, enabled: bool = True) -> int:
    handshake.order(words)
    handshake.step(words, status, 0.0, enabled=enabled)
    return handshake.bits


def test_it_rises_with_the_position_and_stays_until_the_drive_has_taken_it(handshake: Handshake):
    assert handshake.bits == 0
    assert order(handshake, 1, 0) == NEW
    handshake.step((1, 0), 0, 0.0, enabled=True)
    assert handshake.bits == NEW
    handshake.step((1, 0), TAKEN, 0.0, enabled=True)
    assert handshake.bits == 0


def test_the_same_position_is_no_new_one(handshake: Handshake):
    order(handshake, 1, 0)
    handshake.step((1, 0), TAKEN, 0.0, enabled=True)
    handshake.step((1, 0), 0, 0.0, enabled=True)
    assert order(handshake, 1, 0) == 0
    assert order(handshake, 0, 1) == NEW, "the high word counts too"


def test_the_next_waits_until_the_drive_has_lowered_its_bit(handshake: Handshake):
    order(handshake, 1, 0)
    handshake.step((1, 0), TAKEN, 0.0, enabled=True)
    assert order(handshake, 2, 0, status=TAKEN) == 0
    handshake.step((2, 0), 0, 0.0, enabled=True)
    assert handshake.bits == NEW


def test_one_that_comes_while_the_bit_is_up_gets_an_edge_of_its_own(handshake: Handshake):
    order(handshake, 1, 0)
    assert order(handshake, 2, 0) == NEW
    handshake.step((2, 0), TAKEN, 0.0, enabled=True)
    assert handshake.bits == 0
    handshake.step((2, 0), 0, 0.0, enabled=True)
    assert handshake.bits == NEW


def test_going_back_to_the_position_that_is_handed_over_takes_the_one_between_back(handshake: Handshake):
    order(handshake, 1, 0)
    order(handshake, 2, 0)
    assert order(handshake, 1, 0) == NEW
    handshake.step((1, 0), TAKEN, 0.0, enabled=True)
    handshake.step((1, 0), 0, 0.0, enabled=True)
    assert handshake.bits == 0, "a drive that counts from where it is would go on by 1 again"


def test_an_order_waits_for_the_enable(handshake: Handshake):
    assert order(handshake, 1, 0, enabled=False) == 0
    handshake.step((1, 0), 0, 0.0, enabled=True)
    assert handshake.bits == NEW


def test_what_was_taken_is_forgotten_when_the_drive_is_not_enabled_any_more(handshake: Handshake):
    order(handshake, 1, 0)
    handshake.step((1, 0), 0, 0.0, enabled=False)
    assert handshake.bits == 0
    handshake.step((1, 0), 0, 0.0, enabled=True)
    assert handshake.bits == 0, "nobody has ordered it again"
    assert order(handshake, 1, 0) == NEW


def test_a_stop_forgets_what_waits(handshake: Handshake):
    order(handshake, 1, 0, enabled=False)
    handshake.reset()
    handshake.step((1, 0), 0, 0.0, enabled=True)
    assert handshake.bits == 0
