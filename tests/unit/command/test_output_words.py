"""Outputs of a node as words: where each stands, what it gets when it is safe, and what a telegram asks."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Code
from bridge.command.messages.telegram import Refusal, Telegram
from bridge.command.output_words import ACTIVE, OutputWords
from bridge.config import SafeValue
from bridge.mapping.device_signals import Output


def output(name: str, data_type: str, on_expiry: SafeValue = 0, **more: object) -> Output:
    keys = {"name": name, "object": f"6200:{len(name):02X}", "data_type": data_type, "on_expiry": on_expiry}
    return Output.model_validate({**keys, **more})


VALVES = output("valves", "uint8")
LEVEL = output("level", "int32", on_expiry="hold")
HEAT = output("heat", "int16", on_expiry=20, unit="°C")


def words_of(**on_expiry: SafeValue) -> OutputWords:
    return OutputWords("block", (VALVES, LEVEL, HEAT), on_expiry)


def test_an_output_has_as_many_words_as_its_bits_need() -> None:
    words = words_of()
    assert [(place.word, place.span) for place in words.places.values()] == [(0, 1), (1, 2), (3, 1)]
    assert words.count == 4


def test_safe_is_what_the_mapping_says_and_the_site_before_it_and_what_holds_stays() -> None:
    held = (0xFF, 0x1111, 0x2222, 7)
    assert words_of().safe(held) == (0, 0x1111, 0x2222, 20)
    assert words_of(valves=3, heat="hold").safe(held) == (3, 0x1111, 0x2222, 7)
    assert words_of().held == (0, 0, 0, 20), "before anybody has commanded it"


def test_values_have_their_signs() -> None:
    words = words_of()
    assert words.value((0, 0xFFFE, 0xFFFF, 0xFFFF), words.places["level"]) == -2
    assert words.value((0, 0, 0, 0xFFFF), words.places["heat"]) == -1
    assert words.value((0x80, 0, 0, 0), words.places["valves"]) == 0x80


def test_all_hold_where_each_of_them_does() -> None:
    assert not words_of(valves="hold").all_hold
    assert words_of(valves="hold", heat="hold").all_hold


def test_a_telegram_keeps_what_it_does_not_write_and_holds_what_is_held() -> None:
    words = words_of()
    words.take((1, 5, 0, 20))
    telegram = words.decode({"heat": 30}, (1, 99, 0, 20), 0)
    assert telegram == Telegram(ACTIVE, (1, 5, 0, 30))


def test_a_telegram_that_leaves_all_safe_or_as_it_is_stops() -> None:
    words = words_of()
    words.take((1, 5, 0, 30))
    assert words.decode({"valves": 0, "heat": 20}, (1, 5, 0, 30), 0) == Telegram(0, (0, 5, 0, 20))


def test_a_bit_is_written_over_the_whole_output() -> None:
    words = words_of()
    assert words.decode({"valves.7": True, "valves": 1}, (0, 0, 0, 20), 0).setpoints[0] == 0x81
    assert words.decode({"valves.0": False}, (3, 0, 0, 20), 0).setpoints[0] == 2


@pytest.mark.parametrize(
    ("values", "code", "text"),
    [
        ({"valve": 1}, Code.UNKNOWN_POINT, "block/output has no 'valve'; it has valves, level, heat"),
        ({"valves.8": 1}, Code.OUT_OF_RANGE, "valves.8 is none of its 8 bits"),
        ({"valves.x": 1}, Code.OUT_OF_RANGE, "valves.x is none of its 8 bits"),
        ({"valves.1": 2}, Code.OUT_OF_RANGE, "valves.1 takes true or false, not 2"),
    ],
)
def test_what_cannot_be_written_is_refused(values: dict[str, int], code: Code, text: str) -> None:
    with pytest.raises(Refusal) as caught:
        words_of().decode(values, (0, 0, 0, 20), 0)
    assert (caught.value.code, str(caught.value)) == (code, text)


@pytest.mark.parametrize("value", [256, -1])
def test_a_value_that_does_not_fit_is_refused_with_its_unit(value: int) -> None:
    with pytest.raises(Refusal) as caught:
        words_of().decode({"valves": value}, (0, 0, 0, 20), 0)
    assert caught.value.code is Code.OUT_OF_RANGE
    with pytest.raises(Refusal, match=r"°C$"):
        words_of().decode({"heat": 40_000}, (0, 0, 0, 20), 0)


def test_the_wire_has_the_owners_values_while_the_leg_is_active_and_safe_ones_else() -> None:
    words = words_of()
    words.take((1, 5, 0, 30))
    assert words.on_wire((ACTIVE, 7, 8, 0, 40)) == (7, 8, 0, 40)
    assert words.on_wire((0, 7, 8, 0, 40)) == (0, 5, 0, 20)


def test_what_is_let_go_is_held_no_longer() -> None:
    words = words_of()
    words.take((1, 5, 0, 30))
    words.let_go()
    assert words.has_let_go
    assert words.held == (1, 0, 0, 30)
    words.take((1, 6, 0, 30))
    assert not words.has_let_go


def test_what_lets_go_and_does_not_take_0_gets_what_is_nearest_to_it() -> None:
    tight = OutputWords("block", (output("speed", "int16", on_expiry="hold", low=5, high=10),), {})
    tight.take((8,))
    tight.let_go()
    assert tight.held == (5,)


def test_what_the_node_holds_is_taken_over_by_name() -> None:
    words = words_of()
    words.hold({"level": 0x0002_0001})
    assert words.held == (0, 1, 2, 20)


def test_what_the_node_holds_takes_no_stop_back() -> None:
    words = words_of()
    words.let_go()
    words.hold({"level": 0x0002_0001})
    assert words.has_let_go
    assert words.held == (0, 0, 0, 20)


@given(st.integers(-(1 << 31), (1 << 31) - 1), st.integers(0, 255))
def test_what_is_written_is_read(level: int, valves: int) -> None:
    words = words_of()
    sent = words.decode({"valves": valves, "heat": -5}, (0, 0, 0, 20), 0).setpoints
    assert words.value(sent, words.places["valves"]) == valves
    assert words.value(sent, words.places["heat"]) == -5
    held = words_of(level=0)
    sent = held.decode({"level": level}, (0, 0, 0, 20), 0).setpoints
    assert held.value(sent, held.places["level"]) == level
