"""States of a session, and what each of them refuses."""

from __future__ import annotations

import pytest
from asyncua import ua

from bridge.uaserver.services import request_type
from bridge.uaserver.states import REFUSALS, Need, RequestSession, need_of


def test_each_service_needs_one_thing_of_a_session() -> None:
    named = [name for need in Need for name in need.value]
    assert len(named) == len(set(named))
    assert all(need_of(request_type(name)) is need for need in Need for name in need.value)
    assert need_of(request_type("Read")) is Need.USE


@pytest.mark.parametrize("need", [Need.USE, Need.CLOSE])
def test_a_session_that_is_not_there_is_not_called_one_that_is_not_activated(need: Need) -> None:
    """Clients make a new session after BadSessionIdInvalid alone."""
    for state in (RequestSession.NONE, RequestSession.ENDED, RequestSession.MOVED, RequestSession.OTHER):
        assert REFUSALS[need][state] == ua.StatusCodes.BadSessionIdInvalid
