"""The tables of services and of sessions are whole."""

from __future__ import annotations

from asyncua import ua

from bridge.uaserver.services import REFUSED, SERVICES

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
