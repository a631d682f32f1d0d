"""The tables of services and of sessions are whole."""

from __future__ import annotations

import pytest
from asyncua import ua

from bridge.uaserver.services import REFUSED, SERVICES, request_type
from bridge.uaserver.states import REFUSALS, Need, State, need_of

_ENDING = "Request_Encoding_DefaultBinary"
NO_SERVICES = {"CallMethod", "MonitoredItemCreate", "MonitoredItemModify"}
"""Parts of requests whose names end as those of requests do."""


def test_every_request_that_there_is_has_its_place() -> None:
    requests = {name.removesuffix(_ENDING) for name in vars(ua.ObjectIds) if name.endswith(_ENDING)}
    names = [service.name for services in SERVICES.values() for service in services]
    assert set(names) == requests - NO_SERVICES
    assert len(names) == len(set(names))


def test_what_is_refused_has_a_bad_code() -> None:
    assert REFUSED
    assert all(ua.StatusCode(code).is_bad() for code in REFUSED.values())


# sessions


def test_each_service_needs_one_thing_of_a_session() -> None:
    named = [name for need in Need for name in need.value]
    assert len(named) == len(set(named))
    assert all(need_of(request_type(name)) is need for need in Need for name in need.value)
    assert need_of(request_type("Read")) is Need.USE


@pytest.mark.parametrize("need", [Need.USE, Need.CLOSE])
def test_a_session_that_is_not_there_is_not_called_one_that_is_not_activated(need: Need) -> None:
    """Clients make a new session after BadSessionIdInvalid alone."""
    for state in (State.NONE, State.ENDED, State.MOVED, State.OTHER):
        assert REFUSALS[need][state] == ua.StatusCodes.BadSessionIdInvalid
