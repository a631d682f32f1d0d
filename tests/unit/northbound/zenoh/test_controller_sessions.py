"""A zenoh controller is known by the session that it names."""

from __future__ import annotations

import pytest

from bridge.command import Identity, Source
from bridge.northbound.zenoh.commands import BadCommand, identity_of, session_of
from bridge.northbound.zenoh.controller_sessions import UNNAMED, ControllerSessions

PLC = Identity(Source.ZENOH, "plc")
ZID = "8861d62718d0e0e4994ebfcf9bad87fa"


def test_the_attachment_names_it_before_zenoh_does() -> None:
    asked = identity_of(b'{"controller": "plc", "session": "line-2"}')
    assert ControllerSessions().of(asked, ZID).connection == "session line-2"
    assert ControllerSessions().of(PLC, ZID).connection == f"session {ZID}"


def test_without_a_name_all_are_one_that_is_none_of_the_named() -> None:
    """Nor is it an owner whose connection has ended."""
    sessions = ControllerSessions()
    assert sessions.of(PLC, "") == sessions.of(PLC, "")
    assert sessions.of(PLC, "").connection == UNNAMED
    assert not sessions.of(PLC, ZID).goes_on_as(sessions.of(PLC, ""))


@pytest.mark.parametrize("session", ["a/b", " ", "x" * 65])
def test_a_name_that_is_none_is_refused(session: str) -> None:
    attachment = f'{{"controller": "plc", "session": "{session}"}}'.encode()
    with pytest.raises(BadCommand, match="letters"):
        identity_of(attachment)
    assert session_of(attachment) == ""


def test_its_end_is_that_of_all_who_came_by_it() -> None:
    sessions = ControllerSessions()
    other = Identity(Source.ZENOH, "fan")
    both = [sessions.of(one, ZID) for one in (PLC, other)]
    sessions.of(PLC, "another")
    assert sessions.ended(ZID) == [(both[0], True), (both[1], False)]
    assert sessions.ended(ZID) == []


def test_so_many_are_remembered_and_no_more() -> None:
    sessions = ControllerSessions()
    sessions.of(PLC, ZID)
    for number in range(256):
        sessions.of(PLC, str(number))
    assert sessions.ended(ZID) == []
    assert sessions.ended("0")
