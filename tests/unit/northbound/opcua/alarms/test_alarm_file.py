"""File of the alarms: what goes in comes out, and what cannot be used is named."""

from __future__ import annotations

import json
import logging
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.northbound.opcua.alarms.alarm_file import AlarmFile, is_worth_keeping, kept_alarm, state_of
from bridge.uaserver.conditions.condition import (
    MAX_TIME_SHELVED_MS,
    MOST_EVENT_IDS,
    NORMAL,
    Comment,
    ConditionState,
    Shelving,
)

NOW_MS = 1_000_000.0
TIMES = st.floats(0, 2 * NOW_MS)
STATES = st.builds(
    ConditionState,
    enabled=st.booleans(),
    active=st.booleans(),
    acked=st.just(True),
    confirmed=st.booleans(),
    severity=st.integers(1, 1000),
    last_severity=st.integers(1, 1000),
    comment=st.builds(Comment, st.text(max_size=20), st.just("de"), st.text(max_size=20), TIMES),
    event_ids=st.lists(st.binary(min_size=16, max_size=16), max_size=MOST_EVENT_IDS).map(tuple),
    active_ms=TIMES,
    acked_ms=TIMES,
)


@given(STATES)
def test_a_state_outlives_a_restart(tmp_path_factory: pytest.TempPathFactory, state: ConditionState) -> None:
    file = AlarmFile(tmp_path_factory.mktemp("state"))
    file.save({"conveyor/fu1/Alarm": kept_alarm(state, b'{"kind":"held"}')})
    (kept,) = file.load().values()
    assert state_of(kept, NOW_MS) == state
    assert bytes(kept.trouble) == b'{"kind":"held"}'


def test_nobody_else_can_read_it(tmp_path: Path) -> None:
    file = AlarmFile(tmp_path / "opcua")
    file.save({})
    assert file.path.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"", "Input data was truncated"),
        (b"[]", "Expected `object`, got `array`"),
        (b'{"version": 2, "alarms": {}}', "is of version 2, and this program reads 1"),
        (b'{"version": 1, "alarms": {"x": {"acked": 7}}}', "Expected `bool`, got `int`"),
        (b'{"version": 1, "alarms": {"x": {"shelving": "gone"}}}', "Invalid enum value 'gone'"),
    ],
)
def test_a_file_that_cannot_be_used_is_named_and_nothing_is_taken_of_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, content: bytes, why: str
) -> None:
    file = AlarmFile(tmp_path)
    file.path.write_bytes(content)
    with caplog.at_level(logging.WARNING):
        assert file.load() == {}
    assert f"{file.path}: {why}" in caplog.text
    assert "alarms begin anew" in caplog.text


def test_without_a_file_nothing_is_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert AlarmFile(tmp_path).load() == {}
    assert caplog.text == ""


def test_what_a_file_says_beyond_what_may_be_is_brought_back(tmp_path: Path) -> None:
    file = AlarmFile(tmp_path)
    alarm = {
        "acked": False,
        "confirmed": False,
        "shelving": "timed_shelved",
        "unshelve_at_ms": 1e15,
        "severity": 7000,
        "comment": "x" * 5000,
    }
    file.path.write_text(json.dumps({"version": 1, "alarms": {"x": alarm}}))
    state = state_of(file.load()["x"], NOW_MS)
    assert (state.confirmed, state.severity, len(state.comment.text)) == (True, 1000, 1000)
    assert (state.shelving, state.unshelve_at_ms) == (Shelving.TIMED, NOW_MS + MAX_TIME_SHELVED_MS)


def test_what_is_shelved_until_meanwhile_is_not_shelved() -> None:
    shelved = replace(NORMAL, shelving=Shelving.ONE_SHOT, unshelve_at_ms=NOW_MS - 1)
    assert state_of(kept_alarm(shelved, b"null"), NOW_MS) == NORMAL


def test_only_what_says_something_is_kept() -> None:
    assert not is_worth_keeping(ConditionState())
    assert is_worth_keeping(ConditionState(enabled=False))
