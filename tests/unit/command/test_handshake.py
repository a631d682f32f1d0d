"""The new set-point handshake: bit 4 rises with a position, falls with bit 12, and rises again after it."""

from __future__ import annotations

import pytest

from bridge.command.leg import order as orders
from bridge.command.leg.state import Order


class Handshake:
    """The order of one drive."""

    def __init__(self) -> None:
        self.order = Order()

    def steps(self, words: tuple[int, ...], *, taken: bool = False, enabled: bool = True) -> None:
        self.order, is_untaken = orders.went_on(
            self.order, words, 0.0, is_acknowledged=taken, commanded=enabled
        )
        assert not is_untaken, "no time passes"

    def orders(self, *words: int, taken: bool = False, enabled: bool = True) -> bool:
        self.order = orders.ordered(self.order, words)
        self.steps(words, taken=taken, enabled=enabled)
        return self.is_up

    @property
    def is_up(self) -> bool:
        return self.order.is_raised


@pytest.fixture
def handshake() -> Handshake:
    return Handshake()


def test_it_rises_with_the_position_and_stays_until_the_drive_has_taken_it(handshake: Handshake):
    assert not handshake.is_up
    assert handshake.orders(1, 0)
    handshake.steps((1, 0))
    assert handshake.is_up
    handshake.steps((1, 0), taken=True)
    assert not handshake.is_up


def test_the_same_position_is_no_new_one(handshake: Handshake):
    handshake.orders(1, 0)
    handshake.steps((1, 0), taken=True)
    handshake.steps((1, 0))
    assert not handshake.orders(1, 0)
    assert handshake.orders(0, 1), "the high word counts too"


def test_the_next_waits_until_the_drive_has_lowered_its_bit(handshake: Handshake):
    handshake.orders(1, 0)
    handshake.steps((1, 0), taken=True)
    assert not handshake.orders(2, 0, taken=True)
    handshake.steps((2, 0))
    assert handshake.is_up


def test_one_that_comes_while_the_bit_is_up_gets_an_edge_of_its_own(handshake: Handshake):
    handshake.orders(1, 0)
    assert handshake.orders(2, 0)
    handshake.steps((2, 0), taken=True)
    assert not handshake.is_up
    handshake.steps((2, 0))
    assert handshake.is_up


def test_going_back_to_the_position_that_is_handed_over_takes_the_one_between_back(handshake: Handshake):
    handshake.orders(1, 0)
    handshake.orders(2, 0)
    assert handshake.orders(1, 0)
    handshake.steps((1, 0), taken=True)
    handshake.steps((1, 0))
    assert not handshake.is_up, "a drive that counts from where it is would go on by 1 again"


def test_an_order_waits_for_the_enable(handshake: Handshake):
    assert not handshake.orders(1, 0, enabled=False)
    handshake.steps((1, 0))
    assert handshake.is_up


def test_what_was_taken_is_forgotten_when_the_drive_is_not_enabled_any_more(handshake: Handshake):
    handshake.orders(1, 0)
    handshake.steps((1, 0), enabled=False)
    assert not handshake.is_up
    handshake.steps((1, 0))
    assert not handshake.is_up, "nobody has ordered it again"
    assert handshake.orders(1, 0)


def test_a_stop_forgets_what_waits(handshake: Handshake):
    handshake.orders(1, 0, enabled=False)
    handshake.order = orders.dropped(handshake.order)
    handshake.steps((1, 0))
    assert not handshake.is_up
