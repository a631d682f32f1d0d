"""Keys and what is written under them."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Code, Event, EventKind, Outcome
from bridge.image import Columns, DataType, Point, Quality, Reading
from bridge.northbound.zenoh.keys import KeySpace, event_json, outcome_json
from bridge.text import Text

POINTS = (
    Point(name="conveyor/fu1/status/state", data_type=DataType.UINT8, states=((4, "operation_enabled"),)),
    Point(name="conveyor/fu1/actual/frequency", data_type=DataType.FLOAT, unit="Hz"),
    Point(name="conveyor/fu1/status/fault_text", data_type=DataType.STRING),
    Point(name="conveyor/fu1/supervision/restart_interlock", data_type=DataType.BOOL),
)
STATE, FREQUENCY, TEXT, INTERLOCK = range(4)
KEYS = KeySpace("drives", "hall3", POINTS)
NOW_NS = 1_700_000_000_123_456_789


def good(value: bool | int | float | str) -> Reading:
    return Reading(value, Quality.GOOD, 5.0, "")


def test_a_key_is_prefix_site_and_point() -> None:
    assert KEYS.keys[FREQUENCY] == "drives/hall3/conveyor/fu1/actual/frequency"
    assert KEYS.tail(KEYS.keys[FREQUENCY]) == "conveyor/fu1/actual/frequency"
    assert KEYS.node_token("conveyor") == "drives/hall3/@/conveyor"


def test_a_value_comes_with_quality_and_time_in_microseconds() -> None:
    assert KEYS.as_json(FREQUENCY, good(25.0), NOW_NS) == b'{"v":25.0,"q":"good","t":1700000000.123457}'


def test_an_enumeration_names_its_state() -> None:
    assert json.loads(KEYS.as_json(STATE, good(4), NOW_NS))["s"] == "operation_enabled"
    assert "s" not in json.loads(KEYS.as_json(STATE, good(99), NOW_NS))
    states = ((3, Text.both("system bus", "Systembus")),)
    keys = KeySpace("drives", "hall3", (replace(POINTS[STATE], states=states),))
    assert json.loads(keys.as_json(0, good(3), NOW_NS))["s"] == "system bus"


def test_a_held_value_says_why_it_is_not_good() -> None:
    shown = json.loads(KEYS.as_json(FREQUENCY, Reading(25.0, Quality.LOST, 5.0, "lost"), NOW_NS))
    assert (shown["v"], shown["q"], shown["r"]) == (25.0, "lost", "lost")


@pytest.mark.parametrize("quality", [quality for quality in Quality if not quality.has_value])
def test_a_value_that_is_gone_is_not_shown(quality: Quality) -> None:
    reading = Reading(4, quality, 5.0, "")
    shown = json.loads(KEYS.as_json(STATE, reading, NOW_NS))
    assert shown["v"] is None and "s" not in shown
    assert KEYS.as_bare(STATE, reading, NOW_NS)[0] == b""


VALUES = st.booleans() | st.integers(-(2**31), 2**32) | st.floats() | st.text(max_size=5)
READINGS = st.builds(
    Reading,
    VALUES,
    st.sampled_from(Quality),
    st.sampled_from([0.0, 5.0, 5.001]),
    st.sampled_from(["", "why"]),
)


@given(st.lists(st.tuples(st.integers(0, len(POINTS) - 1), READINGS), max_size=8))
def test_many_are_written_as_each_of_them(some: list[tuple[int, Reading]]) -> None:
    indices, readings = [index for index, _ in some], [reading for _, reading in some]
    columns = Columns(*(list(map(list, zip(*readings, strict=True))) or [[], [], [], []]))
    each = [KEYS.as_json(i, one, NOW_NS + round(one.time * 1e9)) for i, one in some]
    assert list(map(json.loads, KEYS.as_jsons(indices, columns, NOW_NS))) == list(map(json.loads, each))


def test_a_point_that_never_had_a_value_has_no_time() -> None:
    shown = json.loads(KEYS.as_json(FREQUENCY, Reading(0.0, Quality.WAITING, 0.0, ""), NOW_NS))
    assert shown == {"v": None, "q": "waiting", "t": None}


@pytest.mark.parametrize(
    ("index", "value", "text"),
    [
        (STATE, 4, b"4"),
        (FREQUENCY, 25.0, b"25.0"),
        (TEXT, "Überstrom", "Überstrom".encode()),
        (INTERLOCK, True, b"true"),
    ],
)
def test_a_bare_value_is_its_text_with_the_rest_in_the_attachment(
    index: int, value: int | float | str, text: bytes
) -> None:
    payload, attachment = KEYS.as_bare(index, good(value), NOW_NS)
    assert payload == text
    assert json.loads(attachment)["q"] == "good"
    assert json.loads(attachment)["t"] == 1700000000.123457


@given(
    value=st.booleans()
    | st.integers(0, 2**32 - 1)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    quality=st.sampled_from(Quality),
    why=st.text(max_size=40),
    epoch_ns=st.integers(0, 4_000_000_000_000_000_000),
)
def test_whatever_is_shown_reads_back(
    value: bool | int | float | str, quality: Quality, why: str, epoch_ns: int
) -> None:
    shown = json.loads(KEYS.as_json(TEXT, Reading(value, quality, 1.0, why), epoch_ns))
    assert shown["v"] == (value if quality.has_value else None)
    assert shown["q"] == quality.label
    assert shown.get("r", "") == why
    if shown["t"] is not None:
        assert abs(shown["t"] - epoch_ns / 1e9) <= 1e-6


def test_outcomes() -> None:
    assert outcome_json(Outcome(Code.OK)) == b'{"ok":true,"forwarded":true}'
    tripped = outcome_json(Outcome(Code.OK, "tripped: acknowledge first", forwarded=False))
    assert json.loads(tripped) == {"ok": True, "forwarded": False, "message": "tripped: acknowledge first"}
    refused = outcome_json(Outcome(Code.NOT_ALLOWED, "the drive is controlled by modbus", forwarded=False))
    assert json.loads(refused) == {
        "ok": False,
        "code": "not_allowed",
        "message": "the drive is controlled by modbus",
    }


def test_events() -> None:
    event = Event(5.0, EventKind.WATCHDOG, "conveyor/fu1", 900, "silent")
    assert KEYS.event_key(event) == "drives/hall3/@/event/watchdog"
    assert json.loads(event_json(event, 1_500_000_000)) == {
        "t": 1.5,
        "kind": "watchdog",
        "source": "conveyor/fu1",
        "severity": 900,
        "message": "silent",
    }
    says = Event(5.0, EventKind.BUS, "conveyor", 200, Text.of("node.is_lost", node="conveyor"))
    told = json.loads(event_json(says, 1_500_000_000))
    assert told["message"] == "conveyor is lost"
    assert (told["code"], told["facts"]) == ("node.is_lost", {"node": "conveyor"})
