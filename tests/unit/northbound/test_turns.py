"""Order of service: by address, then by connection, the one served longest ago first."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.northbound.turns import Turns


def test_a_crowd_has_the_turns_of_one_address() -> None:
    turns = Turns[str]()
    for number in range(100):
        turns.enter(f"crowd {number}", "10.0.0.1")
    turns.enter("plc", "10.0.0.2")
    for number in range(100):
        turns.wish(f"crowd {number}")
    turns.take()
    turns.wish("plc")
    assert turns.take() == "plc"


def test_who_asks_seldom_is_next_however_many_addresses_ask_without_a_pause() -> None:
    turns = Turns[int]()
    for number in range(101):
        turns.enter(number, f"10.0.0.{number}")
        turns.wish(number)
    for _ in range(101):
        turns.take()
    for number in range(1, 101):
        turns.wish(number)
    for _ in range(250):
        one = turns.take()
        assert one is not None
        turns.wish(one)
    turns.wish(0)
    assert turns.take() == 0


def test_connections_of_one_address_take_turns() -> None:
    turns = Turns[str]()
    for name in "abc":
        turns.enter(name, "10.0.0.1")
        turns.wish(name)
    taken: list[str] = []
    for _ in range(9):
        one = turns.take()
        assert one is not None
        taken.append(one)
        turns.wish(one)
    assert taken == list("abcabcabc")


def test_who_connects_anew_for_each_request_gains_nothing() -> None:
    turns = Turns[str]()
    for name in ("old", "new 0"):
        turns.enter(name, "10.0.0.1")
        turns.wish(name)
    served: list[str] = []
    for number in range(20):
        one = turns.take()
        assert one is not None
        served.append(one.partition(" ")[0])
        if one == "old":
            turns.wish("old")
        else:
            turns.leave(one)
            turns.enter(f"new {number + 1}", "10.0.0.1")
            turns.wish(f"new {number + 1}")
    assert Counter(served) == {"old": 10, "new": 10}


def test_who_has_left_has_no_turn() -> None:
    turns = Turns[str]()
    turns.enter("a", "10.0.0.1")
    turns.wish("a")
    turns.leave("a")
    turns.leave("a")
    turns.wish("a")
    assert turns.take() is None
    assert turns.addresses == 0


STEPS = st.lists(
    st.tuples(st.sampled_from(("enter", "leave", "wish", "take")), st.integers(0, 7)), max_size=80
)


@pytest.mark.landing
@given(STEPS)
def test_everybody_who_waits_has_one_turn(steps: list[tuple[str, int]]) -> None:
    turns = Turns[int]()
    there: set[int] = set()
    waiting: set[int] = set()
    for what, one in steps:
        match what:
            case "enter" if one not in there:
                turns.enter(one, f"10.0.0.{one % 3}")
                there.add(one)
            case "leave":
                turns.leave(one)
                there.discard(one)
                waiting.discard(one)
            case "wish":
                turns.wish(one)
                waiting |= {one} & there
            case "take":
                taken = turns.take()
                assert (taken is None) == (not waiting)
                waiting.discard(-1 if taken is None else taken)
            case _:
                pass
    assert turns.addresses == len({one % 3 for one in there})
    left = [turns.take() for _ in range(len(waiting))]
    assert set(left) == waiting
    assert turns.take() is None
