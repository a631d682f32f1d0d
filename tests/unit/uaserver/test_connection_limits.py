"""Limits of connections to the server; how they are kept is in ``base.admission``."""

from __future__ import annotations

from bridge.base.admission import ConnectionStage
from bridge.uaserver.connection_limits import (
    DEADLINE_S,
    KEPT,
    MOST_CONNECTIONS,
    MOST_OF_ADDRESS,
    MOST_WAITING,
    limits,
)
from bridge.uaserver.subscriptions.quotas import MOST_SESSIONS, MOST_SESSIONS_OF_ADDRESS


def test_every_session_has_a_connection_and_there_is_one_to_come_back_on() -> None:
    made = limits()
    assert made.connections == MOST_CONNECTIONS == MOST_SESSIONS + 1
    assert made.of_address == MOST_OF_ADDRESS == MOST_SESSIONS_OF_ADDRESS + 1
    assert 0 < KEPT < MOST_CONNECTIONS
    assert MOST_WAITING < MOST_OF_ADDRESS, "who waits keeps no session of the same address out"


def test_each_step_has_its_time_and_a_session_has_none() -> None:
    deadlines = limits().deadlines
    assert {stage: one.seconds for stage, one in deadlines.items()} == DEADLINE_S
    assert set(ConnectionStage) - set(deadlines) == {ConnectionStage.SESSION}
    assert sorted(DEADLINE_S.values()) == [DEADLINE_S[stage] for stage in sorted(DEADLINE_S)]
